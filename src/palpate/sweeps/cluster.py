"""A Dask cluster on this machine whose workers are plain subprocesses.

Dask's own local cluster starts workers by multiprocessing, which imports the user's script anew and so needs
an ``if __name__ == "__main__"`` guard in it. These workers are started as ``python -m palpate.sweeps.worker``
and need none: a sweep works in a file without a guard, in a notebook and on standard input.

Whoever may talk to a scheduler or a worker can run code as its owner, and other users of a machine reach its
127.0.0.1. Each local cluster therefore has a key of its own: scheduler, workers and client speak TLS and show it to
each other. It is made when the cluster starts and reaches the workers through their standard input alone.
"""

from __future__ import annotations

import json
import logging
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.errors import SolverError, UsageError
from palpate.files import TemporaryFolder
from palpate.processes import available_cores, helper_environment

__all__ = ["LocalCluster", "OnDemandCluster", "Scheduler", "local_cluster"]

_GRACE = 1.0  # s in which workers end by themselves; one in the midst of a solve does not
_SPARE_LIVES = 16  # workers started again after a crash, per cluster


class LocalCluster:
    """A scheduler in this process and workers in subprocesses, all on 127.0.0.1.

    A context manager; closing it ends every process it started.

    Parameters
    ----------
    workers : int
        Number of worker processes.

    Attributes
    ----------
    security : distributed.Security
        Key and certificate of this cluster, for a Dask client of it. They exist in memory only.
    """

    def __init__(self, workers: int) -> None:
        self.security: Any = None
        self._scratch = TemporaryFolder()
        self._lives = workers + _SPARE_LIVES
        self._scheduler: Any = None
        self._workers: list[subprocess.Popen[bytes]] = []
        try:
            # they import Dask while the scheduler starts here
            self._workers = [self._start_worker() for _ in range(workers)]
            self.security, self._scheduler = _start_scheduler()
            for worker in self._workers:
                self._invite(worker)
        except BaseException:
            self.close()
            raise

    @property
    def address(self) -> str:
        """The scheduler's address, for a Dask client."""
        return str(self._scheduler.scheduler_address)

    @property
    def process_ids(self) -> tuple[int, ...]:
        """Process ids of the workers."""
        return tuple(worker.pid for worker in self._workers)

    @property
    def folder(self) -> Path:
        """Folder of the scratch files of all workers."""
        return self._scratch.path

    def __len__(self) -> int:
        return len(self._workers)

    def __str__(self) -> str:
        return f"LocalCluster of {len(self)} workers at {self.address}"

    def __enter__(self) -> LocalCluster:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def revive(self) -> None:
        """Start a new worker for each one that died.

        Raises
        ------
        SolverError
            If they die again and again.
        """
        for place, worker in enumerate(self._workers):
            if worker.poll() is not None:
                _end(worker, time.monotonic())
                self._workers[place] = self._start_worker()
                self._invite(self._workers[place])

    def close(self) -> None:
        """End the scheduler and all workers; closing again does nothing."""
        if self._scheduler is not None:
            self._scheduler.close()  # tells the workers to end
        deadline = time.monotonic() + _GRACE
        for worker in self._workers:
            _end(worker, deadline)
        self._scratch.remove()

    def _start_worker(self) -> subprocess.Popen[bytes]:
        self._lives -= 1
        if self._lives < 0:
            raise SolverError("The workers of the sweep die again and again.", why=self._last_words())
        name = f"worker-{self._lives}"
        with (self.folder / f"{name}.log").open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "palpate.sweeps.worker", str(self.folder), name],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=log,
                env=helper_environment(scratch=self.folder),
                # Ctrl-C in the terminal is for this process, which then ends its workers
                start_new_session=True,
            )

    def _invite(self, worker: subprocess.Popen[bytes]) -> None:
        """Give a worker the scheduler's address and the key, as one line of JSON on its standard input."""
        invitation = {
            "address": self.address,
            "certificate": self.security.tls_worker_cert,
            "key": self.security.tls_worker_key,
        }
        if worker.stdin:
            try:
                worker.stdin.write(json.dumps(invitation).encode() + b"\n")
                worker.stdin.flush()
            except BrokenPipeError:
                pass  # it died already: `revive` sees to it

    def _last_words(self) -> str:
        logs = sorted(self.folder.glob("*.log"), key=lambda log: log.stat().st_mtime)
        return "\n".join(log.read_text(errors="replace")[-2000:] for log in logs[-1:])


def local_cluster(workers: int | None = None) -> LocalCluster:
    """Start workers on this machine; one cluster serves any number of sweeps.

    Parameters
    ----------
    workers : int, optional
        Number of worker processes; by default one for each core.

    Returns
    -------
    LocalCluster
        For a ``with`` statement.

    Raises
    ------
    UsageError
        If `workers` is below 1.

    Examples
    --------
    >>> with local_cluster() as cluster:  # doctest: +SKIP
    ...     copper = sweep(body, loads, cluster=cluster)
    """
    count = available_cores() if workers is None else workers
    if count < 1:
        raise UsageError(
            f"A sweep can't run on {count} workers.", why="It needs one at least.", fix="Ask for more."
        )
    return LocalCluster(count)


