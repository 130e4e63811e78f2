"""The surrogates' benchmark: its data, its rivals and its figures, on bodies whose answer is known by formula."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.records import Record
from benchmarks.surrogate_cases import Case, symmetry_of
from benchmarks.surrogate_measure import _errors
from benchmarks.surrogate_rivals import RIVALS, _rows, cubic_rbf, learnt, linear_in_depth
from benchmarks.surrogate_springs import Springs, identified
from benchmarks.touch_studies import STUDIES, TouchStudy

from benchmarks import surrogate_cases, surrogate_relaxation, touch_data
from palpate.learning.relaxation import random_drive, step_hold
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.surrogates.memories import Patches, Relaxation, course
from palpate.validation import TouchSolves

SIDE, HEIGHT, R = 0.04, 0.02, 0.01
STUDY = TouchStudy(
    lambda: Body(Block((SIDE, SIDE, HEIGHT), element=0.01), NeoHookean(9e3, 0.45), fixed="bottom"),
    depth=0.006,
    over=((0.02, 0.02), (0.03, 0.03)),
    about=(0.02, 0.02),
    wanted=20,
)


def energy(X, power=2.0):
    """U (N,), F (N, 3) and ∂F/∂c (N, 3, 3) of a body with the square's symmetry: U = ½ k g sᵖ, g = 1 + q r²."""
    k, q = 200.0, 300.0
    r, s = X[:, :2] - 0.02, HEIGHT + R - X[:, 2]
    g = 1 + q * (r**2).sum(axis=1)
    p = power
    U = 0.5 * k * g * s**p
    F = 0.5 * k * np.c_[-2 * q * r * s[:, None] ** p, p * g * s ** (p - 1)]
    K = np.zeros((len(X), 3, 3))
    K[:, 0, 0] = K[:, 1, 1] = -k * q * s**p
    K[:, :2, 2] = K[:, 2, :2] = k * q * p * r * s[:, None] ** (p - 1)
    K[:, 2, 2] = -0.5 * k * g * p * (p - 1) * s ** (p - 2)
    return U, F, K


def file_of(columns=12, depths=4, answer=energy):
    rows = [
        (role, c.number, x, *(v[0] for v in answer(x[None])))
        for role in ("train", "test")
        for c in touch_data.columns_of(STUDY, columns, depths, 0, role)
        for x in c.centres
    ]
    names = ("role", "column", "inputs", "energy", "force", "stiffness")
    return {name: np.array([row[i] for row in rows]) for i, name in enumerate(names)}


@pytest.fixture(scope="module")
def case():
    return Case("block", STUDY, file_of(), surrogate_cases._surface(STUDY))


def test_data_of_a_longer_run_begin_with_those_of_a_shorter_one():
    few, many = (touch_data.columns_of(STUDY, n, 3, 5, "train") for n in (4, 16))
    for a, b in zip(few, many, strict=False):
        assert np.array_equal(a.centres, b.centres)
    other = touch_data.columns_of(STUDY, 16, 3, 5, "test")
    assert not {c.centres.tobytes() for c in many} & {c.centres.tobytes() for c in other}


def test_columns_press_the_plane_within_their_depths():
    for role in ("train", "test"):
        for column in touch_data.columns_of(STUDY, 8, 5, 1, role):
            assert np.allclose(HEIGHT + R - column.centres[:, 2], column.depths, atol=1e-15)
            assert (np.diff(column.depths) > 0).all()
            assert 2e-4 <= column.depths[0] < column.depths[-1] <= STUDY.depth
            assert (column.foot[:2] >= 0.02).all()
            assert (column.foot[:2] <= 0.03).all()


