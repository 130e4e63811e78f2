"""Fields learnt from solves: the modes are the singular vectors, exact parts are found, errors are stated honestly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.learning.fields import (
    Snapshots,
    learn_displacement,
    learn_field,
    learn_snapshots,
    lumped_mass,
)
from palpate.learning.fields.decompose_field import SurfaceModes, left_out
from palpate.learning.fields.fit_local_mode import (
    border_widths,
    by_conjugate_gradients,
    degrees,
    directions,
    fade_out,
    fit_local_mode,
)
from palpate.learning.fields.snapshots import Solves
from palpate.network.codec import decode, encode
from palpate.surrogates import TouchedSurface
from palpate.surrogates.fields import DepthAmplitude, LocalMode, Variation
from palpate.surrogates.fields.local_mode import design
from palpate.surrogates.fields.surface_interpolation import SurfaceInterpolation
from palpate.units import Range
from solved import solved

RADIUS, DEEPEST = 0.010, 0.006
BOX = [
    Range("c_x", -0.01, 0.01, "m"),
    Range("c_y", -0.01, 0.01, "m"),
    Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
]


@pytest.fixture(scope="module")
def face():
    """Points and triangles of the face z = 0, 60 mm wide, and its distance."""
    side = 13
    x = np.linspace(-0.03, 0.03, side)
    points = np.array([(a, b, 0.0) for a in x for b in x])
    k = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower, upper = np.stack([k, k + side, k + 1], 1), np.stack([k + 1, k + side, k + side + 1], 1)
    triangles = np.vstack([lower, upper])
    return points, triangles, TouchedSurface.of(points, triangles, radius=RADIUS)


def columns(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Positions (3 · count, 3) in columns of three depths, the last the deepest, and their columns."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.01, 0.01, (count, 2))
    depths = np.column_stack([rng.uniform(0.0005, 0.005, (count, 2)), np.full(count, DEEPEST)])
    X = np.column_stack([np.repeat(places, 3, axis=0), RADIUS - depths.ravel()])
    return X, np.repeat(np.arange(count), 3)


def snapshots(seed: int = 0, N: int = 12, nodes: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Random fields and masses, with sizes that fall."""
    rng = np.random.default_rng(seed)
    mass = rng.uniform(0.2, 2.0, nodes)
    fields = np.tensordot(rng.normal(size=(N, N)) * 0.5 ** np.arange(N), rng.normal(size=(N, nodes, 3)), 1)
    return fields, mass / mass.sum()


def test_modes_are_singular_vectors_in_the_weighted_inner_product():
    values, mass = snapshots()
    found = SurfaceModes.of(values, mass)
    # eigenvectors of the correlation in the same inner product, by another way: the method of snapshots
    gram = np.einsum("ajc,bjc,j->ab", values, values, mass)
    sizes, V = np.linalg.eigh(gram)
    np.testing.assert_allclose(found.sizes[:6], np.sqrt(sizes[::-1][:6] / len(values)), rtol=1e-8)
    for k in range(6):
        mode = np.tensordot(V[:, -1 - k], values, 1) / np.sqrt(sizes[-1 - k])
        overlap = abs((mode * found.modes[k] * mass[:, None]).sum())
        assert overlap == pytest.approx(1.0, abs=1e-8)


def test_modes_are_orthonormal_to_twelve_digits():
    values, mass = snapshots()
    modes = SurfaceModes.of(values, mass).modes
    inner = np.einsum("ajc,bjc,j->ab", modes, modes, mass)
    np.testing.assert_allclose(inner, np.eye(len(modes)), atol=1e-12)


def test_what_the_modes_miss_of_the_snapshots_is_the_tail_of_singular_values():
    values, mass = snapshots()
    found = SurfaceModes.of(values, mass)
    for r in (1, 3, 7, 11):
        modes = found.take(r).modes
        along = np.einsum("njc,kjc,j->nk", values, modes, mass)
        rest = values - np.tensordot(along, modes, 1)
        missed = np.sqrt(((rest**2).sum(axis=2) @ mass).mean())
        assert missed == pytest.approx(found.missed[r], rel=1e-8)
        assert found.count(missed * 1.01) == r
        assert found.count(missed * 0.99) == r + 1


