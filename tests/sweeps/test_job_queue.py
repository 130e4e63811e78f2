"""Sweeps as jobs of a queue: on a real SLURM of one node, with jobs and the sweep itself killed."""

import os
import random
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from one_node_slurm import DAEMON_PATH, PROGRAMS, jobs, one_node_slurm
from sweep_problems import Spring

from palpate.dataset import Dataset
from palpate.errors import ResourceError, UsageError
from palpate.sweeps import JobQueue, sweep
from palpate.sweeps.case import NoTimeLeft, failed_rows
from palpate.sweeps.plan import make_plan
from palpate.sweeps.runner import Machines, connect, run, seconds_per_case
from system_programs import require_program

OPTIONS = {"cores": 1, "memory": "500MB", "walltime": "00:02:00"}
QUEUE = """[slurm]
jobs = {at_once}
cores = {cores}
memory = "500MB"
walltime = "{walltime}"
scheduler_options = {{host = "127.0.0.1"}}
worker_extra_args = ["--host", "127.0.0.1"]
"""

SWEEP = """
from sweep_problems import Spring
from palpate.sweeps import JobQueue, sweep
with JobQueue.of({queue!r}, folder={jobs!r}) as queue:
    sweep(Spring(seconds={seconds}, log={log!r}), samples={samples}, cluster=queue, path={path!r}, progress=False)
"""


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('[slrum]\njobs = 1\ncores = 1\nmemory = "1GB"\nwalltime = "00:10:00"', "Did you mean 'slurm'"),
        ('[slurm]\njobs = 1\ncores = 1\nmemory = "1GB"\nwall_time = "1"', "'wall_time' is no option"),
        ('[slurm]\njobs = 1\ncores = 1\nwalltime = "00:10:00"', "no memory"),
        ('[slurm]\njobs = 1\ncores = 1\nmemory = "1GB"', "no time limit"),
        ('[slurm]\njobs = 1\ncores = 1\nmemory = "1GB"\nwalltime = "ten minutes"', "HH:MM:SS"),
        ('[slurm]\njobs = 0\ncores = 1\nmemory = "1GB"\nwalltime = "00:10:00"', "number of jobs"),
        ('[slurm]\ncores = 1\nmemory = "1GB"\nwalltime = "00:10:00"', "how many jobs"),
        (
            '[slurm]\njobs = 1\ncores = 1\nmemory = "1GB"\nwalltime = "00:10:00"\nsecurity = true',
            "settled by",
        ),
        ("jobs = 3", "does not describe a queue"),
    ],
)
def test_a_queue_that_cannot_be_is_refused_in_words(tmp_path, content, words):
    file = tmp_path / "queue.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(UsageError, match=words):
        JobQueue.of(file, folder=tmp_path)


@pytest.mark.parametrize(
    ("kind", "walltime", "seconds"),
    [
        ("slurm", "01:30:00", 5400),
        ("slurm", "2-00:00:10", 172810),
        ("pbs", "00:00:59", 59),
        ("lsf", "1:30", 5400),
    ],
)
def test_the_time_limit_of_a_job(tmp_path, kind, walltime, seconds):
    queue = JobQueue(kind, 3, {"cores": 4, "memory": "1GB", "walltime": walltime}, tmp_path)
    assert queue.seconds == seconds
    assert queue.slots == 12


def test_a_queue_that_is_not_here_is_said(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ResourceError, match="sbatch is not to be found"):
        sweep(Spring(), samples=4, cluster=JobQueue("slurm", 1, OPTIONS, tmp_path), progress=False)


def test_a_queue_without_jobs_leaves_the_keys_of_another_sweep_alone(tmp_path):
    key = tmp_path / "keys" / "key.pem"
    key.parent.mkdir()
    key.touch()
    with JobQueue("slurm", 1, OPTIONS, tmp_path):
        pass
    assert key.exists()


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    for name in PROGRAMS:
        require_program(name, path=DAEMON_PATH)
    with one_node_slurm(tmp_path_factory.mktemp("slurm")) as environment:
        yield environment


def start(
    folder: Path, slurm: dict[str, str], walltime="00:02:00", at_once=2, cores=1, **content
) -> subprocess.Popen:
    """Start the sweep as a process of its own."""
    queue = folder / "queue.toml"
    queue.write_text(QUEUE.format(walltime=walltime, at_once=at_once, cores=cores), encoding="utf-8")
    (folder / "log").mkdir(exist_ok=True)
    places = {"queue": queue, "jobs": folder / "jobs", "log": folder / "log", "path": folder / "a.zarr"}
    code = SWEEP.format(
        folder=str(Path(__file__).parent), **{k: str(v) for k, v in places.items()}, **content
    )
    # jobs inherit it: they must find the module of the problem
    searched = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    environment = {**slurm, "PYTHONPATH": searched}
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def solves(folder: Path) -> Counter:
    """Return how often each input was solved."""
    return Counter(file.name.split("-")[0] for file in (folder / "log").iterdir())