@pytest.mark.full
def test_a_run_goes_on_where_it_was_and_parts_join(tmp_path, monkeypatch):
    monkeypatch.setitem(STUDIES, "block", STUDY)
    asked = []

    def solved(solver, column, options):
        asked.append(column.number)
        rows = [
            dict(zip(("energy", "force", "stiffness"), energy(x[None]), strict=True)) for x in column.centres
        ]
        return [
            {k: v[0] for k, v in row.items()}
            | {"inputs": x, "column": column.number, "role": options.role, "seconds": 0.0}
            for row, x in zip(rows, column.centres, strict=True)
        ]

    monkeypatch.setattr(touch_data, "_solve", solved)
    files = [tmp_path / f"{i}.npz" for i in range(3)]
    common = ["block", "--depths", "2", "--seed", "3", "--columns"]
    touch_data.main([*common, "3", "--part", "0/2", "--out", str(files[0])])
    assert asked == [0, 2]
    touch_data.main([*common, "6", "--part", "0/2", "--out", str(files[0])])
    assert asked == [0, 2, 4]
    touch_data.main([*common, "6", "--part", "1/2", "--out", str(files[1])])
    touch_data.main([*common, "2", "--role", "test", "--out", str(files[2])])
    whole = tmp_path / "whole.npz"
    touch_data.main(["block", "--join", *map(str, reversed(files)), "--out", str(whole)])
    with np.load(whole) as data:
        assert data["role"].tolist() == ["train"] * 12 + ["test"] * 4
        assert data["column"].tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 0, 0, 1, 1]
        assert np.allclose(data["force"], energy(data["inputs"])[1])
    # columns of another number of depths come to a joined file later
    later = tmp_path / "later.npz"
    touch_data.main(
        ["block", "--depths", "3", "--seed", "3", "--columns", "8", "--first", "6", "--out", str(later)]
    )
    touch_data.main(["block", "--join", str(whole), str(later), "--out", str(tmp_path / "longer.npz")])
    with np.load(whole) as short, np.load(tmp_path / "longer.npz") as data:
        assert data["column"][:18].tolist() == [*short["column"][:12], 6, 6, 6, 7, 7, 7]
        assert np.array_equal(data["force"][18:], short["force"][12:])
        plans = str(data["provenance"])
        assert all(word in plans for word in ('"depths": 2', '"depths": 3', '"role": "test"'))
    with pytest.raises(SystemExit, match="not of layered"):
        touch_data.main(["layered", "--join", str(whole), "--out", str(tmp_path / "wrong.npz")])
    with pytest.raises(SystemExit, match="4 solves are in two"):
        touch_data.main(["block", "--join", str(whole), str(files[2]), "--out", str(tmp_path / "twice.npz")])
    with pytest.raises(SystemExit, match="name another file"):
        touch_data.main(["block", "--depths", "3", "--out", str(files[0])])


@pytest.mark.full
def test_displacements_of_a_joined_file_stay_where_more_is_joined(tmp_path):
    def part(name, role, seed):
        rng = np.random.default_rng(seed)
        points = np.random.default_rng(0).random((20, 3))
        plan = {"study": "block", "depths": 2, "seed": 0, "role": role, "fields": True}
        arrays = {key: rng.random((4, 3)) for key in ("inputs", "force")} | {"energy": rng.random(4)}
        arrays |= {"column": np.array([0, 0, 1, 1]) + 2 * seed, "role": np.full(4, role)}
        arrays |= {"displacement": rng.random((4, 20, 3)).astype(np.float32), "points": points}
        triangles = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8]])
        np.savez(tmp_path / name, **arrays, triangles=triangles, plan=json.dumps(plan), done=[0, 1])
        return str(tmp_path / name)

    first, second, test = part("a.npz", "train", 0), part("b.npz", "train", 1), part("c.npz", "test", 2)
    once, before, after = (str(tmp_path / name) for name in ("once.npz", "before.npz", "after.npz"))
    touch_data.main(["block", "--join", first, second, test, "--out", once])
    touch_data.main(["block", "--join", first, test, "--out", before])
    touch_data.main(["block", "--join", before, second, "--out", after])
    with np.load(once) as one, np.load(after) as two:
        assert one["displacement_mm"].shape == (12, 9, 3)
        for key in ("displacement_mm", "nodes", "inputs", "column"):
            assert np.array_equal(one[key], two[key]), key


@pytest.mark.parametrize(("kind", "count"), [("square", 8), ("round", 16), ("none", 0)])
def test_symmetries_are_groups(kind, count):
    M = symmetry_of(kind)
    assert len({np.round(m, 9).tobytes() for m in M}) == count
    for a in M:
        assert any(np.allclose(a @ M[1], b) for b in M)


def test_images_are_touches_of_the_same_body(case):
    train = case.training(10)
    X, F = case.images(train.X, train.force)
    assert X.shape == (10, 8, 3)
    assert np.allclose(energy(X.reshape(-1, 3))[1], F.reshape(-1, 3), atol=1e-12)


@pytest.mark.parametrize("count", [1, 6, 20, 48])
def test_training_sets_have_the_size_asked_and_no_solve_twice(case, count):
    rows = case.training_rows(count)
    assert len(set(rows.tolist())) == count
    assert set(rows) <= set(case.rows("train"))


