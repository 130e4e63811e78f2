"""Workers as jobs of a cluster's queue: SLURM and the others that dask-jobqueue speaks to.

The scheduler runs beside the sweep, on the machine that asked for it; each job is one of Dask's own workers, with a
thread for each core, and connects to it over TLS with a key that is new for each sweep. Jobs come and go: the queue
starts them when it has room, ends them at their time limit or kills them, and Dask asks for others as long as
something is left to solve. It does not see a job end that has several workers.
"""

from __future__ import annotations

import inspect
import os
import re
import shutil
import subprocess
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate import checks
from palpate.checks import did_you_mean
from palpate.errors import ResourceError, UsageError
from palpate.files import system_errors
from palpate.format import count, duration
from palpate.input_files import read_toml

__all__ = ["JOB_END", "JobQueue"]

JOB_END = "PALPATE_JOB_END"
"""Environment variable of a job: the time at which its queue ends it, in s since 1970."""

_KINDS = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "htcondor": "HTCondorCluster",
    "oar": "OARCluster",
    "moab": "MoabCluster",
}
_OURS = frozenset({"jobs", "python", "interface", "scheduler_options"})
# what this module settles itself
_SETTLED = frozenset(
    {
        "scheduler",
        "name",
        "security",
        "protocol",
        "shared_temp_directory",
        "nanny",
        "config_name",
        "processes",
    }
)
_EXAMPLE = '[slurm]\njobs = 10\ncores = 4\nmemory = "8GB"\nwalltime = "01:00:00"\nqueue = "normal"'
_LOOK = 10.0  # s between looks at the queue, and how long its answer may take
_MOST_LOST = 5
_WAIT = "30s"  # after which a worker without a scheduler ends, and with it its job