class OnDemandCluster:
    """Workers on this machine that start with the first sweep that has something to solve, and serve those after it.

    A context manager; closing it ends the workers. A problem that one sweep has opened stays open for the next.

    Parameters
    ----------
    workers : int, optional
        Number of worker processes; by default one for each core.
    """

    def __init__(self, workers: int | None = None) -> None:
        self._workers = workers
        self._running: LocalCluster | None = None

    def start(self) -> LocalCluster:
        """Return the running cluster, started if it is new."""
        if self._running is None:
            self._running = local_cluster(self._workers)
        return self._running

    def __enter__(self) -> OnDemandCluster:
        return self

    def __exit__(self, *_: object) -> None:
        if self._running is not None:
            self._running.close()
            self._running = None


@dataclass(frozen=True)
class Scheduler:
    """A Dask scheduler of the user's own, and the files that its TLS asks for.

    Attributes
    ----------
    address : str
        Such as ``tls://cluster.example:8786``. Through ``tcp://`` whoever reaches the port can run code as you.
    ca, certificate, key : path, optional
        PEM files: the certificate of the authority that both sides trust, and this side's own certificate with its
        key (left out where the certificate's file holds it too). By default those of Dask's configuration.

    Examples
    --------
    >>> own = Scheduler("tls://cluster.example:8786", ca="ca.pem", certificate="me.pem", key="me.key")
    >>> sweep(body, loads, samples=200, cluster=own)  # doctest: +SKIP
    """

    address: str
    ca: str | Path | None = None
    certificate: str | Path | None = None
    key: str | Path | None = None

    def __post_init__(self) -> None:
        scheme, separator, place = self.address.partition("://")
        if not separator or not place:
            raise UsageError(
                f"{self.address!r} is no scheduler's address.", fix="Write it as tls://HOST:PORT."
            )
        files = [path for path in (self.ca, self.certificate, self.key) if path is not None]
        if files and scheme != "tls":
            raise UsageError(
                f"Certificates don't protect {self.address}.",
                why="Only an address that begins with tls:// is encrypted.",
                fix="Start the scheduler with its TLS options and give its tls:// address.",
            )
        if files and None in (self.ca, self.certificate):
            raise UsageError(
                "TLS needs the authority's certificate and your own.",
                fix="Give both, and the key where it stands in a file of its own.",
            )
        for path in files:
            if not Path(path).is_file():
                raise UsageError(f"There is no file {path}.", fix="Name the PEM files of your cluster.")

    @property
    def warning(self) -> str:
        """A sentence for who uses an address without TLS, else ""."""
        if self.address.startswith("tls://"):
            return ""
        return (
            f"{self.address} is not encrypted: whoever reaches that port can run code as you. "
            "Start the scheduler and its workers with TLS and give the tls:// address."
        )

    def security(self) -> Any:
        """Return Dask's record of these files, with what its configuration adds; None for an address without TLS.

        Raises
        ------
        UsageError
            If the address asks for certificates that are neither given nor configured.
        """
        import distributed

        if not self.address.startswith("tls://"):
            return None
        named = {"tls_ca_file": self.ca, "tls_client_cert": self.certificate, "tls_client_key": self.key}
        given = {name: str(path) for name, path in named.items() if path is not None}
        security: Any = distributed.Security(require_encryption=True, **given)
        if not security.tls_ca_file or not security.tls_client_cert:
            raise UsageError(
                f"{self.address} asks for certificates.",
                why="Neither options nor Dask's configuration (distributed.comm.tls) name any.",
                fix="Give --tls-ca, --tls-cert and --tls-key.",
            )
        return security


def _start_scheduler() -> tuple[Any, Any]:
    """Return a new key, as Dask's record of it, and a scheduler that asks for it."""
    import dask
    import distributed

    security = distributed.Security.temporary()
    settings = {
        # one task at a time per worker: a task that kills it takes no other one along
        "distributed.scheduler.worker-saturation": 1.0,
        # Dask opens a port for pages in any case, which knows no key: it serves nothing
        "distributed.scheduler.http.routes": [],
    }
    with dask.config.set(settings):
        scheduler = distributed.LocalCluster(
            n_workers=0,
            processes=False,
            protocol="tls://",
            security=security,
            host="127.0.0.1",
            silence_logs=logging.CRITICAL,
            scheduler_kwargs={
                # nor is it tried on the other workers, one after the other
                "allowed_failures": 0,
                # without a dashboard Dask still opens its port, by default to the whole network
                "dashboard": False,
                "dashboard_address": "127.0.0.1:0",
            },
        )
    return security, scheduler


def _end(worker: subprocess.Popen[bytes], deadline: float) -> None:
    try:
        worker.wait(timeout=max(0.0, deadline - time.monotonic()))
    except subprocess.TimeoutExpired:
        worker.kill()
        worker.wait()
    if worker.stdin:
        worker.stdin.close()
