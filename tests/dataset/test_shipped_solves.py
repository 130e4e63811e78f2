"""The datasets that tests learn from are small, and what finite elements still answer."""

from __future__ import annotations

import runpy

import numpy as np
import pytest

from solved import DATA, solved

SOLVED = runpy.run_path(str(DATA / "make_solves.py"))["SOLVED"]


def test_every_file_has_a_problem_and_is_small():
    assert {file.stem for file in DATA.glob("*.zip")} == {*SOLVED, "small"}
    assert all(file.stat().st_size < 200_000 for file in DATA.glob("*.zip"))


@pytest.mark.full
@pytest.mark.parametrize("name", SOLVED)
def test_a_shipped_solve_is_solved_again(name):
    problem, samples, _ = SOLVED[name]()
    data = solved(name)
    assert len(data.ok) == samples
    assert [r.name for r in problem.ranges] == [r.name for r in data.ranges]
    found = problem.solve(data.X[0])
    # as close as solves from other starts come, which end at the solver's tolerance
    assert found.potential_energy == pytest.approx(float(data.data["potential_energy"][0]), rel=1e-6)
    force = np.asarray(data.data["response"][0])
    np.testing.assert_allclose(found.response, force, atol=1e-5 * np.linalg.norm(force[:3]))
