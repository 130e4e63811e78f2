"""The worker process of a sweep: ``python -m palpate.sweeps.worker``, started by `palpate.sweeps.cluster`.

It reads the scheduler's address from the first line of its standard input, and ends when that input closes.
So no worker outlives the process that started it, however that one died.
"""

from __future__ import annotations

import sys

from palpate.processes import end_with_input

__all__ = ["main"]


async def _work(address: str, folder: str, name: str) -> None:
    from distributed import Worker

    async with Worker(
        address,
        nthreads=1,
        name=name,
        host="127.0.0.1",
        dashboard=False,
        dashboard_address="127.0.0.1:0",  # Dask opens this port in any case
        local_directory=folder,
        memory_limit=0,  # Dask would pause or restart a worker in the midst of a solve
        death_timeout=60,
    ) as worker:
        await worker.finished()


def main(folder: str, name: str) -> None:
    """Work for the scheduler whose address comes on standard input, with scratch files in `folder`."""
    import asyncio
    import logging

    import distributed  # noqa: F401 - the import runs while the scheduler starts

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    address = sys.stdin.buffer.readline().decode().strip()
    if not address:
        return
    end_with_input()
    asyncio.run(_work(address, folder, name))


if __name__ == "__main__":
    main(*sys.argv[1:])
