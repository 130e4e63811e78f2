"""Beams that yield, against the closed forms of plastic bending."""

import itertools
import pickle

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from palpate.errors import UsageError
from palpate.physics.beam import (
    HISTORY_PRESETS,
    Cantilever,
    Circle,
    LoadAndUnload,
    Rectangle,
    Section,
    TipLoad,
    preset,
)
from palpate.physics.beam.section_laws import PlasticSection
from palpate.physics.materials.hardening import LinearHardening, VoceHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.uniaxial import UniaxialPlastic
from palpate.physics.stop import Stop

ELASTIC = LinearElastic(110e9, 0.35, 8700.0)
YIELD = 100e6
RECTANGLE = Rectangle(0.01, 0.01)
LENGTH = 0.5
FIRST = YIELD / ELASTIC.young / RECTANGLE.half_height  # curvature at first yield, 1/m
FIRST_LOAD = ELASTIC.young * RECTANGLE.second_moment * FIRST / LENGTH
COLLAPSE_LOAD = 1.5 * FIRST_LOAD


def metal(modulus=0.0):
    return Plastic(ELASTIC, LinearHardening(YIELD, modulus))


def law(section=RECTANGLE, fibres=24, modulus=0.0):
    return PlasticSection(
        section, UniaxialPlastic(ELASTIC.young, LinearHardening(YIELD, modulus)), 1e6, fibres
    )


def bent(section, curvature, axial=0.0, internal=None):
    """Answer of one section to a curvature and an axial strain."""
    internal = section.rest((1,)) if internal is None else internal
    return section.answer(np.array([[axial, 0.0, curvature]]), internal, None)


def moment(section, curvature):
    return bent(section, curvature).force[0, 2]


def perfect_moment(curvature):
    """M = M_p (1 - (κ_y/κ)²/3) beyond first yield, of a rectangle without hardening."""
    plastic = 1.5 * ELASTIC.young * RECTANGLE.second_moment * FIRST
    return (
        plastic * (1 - (FIRST / curvature) ** 2 / 3)
        if curvature > FIRST
        else plastic * curvature / FIRST / 1.5
    )


def beam(material=None, **changes):
    body = {"section": RECTANGLE, "kinematics": "small", "material": material or metal(), **changes}
    return Cantilever(LENGTH, **body)


def tip(solution):
    return -solution.displacement[-1, 1]


# sections


def test_what_never_yields_is_the_elastic_beam():
    for kinematics in ("large", "small"):
        strong = Plastic(LinearElastic(2e9, 0.43, 1150.0), LinearHardening(1e12))
        bodies = [
            Cantilever(1.0, Circle(0.005), material, kinematics=kinematics, self_weight=True)
            for material in (strong, strong.elastic)
        ]
        plastic, elastic = (body.problem(TipLoad(0, 5)).solve(4.0) for body in bodies)
        np.testing.assert_allclose(plastic.displacement, elastic.displacement, atol=1e-11)
        np.testing.assert_allclose(plastic.root_reaction, elastic.root_reaction, atol=1e-9)
        assert plastic.strain_energy == pytest.approx(elastic.strain_energy, rel=1e-10)
        assert plastic.potential_energy == pytest.approx(elastic.potential_energy, rel=1e-10)
        assert plastic.dissipated == 0.0


def hardened_tip(load, modulus):
    """Tip deflection from the moment-curvature law: ∫ κ(P ξ) ξ dξ + P L/kGA."""
    share = modulus / (ELASTIC.young + modulus)
    bending = ELASTIC.young * RECTANGLE.second_moment

    def curvature(moment):
        def excess(k):
            return (1 - share) * perfect_moment(k) + share * bending * k - moment

        return brentq(excess, 0, 1e4 * FIRST, xtol=1e-14)

    knee = FIRST_LOAD * LENGTH / load
    parts = [(0, min(knee, LENGTH)), (min(knee, LENGTH), LENGTH)]
    bend = sum(quad(lambda x: curvature(load * x) * x, *part, epsrel=1e-10)[0] for part in parts)
    shear = RECTANGLE.shear_factor(0.35) * ELASTIC.shear_modulus * RECTANGLE.area
    return bend + load * LENGTH / shear


