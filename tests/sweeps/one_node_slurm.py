"""A SLURM of one node on loopback: its daemons live in a folder, and end with the context."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch")
DAEMON_PATH = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
"""Where daemons are looked for: they stand in folders that a user's path may lack."""

_CONFIGURATION = """
ClusterName=palpate
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SlurmdParameters=config_overrides
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,sched_interval=1
KillWait=1
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=8000 State=UNKNOWN
PartitionName=work Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


@contextlib.contextmanager
def one_node_slurm(folder: Path) -> Iterator[dict[str, str]]:
    """Yield the environment in which sbatch, squeue and scancel speak to a SLURM of this machine alone."""
    for name in ("state", "spool"):
        (folder / name).mkdir(parents=True)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    configuration = folder / "slurm.conf"
    ports = {"controller": _free_port(), "node": _free_port()}
    names = {
        "host": socket.gethostname().split(".")[0],
        "user": os.environ.get("USER", "root"),
        "folder": folder,
    }
    configuration.write_text(_CONFIGURATION.format(**ports, **names), encoding="utf-8")
    environment = {**os.environ, "SLURM_CONF": str(configuration)}
    with contextlib.ExitStack() as stack:

        def start(name: str, *options: str) -> None:
            log = stack.enter_context((folder / f"{name}.log").open("wb"))
            found = shutil.which(name, path=DAEMON_PATH)
            assert found is not None
            daemon = subprocess.Popen([found, *options], env=environment, stdout=log, stderr=log)
            stack.callback(_end, daemon)

        files = {"key": key, "socket": folder / "munge.socket", "pid": folder / "munged.pid"}
        files |= {"log": folder / "munge.log", "seed": folder / "munge.seed"}
        options = [f"--{kind}{'' if kind == 'socket' else '-file'}={path}" for kind, path in files.items()]
        start("munged", "--foreground", "--force", *options)
        _wait(files["socket"].exists, "munged")
        start("slurmctld", "-D")
        start("slurmd", "-D")
        _wait(lambda: "idle" in _told(["sinfo", "--noheader", "--format=%T"], environment), "slurmd")
        yield environment


def jobs(environment: dict[str, str]) -> list[str]:
    """Return the ids of all jobs that wait or run."""
    return _told(["squeue", "--noheader", "--format=%i"], environment).split()


def _told(command: list[str], environment: dict[str, str]) -> str:
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=30, check=False
    ).stdout


def _wait(is_up, name: str) -> None:
    deadline = time.monotonic() + 30
    while not is_up():
        assert time.monotonic() < deadline, f"{name} does not come up"
        time.sleep(0.1)


def _end(daemon: subprocess.Popen[bytes]) -> None:
    daemon.terminate()
    try:
        daemon.wait(timeout=5)
    except subprocess.TimeoutExpired:
        daemon.kill()
        daemon.wait()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
