"""Cases that crash, hang, raise or lie cost themselves; a lost worker or scheduler costs no answer."""

import contextlib
import gc
import os
import signal
import sys
import threading

import numpy as np
import psutil
import pytest
from solid_problems import Ground
from sweep_problems import Spring

from palpate.dataset import Dataset
from palpate.errors import ResourceError, SolverError, UsageError
from palpate.sweeps import local_cluster, sweep
from palpate.sweeps.runner import connect


@pytest.mark.full
def test_crashing_cases_cost_only_themselves(cluster, tmp_path):
    """Four of 96 take their process down, by a signal or an exit, among others that raise."""
    points = np.arange(96.0) / 10
    spring = Spring(aborts=(1.0, 5.0), dies=(5.2, 9.5), raises=(3.0,), log=str(tmp_path))
    before = cluster.process_ids
    data = sweep(spring, points=points, cluster=cluster)
    failed = np.flatnonzero(~data.converged)
    np.testing.assert_array_equal(failed, [10, 30, 50, 52, 95])
    np.testing.assert_array_equal(data.ok.displacement[:, 0, 1], -np.delete(points, failed) / 2)
    assert cluster.process_ids == before
    # two tries each, and no more
    tries = [len(list(tmp_path.glob(f"{points[row]:.6f}-*"))) for row in failed]
    assert tries == [2] * 5
    aborted, raised, died = (data.message[row] for row in (10, 30, 95))
    assert aborted.startswith("its process was ended by SIGABRT, in each of 2 tries\n\n")
    assert "Fatal Python error: Aborted" in aborted
    assert "sweep_problems.py" in aborted
    assert died.startswith("its process ended with exit code 3, in each of 2 tries")
    assert raised.startswith("ZeroDivisionError: no answer at 3\n\nTraceback")
    assert "in solve" in raised
    assert "case.py" not in raised


@pytest.mark.full
def test_a_case_that_never_ends_costs_its_limit_once(cluster, tmp_path):
    spring = Spring(hangs=(4.0,), log=str(tmp_path))
    data = sweep(spring, points=np.arange(8.0), cluster=cluster, case_limit=2.0)
    np.testing.assert_array_equal(np.flatnonzero(~data.converged), [4])
    assert data.message[4].startswith("it took longer than 2 s\n\n")
    assert "in never_end" in data.message[4]
    assert len(list(tmp_path.glob("4.000000-*"))) == 1


def test_what_is_no_exception_costs_its_row_alone(cluster):
    """sys.exit and its like end neither the worker nor the neighbours, which solve on in the same chain."""
    quits = {"exit": 1.0, "KeyboardInterrupt": 3.0, "GeneratorExit": 4.0, "Unwritable": 6.0}
    before = cluster.process_ids
    data = sweep(Spring(quits=quits), points=np.arange(8.0), cluster=cluster)
    np.testing.assert_array_equal(np.flatnonzero(~data.converged), [1, 3, 4, 6])
    np.testing.assert_array_equal(data.ok.displacement[:, 0, 1], -np.array([0.0, 2.0, 5.0, 7.0]) / 2)
    assert cluster.process_ids == before
    reasons = [str(data.message[row]).partition("\n\n")[0] for row in (1, 3, 4, 6)]
    assert reasons[:3] == ["called sys.exit(3)", "raised KeyboardInterrupt", "raised GeneratorExit"]
    assert reasons[3].startswith("raised sweep_problems.Unwritable")
    assert "in solve" in data.message[1]


class Quitting(Ground):
    def open(self):
        sys.exit("no licence")


def test_a_model_that_quits_while_it_is_opened_is_said(cluster):
    with pytest.raises(SolverError, match="4 of 4") as caught:
        sweep(Quitting(), samples=4, cluster=cluster)
    assert "called sys.exit('no licence')" in caught.value.why


def test_too_many_failures_are_told_without_their_tracebacks(cluster):
    with pytest.raises(SolverError) as caught:
        sweep(Spring(raises=(1.0, 2.0)), points=[1.0, 2.0], cluster=cluster)
    assert "ZeroDivisionError: no answer at 1" in caught.value.why
    assert "Traceback" not in caught.value.why


def test_convergence_without_numbers_is_a_failure(cluster):
    data = sweep(Spring(lies=(3.0,)), points=np.arange(5.0), cluster=cluster)
    np.testing.assert_array_equal(np.flatnonzero(~data.converged), [3])
    assert data.message[3] == "the solver calls it converged, but potential_energy is not finite"