def test_no_modes_of_zero_fields_and_none_beyond_the_rank():
    values, mass = snapshots()
    assert len(SurfaceModes.of(values[:3][[0, 1, 2, 0, 1]], mass).sizes) == 3
    nothing = SurfaceModes.of(np.zeros((4, 40, 3)), mass)
    assert len(nothing.modes) == 1
    assert not nothing.sizes.any()


def test_modes_left_out_miss_what_is_new_in_a_group():
    _, mass = snapshots()
    values = np.random.default_rng(0).normal(size=(6, 40, 3))  # hardly anything in common
    alike = np.concatenate([values, 2.0 * values])
    assert left_out(alike, mass, 6, np.arange(12) % 6) > 1.0  # each pair goes together
    assert left_out(alike, mass, 6, np.arange(12)) < 0.2  # folds of ten part but two pairs
    assert np.isnan(left_out(values, mass, 6, np.zeros(6)))


def test_masses_are_shares_of_the_area(face):
    points, triangles, _ = face
    mass = lumped_mass(points, triangles)
    assert mass.sum() == pytest.approx(1.0, abs=1e-14)
    assert mass @ points[:, 0] == pytest.approx(0.0, abs=1e-16)
    inner = (np.abs(points[:, :2]) < 0.029).all(axis=1)
    np.testing.assert_allclose(mass[inner], 1 / 144, rtol=1e-12)  # one square of 12 × 12


@pytest.mark.full
def test_rigid_fields_whose_coefficients_are_affine_are_found_exactly(face):
    points, triangles, surface = face
    X, column = columns(8)
    moves = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]])
    f = ((RADIUS - X[:, 2]) / DEEPEST) ** 2
    # translations and a turn about z, with coefficients f times affine functions of the place
    b = np.column_stack([0.3 + 20 * X[:, 0], 10 * X[:, 1], 1 + 5 * X[:, 0], 30 * X[:, 0] - 90 * X[:, 2]])
    turn = np.cross([0, 0, 1.0], points) / 0.03
    shapes = np.concatenate([np.broadcast_to(moves[:, None], (3, len(points), 3)), turn[None]])
    values = 1e-3 * np.tensordot(f[:, None] * b, shapes, 1)
    known = {"points": points, "triangles": triangles, "surface": surface, "radius": RADIUS, "inputs": BOX}
    learnt = learn_field(
        X, values, **known, tolerance=1e-12, moving=False, groups=column, units_max=4, effort=0.2
    )
    assert learnt.field.amplitude.name == "square"
    assert len(learnt.field.modes) == 4
    new, _ = columns(5, seed=1)
    bn = np.column_stack(
        [0.3 + 20 * new[:, 0], 10 * new[:, 1], 1 + 5 * new[:, 0], 30 * new[:, 0] - 90 * new[:, 2]]
    )
    fn = ((RADIUS - new[:, 2]) / DEEPEST) ** 2
    errors = learnt.field.errors(new, 1e-3 * np.tensordot(fn[:, None] * bn, shapes, 1))
    # the ridge of 1e-9 on weights of size one; fields of 1 mm
    assert errors.max() < 1e-8
    assert errors.max("truncation") < 1e-12
    assert learnt.learning_left_out < 1e-8