def test_held_out_rows_are_whole_solves(case):
    train = case.training(20)
    X, F = case.images(train.X, train.force)
    x, _ = _rows(X, F)
    last = x[len(x) - len(x) // 5 :]
    folded = {(*tuple(np.round(np.sort(np.abs(p[:2] - 0.02)), 9)), round(p[2], 9)) for p in last}
    others = {
        (*tuple(np.round(np.sort(np.abs(p[:2] - 0.02)), 9)), round(p[2], 9)) for p in x[: len(x) - len(last)]
    }
    assert not folded & others


def test_images_that_coincide_count_once():
    x = np.zeros((1, 8, 3))
    x[0, 4:, 0] = 1.0
    assert len(_rows(x, np.ones((1, 8, 3)))[0]) == 2


def test_a_force_that_is_linear_in_depth_is_learnt_exactly():
    # U = ½ k s² with one k everywhere
    def spring(X):
        s = HEIGHT + R - X[:, 2]
        K = np.zeros((len(X), 3, 3))
        K[:, 2, 2] = -50.0
        return 25 * s**2, np.c_[0 * s, 0 * s, 50 * s], K

    case = Case("block", STUDY, file_of(answer=spring), surrogate_cases._surface(STUDY))
    test, model = case.solves("test"), linear_in_depth(case, case.training(48))
    assert np.allclose(model.force(test.X), test.force, atol=1e-6 * test.force.max())
    # forces have rounding, and the differences are of 1 µm
    assert np.allclose(model.stiffness(test.X), test.stiffness, atol=1e-3 * 50)


def test_interpolation_takes_its_training_forces(case):
    train = case.training(20)
    model = learnt(cubic_rbf, "RBF")(case, train)
    assert np.allclose(model.force(train.X), train.force, atol=1e-6 * np.abs(train.force).max())


@pytest.mark.full
def test_no_rival_feels_anything_without_contact(case):
    away = np.array([[0.02, 0.02, HEIGHT + R + 1e-4]])
    for rival in RIVALS.values():
        assert not rival(case, case.training(10)).force(away).any()


def test_errors_of_a_force_a_percent_too_large(case):
    test = case.solves("test")
    row = _errors(test, 1.01 * test.force, 1.01 * test.stiffness)
    assert row["median"] == pytest.approx(0.01, rel=1e-9)
    assert row["p95"] == pytest.approx(0.01, rel=1e-9)
    assert row["stiffness"] == pytest.approx(0.01, rel=1e-9)
    assert row["direction"] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.full
def test_springs_find_the_modulus_that_made_their_data():
    true = Springs(Case("block", STUDY, file_of(), surrogate_cases._surface(STUDY)), (1.3,))
    train = true.case.training(6)
    F, _ = true.answers(train.X)
    assert np.isfinite(F).all()
    found = identified(true.case, replace(train, force=F), 10)
    assert found.factors[0] == pytest.approx(1.3, rel=1e-3)


def test_touches_of_a_round_body_are_turned_to_where_its_mesh_is_fine(case):
    round_case = replace(case, study=replace(STUDY, symmetry="round"))
    X = case.training(20).X
    turned, back = Springs(round_case, (1.0,))._turned(X)
    assert np.allclose(turned[:, 1], 0.02)
    assert (turned[:, 0] >= 0.02).all()
    about = np.array([0.02, 0.02, 0.0])
    assert np.allclose(np.einsum("nij,nj->ni", back, turned - about) + about, X, atol=1e-15)


def test_relaxation_finds_the_branches_that_made_its_data(tmp_path, monkeypatch):
    touch, height = (0.03, 0.03, 0.04), 0.03
    times = np.geomspace(0.02, 14, 16)
    drives = {
        "hold2": step_hold(touch, 0.002, times),
        "hold5": step_hold(touch, 0.005, times),
        "random": random_drive(touch, 0.005, 0.004, seconds=4, dt=0.02),
    }
    branches, arrays = Relaxation(((0.3, 0.1), (0.2, 2.0)), 1e-4), {"height": height}
    elastic = {}
    for name, drive in drives.items():
        s = np.maximum(touch[2] - drive.positions[:, 2], 0.0)
        elastic[name] = (1e4 * s**3, np.c_[0 * s, 0 * s, 3e4 * s**2])
        arrays |= {f"{name}_t": drive.times, f"{name}_c": drive.positions}
        arrays |= {f"{name}_U": elastic[name][0], f"{name}_Fe": elastic[name][1]}
    parts = {n: {"c": d.positions, "U": elastic[n][0]} for n, d in drives.items()}
    patches: Patches = surrogate_relaxation._patches(parts, height)
    for name, drive in drives.items():
        U, F = elastic[name]
        arrays[f"{name}_F"] = course(
            replace(branches, patches=patches).start(), drive.times, drive.positions, U, -F
        ).force
    np.savez(tmp_path / "visco.npz", **arrays)
    monkeypatch.setattr(surrogate_relaxation, "DATA", tmp_path)
    (table,) = surrogate_relaxation.relaxation_table(quick=False)
    (row,) = [r for r in table.rows if r["drive"] == "random"]
    # a held press takes time to spread over the patches, which the identification of one memory leaves out
    assert row["p95"] < 0.02
    assert row["times"] > 3
    assert all(claim.met == 1.0 for claim in table.claims)


def test_every_study_has_its_tables_of_record():
    for name in STUDIES:
        for kind in ("", "-curve", "-rivals"):
            assert Record.read(f"surrogates-{name}{kind}").rows


def test_solves_of_the_file_are_a_test_for_validation(case):
    assert isinstance(case.solves("test"), TouchSolves)
    assert case.solves("refined") is None