class Unopenable(Ground):
    def open(self):
        super().open()
        os.abort()


@pytest.mark.full
def test_a_model_that_cannot_be_opened_is_tried_twice_by_each_worker(cluster, tmp_path):
    with pytest.raises(SolverError, match="32 of 32") as caught:
        sweep(Unopenable(log=str(tmp_path)), samples=32, cluster=cluster)
    assert "The model could not be opened: its process was ended by SIGABRT" in caught.value.why
    assert len(list(tmp_path.iterdir())) <= 2 * len(cluster)


def test_the_limit_of_a_case_is_a_time():
    with pytest.raises(UsageError, match="limit of a case"):
        sweep(Spring(), points=[1.0], case_limit=0.0)


@pytest.mark.full
def test_a_killed_worker_changes_no_bit_and_leaves_nothing(cluster):
    ground = Ground(seconds=0.005)
    with local_cluster(1) as mortal:
        (worker,) = mortal.process_ids

        def kill(done, total):
            if 0 < done < total and psutil.pid_exists(worker):
                os.kill(worker, signal.SIGKILL)

        data = sweep(ground, samples=32, cluster=mortal, progress=kill)
        assert mortal.process_ids != (worker,)
        children = psutil.Process(*mortal.process_ids).children()
        assert len(children) == 1
        assert mortal.folder.is_dir()
    assert data.hash == sweep(ground, samples=32, cluster=cluster).hash
    assert not mortal.folder.exists()
    _, alive = psutil.wait_procs(children, timeout=10)
    assert not alive


@pytest.mark.full
def test_sigterm_keeps_what_is_solved(cluster, tmp_path):
    def terminate(done, total):
        if done:
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(SystemExit) as end:
        sweep(Spring(), samples=64, cluster=cluster, path=tmp_path / "a.zarr", progress=terminate)
    assert end.value.code == 128 + signal.SIGTERM
    assert list((tmp_path / "a.zarr.parts").glob("part-*.zarr"))


def test_a_plan_cut_short_is_written_again(cluster, tmp_path):
    parts = tmp_path / "a.zarr.parts"
    parts.mkdir()
    (parts / "plan.json").write_text("{", encoding="utf-8")
    assert sweep(Spring(), samples=4, cluster=cluster, path=tmp_path / "a.zarr").converged.all()


def test_no_scheduler_is_said_in_a_sentence():
    import dask

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "200ms"}),
        pytest.raises(ResourceError, match=r"No scheduler answers at tcp://127.0.0.1:9") as caught,
    ):
        sweep(Spring(), points=[1.0], cluster="tcp://127.0.0.1:9")
    assert caught.value.exit_code == 3


@pytest.mark.full
@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # sockets that Dask lets go, below
def test_a_lost_scheduler_keeps_what_is_solved(cluster, tmp_path):
    import distributed

    arguments = {"body": Spring(), "samples": 64, "path": tmp_path / "a.zarr"}
    mortal = local_cluster(1)
    ends = threading.Thread(target=mortal.close)

    def lose(done, total):
        if done and not ends.ident:
            ends.start()
            ends.join()

    own = distributed.Client(mortal.address, security=mortal.security, set_as_default=False)
    with pytest.raises(ResourceError, match="is lost") as caught:
        sweep(**arguments, cluster=own, progress=lose)
    with contextlib.suppress(OSError, ValueError):  # of Dask, which tries to connect again meanwhile
        own.close()
    own.status = "closed"  # or it closes again when it is collected, and fails in whatever test runs then
    gc.collect()  # a connection that it began is warned of here, not in the next test
    assert "same command goes on" in caught.value.fix
    kept = sum(len(Dataset.open(part)) for part in (tmp_path / "a.zarr.parts").glob("part-*.zarr"))
    assert kept > 0
    seen = []
    sweep(**arguments, cluster=cluster, progress=lambda done, _: seen.append(done))
    assert seen[0] == kept


@pytest.mark.parametrize("status", ["connecting", "running"])
def test_a_client_that_fails_to_close_hides_no_loss(monkeypatch, status):
    class Failing:
        def __init__(self, address, **options):
            self.status = status

        def close(self):
            closed.append(True)
            raise ValueError("IOStream is not idle")

    closed = []
    monkeypatch.setattr("distributed.Client", Failing)
    expected = ResourceError if status == "connecting" else ValueError
    with pytest.raises(expected), connect("tcp://127.0.0.1:9", None):
        raise ResourceError("The scheduler of the sweep is lost.")
    assert closed == [True]