def test_the_tip_of_a_perfectly_plastic_cantilever():
    """w/w_y = (P_y/P)² (5 - (3 + P/P_y) √(3 - 2P/P_y)) (Prager & Hodge 1951)."""
    ratio, shear = 1.4, RECTANGLE.shear_factor(0.35) * ELASTIC.shear_modulus * RECTANGLE.area
    first = FIRST_LOAD * LENGTH**3 / (3 * ELASTIC.young * RECTANGLE.second_moment)
    exact = (
        first / ratio**2 * (5 - (3 + ratio) * np.sqrt(3 - 2 * ratio)) + ratio * FIRST_LOAD * LENGTH / shear
    )
    assert hardened_tip(ratio * FIRST_LOAD, 1e-3) == pytest.approx(
        exact, rel=1e-6
    )  # one oracle for the other
    found = tip(beam(elements=80, fibres=200).problem(TipLoad(0, 100)).solve(ratio * FIRST_LOAD))
    assert found == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize(("ratio", "modulus"), [(1.3, 1e9), (1.8, 5e9), (1.6, 2e8)])
def test_the_tip_converges_with_fibres_and_elements(ratio, modulus):
    exact, errors = hardened_tip(ratio * FIRST_LOAD, modulus), []
    for elements, fibres in ((10, 12), (20, 24), (80, 96)):
        body = beam(metal(modulus), elements=elements, fibres=fibres)
        errors.append(abs(tip(body.problem(TipLoad(0, 200)).solve(ratio * FIRST_LOAD)) / exact - 1))
    assert errors[2] < 2e-3
    assert errors[2] < errors[0] / 8


@pytest.mark.full
def test_the_collapse_load():
    """M_p/L: found from above, nearer the finer the mesh, and as hardening vanishes."""
    body = beam(elements=80, fibres=96)
    solver = body.problem(TipLoad(0, 100)).open()
    stands, falls = solver.march([0.995 * COLLAPSE_LOAD, 1.02 * COLLAPSE_LOAD])
    assert stands.converged, stands.message
    assert falls.stop is Stop.STEP_TOO_SMALL, falls.message
    assert "1 of the first plastic one" in falls.message
    assert np.isnan(falls.displacement).all()
    # with hardening the beam goes on to bear, and the less it hardens the further it sinks
    depths = [
        tip(beam(metal(h)).problem(TipLoad(0, 100)).solve(1.05 * COLLAPSE_LOAD)) for h in (4e9, 2e9, 1e9)
    ]
    assert depths[0] < depths[1] < depths[2]
    assert depths[2] == pytest.approx(hardened_tip(1.05 * COLLAPSE_LOAD, 1e9), rel=0.02)


def test_unloading_is_elastic():
    elastic = tip(beam(ELASTIC).problem(TipLoad(0, 100)).solve(1.3 * FIRST_LOAD))
    loaded, half, bare = beam().problem(TipLoad(0, 100)).solve_path(np.array([1.3, 0.65, 0.0]) * FIRST_LOAD)
    assert tip(loaded) - tip(bare) == pytest.approx(elastic, rel=1e-9)
    assert tip(loaded) - tip(half) == pytest.approx(elastic / 2, rel=1e-9)
    assert tip(bare) > 0.01 * tip(loaded)
    assert loaded.dissipated == half.dissipated == bare.dissipated > 0


def test_reloading_goes_back_the_way_it_came():
    loads = np.array([1.3, 0.0, 1.3, 1.4]) * FIRST_LOAD
    problem = beam(kinematics="large").problem(TipLoad(0, 100))
    first, _, again, further = problem.solve_path(loads)
    np.testing.assert_allclose(again.displacement, first.displacement, atol=1e-12)
    np.testing.assert_allclose(further.displacement, problem.solve(loads[-1]).displacement, atol=1e-9)