@dataclass(eq=False)
class JobQueue:
    """A cluster's queue, and the jobs that a sweep may have there at once.

    A context manager; closing it cancels its jobs. The first sweep that has something to solve asks for them.

    Attributes
    ----------
    kind : str
        ``slurm``, ``pbs``, ``sge``, ``lsf``, ``htcondor``, ``oar`` or ``moab``.
    jobs : int
        Jobs at once, at most.
    options : mapping
        Options of dask-jobqueue's class, such as cores, memory, walltime, queue and account, under its own names.
    folder : path
        Where logs and, while it runs, keys are kept; all nodes must see it.

    Raises
    ------
    UsageError
        For a kind or an option that is not known, and one that lacks.

    Examples
    --------
    >>> with JobQueue.of("slurm.toml", folder="jobs") as queue:  # doctest: +SKIP
    ...     sweep(body, loads, samples=2000, cluster=queue, path="solves.zarr")
    """

    kind: str
    jobs: int
    options: Mapping[str, Any]
    folder: Path
    _running: Any = field(default=None, init=False, repr=False)
    _looked: float = field(
        default=0.0, init=False, repr=False
    )  # monotonic time of the last look at the queue, s
    _has_solved: bool = field(default=False, init=False, repr=False)  # whether a job has ever connected
    _lost: int = field(default=0, init=False, repr=False)  # jobs that were gone before any had connected

    warning = ""

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise UsageError(
                f"{self.kind!r} is no queue that is known.",
                why=f"Known are {', '.join(_KINDS)}.",
                fix=did_you_mean(self.kind, _KINDS, shown=repr) or "Name one of them.",
            )
        checks.fits("The number of jobs", self.jobs, least=1, whole=True)
        _check_options(self.kind, self.options)
        self.folder = Path(self.folder).absolute()

    @classmethod
    def of(cls, file: str | os.PathLike[str], *, folder: str | os.PathLike[str]) -> JobQueue:
        """Return the queue of a TOML file, whose one table is named by the kind of queue and holds its options.

        Raises
        ------
        UsageError
            For a file that is missing, is no TOML or has another form.
        """
        content = read_toml(file)
        tables = {name: table for name, table in content.items() if isinstance(table, dict)}
        if len(content) != 1 or not tables:
            raise UsageError(
                f"{file} does not describe a queue.",
                why="It has one table, named by the kind of queue, and nothing else.",
                fix=f"For example:\n\n{_EXAMPLE}\n",
            )
        ((kind, table),) = tables.items()
        if "jobs" not in table:
            raise UsageError(f"{file} does not say how many jobs may run at once.", fix="Add jobs = 10.")
        return cls(kind, table["jobs"], {k: v for k, v in table.items() if k != "jobs"}, Path(folder))

    def __str__(self) -> str:
        each = count(self.options["cores"], "core")
        limit = f", {duration(self.seconds)} each" if self.seconds else ""
        return f"{self.kind}: at most {count(self.jobs, 'job')} of {each}{limit}"

    @property
    def slots(self) -> int:
        """Cases that all jobs solve at once: one on each core."""
        return self.jobs * int(self.options["cores"])

    @property
    def seconds(self) -> float | None:
        """Time limit of a job in s; None where it has none."""
        return _walltime(self.kind, self.options.get("walltime"))

    def start(self) -> Any:
        """Return Dask's running cluster, started if it is new.

        Raises
        ------
        ResourceError
            If the queue's own commands are missing here.
        """
        if self._running is None:
            self._running = self._open()
        return self._running

    def replace_lost(self) -> None:
        """Ask for others in place of jobs that were gone before they connected, of which Dask hears nothing.

        Only SLURM is asked which jobs it has.

        Raises
        ------
        ResourceError
            If so many were gone and none has ever connected.
        """
        cluster = self._running
        if self.kind != "slurm" or cluster is None or time.monotonic() - self._looked < _LOOK:
            return
        self._looked = time.monotonic()
        asked = ["squeue", "--noheader", "--me", "--format=%A"]
        try:
            told = subprocess.run(asked, capture_output=True, text=True, timeout=_LOOK, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return  # a queue that is busy now
        connected = {worker["name"] for worker in cluster.scheduler_info["workers"].values()}
        self._has_solved = self._has_solved or bool(connected)
        there = set(told.stdout.split())
        handed_in = {name: job.job_id for name, job in list(cluster.workers.items())}
        gone = [name for name, number in handed_in.items() if number not in there and name not in connected]
        if told.returncode or not gone:
            return
        self._lost += len(gone)
        if not self._has_solved and self._lost >= _MOST_LOST:
            raise ResourceError(
                f"{count(self._lost, 'job')} of the queue ended before any of them could solve.",
                why=f"Their logs are in {self.folder}: the nodes may lack this Python, or not reach this machine.",
                fix="See to what they say; python, job_script_prologue and interface are options of the queue's file.",
            )
        cluster.sync(cluster.scale_down, gone)

    def __enter__(self) -> JobQueue:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Cancel the jobs and forget their key; closing again does nothing."""
        if self._running is not None:
            self._running.close()
            self._running = None
            shutil.rmtree(self._keys, ignore_errors=True)  # not where another sweep has them

    @property
    def _keys(self) -> Path:
        return self.folder / "keys"

    def _open(self) -> Any:
        import dask

        jobqueue_class = _jobqueue_class(self.kind)
        program = str(jobqueue_class.job_cls.submit_command).split()[0]
        if shutil.which(program) is None:
            raise ResourceError(
                f"The command {program} is not to be found here.",
                why=f"Jobs of {self.kind} are handed in with it.",
                fix="Start the sweep on a machine from which you hand in jobs, such as the cluster's login node.",
            )
        security = self._new_key()
        # Dask's ports for pages know no key: they serve nothing
        no_pages = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
        scheduler = {"allowed_failures": 0, **no_pages, **self.options.get("scheduler_options", {})}
        options = {
            "processes": 1,
            "job_name": "palpate",
            "log_directory": str(self.folder),
            "death_timeout": _WAIT,
            **{name: value for name, value in self.options.items() if name != "scheduler_options"},
            "job_script_prologue": [*self.options.get("job_script_prologue", ()), *self._prologue()],
            "worker_extra_args": [*self.options.get("worker_extra_args", ()), "--no-dashboard"],
        }
        with dask.config.set({"distributed.scheduler.http.routes": []}):
            cluster = jobqueue_class(
                **options,
                nanny=False,  # it would start a worker again that has ended for want of time
                security=security,
                scheduler_options=scheduler,
                silence_logs="critical",  # of jobs that ended: the sweep sees to them
            )
        cluster.adapt(minimum_jobs=1, maximum_jobs=self.jobs)
        return cluster

    def _new_key(self) -> Any:
        """Return Dask's record of a new key, which is written where jobs read it and no other user does."""
        import distributed

        new: Any = distributed.Security.temporary()
        with system_errors(f"The folder {self.folder} could not be written."):
            shutil.rmtree(self._keys, ignore_errors=True)  # of a run that was killed: its scheduler is gone
            self.folder.mkdir(parents=True, exist_ok=True)
            self._keys.mkdir(mode=0o700)
            certificate, key = self._keys / "certificate.pem", self._keys / "key.pem"
            certificate.write_text(new.tls_worker_cert, encoding="utf-8")
            key.write_text(new.tls_worker_key, encoding="utf-8")
        roles = ("scheduler", "worker", "client")
        files = {f"tls_{role}_cert": str(certificate) for role in roles}
        files |= {f"tls_{role}_key": str(key) for role in roles}
        security: Any = distributed.Security(require_encryption=True, tls_ca_file=str(certificate), **files)
        return security

    def _prologue(self) -> list[str]:
        """Return the lines of a job's script that stand before its workers."""
        lines = ["export DASK_DISTRIBUTED__WORKER__HTTP__ROUTES='[]'"]
        if self.seconds:
            lines.append(f"export {JOB_END}=$(( $(date +%s) + {int(self.seconds)} ))")
        return lines


def _walltime(kind: str, words: object) -> float | None:
    """Return a queue's time limit in s: HH:MM:SS with days before it, for LSF HH:MM; None where it can have none."""
    if words is None and kind == "htcondor":
        return None
    form = r"(\d+):(\d\d)()" if kind == "lsf" else r"(?:(\d+)-)?(\d+):(\d\d):(\d\d)"
    found = re.fullmatch(form, str(words))
    if found is None:
        shown = "HH:MM" if kind == "lsf" else "HH:MM:SS"
        raise UsageError(
            "The jobs have no time limit." if words is None else f"The walltime {words!r} is not understood.",
            why="A case is not begun in a job that ends before it.",
            fix=f'Write walltime = "01:00{"" if kind == "lsf" else ":00"}", which is {shown}.',
        )
    numbers = [int(number or 0) for number in found.groups()]
    days, hours, minutes, seconds = [0, *numbers] if kind == "lsf" else numbers
    return float(days * 86400 + hours * 3600 + minutes * 60 + seconds)


def _check_options(kind: str, options: Mapping[str, Any]) -> None:
    """Refuse options that the class of dask-jobqueue does not take, and missing sizes of a job."""
    known = _OURS | {name for part in _jobqueue_class(kind).job_cls.__mro__ for name in _parameters(part)}
    known -= _SETTLED
    for name in options:
        if name not in known:
            raise UsageError(
                f"{name!r} is no option of the queue {kind}.",
                why="This is settled by the sweep itself." if name in _SETTLED else "",
                fix=did_you_mean(name, known, shown=repr)
                or "Options are those of dask-jobqueue's class, under its names.",
            )
    missing = [name for name in ("cores", "memory") if name not in options]
    if missing:
        raise UsageError(
            f"The jobs of {kind} have no {' and no '.join(missing)}.",
            why="A queue gives a job what it asks for.",
            fix='For example cores = 4, memory = "8GB".',
        )
    checks.fits("The cores of a job", options["cores"], least=1, whole=True)
    _walltime(kind, options.get("walltime"))


def _parameters(part: type) -> list[str]:
    own = vars(part).get("__init__")
    given = inspect.signature(own).parameters.values() if inspect.isfunction(own) else ()
    return [p.name for p in given if p.name != "self" and p.kind is not inspect.Parameter.VAR_KEYWORD]


def _jobqueue_class(kind: str) -> Any:
    try:
        import dask_jobqueue
    except ImportError as error:
        raise UsageError(
            "Jobs of a queue need the package dask-jobqueue, which can't be imported.",
            why=str(error),
            fix="Install it with palpate: pip install 'palpate[cluster]'.",
        ) from error
    return getattr(dask_jobqueue, _KINDS[kind])
