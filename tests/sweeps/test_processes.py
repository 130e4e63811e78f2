"""Worker processes: scripts without a guard, nothing left behind, nothing open to the network."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.sweeps import local_cluster

pytestmark = pytest.mark.full  # programs and their worker processes

SCRIPT = """
from palpate.physics import Cantilever, Circle, LinearElastic, TipLoad
from palpate.sweeps import sweep
body = Cantilever(1.0, Circle(0.005), LinearElastic(2e9, 0.43), elements=5)
data = sweep(body, TipLoad(0, 5), samples=8, workers=2)
print(len(data.ok), "solved")
"""

ENDLESS = """
import sys
sys.path.insert(0, {folder!r})
from sweep_problems import Spring
from palpate.sweeps import sweep
def report(done, total):
    if done:
        print("busy", flush=True)
sweep(Spring(seconds=0.05), samples=2000, workers=2, progress=report, path={path!r})
"""


KILLED = """
import sys
sys.path.insert(0, {folder!r})
from sweep_problems import LoneSpring
from palpate.cli.console import Console
from palpate.errors import PalpateError
from palpate.sweeps import sweep
def report(done, total):
    if done == 1:
        print("busy", flush=True)
try:
    sweep(LoneSpring(seconds=1.0), samples=40, cluster={address!r}, progress=report, path={path!r})
except PalpateError as error:
    Console().error(error)
    sys.exit(error.exit_code)
"""


IN_A_RUNNING_LOOP = f"""
import asyncio
async def cell():
    exec({SCRIPT!r})
asyncio.run(cell())
"""


def children(pid):
    return psutil.Process(pid).children(recursive=True)


def gone(processes, seconds=10.0):
    _, alive = psutil.wait_procs(processes, timeout=seconds)
    return not alive


@pytest.mark.parametrize("way", ["file", "stdin", "notebook"])
def test_a_plain_script_needs_no_guard(tmp_path, way):
    file = tmp_path / "script.py"
    file.write_text(SCRIPT, encoding="utf-8")
    arguments = {
        "file": [str(file)],
        "stdin": ["-"],
        "notebook": ["-c", IN_A_RUNNING_LOOP],  # a notebook's cells run inside an event loop
    }[way]
    done = subprocess.run(
        [sys.executable, "-W", "error", *arguments],
        input=SCRIPT if way == "stdin" else None,
        capture_output=True,
        text=True,
        timeout=100,
        cwd=tmp_path,
        check=False,
    )
    assert done.stdout == "8 solved\n"
    assert not done.stderr
    assert done.returncode == 0


@pytest.fixture
def busy(tmp_path):
    """A script in the middle of a sweep, in a process group of its own, and its worker processes."""
    code = ENDLESS.format(folder=str(Path(__file__).parent), path=str(tmp_path / "a.zarr"))
    script = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert script.stdout.readline() == "busy\n"
    workers = children(script.pid)
    assert len(workers) == 4  # each has a child that solves
    yield script, workers
    for process in (script, *workers):
        if process.poll() is None if isinstance(process, subprocess.Popen) else process.is_running():
            process.kill()
    script.communicate()


def test_ctrl_c_ends_everything_and_keeps_what_is_done(busy, tmp_path):
    script, workers = busy
    os.killpg(script.pid, signal.SIGINT)  # what a terminal does
    _, errors = script.communicate(timeout=20)
    assert "KeyboardInterrupt" in errors
    assert gone(workers)
    assert list((tmp_path / "a.zarr.parts").glob("part-*.zarr"))


def test_a_killed_script_leaves_no_worker(busy):
    script, workers = busy
    script.kill()
    script.communicate()
    assert gone(workers)


@pytest.fixture
def scheduler(tmp_path):
    """A scheduler of Dask's own and its worker, each a process, and the scheduler's address."""
    file = tmp_path / "scheduler.json"
    begin = [sys.executable, "-m", "distributed.cli.dask_{}", "--scheduler-file", str(file), "--no-dashboard"]
    further = {
        "scheduler": ["--host", "127.0.0.1", "--port", "0"],
        "worker": ["--nthreads", "1", "--no-nanny", "--local-directory", str(tmp_path)],
    }
    path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    processes = [
        subprocess.Popen(
            [word.format(kind) for word in begin] + further[kind],
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": path},
        )
        for kind in further
    ]
    while not file.exists():
        assert processes[0].poll() is None
        time.sleep(0.05)
    yield processes[0], json.loads(file.read_text())["address"]
    for process in processes:
        process.kill()
        process.wait()


def test_a_killed_scheduler_keeps_what_is_solved(scheduler, tmp_path):
    """It is killed in the midst of a solve, and the command ends in a sentence, with code 3."""
    process, address = scheduler
    code = KILLED.format(folder=str(Path(__file__).parent), path=str(tmp_path / "a.zarr"), address=address)
    script = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert script.stdout.readline() == "busy\n"
    time.sleep(0.5)  # half of a case
    process.kill()
    _, errors = script.communicate(timeout=60)
    assert script.returncode == 3
    assert errors.startswith("error: The scheduler of the sweep is lost.\n")
    assert "Traceback" not in errors
    parts = [Dataset.open(part) for part in (tmp_path / "a.zarr.parts").glob("part-*.zarr")]
    assert parts
    assert all(part.converged.all() for part in parts)


def test_a_cluster_ends_with_its_block_also_by_an_error():
    before = {child.pid for child in children(os.getpid())}
    workers = []

    def fail():
        with local_cluster(2) as cluster:
            workers.extend(psutil.Process(pid) for pid in cluster.process_ids)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert gone(workers, 1.0)
    assert {child.pid for child in children(os.getpid())} <= before


def test_closing_twice_is_harmless():
    cluster = local_cluster(1)
    cluster.close()
    cluster.close()


def test_a_cluster_needs_a_worker():
    with pytest.raises(UsageError):
        local_cluster(0)


def test_nothing_listens_beyond_this_machine(cluster):
    deadline = time.monotonic() + 20
    processes = [psutil.Process(pid) for pid in cluster.process_ids]
    listening = []
    while len(listening) < 2 and time.monotonic() < deadline:  # a worker starts to listen once it is up
        listening = [c for p in processes for c in p.net_connections("tcp") if c.status == "LISTEN"]
    own = [c for c in psutil.Process().net_connections("tcp") if c.status == "LISTEN"]
    assert listening
    assert own
    assert {connection.laddr.ip for connection in listening + own} <= {"127.0.0.1", "::1"}