@pytest.mark.full
@pytest.mark.parametrize("components", [1, 3])
def test_a_dimple_alone_needs_no_modes(face, components):
    """A field that is the same everywhere in the probe's frame is shown by the moving part, where modes fail."""
    points, triangles, surface = face
    mass = lumped_mass(points, triangles)
    amplitude = DepthAmplitude("square", DEEPEST)

    def dimples(X):
        offset = points[None] - np.column_stack([X[:, :2], np.zeros(len(X))])[:, None]
        rho = np.linalg.norm(offset, axis=2) / (3 * RADIUS)
        s = (RADIUS - X[:, 2]) / DEEPEST
        shape = np.where(rho < 1, (1 - rho**2) ** 4, 0.0) * (s**2 * (1 - 0.3 * s))[:, None]
        if components == 1:
            return 1e-3 * shape[..., None]
        return 1e-3 * (0.2 * shape[..., None] * offset / RADIUS - shape[..., None] * [0, 0, 1.0])

    X, column = columns(10)
    new, _ = columns(6, seed=1)
    known = {"surface": surface, "points": points}

    def solves(X):
        one = Snapshots(X, dimples(X), np.arange(len(X)), points, mass, triangles)
        return Solves.of([one], BOX, surface, RADIUS, points, triangles, mass)

    local_mode = fit_local_mode(solves(X), amplitude)
    (shown,) = solves(new).moving(local_mode, amplitude)
    # splines of 3.6 mm on a polynomial of degree 8: h⁴ |g''''|/384 of it
    assert np.abs(shown - dimples(new)).max() < 0.01 * np.abs(dimples(new)).max()

    more = {**known, "triangles": triangles, "radius": RADIUS, "inputs": BOX, "groups": column}
    errors = [
        learn_field(X, dimples(X), **more, moving=t, amplitude="square", effort=0.2, units_max=2)
        .field.errors(new, dimples(new))
        .mean()
        for t in (True, False)
    ]
    assert errors[0] < 0.1 * errors[1]


@pytest.mark.full
@pytest.mark.parametrize("components", [1, 3])
def test_a_dimple_that_differs_from_place_to_place_is_learnt(face, components):
    """It leans towards the middle and grows sideways by a quarter: what travels unchanged misses that."""
    points, triangles, surface = face

    def dimples(X):
        offset = (points[None] - np.column_stack([X[:, :2], np.zeros(len(X))])[:, None]) / 0.02
        rho, s = np.linalg.norm(offset, axis=2), (RADIUS - X[:, 2]) / DEEPEST
        even = np.where(rho < 1, (1 - rho**2) ** 4, 0.0) * (s**2)[:, None]
        lean = 1.0 + 25.0 * X[:, :1] - 40.0 * np.einsum("nkc,nc->nk", offset[:, :, :2], X[:, :2])
        return 1e-3 * (even * lean)[..., None] * ([1.0] if components == 1 else [0.2, 0.0, -1.0])

    X, column = columns(30)
    new, _ = columns(12, seed=1)
    known = {"surface": surface, "points": points, "triangles": triangles, "radius": RADIUS, "inputs": BOX}
    learnt = learn_field(X, dimples(X), **known, groups=column, amplitude="square", effort=0.2, units_max=2)
    assert learnt.field.local_mode.variation is not None
    assert "a local mode that varies" in str(learnt.field)
    fixed = replace(learnt.field, local_mode=replace(learnt.field.local_mode, variation=None))
    missed, without = (F.errors(new, dimples(new)) for F in (learnt.field, fixed))
    assert missed.max() < 0.2 * without.max()
    assert missed.mean() < 0.1 * without.mean()


@pytest.mark.full
def test_a_dimple_that_is_the_same_everywhere_does_not_vary(face):
    points, triangles, surface = face
    X, column = columns(12)
    rng = np.random.default_rng(0)
    offset = points[None] - np.column_stack([X[:, :2], np.zeros(len(X))])[:, None]
    rho, s = np.linalg.norm(offset, axis=2) / (3 * RADIUS), (RADIUS - X[:, 2]) / DEEPEST
    values = 1e-3 * np.where(rho < 1, (1 - rho**2) ** 4, 0.0) * (s**2)[:, None]
    values += rng.normal(0.0, 1e-5, values.shape)  # what no place tells
    known = {"surface": surface, "points": points, "triangles": triangles, "radius": RADIUS, "inputs": BOX}
    learnt = learn_field(X, values, **known, groups=column, amplitude="square", effort=0.2, units_max=2)
    assert learnt.field.local_mode.variation is None
    alone = learn_field(
        X, values, **known, groups=np.zeros(len(X)), amplitude="square", effort=0.2, units_max=2
    )
    assert alone.field.local_mode.variation is None, "nothing can be left out"


@pytest.mark.parametrize(("off", "count"), [(0.0, 1), (3e-4, 2), (1e-3, 1)])
def test_nodes_that_lie_a_little_off_the_surface_are_tried_with_and_without(face, off, count):
    """By 3 % of the radius, as a rounded border does; on it, or a tenth of the radius off, nothing is to decide."""
    points, triangles = (
        np.array([[0.0, 0.0, -off], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]]),
        np.array([[0, 1, 2]]),
    )
    X, column = columns(2)
    one = Snapshots(X, np.zeros((6, 3, 1)), column, points, np.full(3, 1 / 3), triangles)
    solves = Solves.of([one], BOX, face[2], RADIUS, points, triangles, one.mass)
    assert len(border_widths(solves)) == count