def test_a_loop_without_hardening_is_the_virgin_curve_at_twice_the_scale():
    """Masing 1926: u(P) = u(P_max) - 2 u_virgin((P_max - P)/2), for a perfectly plastic beam that bends little."""
    peak = 1.35 * FIRST_LOAD
    problem = beam().problem(TipLoad(-100, 100))
    down = np.linspace(peak, -peak, 9)
    path = problem.solve_path([*down, *down[::-1][1:], *down[1:]])
    virgin = [tip(problem.solve((peak - load) / 2)) for load in down]
    found = [tip(solution) for solution in path]
    np.testing.assert_allclose(found[:9], found[0] - 2 * np.array(virgin), atol=1e-8)
    # from the first loop on nothing changes any more
    np.testing.assert_allclose(found[16], found[0], atol=1e-8)
    np.testing.assert_allclose(found[17:], found[1:9], atol=1e-8)
    once, twice = path[8].dissipated - path[0].dissipated, path[24].dissipated - path[16].dissipated
    assert twice == pytest.approx(once, rel=1e-6)


@pytest.mark.parametrize("kinematics", [pytest.param("large", marks=pytest.mark.full), "small"])
def test_work_is_stored_or_dissipated(kinematics):
    """∮ P du over a cycle, by the trapezoidal rule on two step sizes."""
    material = Plastic(ELASTIC, VoceHardening(YIELD, 60e6, 400.0, 1e9))
    problem = beam(material, kinematics=kinematics).problem(TipLoad(-200, 200))
    corners = np.array([0.0, 1.6, -1.8, 0.0]) * FIRST_LOAD

    def work(count):
        loads = np.concatenate([np.linspace(a, b, count + 1)[1:] for a, b in itertools.pairwise(corners)])
        path = problem.solve_path(loads)
        lost = [0.0, *(solution.dissipated for solution in path)]
        assert (np.diff(lost) >= -1e-15).all()
        return np.trapezoid([0.0, *loads], [0.0, *map(tip, path)]), path[-1]

    (coarse, last), (fine, again) = work(8), work(16)
    assert again.dissipated == pytest.approx(last.dissipated, rel=1e-5)
    assert fine == pytest.approx(again.strain_energy + again.dissipated, abs=1.1 * abs(fine - coarse))
    assert abs(fine - coarse) < 0.05 * fine  # a bound that says something
    assert 0 < again.strain_energy < 0.2 * again.dissipated


def test_the_clamp_balances_the_load_after_yielding():
    problem = beam(kinematics="large").problem(TipLoad(0, 100))
    solution = problem.solve(1.45 * FIRST_LOAD)
    load = 1.45 * FIRST_LOAD
    arm = LENGTH + solution.displacement[-1, 0]
    np.testing.assert_allclose(solution.root_reaction, (0.0, load, load * arm), atol=1e-8)


def test_answers_do_not_depend_on_what_was_asked_before():
    problem = preset("beam-plastic").problem()
    solver = problem.open()
    solver.solve((24.0, 3.0))
    solver.march([[20.0], [-10.0]])
    np.testing.assert_array_equal(solver.solve((21.0, 5.0)).state, problem.solve((21.0, 5.0)).state)


def test_a_history_can_be_taken_up_again():
    problem = beam(kinematics="large").problem(TipLoad(-100, 100))
    whole = problem.solve_path(np.array([1.3, -0.2, 1.4]) * FIRST_LOAD)
    solver = problem.open()
    first = solver.march(np.array([1.3, -0.2]) * FIRST_LOAD)[-1]
    last = solver.march(1.4 * FIRST_LOAD * np.ones(1), start=first)[0]
    np.testing.assert_array_equal(last.state, whole[-1].state)
    assert last.dissipated == whole[-1].dissipated


@pytest.mark.full
def test_load_and_unload_is_that_history():
    problem = preset("beam-plastic").problem()
    assert [r.name for r in problem.ranges] == ["P_max", "P"]
    there, back = problem.solve_path([22.0, 4.0])
    np.testing.assert_array_equal(problem.solve((22.0, 4.0)).state, back.state)
    assert tip(there) > tip(back) > tip(problem.solve((4.0, 4.0)))
    # beyond the peak the load just goes on
    np.testing.assert_allclose(
        problem.solve((4.0, 22.0)).displacement, problem.solve((22.0, 22.0)).displacement, atol=1e-9
    )
    left = problem.solve((25.0, 0.0))
    assert tip(left) > 0.1  # m: the annealed copper beam keeps a good part of its bend


