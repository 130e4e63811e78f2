"""The worker process of a sweep: ``python -m palpate.sweeps.worker``, started by `palpate.sweeps.cluster`.

It reads the scheduler's address and the cluster's key from the first line of its standard input, where no other user
of the machine sees them, and ends when that input closes. So no worker outlives the process that started it, however
that one died.
"""

from __future__ import annotations

import json
import sys

from palpate.processes import end_with_input

__all__ = ["main"]


async def _work(invitation: dict[str, str], folder: str, name: str) -> None:
    from distributed import Security, Worker

    certificate, key = invitation["certificate"], invitation["key"]
    security = Security(
        require_encryption=True,
        tls_ca_file=certificate,
        tls_worker_cert=certificate,
        tls_worker_key=key,
        tls_client_cert=certificate,
        tls_client_key=key,
    )
    async with Worker(
        invitation["address"],
        security=security,
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
    """Work for the scheduler that the line on standard input names, with scratch files in `folder`."""
    import asyncio
    import logging

    import dask
    import distributed  # noqa: F401 - the import runs while the scheduler starts

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    dask.config.set({"distributed.worker.http.routes": []})  # a port that knows no key serves nothing
    line = sys.stdin.buffer.readline()
    if not line.endswith(b"\n"):  # the cluster ended before it started
        return
    end_with_input()
    asyncio.run(_work(json.loads(line), folder, name))


if __name__ == "__main__":
    main(*sys.argv[1:])
