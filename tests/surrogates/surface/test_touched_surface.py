"""Depths into planes, balls, tubes and boxes, where they are known."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from skins import ball, box, directions, plate, quads, tube

from palpate.errors import FileFormatError, UsageError
from palpate.surrogates.surface import TouchedSurface, distance_into
from palpate.surrogates.surface.distance_table import GAIN, SOME

R = 0.010  # m
FACE = 0.060  # m


@cache
def face():
    return TouchedSurface.of(*plate(FACE, 10, seed=0), radius=R)


@cache
def sphere():
    return TouchedSurface.of(*ball(0.05, 12, scatter=0.06), radius=R, spacing=0.002)


def uniform(low, high, count, seed=0):
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def one(surface, c):
    gradient, hessian = np.zeros(3), np.zeros((3, 3))
    return (
        distance_into(np.asarray(c, dtype=float), gradient, hessian, *surface.compiled()),
        gradient,
        hessian,
    )


def test_over_the_interior_of_a_plane_the_distance_is_its_height():
    h = face().spacing
    # how far inside the border, and from what depth on: that is bridged deeper than R/2 within R of the border
    for edge, low in ((FACE / 2 - 5 * h, -R / 2 + 5 * h), (FACE / 2 - R - 5 * h, -face().inner)):
        C = uniform([-edge, -edge, low], [edge, edge, face().reach], 5000)
        exact(face(), C, C[:, 2])


def exact(surface, C, truth):
    d, gradient, hessian = surface.at(C)
    assert np.abs(d - truth).max() < 1e-12 * FACE
    assert np.abs(gradient - [0, 0, 1]).max() < 1e-12
    assert np.abs(hessian).max() < 1e-12 / surface.spacing


def test_a_plane_that_lies_askew_is_as_exact():
    Q, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    Q *= np.linalg.det(Q)
    points, triangles = plate(FACE, 6, seed=1)
    surface = TouchedSurface.of(points @ Q.T + 0.3, triangles, radius=R, spacing=0.0015)
    edge = FACE / 2 - 9 * surface.spacing  # the grid's diagonal neighbours are 5 √3 nodes away
    C = uniform(
        [-edge, -edge, 9 * surface.spacing - R],
        [edge, edge, surface.reach - 4 * surface.spacing],
        2000,
    )
    d, gradient, _ = surface.at(C @ Q.T + 0.3)
    assert np.abs(d - C[:, 2]).max() < 1e-12
    assert np.abs(gradient - Q[:, 2]).max() < 1e-10


def beside_an_edge(count, seed=0):
    """Places beside the edge x = FACE/2 and their distances from its line."""
    C = uniform([FACE / 2, -0.015, -0.012], [FACE / 2 + 0.013, 0.015, 0.012], count, seed)
    return C, np.hypot(C[:, 0] - FACE / 2, C[:, 2])


def test_beyond_an_edge_it_is_the_distance_to_the_edge():
    # a spline does no worse than straight lines between nodes: h² f''/8 with f'' = 1/r
    C, r = beside_an_edge(20_000)
    told = (C[:, 2] > 0) & (r > 0.8 * R) & (r < face().reach)
    miss = np.abs(face().at(C)[0] - r)
    assert (miss < face().spacing ** 2 / (8 * r))[told].all()
    assert miss[(C[:, 2] > 0) & (r < face().reach)].max() < face().spacing / 4  # rounded at the edge itself


def test_beyond_a_corner_it_is_the_distance_to_the_corner():
    corner = np.array([FACE / 2, FACE / 2, 0.0])
    C = uniform(corner, corner + 0.012, 20_000)
    r = np.linalg.norm(C - corner, axis=1)
    told = (r > 0.8 * R) & (r < face().reach)
    assert (np.abs(face().at(C)[0] - r) < 2 * face().spacing ** 2 / (8 * r))[told].all()


def test_a_probe_feels_the_edge_exactly_while_it_overlaps_it():
    C, r = beside_an_edge(20_000, seed=1)
    depth, slack = face().depth(C, R), face().spacing ** 2 / (4 * R)
    assert (depth < slack)[r > R].all()
    assert (depth < 0)[r > R + slack].all()
    assert (depth > 0)[(r < R - slack) & (C[:, 2] > 0)].all()


@pytest.mark.parametrize("height", [0.0, -0.001, -0.002, -0.004])
def test_below_the_border_the_depth_falls_steadily_to_that_of_the_border(height):
    x = np.linspace(0, FACE / 2 + R, 400)
    C = np.column_stack([x, np.zeros_like(x), np.full_like(x, height)])
    d = face().at(C)[0]
    r = np.hypot(np.maximum(x - FACE / 2, 0), height)
    assert np.diff(d).min() > -0.01 * face().spacing
    assert np.abs(np.diff(d)).max() < 3 * (x[1] - x[0])
    assert d[0] == pytest.approx(height, abs=1e-12)
    assert d[-1] == pytest.approx(r[-1], abs=face().spacing ** 2 / (4 * R))


@cache
def shouldered():
    return TouchedSurface.of(*plate(FACE, 2), radius=R, shoulder=R / 3)


@pytest.mark.grid
@pytest.mark.parametrize("surface", [face, shouldered, sphere])
def test_far_away_nothing_is_felt_on_any_side(surface):
    v = np.vstack([directions(4000, 0), [[0, 0, -1], [1, 1, -1], [1, 1, -0.01], [-1, 1, 0]]])
    for far in (0.12, 1.0, 1e3, 1e9, 1e300):
        assert (surface().depth(far * v, surface().reach) < 0).all()


@pytest.mark.parametrize(("surface", "shoulder"), [(face, 0.0), (shouldered, R / 3)])
def test_beside_the_body_nothing_is_felt_at_any_height(surface, shoulder):
    C = uniform([-0.3, -0.3, -0.3], [0.3, 0.3, 0.3], 200_000)
    C[::2] *= 0.2
    beyond = np.maximum(np.abs(C[:, :2]) - FACE / 2, 0)
    beside = np.linalg.norm(beyond, axis=1) > R + 1.5 * shoulder + surface().spacing
    assert beside.sum() > 50_000
    assert (surface().depth(C[beside], R) < 0).all()


@pytest.mark.parametrize("surface", [face, shouldered])
def test_behind_an_open_surface_the_distance_turns_back(surface):
    z = -np.linspace(surface().inner, surface().inner + 4 * R, 200)
    d, gradient, _ = surface().at(np.column_stack([np.zeros((200, 2)), z]))
    assert d[0] == pytest.approx(-surface().inner, rel=1e-4)
    assert gradient[0] == pytest.approx([0, 0, 1], abs=1e-3)
    turn = np.argmin(d)
    assert (np.diff(d[: turn + 1]) < 0).all()
    assert (np.diff(d[turn:]) > -1e-12).all(), "once"
    assert d[turn] > -(surface().inner + 2 * R)
    assert (d[z < -(surface().inner + 3 * R)] > surface().reach).all(), "and nothing is felt any more"


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_position_that_is_no_number_touches_nothing(odd, axis):
    c = np.zeros(3)
    c[axis] = odd
    d, gradient, hessian = one(face(), c)
    assert d == np.inf
    assert not gradient.any()
    assert not hessian.any()


def test_the_facets_of_a_coarse_ball_do_not_show():
    points, triangles = ball(0.05, 12, scatter=0.06)
    facets = 0.05 - np.linalg.norm(points[triangles].mean(axis=1), axis=1)
    v = directions(5000, 1)
    truth = uniform(-0.015, face().reach, 5000)[:, 0]
    d, gradient, hessian = sphere().at((0.05 + truth)[:, None] * v)
    assert facets.max() > 1.5e-4
    assert np.abs(d - truth).max() < facets.max() / 20
    assert np.abs(d - truth).max() < 1.5 * sphere().error + 2e-6
    assert np.abs(np.linalg.norm(gradient, axis=1) - 1).max() < 0.005
    exact = (np.eye(3) - v[:, :, None] * v[:, None]) / (0.05 + truth)[:, None, None]
    outside = truth > -0.005
    assert np.abs(hessian - exact)[outside].max() < 0.1 / 0.05


@pytest.mark.full
def test_spacing_is_refined_until_the_error_is_small():
    points, triangles = ball(0.012, 6)
    surface = TouchedSurface.of(points, triangles, radius=0.004, inner=0.004)
    assert surface.error < 1e-3 * surface.radius
    v = directions(3000, 2)
    d = surface.at(0.014 * v)[0]
    facets = 0.012 - np.linalg.norm(points[triangles].mean(axis=1), axis=1)
    assert np.abs(d - 0.002).max() < 2 * surface.error + facets.max() / 20


@pytest.mark.full
def test_the_side_of_a_cylinder():
    surface = TouchedSurface.of(*tube(0.03, 0.06, 32, 10), radius=R, spacing=0.0015)
    sag = 0.03 * (1 - np.cos(np.pi / 32))
    rng = np.random.default_rng(0)
    angle, r, z = (
        rng.uniform(0, 7, 4000),
        rng.uniform(0.025, 0.03 + R, 4000),
        rng.uniform(-0.012, 0.012, 4000),
    )
    d, gradient, _ = surface.at(np.column_stack([r * np.cos(angle), r * np.sin(angle), z]))
    assert sag > 1.4e-4
    assert np.abs(d - (r - 0.03)).max() < sag / 20
    assert np.abs(gradient[:, 2]).max() < 0.005


@pytest.mark.full
def test_a_box_from_outside_and_inside():
    half = 0.03
    surface = TouchedSurface.of(*box(2 * half, 4), radius=R, spacing=0.0012)
    C = uniform(-half - 0.014, half + 0.014, 20_000)
    beyond = np.abs(C) - half
    out = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    truth = np.where(out > 0, out, beyond.max(axis=1))
    d = surface.at(C)[0]
    outside = (out > 0.8 * R) & (out < surface.reach)
    assert np.abs(d - truth)[outside].max() < 2 * surface.spacing**2 / (8 * 0.8 * R)
    second = np.sort(beyond, axis=1)[:, 1]
    clear = (out == 0) & (truth > -0.012) & (truth - second > 6 * surface.spacing)
    assert np.abs(d - truth)[clear].max() < quantum_of(surface) / 2 + 1e-12
    assert np.abs(d - truth)[(out == 0) & (truth > -0.012)].max() < surface.spacing


def test_stated_error_holds_at_other_places():
    v = directions(4000, 5)
    truth = uniform(-0.01, R, 4000, seed=6)[:, 0]
    assert 0 < sphere().error < 2e-5
    assert np.abs(sphere().at((0.05 + truth)[:, None] * v)[0] - truth).max() < 1.5 * sphere().error + 2e-6


@pytest.mark.parametrize("name", ["face", "sphere"])
def test_derivatives_are_those_of_the_distance(name):
    surface = {"face": face, "sphere": sphere}[name]()
    low, high = surface.box
    C = uniform(low - 0.01, high + 0.01, 300, seed=3)  # beyond the box as well
    h = surface.spacing
    C = C[np.abs((C - surface.frame[:3]) / h % 1 - 0.5).max(axis=1) < 0.45]  # third derivatives jump at nodes
    _, gradient, hessian = surface.at(C)
    step = 1e-3 * h
    for axis in range(3):
        move = step * np.eye(3)[axis]
        (up, g_up, _), (down, g_down, _) = surface.at(C + move), surface.at(C - move)
        assert (up - down) / (2 * step) == pytest.approx(gradient[:, axis], abs=1e-5)
        assert (g_up - g_down) / (2 * step) == pytest.approx(hessian[:, axis], abs=1e-5 / h)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_derivatives_are_continuous_at_nodes_and_at_the_box(axis):
    surface, C = face(), uniform([-0.04, -0.04, -0.014], [0.04, 0.04, 0.02], 3000)
    low, high = surface.box
    nodes = np.round((C[:, axis] - low[axis]) / surface.spacing)
    nodes[:500], nodes[500:1000] = 0, round((high - low)[axis] / surface.spacing)
    C[:, axis] = low[axis] + nodes * surface.spacing
    step = 1e-9 * surface.spacing * np.eye(3)[axis]
    for before, after, scale in zip(surface.at(C - step), surface.at(C + step), (1e-3, 1, 1e3), strict=True):
        assert np.abs(after - before).max() < 1e-6 * scale


def test_the_kernel_is_the_tensor_product_spline():
    from scipy.interpolate import NdBSpline

    surface = sphere()
    knots = [
        surface.frame[a] + surface.spacing * (np.arange(surface.coefficients.shape[a] + 4) - 2)
        for a in range(3)
    ]
    spline = NdBSpline(tuple(knots), surface.coefficients, 3)
    low, high = surface.box
    C = uniform(low, high, 500, seed=4)
    d, gradient, hessian = surface.at(C)
    assert d == pytest.approx(spline(C), abs=1e-12)
    for i in range(3):
        order = np.eye(3, dtype=int)[i]
        assert gradient[:, i] == pytest.approx(spline(C, nu=tuple(order)), abs=1e-12)
        for j in range(3):
            second = spline(C, nu=tuple(order + np.eye(3, dtype=int)[j]))
            assert hessian[:, i, j] == pytest.approx(second, abs=1e-12 / surface.spacing**1 * 1e3)
    for c, value, slope in zip(C[:50], d, gradient, strict=False):
        told, g, _ = one(surface, c)
        assert told == value
        assert (g == slope).all()


def quantum_of(surface):
    return 2.0 ** (np.floor(np.log2(surface.spacing)) - 16)


def test_rounding_changes_distance_and_derivatives_by_no_more_than_it_may():
    # a ball's table before it was rounded: the rounded one and random parts of a quantum
    q, h = quantum_of(sphere()), sphere().spacing
    parts = np.random.default_rng(8).uniform(-0.5, 0.5, sphere().coefficients.shape)
    before = dataclasses.replace(sphere(), coefficients=sphere().coefficients + q * parts)
    after = before.round_to_quanta()
    assert np.array_equal(after.coefficients, sphere().coefficients)
    assert after.error == before.error + q / 2
    C = uniform(*sphere().box, 20_000, seed=9)
    for new, old, bound in zip(
        after.at(C), before.at(C), (q / 2, 3 * q / (4 * h), 2 * q / h**2), strict=True
    ):
        assert 0.2 * bound < np.abs(new - old).max() < bound * (1 + 1e-9)
    assert q / h <= 2.0**-16
    assert 3 * q / (4 * h) < 1.2e-5
    assert 2 * q / h < 3.1e-5
    # the worst that can be: signs that alternate along an axis, one by one and in pairs
    number = np.indices(parts.shape)[0]
    singly, pairs = (
        dataclasses.replace(sphere(), coefficients=q / 2 * (-1.0) ** signs) for signs in (number, number // 2)
    )
    node = sphere().frame[:3] + 5 * h
    assert abs(one(singly, node)[2][0, 0]) == pytest.approx(2 * q / h**2)
    assert abs(one(pairs, node + h / 2 * np.eye(3)[0])[1][0]) == pytest.approx(3 * q / (4 * h))


def test_curved_surfaces_are_made_of_whole_quanta_and_flat_ones_are_exact():
    whole = sphere().coefficients / quantum_of(sphere())
    assert np.array_equal(whole, np.rint(whole))
    assert sphere().round_to_quanta() is sphere()
    assert face().round_to_quanta() is face()


def test_a_surface_goes_through_arrays_unchanged():
    for surface in (face(), sphere()):
        again = TouchedSurface.from_arrays(surface.arrays())
        assert again.equals(surface)
        assert repr(again) == repr(surface)


def test_a_table_that_is_not_packed_is_read_too():
    plain = {"frame": sphere().frame, "coefficients": sphere().coefficients, "lengths": sphere().lengths}
    assert TouchedSurface.from_arrays(plain).equals(sphere())


def test_a_flat_surface_takes_little_room_and_a_curved_one_a_fraction_of_its_table():
    assert sum(a.nbytes for a in face().arrays().values()) < 200_000
    assert sum(a.nbytes for a in sphere().arrays().values()) < 0.2 * sphere().coefficients.nbytes


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("packed", np.zeros(100, dtype=np.uint8)),
        ("packed", np.zeros(100)),
        ("shape", np.array([4.0, 4.0, 4.0])),
        ("shape", np.array([4.0, 4.0, -4.0])),
        ("shape", np.array([9e3, 9e3, 9e3])),
        ("shape", None),
    ],
)
def test_damaged_packed_tables_are_refused(name, wrong):
    arrays = sphere().arrays() | {name: wrong}
    if wrong is None:
        del arrays[name]
    with pytest.raises(FileFormatError):
        TouchedSurface.from_arrays(arrays)


def test_a_raised_surface_is_nearer_everywhere():
    C = uniform(-0.05, 0.05, 100)
    assert face().raised(1e-3).at(C)[0] == pytest.approx(face().at(C)[0] - 1e-3, abs=1e-15)
    # a curved one by whole quanta
    higher = sphere().raised(1e-3)
    off = higher.at(C)[0] - (sphere().at(C)[0] - 1e-3)
    assert 0 < np.abs(off).max() <= quantum_of(sphere()) / 2 + 1e-15
    assert np.ptp(off) < 1e-15
    assert higher.error == pytest.approx(sphere().error + np.abs(off).max(), abs=1e-15)
    assert higher.round_to_quanta() is higher
    assert np.array_equal(higher.raised(-1e-3).coefficients, sphere().coefficients)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("frame", np.zeros(3)),
        ("frame", np.zeros(4)),
        ("frame", np.zeros(15)),
        ("frame", np.ones(15)),
        ("profile", np.zeros((3, 9))),
        ("profile", np.full((9, 9), np.nan)),
        ("coefficients", np.zeros((3, 9, 9))),
        ("coefficients", np.zeros((9, 9, 9), dtype=np.float32)),
        ("coefficients", np.full((9, 9, 9), np.inf)),
        ("lengths", np.array([0.01, -1, 0.01, 0])),
        ("lengths", np.zeros(3)),
        ("lengths", None),
    ],
)
def test_damaged_arrays_are_refused(name, wrong):
    arrays = face().arrays() | {name: wrong}
    if wrong is None:
        del arrays[name]
    with pytest.raises(FileFormatError):
        TouchedSurface.from_arrays(arrays)


@pytest.mark.parametrize(
    "lengths",
    [
        {"radius": 0.0},
        {"radius": R, "reach": 0.005},
        {"radius": R, "inner": -1.0},
        {"radius": R, "spacing": 1e-5},
    ],
)
def test_mistaken_lengths_are_refused(lengths):
    with pytest.raises(UsageError):
        TouchedSurface.of(*plate(FACE, 2), **lengths)


def test_places_of_another_shape_are_refused():
    with pytest.raises(UsageError, match="shape"):
        face().at(np.zeros(3))


def test_with_a_shoulder_the_distance_is_the_height_right_up_to_the_border():
    side, rho = 0.04, 0.004
    points = np.array([[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0]], float)
    surface = TouchedSurface.of(points, np.array([[0, 1, 2], [0, 2, 3]]), radius=0.01, shoulder=rho)
    rng = np.random.default_rng(2)
    C = rng.random((500, 3)) * [side, side, 0.013] - [0, 0, 0.003]
    C[:100, 0], C[100:200, 1] = side, 0.0  # on the border itself
    d, g, H = surface.at(C)
    # it begins with the fourth power of the way t beyond, t⁴ / (8 (ρ/2)² (z + ρ)): a spline feels one cell of it
    start = surface.spacing**4 / (8 * (rho / 2) ** 2 * (rho - 0.003))
    assert np.abs(d - C[:, 2]).max() < start
    assert np.abs(g - [0, 0, 1]).max() < 4 * start / surface.spacing
    assert np.abs(H).max() < 12 * start / surface.spacing**2
    # beyond it falls as it rolls off, and ends
    t = np.linspace(0.0, 0.02, 41)
    line = np.stack([side + t, np.full(41, side / 2), np.full(41, 0.002)], axis=1)
    b = np.sqrt(t**2 + (rho / 2) ** 2) - rho / 2
    np.testing.assert_allclose(
        surface.at(line)[0][:18], (np.hypot(b, 0.002 + rho) - rho)[:18], atol=1e-3 * 0.01
    )
    assert (surface.depth(line[30:], 0.01) <= 0).all()


def test_the_kinks_of_a_scan_take_no_finer_table():
    """Between noisy triangles a finer table is no more exact, so the coarsest is kept."""
    x = np.linspace(-0.012, 0.012, 17)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((17, 17))], -1).reshape(-1, 3)
    points[:, 2] = 5e-5 * np.random.default_rng(0).standard_normal(len(points))
    triangles = quads(17 * np.arange(17)[:, None] + np.arange(17))
    sizes = {"radius": 0.008, "inner": 0.004, "shoulder": 0.002}
    kept = TouchedSurface.of(points, triangles, **sizes)
    assert kept.spacing == pytest.approx(0.008 / SOME)
    finer = TouchedSurface.of(points, triangles, **sizes, spacing=0.7 * kept.spacing)
    assert finer.error > GAIN * kept.error
