"""Sweeps on real worker processes."""

import json
import os
import sys
import time

import numpy as np
import pytest
from sweep_problems import LoneSpring, Spring

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, SolverError, UsageError
from palpate.physics import Cantilever, Circle, LinearElastic, TipLoad, preset
from palpate.sweeps import OnDemandCluster, Scheduler, grow, is_begun, sweep
from palpate.sweeps.sweep import reporter

BODY = Cantilever(1.0, Circle(0.005), LinearElastic(2e9, 0.43), elements=5)


def test_a_sweep_is_the_solves_one_by_one(cluster):
    data = sweep(BODY, TipLoad(0, 5), samples=20, seed=4, cluster=cluster)
    problem = BODY.problem(TipLoad(0, 5))
    assert data.ranges == problem.ranges
    assert data.converged.all()
    for x, found in zip(data.X, data.displacement, strict=True):
        np.testing.assert_allclose(found, problem.solve(x).displacement, atol=1e-9)
    np.testing.assert_allclose(data.root_reaction[:, 1], data.X[:, 0], atol=1e-9)
    np.testing.assert_array_equal(data.rest, problem.rest)
    strains = [problem.solve(x).largest_strain for x in data.X]
    np.testing.assert_allclose(data.largest_strain, strains, rtol=1e-6)
    assert data.provenance["problem"] == json.loads(json.dumps(problem.describe()))


@pytest.mark.full
def test_the_founding_sweep(cluster):
    beam = preset("beam-nylon")
    data = sweep(beam.body, beam.loads, samples=beam.samples, design=beam.design, cluster=cluster)
    assert len(data) == 501
    assert data.converged.all()
    np.testing.assert_allclose(data.X[:, 0], np.arange(501) / 100, atol=1e-15)
    tip = data.displacement[:, data.load_nodes[0], 1]
    assert (np.diff(tip) < 0).all()
    # dΠ/dP = -(displacement along the load), by central differences of neighbouring rows
    slope = (data.potential_energy[2:] - data.potential_energy[:-2]) / 0.02
    np.testing.assert_allclose(slope, tip[1:-1], atol=5e-6)  # h² w'''/6


@pytest.mark.full
def test_the_number_of_workers_changes_no_bit(cluster):
    two = sweep(BODY, TipLoad(0, 5), samples=40, cluster=cluster)
    one = sweep(BODY, TipLoad(0, 5), samples=40, workers=1)
    assert one.hash == two.hash


@pytest.mark.full
def test_workers_on_demand_serve_all_sweeps_and_start_for_none_that_is_solved(tmp_path):
    with OnDemandCluster(1) as workers:
        data = sweep(Spring(), points=[1.0, 2.0], path=tmp_path / "a.zarr", cluster=workers)
        (process,) = workers.start().process_ids
        sweep(Spring(), points=[3.0], cluster=workers)
        assert workers.start().process_ids == (process,)
    none = OnDemandCluster(0)
    assert sweep(Spring(), points=[1.0, 2.0], path=tmp_path / "a.zarr", cluster=none).hash == data.hash
    with pytest.raises(UsageError, match="0 workers"):
        sweep(Spring(), points=[3.0], cluster=none)


def test_points_and_progress_of_ones_own(cluster):
    seen = []
    data = sweep(Spring(), points=[1.0, 7.0, 3.0], cluster=cluster, progress=lambda *done: seen.append(done))
    np.testing.assert_array_equal(data.X[:, 0], [1, 7, 3])
    np.testing.assert_array_equal(data.displacement[:, 0, 1], [-0.5, -3.5, -1.5])
    assert seen[0] == (0, 3)
    assert seen[-1] == (3, 3)
    assert data.provenance["design"] == "points"


def test_failures_are_rows(cluster):
    points = np.arange(10.0)
    data = sweep(Spring(fails=(2.0,), raises=(5.0,)), points=points, cluster=cluster)
    np.testing.assert_array_equal(np.flatnonzero(~data.converged), [2, 5])
    assert np.isnan(data.displacement[[2, 5]]).all()
    np.testing.assert_array_equal(data.ok.displacement[:, 0, 1], -np.delete(points, [2, 5]) / 2)
    assert "unstable" in data.data["message"].values[2]
    assert "ZeroDivisionError: no answer at 5" in data.data["message"].values[5]


def test_too_many_failures_raise_with_examples(cluster):
    with pytest.raises(SolverError, match="3 of 4") as caught:
        sweep(Spring(fails=(1.0, 2.0, 3.0)), points=[0.0, 1.0, 2.0, 3.0], cluster=cluster)
    assert "P = 1 N" in caught.value.why
    assert "unstable" in caught.value.why
    data = sweep(Spring(fails=(1.0, 2.0, 3.0)), points=np.arange(4.0), cluster=cluster, max_failed=0.75)
    assert len(data.ok) == 1


