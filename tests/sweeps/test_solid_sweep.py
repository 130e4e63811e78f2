"""Sweeps of bodies in space: their own design and chains, the same bits on whatever workers."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from solid_problems import REST, TRIANGLES, Ground, answer, outside

from palpate.dataset import Dataset, Field, Layout, solid_fields
from palpate.errors import SolverError, UsageError
from palpate.sweeps import ExternalProblem, local_cluster, sweep
from palpate.sweeps.ledger import Ledger
from palpate.units import Range

SPRING = ExternalProblem(
    ranges=(Range("h", 0.0, 0.01, "m"),),
    layout=Layout(np.zeros((1, 3))),
    schema=solid_fields(1, (Range("h", 0.0, 0.01, "m"),)),
    function=outside,
    description={"body": {"type": "spring"}},
)


def interrupt_after(count):
    def interrupt(done, total):
        if done >= count:
            raise KeyboardInterrupt

    return interrupt


@pytest.mark.full
def test_every_answer_is_where_it_belongs(cluster):
    data = sweep(Ground(), samples=32, seed=2, cluster=cluster)
    assert data.converged.all()
    assert data.provenance["design"] == "columns"
    np.testing.assert_array_equal(data.X, Ground().design(32, 2))
    np.testing.assert_array_equal(data.rest, REST)
    np.testing.assert_array_equal(data.triangles, TRIANGLES)
    for row, c in enumerate(data.X):
        energy, force, gradient, s = answer(c)
        np.testing.assert_allclose(data.potential_energy[row], energy, atol=1e-12)
        np.testing.assert_array_equal(data.force[row], force)
        np.testing.assert_array_equal(data.force_gradient[row], gradient)
        assert data.penetration[row] == s
        assert data.displacement[row, :, 2].min() >= -s
    assert (data["solve_seconds"] > 0).all()
    assert (data["iterations"] == 3).all()
    assert np.isnan(data.largest_strain).all()  # optional, and not answered


def test_another_design_may_be_asked_for(cluster):
    own = sweep(Ground(), samples=8, design="columns", cluster=cluster)
    other = sweep(Ground(), samples=8, design="sobol", cluster=cluster)
    assert own.hash == sweep(Ground(), samples=8, cluster=cluster).hash
    assert other.provenance["design"] == "sobol"
    assert len(np.unique(other.X[:, 0])) == 8
    with pytest.raises(UsageError, match="'columns'"):
        sweep(SPRING, samples=8, design="columns", cluster=cluster)


@pytest.mark.full
def test_chains_begin_anew_whoever_solves_them(cluster, tmp_path):
    """The energy counts the solves since opening or reset: each column counts from 1, however it was run."""
    two = sweep(Ground(log=str(tmp_path)), samples=64, cluster=cluster)
    openings = list(tmp_path.iterdir())
    one = sweep(Ground(), samples=64, workers=1)
    assert one.hash == two.hash
    # 16 chains, but each of the two workers opens once
    assert len(openings) <= 2
    surplus = [energy - answer(c)[0] for energy, c in zip(one.potential_energy, one.X, strict=True)]
    np.testing.assert_allclose(surplus, np.tile([1e-13, 2e-13, 3e-13, 4e-13], 16), atol=2e-14)


@pytest.mark.full
def test_an_interruption_changes_no_bit(cluster, tmp_path):
    arguments = {"samples": 64, "cluster": cluster, "path": tmp_path / "a.zarr"}
    for count in (9, 30):
        with pytest.raises(KeyboardInterrupt):
            sweep(Ground(seconds=0.005), **arguments, progress=interrupt_after(count))
        ledger = Ledger(tmp_path / "a.zarr", "")
        kept = np.concatenate([part["sample"] for part in ledger.read()])
        # whole columns of four only
        assert np.all(np.bincount(kept // 4, minlength=16) % 4 == 0)
        assert 0 < np.unique(kept).size < 64
    seen = []
    data = sweep(Ground(seconds=0.005), **arguments, progress=lambda done, _: seen.append(done))
    assert seen[0] >= 30
    assert data.hash == sweep(Ground(), samples=64, cluster=cluster).hash
    assert Dataset.open(tmp_path / "a.zarr").hash == data.hash


@pytest.mark.full
def test_a_chain_of_which_only_a_part_is_on_disk_is_solved_again(cluster, tmp_path):
    whole = sweep(Ground(), samples=16, cluster=cluster)
    ledger = Ledger(tmp_path / "a.zarr", whole.provenance["config_hash"])
    ledger.begin(16)
    ledger.add(whole.take([0, 1, 2, 3, 4, 5]))
    seen = []
    data = sweep(
        Ground(),
        samples=16,
        cluster=cluster,
        path=tmp_path / "a.zarr",
        progress=lambda done, _: seen.append(done),
    )
    assert seen[0] == 4
    assert data.hash == whole.hash


@pytest.mark.full
def test_parts_of_another_mesh_are_not_taken_up(cluster, tmp_path):
    whole = sweep(Ground(), samples=8, cluster=cluster)
    moved = Dataset(whole.data.assign_coords(rest=whole.data["rest"] + 1e-6))
    ledger = Ledger(tmp_path / "a.zarr", whole.provenance["config_hash"])
    ledger.begin(8)
    ledger.add(moved)
    seen = []
    arguments = {"cluster": cluster, "path": tmp_path / "a.zarr", "samples": 8}
    data = sweep(Ground(), **arguments, progress=lambda done, _: seen.append(done))
    assert seen[0] == 0
    assert data.hash == whole.hash


@pytest.mark.full
def test_a_worker_that_dies_by_accident_changes_no_bit(tmp_path):
    deadly = Ground().design(16, 0)[5, 0]
    with local_cluster(2) as mortal:
        data = sweep(Ground(log=str(tmp_path), kills_once=deadly), samples=16, cluster=mortal)
        assert (tmp_path / "killed").exists()
        assert data.hash == sweep(Ground(), samples=16, cluster=mortal).hash


def test_rows_without_an_admissible_answer_say_why(cluster):
    torn = Ground().design(16, 0)[4, 0]
    data = sweep(Ground(fails_below=0.056, raises=(torn,)), samples=16, cluster=cluster)
    # the deepest of each column, and a whole column that raises
    np.testing.assert_array_equal(np.flatnonzero(~data.converged), [3, 4, 5, 6, 7, 11, 15])
    assert data.message[3] == "the probe is through the surface"
    assert "ZeroDivisionError" in data.message[5]
    assert data["iterations"][3] == 3
    assert data["solve_seconds"][3] > 0
    for name in ("displacement", "potential_energy", "response", "response_gradient"):
        assert np.isnan(data[name][3]).all()
        assert np.isfinite(data[name][2]).all()
    assert "7 did not converge" in str(data)


def test_a_function_is_problem_enough(cluster):
    data = sweep(SPRING, samples=16, cluster=cluster)
    h = data.X[:, 0]
    np.testing.assert_array_equal(data.converged, h <= 0.008)
    np.testing.assert_allclose(data.ok.force[:, 0], -100 * h[h <= 0.008])
    assert set(data.message) == {"converged", "the spring is torn"}
    assert data.provenance["problem"]["function"] == "outside"
    assert data.provenance["problem"]["body"]["type"] == "spring"


def test_answers_that_are_not_finite_have_not_converged():
    problem = ExternalProblem(
        SPRING.ranges, SPRING.layout, (Field("energy", unit="J"),), lambda x: {"energy": np.inf}
    )
    found = problem.open().solve(np.array([1.0]))
    assert not found.converged
    assert found.message == "no finite answer"


def lacking(x):
    return {"displacement": [[0.0, 0.0, 0.0]]}


def misshapen(x):
    return outside(x) | {"response": -1.0}


@pytest.mark.parametrize(
    ("function", "why"), [(lacking, "lacks 'potential_energy'"), (misshapen, "'response'")]
)
def test_answers_that_break_the_schema_are_named(cluster, function, why):
    problem = ExternalProblem(SPRING.ranges, SPRING.layout, SPRING.schema, function)
    with pytest.raises(SolverError) as caught:
        sweep(problem, points=[0.001], cluster=cluster)
    assert why in caught.value.why


class Unplanned(Ground):
    design_name = None

    def design(self, samples, seed):
        raise AssertionError

    chains = design


def test_a_problem_may_leave_design_and_chains_to_the_sweep(cluster):
    data = sweep(Unplanned(), samples=16, cluster=cluster)
    assert data.provenance["design"] == "sobol"
    assert len(np.unique(data.X[:, 0])) == 16


class Careless(Ground):
    def chains(self, points):
        return [np.array([0, 1, 1])]


def test_chains_have_to_part_the_samples():
    with pytest.raises(UsageError, match="each sample once"):
        sweep(Careless(), samples=4)


def test_a_schema_has_to_fit_the_layout():
    odd = ExternalProblem(
        SPRING.ranges, SPRING.layout, (Field("displacement", ("node", "component"), (2, 3)),), outside
    )
    with pytest.raises(UsageError, match="'node'"):
        sweep(odd, samples=4)


@pytest.mark.full
def test_the_guides_own_solver_runs(tmp_path):
    guide = Path(__file__).parents[2] / "docs" / "guide" / "datasets-and-files.md"
    (program,) = re.findall(r"```python\n(.*?)```", guide.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", "program.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Dataset of 32 solves of spring, all converged" in done.stdout


def test_what_a_problem_lacks_is_named():
    class Half:
        ranges = SPRING.ranges

        def open(self):
            return None

    with pytest.raises(UsageError) as caught:
        sweep(Half(), samples=4)
    assert "layout, schema, describe" in caught.value.why