def test_a_dimple_fades_to_nothing_at_its_reach():
    """What is asked is the window times the profile, smooth to its end; in the middle nothing changes."""
    r = 21
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 1.0 - 1e-9, 400)
    greville = (np.arange(r) - 1.0) / (r - 3)
    smooth = np.cos(3.0 * greville)[None, :, None] * rng.uniform(0.5, 1.0, (2, 1, 4))
    varied = smooth[0, :, 0][None, None, :, None, None] * rng.normal(size=(4, 3, 1, 4, 3))
    own = Variation(varied, np.array([[0], [1], [2]]), np.eye(3)[:1], np.array([[0.0], [1.0]]))
    free = LocalMode(smooth, 0.05, 1e-4, own)
    found = fade_out(free)
    u = np.clip((t - 0.3) / 0.7, 0.0, 1.0)
    window = (1.0 - u) ** 3 * (1.0 + 3.0 * u + 6.0 * u**2)  # 1 and 0 at its ends, with two derivatives
    before, after = (np.einsum("ti,pij->tpj", design(t * (r - 3), r), one.table) for one in (free, found))
    # splines of h = 1/18 on a window whose third derivative steps by 60/0.7³: h³ 175 times less than a hundredth
    assert np.abs(after - window[:, None, None] * before).max() < 3e-4
    assert not found.table[:, -3:].any()
    assert not found.variation.table[:, :, -3:].any()
    before, after = (
        np.einsum("ti,qmihc->tqmhc", design(t * (r - 3), r), one.variation.table) for one in (free, found)
    )
    assert np.abs(after - window[:, None, None, None, None] * before).max() < 3e-4 * np.abs(before).max()


@pytest.mark.full
def test_what_travels_is_learnt_at_the_nodes_that_it_was_solved_on(face):
    """A local mode as narrow as two elements, on three meshes: carried from node to node it loses its flank."""
    points, triangles, surface = face
    rng = np.random.default_rng(0)
    inner = (np.abs(points[:, :2]) < 0.029).all(axis=1)

    def mesh():
        return points + np.where(
            inner[:, None], rng.uniform(-0.001, 0.001, points.shape) * (1.0, 1.0, 0.0), 0.0
        )

    def dimples(X, points):
        rho = np.linalg.norm(points[None, :, :2] - X[:, None, :2], axis=2)
        return -(RADIUS - X[:, 2:]) * np.exp(-((rho / 0.006) ** 2))

    solved, asked = mesh(), mesh()
    X, column = columns(30)
    new, _ = columns(12, seed=1)
    mass = lumped_mass(points, triangles)
    known = {"inputs": BOX, "points": points, "triangles": triangles, "surface": surface, "radius": RADIUS}
    known |= {"amplitude": "linear", "effort": 0.2, "units_max": 2, "mass": mass}
    own = Snapshots(
        X, dimples(X, solved)[..., None], column, solved, lumped_mass(solved, triangles), triangles
    )
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    carried = replace(
        own,
        values=SurfaceInterpolation.of(solved, triangles, points, up)(own.values),
        points=points,
        mass=mass,
    )
    errors = []
    for one in (own, carried):
        shown = learn_snapshots([one], **known).field.values_at(new, asked, triangles)[..., 0]
        errors.append(np.abs(shown - dimples(new, asked)).max())
    assert errors[0] < 0.3 * errors[1]
    assert errors[0] < 0.05 * DEEPEST


def test_conjugate_gradients_solve_the_normal_equations():
    rng = np.random.default_rng(0)
    A = rng.normal(size=(7, 20, 3))
    grams, touches, sides = A.transpose(0, 2, 1) @ A, rng.normal(size=(7, 5)), rng.normal(size=(7, 3, 2))
    found = by_conjugate_gradients(grams, touches, sides)
    whole = sum(np.kron(np.outer(t, t), G) for t, G in zip(touches, grams, strict=True))
    ridge = 1e-4 * np.trace(whole) / 15
    right = sum(np.einsum("k,lc->klc", t, side) for t, side in zip(touches, sides, strict=True)).reshape(
        15, 2
    )
    left = (whole + ridge * np.eye(15)) @ found.reshape(15, 2) - right
    assert (np.linalg.norm(left, axis=0) <= 1.01e-4 * np.linalg.norm(right, axis=0)).all()


