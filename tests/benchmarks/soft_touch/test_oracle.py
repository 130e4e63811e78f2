"""The shipped tables of soft-touch: their mathematics, and beside a fresh solve."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from benchmarks.soft_touch.bodies import BODIES, CASES, RADIUS, SEED, STEPS, paths_of
from benchmarks.soft_touch.make_cases import make_places
from benchmarks.soft_touch.oracle import ELEMENT, read_solves, solve_path

from benchmarks.soft_touch import oracle


def table(file):
    """Return the columns of a table by name."""
    with file.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def along(name):
    """Return depths in m, force along the path in N, stiffness, energy and the stiffness' error, path by path."""
    presses, oracle = (table(CASES / name / f"{part}.csv") for part in ("presses", "oracle"))
    solved = np.isin(presses["press"], oracle["press"])
    presses = {key: column[solved] for key, column in presses.items()}
    assert presses["press"].tolist() == oracle["press"].tolist()
    force = sum(oracle[f"f{axis}"] * presses[f"n{axis}"] for axis in "xyz")
    columns = (presses["depth"], force, oracle["kn"], oracle["energy"], oracle["stiffness_error"])
    return zip(*(column.reshape(-1, STEPS) for column in columns), strict=True)


@pytest.mark.parametrize("name", BODIES)
def test_places_follow_from_the_published_seed(name):
    presses = table(CASES / name / "presses.csv")
    paths = paths_of(name, SEED, len(presses["press"]) // STEPS)
    centres = np.concatenate([path.centres for path in paths])
    np.testing.assert_allclose(np.column_stack([presses[axis] for axis in "xyz"]), centres, atol=2e-9)
    assert len({tuple(path.place) for path in paths}) == len(paths)


@pytest.mark.parametrize("name", BODIES)
def test_the_energys_slope_is_the_force_and_the_forces_slope_the_stiffness(name):
    """Cubics of Hermite through force and stiffness have the energy's differences as integrals, to the fourth order."""
    for depth, force, stiffness, energy, error in along(name):
        width = np.diff(depth)
        work = width * (force[1:] + force[:-1]) / 2 + width**2 * (stiffness[:-1] - stiffness[1:]) / 12
        np.testing.assert_allclose(np.diff(energy), work, rtol=0.02)
        slope = (stiffness[1:] + stiffness[:-1]) / 2
        allowed = np.maximum(error[1:], error[:-1]) + 0.005 * slope  # the mean's own error, by k ~ √depth
        assert (np.abs(np.diff(force) / width - slope) < allowed).all()
        assert (error < 0.15 * stiffness).all()


@pytest.mark.parametrize("name", BODIES)
def test_a_closed_path_ends_where_it_begins_and_goes_in_small_steps(name):
    loops = table(CASES / name / "loops.csv")
    for loop in (0, 1):
        points = np.column_stack([loops[axis][loops["loop"] == loop] for axis in "xyz"])
        assert len(points) >= 60
        np.testing.assert_allclose(points[0], points[-1], atol=1e-6)
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < RADIUS / 10


@pytest.mark.full
@pytest.mark.timeout(300)
@pytest.mark.parametrize("name", ["block", "dome"])
def test_shipped_solves_agree_with_a_fresh_solve(name):
    """The first press of the first path; meshes of another version of the mesher may differ."""
    path = paths_of(name, SEED, 1)[0]
    fresh = solve_path(name, path, ELEMENT, 1)[0]
    shipped = read_solves(CASES / name)[0, "palpate", f"{ELEMENT:g}"]
    size = np.linalg.norm(shipped[:3])
    np.testing.assert_allclose(fresh[:3], shipped[:3], atol=0.01 * size)
    np.testing.assert_allclose(fresh[3:], shipped[3:], rtol=0.01)


def test_at_the_smallest_depth_the_block_is_near_hertz():
    """A half-space bears less than the bonded block, by the series of a bonded layer (Dimitriadis et al. 2002)."""
    depth, force, *_ = next(iter(along("block")))
    hertz = 4 / 3 * 15e3 / (1 - 0.45**2) * np.sqrt(RADIUS) * depth[0] ** 1.5
    layer = np.sqrt(RADIUS * depth[0]) / 0.05  # width of the contact over the block's height
    first = 2 / np.pi * (1.2876 - 1.4678 * 0.45 + 1.3442 * 0.45**2) / (1 - 0.45)
    assert force[0] / hertz == pytest.approx(1 + first * layer + (first * layer) ** 2, abs=0.05)


def test_another_seed_makes_other_places_with_an_oracle_of_their_own(monkeypatch, tmp_path):
    """Hertz's forces stand in for the solves; the shipped case lends the mesh's part and CalculiX's difference."""

    def hertz(name, path, element):
        depth = path.depths[:, None]
        force = 2e4 * np.sqrt(RADIUS) * depth**1.5
        return np.hstack([force * path.normal, 1.5 * force / depth, 0.4 * force * depth]).tolist()

    monkeypatch.setattr(oracle, "solve_path", hertz)
    make_places("block", 7, tmp_path / "block")
    presses, made = (table(tmp_path / "block" / f"{part}.csv") for part in ("presses", "oracle"))
    assert presses["press"].tolist() == made["press"].tolist() == list(range(60))
    assert (made["force_error"] > 0).all()
    shipped = table(CASES / "block" / "presses.csv")
    assert not set(presses["x"]) & set(shipped["x"])
    ideal = 2e4 * np.sqrt(RADIUS) * presses["depth"] ** 1.5
    np.testing.assert_allclose(made["fz"], ideal, rtol=0.05)


def test_a_path_that_fails_on_coarse_elements_alone_gives_no_correction():
    """The others do: here forces on finer elements are 2 % smaller, so that size zero is 2 % / (1 − 0.7²) below."""
    coarse, finer = np.array([0.0, 0, 1, 100, 1e-3]), np.array([0.0, 0, 0.98, 100, 1e-3])
    solves = {(press, "palpate", f"{ELEMENT:g}"): coarse for press in range(STEPS)}
    solves |= {(press, "palpate", f"{oracle.FINER * ELEMENT:g}"): finer for press in range(2 * STEPS)}
    part, doubt = oracle._mesh_part(solves)
    np.testing.assert_allclose(part[:, 0], -0.02 / (1 - oracle.FINER**2))
    np.testing.assert_allclose(part[:, 1:], 0.0, atol=1e-12)
    assert (doubt[:, 0] > 0).all()