def test_several_loads_with_and_without_a_history():
    body = beam(kinematics="large")
    push = TipLoad(-5, 5, direction=(1, 0), name="H")
    problem = body.problem([push, LoadAndUnload("P", peak=(0, 60))])
    assert [r.name for r in problem.ranges] == ["H", "P_max", "P"]
    assert len(problem.load_nodes) == len(problem.load_directions) == 3
    path = problem.solve_path([[3.0, 0.0], [3.0, 55.0], [3.0, 10.0]])
    np.testing.assert_array_equal(problem.solve((3.0, 55.0, 10.0)).state, path[-1].state)


@pytest.mark.full
def test_a_failed_load_ends_the_history():
    path = beam().problem(TipLoad(0, 100)).solve_path([0.9 * COLLAPSE_LOAD, 2 * COLLAPSE_LOAD, 0.0])
    assert [solution.converged for solution in path] == [True, False, False]
    assert "an earlier load" in path[2].message
    bad = beam().problem(TipLoad(0, 100)).solve(np.nan)
    assert bad.stop is Stop.BAD_INPUT


@pytest.mark.full
@pytest.mark.parametrize("name", list(HISTORY_PRESETS))
def test_presets_with_a_history_converge_at_their_corners_and_refuse_pointless_loads(name):
    problem = preset(name).problem()
    solver = problem.open()
    for corner in itertools.product(*((r.low, r.high) for r in problem.ranges)):
        solution = solver.solve(corner)
        assert solution.converged, (corner, solution.message)
        assert solution.residual < 1e-9
    plain = problem.body.problem(TipLoad(0, 5)).open()
    for load, reasons in (
        (1e9, {Stop.STRAIN_LIMIT, Stop.STEP_TOO_SMALL, Stop.COARSE_MESH}),
        (1e300, {Stop.STEP_TOO_SMALL, Stop.NOT_FINITE}),
        (np.inf, {Stop.BAD_INPUT}),
    ):
        failed = plain.solve(load)
        assert failed.stop in reasons
        assert np.isnan(failed.dissipated)
        assert failed.history is None
    assert pickle.loads(pickle.dumps(problem)) == problem


def test_problems_with_a_history_are_described():
    problems = [beam(metal(h)).problem(LoadAndUnload("P", peak=(0, 60))) for h in (0.0, 1e9)]
    assert problems[0].hash != problems[1].hash
    described = problems[0].describe()
    assert described["body"]["material"]["law"] == "Plastic"
    assert described["loads"][0]["type"] == "LoadAndUnload"
    assert "fibres" not in beam(ELASTIC).problem(TipLoad(0, 5)).describe()["body"]
    assert [field.name for field in problems[0].schema][-1] == "dissipated"


@pytest.mark.parametrize(
    "make",
    [
        lambda: LinearHardening(0.0),
        lambda: LinearHardening(-90e6),
        lambda: Cantilever(1.0, Section(1e-4, 1e-9, 0.9), metal()),
        lambda: beam(fibres=1),
        lambda: beam(fibres="many"),
        lambda: beam(tolerance=0.0),
        lambda: beam(ELASTIC, fibres=24),
        lambda: beam(ELASTIC, tolerance=1e-4),
        lambda: beam(ELASTIC).problem(LoadAndUnload("P", peak=(0, 5))),
        lambda: LoadAndUnload("P", peak=(5, 0)),
        lambda: LoadAndUnload("P", peak="much"),
        lambda: LoadAndUnload("P", peak=(0, 5), direction=(0, 0)),
        lambda: beam().problem([LoadAndUnload("P", peak=(0, 5)), TipLoad(0, 1, name="P_max")]),
        lambda: beam().problem(LoadAndUnload("P", peak=(0, 5))).solve(3.0),
        lambda: beam().problem(TipLoad(0, 5)).solve_path([[1.0, 2.0]]),
        lambda: beam().problem(TipLoad(0, 5)).solve_path([1.0, 2.0], times=[1.0]),
        lambda: (
            beam()
            .problem(TipLoad(0, 5))
            .open()
            .march([1.0], start=beam(ELASTIC).problem(TipLoad(0, 5)).solve(1))
        ),
    ],
)
def test_what_makes_no_sense_is_refused_with_reason_and_remedy(make):
    with pytest.raises(UsageError) as caught:
        make()
    assert caught.value.why
    assert caught.value.fix