def wait_for(condition, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


KILLS = int(os.environ.get("PALPATE_KILLS", "5"))
"""How often a job or the sweep is killed: the documentation's figures are of 20."""


@pytest.mark.full
@pytest.mark.timeout(60 + 20 * KILLS)
def test_kills_lose_nothing_and_repeat_only_what_was_in_flight(tmp_path, slurm, record_property):
    chance, killed = random.Random(1), Counter()
    content = {"samples": 300, "seconds": 0.1}
    driver = start(tmp_path, slurm, **content)
    while killed.total() < KILLS:
        before = solves(tmp_path).total()
        wait_for(lambda before=before: solves(tmp_path).total() > before)
        time.sleep(chance.uniform(0.0, 0.5))
        if killed.total() % 4 == 2:
            driver.kill()
            driver.communicate()
            killed["sweep"] += 1
            wait_for(lambda: not jobs(slurm))  # they end by themselves
            driver = start(tmp_path, slurm, **content)
        elif running := jobs(slurm):
            subprocess.run(
                ["scancel", "--signal=KILL", "--full", chance.choice(running)], env=slurm, check=True
            )
            killed["job"] += 1
    assert driver.communicate(timeout=200)[1] == ""
    data = Dataset.open(tmp_path / "a.zarr")
    assert data.hash == sweep(Spring(), samples=300, workers=1, progress=False).hash
    record_property("figures", f"{killed}, {solves(tmp_path).total()} solves of 300 cases")
    longest = max(rows.size for rows in make_plan(Spring(), None, 300, 0, None, None).chains())
    often = solves(tmp_path)
    assert len(often) == 300
    assert often.total() - 300 <= longest * (killed["job"] + 3 * killed["sweep"])
    wait_for(lambda: not jobs(slurm))


@pytest.mark.full
def test_no_case_is_begun_in_a_job_that_ends_before_it(tmp_path, slurm):
    """Jobs of 30 s, of which the last ten are too few for any case: none is ended in the midst of one.

    Of the two threads of a job each waits for the other's chain, before the job ends.
    """
    driver = start(tmp_path, slurm, "00:00:30", at_once=1, cores=2, samples=110, seconds=0.5)
    assert driver.communicate(timeout=250)[1] == ""
    assert set(solves(tmp_path).values()) == {1}
    assert len(list((tmp_path / "jobs").glob("*.out"))) > 1  # the first was followed by another


class BusyClient:
    """A client whose workers have no time left for the first chains that they get."""

    status = "running"

    def __init__(self, refusals: int, schema, *, fresh: bool) -> None:
        self.refusals, self.schema, self.fresh = refusals, schema, fresh
        self.ended = []

    def nthreads(self):
        return {f"worker {number}": 4 for number in range(10)}

    def retire_workers(self, workers, *, close_workers):
        assert close_workers
        self.ended += workers

    def submit(self, _, task, points, *, pure):
        future = Future()
        if self.refusals:
            self.refusals -= 1
            future.set_exception(NoTimeLeft(f"worker {self.refusals}", 10.0, self.fresh))
        else:
            future.set_result(failed_rows(len(points), self.schema, "none was asked for"))
        future.status = "error" if future.exception() else "finished"
        return future


def test_the_end_of_many_jobs_at_once_says_nothing_of_a_chain():
    plan = make_plan(Spring(), None, 8, 0, None, None)
    client, answered = BusyClient(200, plan.schema, fresh=False), []
    run(
        Machines(client, lambda: None),
        plan.problem,
        plan.schema,
        plan.points,
        plan.chains(),
        lambda rows, _: answered.extend(rows),
        60.0,
    )
    assert sorted(answered) == list(range(8))
    assert len(client.ended) == 200


def test_one_slow_case_does_not_make_all_chains_too_long():
    rows = {"solve_seconds": np.array([1.0, 1.0, np.nan, 10.0])}
    assert seconds_per_case(rows) == 4.0
    assert seconds_per_case({"solve_seconds": np.full(3, np.nan)}) == 0.0


def test_a_chain_for_which_no_fresh_job_has_time_is_said():
    plan = make_plan(Spring(), None, 8, 0, None, None)
    client = BusyClient(200, plan.schema, fresh=True)
    asked = (plan.problem, plan.schema, plan.points, plan.chains(), lambda *_: None, 60.0)
    with pytest.raises(ResourceError, match="too short for this sweep"):
        run(Machines(client, lambda: None), *asked)


@pytest.mark.full
def test_jobs_that_end_before_they_solve_are_said(tmp_path, slurm, monkeypatch):
    for name in ("SLURM_CONF", "PATH"):
        monkeypatch.setenv(name, slurm[name])
    monkeypatch.setattr("palpate.sweeps.job_queue._LOOK", 2.0)
    options = {**OPTIONS, "job_script_prologue": ["exit 1"], "scheduler_options": {"host": "127.0.0.1"}}
    with (
        JobQueue("slurm", 2, options, tmp_path) as queue,
        pytest.raises(ResourceError, match="ended before any of them could solve"),
    ):
        sweep(Spring(), samples=8, cluster=queue, progress=False)


def test_a_chain_longer_than_a_job_is_said(cluster):
    plan = make_plan(Spring(seconds=0.05), None, 8, 0, None, None)
    asked = (plan.problem, plan.schema, plan.points, plan.chains(), lambda *_: None, 60.0)
    with connect(cluster, None) as machines:
        short = replace(machines, job_seconds=0.2)
        with pytest.raises(ResourceError, match="too short for this sweep"):
            run(short, *asked, slowest=0.05)