@pytest.mark.parametrize(("turned", "count"), [(0.0, 2), (np.pi / 4, 2), (np.pi, 3)])
def test_places_are_told_in_a_plane_where_the_surface_is_a_graph_over_it(turned, count):
    """A cap of a sphere is one over the plane of its rim, a whole sphere over none."""
    polar, around = np.meshgrid(np.linspace(0.0, turned, 9), np.linspace(0.0, 2 * np.pi, 8, endpoint=False))
    x, y, z = np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)
    found = directions(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    assert len(found) == count
    np.testing.assert_allclose(found @ found.T, np.eye(count), atol=1e-15)
    if count == 2:
        np.testing.assert_allclose(found @ [0.0, 0.0, 1.0], 0.0, atol=1e-15)


def test_no_more_polynomials_than_eighty_four():
    assert [len(degrees(v)) for v in (2, 3, 4, 5, 6)] == [66, 84, 70, 56, 84]
    assert degrees(2).sum(axis=1).max() == 10
    assert (degrees(3)[0] == 0).all()


def test_without_contact_nothing_moves_and_the_file_and_record_are_whole(face):
    points, triangles, surface = face
    X, column = columns(5)
    rng = np.random.default_rng(0)
    values = 1.0 + rng.normal(size=(15, len(points))) * 1e-3
    learnt = learn_field(
        X, values, points=points, triangles=triangles, surface=surface, radius=RADIUS, inputs=BOX, groups=column,
        name="largest stretch", unit="", rest=np.ones((len(points), 1)), effort=0.2, units_max=2,
    )  # fmt: skip
    F = learnt.field
    assert (F.values(np.array([[0.0, 0, RADIUS], [0, 0, 1.0]])) == 1.0).all()
    again = decode(type(F), encode(F, kind="field"))
    np.testing.assert_array_equal(again.values(X), F.values(X))
    assert again.meta["solves"] == 15
    assert again.meta["truncation"] == learnt.truncation
    # noise can't be learnt, and what is left out says so
    assert learnt.learning_left_out > 3 * learnt.truncation
    assert all(t.error >= learnt.learning_left_out for t in learnt.trials)


def test_what_cannot_be_learnt_is_refused(face):
    points, triangles, surface = face
    X, _ = columns(3)
    known = {"points": points, "triangles": triangles, "surface": surface, "radius": RADIUS, "inputs": BOX}
    values = np.zeros((9, len(points), 3))
    for more, words in (
        ({"amplitude": "cube"}, "option amplitude"),
        ({"seconds": 0}, "option seconds"),
        ({"triangles": triangles[:0]}, "area"),
    ):
        with pytest.raises(UsageError, match=words):
            learn_field(X, values, **(known | more))
    with pytest.raises(UsageError, match="Fields of shape"):
        learn_field(X, values[:, :5], **known)
    with pytest.raises(UsageError, match="contact"):
        learn_field(X + np.array([0, 0, 0.02]), values, **known)


@pytest.mark.full
def test_a_pressed_block_is_seen_within_stated_errors():
    data = solved("block").ok
    top = np.abs(data.rest[data.triangles][:, :, 2] - 0.03).max(axis=1) < 1e-9
    surface = TouchedSurface.of(data.rest, data.triangles[top], radius=RADIUS)
    train, test = data.take(np.arange(12)), data.take(np.arange(12, len(data)))
    learnt = learn_displacement(train, surface=surface, radius=RADIUS, effort=0.2)
    nodes = np.unique(data.triangles)
    errors = learnt.field.errors(test.X, test.displacement[:, nodes])
    assert np.abs(test.displacement).max() > 1e-3  # it was pressed
    # what the study of a touched organ asks of its field
    assert errors.mean() < 0.1e-3
    assert errors.max() < 0.6e-3