def test_the_advice_fits_the_failures(cluster):
    points = np.arange(5.0)
    with pytest.raises(SolverError) as some:
        sweep(Spring(fails=(1.0, 2.0, 3.0, 4.0)), points=points, cluster=cluster)
    assert "The first of them:" in some.value.why
    assert "in Python, max_failed=0.8" in some.value.fix
    with pytest.raises(SolverError) as every:
        sweep(Spring(fails=(1.0, 2.0)), points=points[1:3], cluster=cluster)
    assert "They are:" in every.value.why
    assert "max_failed" not in every.value.fix


def test_loads_beyond_the_solvers_reach_are_a_solver_error(cluster):
    with pytest.raises(SolverError) as caught:
        sweep(BODY, TipLoad(1e6, 1e9), samples=4, cluster=cluster)
    assert "P = " in caught.value.why
    assert caught.value.exit_code == 3


@pytest.mark.parametrize(
    "arguments",
    [
        {"body": BODY, "interactions": TipLoad(0, 1)},
        {"body": BODY, "interactions": TipLoad(0, 1), "samples": 3, "points": [1.0]},
        {"body": BODY, "samples": 3},
        {"body": "beam", "interactions": TipLoad(0, 1), "samples": 3},
        {"body": BODY, "interactions": TipLoad(0, 1), "samples": 0},
        {"body": BODY, "interactions": TipLoad(0, 1), "points": []},
        {"body": BODY, "interactions": TipLoad(0, 1), "samples": 3, "design": "spiral"},
        {"body": BODY, "interactions": TipLoad(0, 1), "samples": 3, "workers": 0},
    ],
)
def test_wrong_arguments(arguments):
    with pytest.raises(UsageError):
        sweep(**arguments)


def test_any_scheduler_and_any_client_will_do(cluster, tmp_path):
    import distributed

    certificate, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    certificate.write_text(cluster.security.tls_client_cert)
    key.write_text(cluster.security.tls_client_key)
    own = Scheduler(cluster.address, ca=certificate, certificate=certificate, key=key)
    by_scheduler = sweep(Spring(), points=[1.0, 2.0], cluster=own)
    with distributed.Client(cluster.address, security=cluster.security, set_as_default=False) as client:
        by_client = sweep(Spring(), points=[1.0, 2.0], cluster=client)
        assert client.status == "running"
    assert by_scheduler.hash == by_client.hash


@pytest.mark.parametrize(
    ("scheduler", "words"),
    [
        ({"address": "cluster.example"}, "tls://HOST:PORT"),
        ({"address": "tcp://127.0.0.1:8786", "ca": __file__, "certificate": __file__}, "tls://"),
        ({"address": "tls://127.0.0.1:8786", "ca": __file__}, "your own"),
        ({"address": "tls://127.0.0.1:8786", "ca": "absent.pem", "certificate": __file__}, "absent.pem"),
        ({"address": "tls://127.0.0.1:8786"}, "--tls-ca"),
    ],
)
def test_a_scheduler_that_cannot_be_asked_is_refused_before_anything_is_sent(scheduler, words):
    with pytest.raises(UsageError, match=words):
        sweep(Spring(), points=[1.0], cluster=Scheduler(**scheduler))


def test_a_finished_sweep_is_read_not_solved_again(cluster, tmp_path):
    (tmp_path / "log").mkdir()
    spring = Spring(log=str(tmp_path / "log"))
    first = sweep(spring, samples=8, cluster=cluster, path=tmp_path / "a.zarr")
    again = sweep(spring, samples=8, cluster=cluster, path=tmp_path / "a.zarr")
    assert again.hash == first.hash == Dataset.open(tmp_path / "a.zarr").hash
    assert len(list((tmp_path / "log").iterdir())) == 8
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.zarr", "log"]


@pytest.mark.grid
@pytest.mark.parametrize("change", [{"samples": 9}, {"seed": 1}, {"body": Spring(fails=(1.0,))}])
def test_another_sweep_at_the_same_path_is_refused(cluster, tmp_path, change):
    arguments = {"body": Spring(), "samples": 8, "cluster": cluster, "path": tmp_path / "a.zarr"}
    first = sweep(**arguments)
    with pytest.raises(UsageError, match="belongs to another sweep"):
        sweep(**arguments | change)
    assert Dataset.open(tmp_path / "a.zarr").hash == first.hash


@pytest.mark.full
def test_a_finished_sweep_grows_by_what_is_missing(cluster, tmp_path):
    """Sobol's first points are those of a smaller design: the larger sweep is the same as one made at once."""
    (tmp_path / "log").mkdir()
    spring, path = LoneSpring(log=str(tmp_path / "log")), tmp_path / "a.zarr"
    assert grow(path, spring, {"samples": 16}) is None
    small = sweep(spring, samples=8, cluster=cluster, path=path)
    assert grow(path, spring, {"samples": 8}) is None
    assert grow(path, spring, {"samples": 16}) is None
    begun = [samples for samples in (8, 16, 32) if is_begun(path, spring, {"samples": samples})]
    assert begun == [16], "as after an interruption: nothing but the parts is there"
    grown = sweep(spring, samples=16, cluster=cluster, path=path)
    assert len(list((tmp_path / "log").iterdir())) == 16
    assert grown.hash == sweep(spring, samples=16, cluster=cluster).hash
    np.testing.assert_array_equal(grown.X[:8], small.X)
    # a larger one serves where fewer are asked for; another seed is another sweep
    assert grow(path, spring, {"samples": 8}).hash == grown.hash
    assert grow(path, spring, {"samples": 32, "seed": 1}) is None
    with pytest.raises(UsageError, match="belongs to another sweep"):
        sweep(spring, samples=32, seed=1, cluster=cluster, path=path)


