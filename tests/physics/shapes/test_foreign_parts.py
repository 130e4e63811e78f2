"""Parts from files of other programs may crash or hang the mesher and the solver; this process goes on."""

import os
import time
from dataclasses import dataclass

import numpy as np
import pytest
import trimesh

from palpate.errors import SolverError, UsageError
from palpate.physics import Body, ImportedSolid, NeoHookean, SurfaceTraction, apart
from palpate.physics.shapes import surface_checks


@pytest.fixture
def stacked(tmp_path):
    """A box of 30 × 30 × 20 on the middle of one of 40 × 40 × 20, in mm: faces touch, no nodes are shared."""
    boxes = [trimesh.creation.box((40, 40, 20)), trimesh.creation.box((30, 30, 20))]
    boxes[1].apply_translation((0, 0, 20))
    trimesh.util.concatenate(boxes).export(path := tmp_path / "stacked.stl")
    return ImportedSolid(path, unit="mm", element=0.012)


def test_shells_that_touch_are_refused_with_the_place(stacked):
    with pytest.raises(UsageError, match="shells 1 and 2") as caught:
        stacked.mesh()
    assert ", 0.01) m" in caught.value.what


@pytest.mark.parametrize("offset", [(0, 0, 40.0), (35.0, 0, 20)])
def test_shells_apart_are_no_fault(tmp_path, offset):
    """One well above the other; one above and beside it, in the plane of its top."""
    boxes = [trimesh.creation.box((40, 40, 20)), trimesh.creation.box((30, 30, 20))]
    boxes[1].apply_translation(offset)
    trimesh.util.concatenate(boxes).export(path := tmp_path / "apart.stl")
    assert len(ImportedSolid(path, unit="mm").surfaces) == 12


@pytest.mark.full
def test_a_crash_of_the_mesher_is_an_error_here(stacked, monkeypatch):
    monkeypatch.setattr(surface_checks, "touching_shells", lambda surface: None)
    with pytest.raises(SolverError, match="SIGABRT") as caught:
        stacked.mesh()
    assert caught.value.exit_code == 3
    assert "unite touching bodies" in caught.value.fix


def test_a_mesher_that_never_ends_is_given_up(monkeypatch):
    monkeypatch.setattr(apart, "MESH_LIMIT", 0.2)
    with pytest.raises(SolverError, match=r"longer than 0\.2 s"):
        apart.read_apart(time.sleep, 60.0, doing="sleeping")


def test_relative_paths_start_where_this_process_is(tmp_path, monkeypatch):
    """Also when it has moved since the child was started, as a notebook does."""
    for folder in (tmp_path / "first", tmp_path / "second"):
        folder.mkdir()
        monkeypatch.chdir(folder)
        assert apart.read_apart(os.getcwd, doing="asking where it is") == str(folder)


@dataclass
class Deadly:
    def open(self):
        os.abort()


@pytest.mark.full
def test_a_crash_of_a_solver_is_an_error_here():
    with pytest.raises(SolverError, match="while solving: its process was ended by SIGABRT"):
        apart.solve_apart(Deadly(), np.zeros(1), {})


@pytest.mark.full
def test_an_imported_part_is_solved_apart_with_the_same_bits(tmp_path):
    trimesh.creation.box((40, 40, 20)).export(tmp_path / "box.stl")
    box = ImportedSolid(tmp_path / "box.stl", unit="mm", element=0.04)
    body = Body(box, NeoHookean(1e5, 0.3), fixed="face 1")
    problem = body.problem(SurfaceTraction("face 2", "normal", (-1e3, 0.0)))
    there = problem.solve([-100.0])
    here = problem.open().solve([-100.0])
    assert there.converged
    np.testing.assert_array_equal(there.displacement, here.displacement)
    assert there.potential_energy == here.potential_energy