@pytest.mark.full
def test_an_interrupted_sweep_goes_on_where_it_stopped(cluster, tmp_path):
    (tmp_path / "log").mkdir()
    spring = Spring(log=str(tmp_path / "log"), seconds=0.01)
    arguments = {"body": spring, "samples": 64, "cluster": cluster, "path": tmp_path / "a.zarr"}

    def interrupt(done, total):
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(**arguments, progress=interrupt)
    assert not (tmp_path / "a.zarr").exists()
    with pytest.raises(UsageError, match="belongs to another sweep"):
        sweep(**arguments | {"seed": 2})
    # tasks in flight end by themselves; their solves count for nothing
    time.sleep(0.5)
    for file in (tmp_path / "log").iterdir():
        file.unlink()
    seen = []
    data = sweep(**arguments, progress=lambda done, _: seen.append(done))
    assert seen[0] >= 20
    assert len(list((tmp_path / "log").iterdir())) == 64 - seen[0]
    assert not (tmp_path / "a.zarr.parts").exists()
    assert data.hash == sweep(Spring(), samples=64, cluster=cluster).hash


def test_a_damaged_dataset_at_the_path_says_to_delete_it(cluster, tmp_path):
    arguments = {"body": Spring(), "samples": 8, "cluster": cluster, "path": tmp_path / "a.zarr"}
    sweep(**arguments)
    (tmp_path / "a.zarr" / "inputs" / "zarr.json").unlink()
    with pytest.raises(FileFormatError, match="corrupt") as caught:
        sweep(**arguments)
    assert "Delete" in caught.value.fix
    assert "sweep again" in caught.value.fix


@pytest.mark.full
@pytest.mark.parametrize("when", [0, 1])
def test_two_runs_of_one_sweep_end_alike(cluster, tmp_path, when):
    """A second run starts and ends while the first one is at it: as it begins, or just before its end."""
    arguments = {"body": Spring(), "samples": 64, "cluster": cluster, "path": tmp_path / "a.zarr"}
    others = []

    def meanwhile(done, total):
        if done == when * total and not others:
            others.append(sweep(**arguments))

    first = sweep(**arguments, progress=meanwhile)
    assert first.hash == others[0].hash == Dataset.open(tmp_path / "a.zarr").hash
    assert [p.name for p in tmp_path.iterdir()] == ["a.zarr"]


@pytest.mark.full
def test_another_sweep_that_takes_the_path_meanwhile_is_spared(cluster, tmp_path):
    arguments = {"samples": 8, "cluster": cluster, "path": tmp_path / "a.zarr"}
    other = sweep(Spring(fails=(99.0,)), samples=8, cluster=cluster)

    def meanwhile(done, total):
        if done == total:
            other.save(tmp_path / "a.zarr")

    with pytest.raises(UsageError, match="belongs to another sweep"):
        sweep(Spring(), **arguments, progress=meanwhile)
    assert Dataset.open(tmp_path / "a.zarr").hash == other.hash


def test_a_bar_starts_where_an_earlier_run_stopped(monkeypatch):
    seen = []

    class Bar:
        def __init__(self, *_, **__):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def add_task(self, _, **fields):
            seen.append(fields)

        def update(self, _, **fields):
            seen.append(fields)

    monkeypatch.setattr("rich.progress.Progress", Bar)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with reporter(True) as report:
        report(20, 64)
    assert seen == [{"completed": 20, "total": 64}]


def test_a_log_gets_a_line_now_and_then(monkeypatch, capsys):
    clock = iter([0.0, 1.0, 11.0, 11.0, 12.0, 13.0, 13.0])
    monkeypatch.setattr(sys.modules["palpate.sweeps.sweep"], "monotonic", lambda: next(clock))
    with reporter(True) as report:
        for done in (0, 3, 5, 9):
            report(done, 9)
    assert capsys.readouterr().err == "solved 3 of 9\nsolved 9 of 9\n"
    with reporter(False) as report:
        report(9, 9)
    assert capsys.readouterr().err == ""


@pytest.mark.full
def test_a_damaged_part_is_solved_again(cluster, tmp_path):
    arguments = {"body": Spring(), "samples": 64, "cluster": cluster, "path": tmp_path / "a.zarr"}

    def interrupt(done, total):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(**arguments, progress=interrupt)
    (part,) = (tmp_path / "a.zarr.parts").glob("part-*")
    os.remove(part / "inputs" / "zarr.json")
    assert sweep(**arguments).hash == sweep(Spring(), samples=64, cluster=cluster).hash
