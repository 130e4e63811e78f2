"""FMUs of bodies with a memory: continuous states in model exchange, directional derivatives, states kept and set."""

from __future__ import annotations

import dataclasses
import shutil
from contextlib import contextmanager

import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exported_bodies import body
from palpate.export import export_fmu
from palpate.export.check_fmu import open_instance
from palpate.export.fmu_export import VERSIONS
from palpate.surrogates.memories import IwanElements, Patches, Relaxation

TERMS = ((0.3, 0.05), (0.2, 0.4))
PLACE, FORCE, STORED, LOST, STATE = [0, 1, 2], [3, 4, 5], 10, 11, 64


def creep():
    """Return a rod of a spring and two dashpots."""
    none = np.full(3, np.inf)
    memory = IwanElements(np.array([0.5, 0.3, 0.2]), none, np.zeros(3), np.array([np.inf, 0.05, 0.4]))
    return dataclasses.replace(body("iwan"), memory=memory, meta={"name": "creep"})


BODIES = {
    "organ": lambda: dataclasses.replace(body("relaxation"), memory=Relaxation(TERMS), fields={}),
    "creep": creep,
    "relaxation": lambda: body("relaxation"),  # on patches, behind a pad
    "indentation": lambda: body("indentation"),
    "iwan": lambda: body("iwan"),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Folder with an FMU of each body and version."""
    folder = tmp_path_factory.mktemp("exchange")
    for version in VERSIONS:
        for name, make in BODIES.items():
            export_fmu(make(), folder / f"{name}-{version}.fmu", name=name, fmi=version, check=False)
    return folder


@contextmanager
def instances(file, *kinds: bool):
    """Open instances of one FMU, in model exchange where a kind is true."""
    description, folder = fmpy.read_model_description(str(file)), fmpy.extract(str(file))
    opened = [open_instance(description, folder, exchange=kind) for kind in kinds]
    for instance in opened:
        instance.begin()
    yield description, *opened
    for instance in opened:
        instance.close()
    shutil.rmtree(folder)


def middle(thing, scale=1.0):
    """Return the deepest place but one of a body, in the middle of what is trained."""
    low, high = np.array([[r.low, r.high] for r in thing.inputs]).T
    k = len(thing.energy.baseline.directions)
    if thing.energy.baseline.holds:
        return scale * 0.6 * high[:k] @ thing.energy.baseline.directions
    return np.array([0.2 * low[0], 0.1 * high[1], high[2] - scale * 0.8 * (high[2] - low[2])])


@pytest.mark.grid
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["organ", "creep"])
def test_a_held_press_relaxes_as_its_series_says(name, version, files):
    """The exact answer is the Prony series. The equations contract, so a solver's errors add up and do not grow: they
    stay below a hundred times its tolerance, and fall with it."""
    thing, place = BODIES[name](), middle(BODIES[name]())
    elastic = thing.energy.force(
        np.atleast_2d(place if not thing.energy.baseline.holds else felt(thing, place))
    )[0]
    t = np.linspace(0.0, 0.5, 51)
    left = 0.5 + (0.3 * np.exp(-t / 0.05) + 0.2 * np.exp(-t / 0.4))
    signals = np.array([(0.0, *place), (1.0, *place)], dtype=[(k, float) for k in ("time", "x", "y", "z")])
    errors = []
    for tolerance in (1e-5, 1e-8):
        result = fmpy.simulate_fmu(
            str(files / f"{name}-{version}.fmu"),
            fmi_type="ModelExchange",
            input=signals,
            output=["fx", "fy", "fz"],
            stop_time=0.5,
            output_interval=0.01,
            relative_tolerance=tolerance,
            record_events=False,
        )
        got = np.column_stack([result[f] for f in ("fx", "fy", "fz")])
        errors.append(np.abs(got - left[:, None] * elastic).max() / np.abs(elastic).max())
        assert errors[-1] < 100 * tolerance
    assert errors[1] < errors[0] / 30
    assert np.linalg.norm(elastic) > 1e-3


def felt(thing, place):
    """Return the felt coordinates of a place, as `energy.force` takes them."""
    return thing.energy.baseline.directions @ place


def path(thing, t):
    """Return the place at a time of a stroke in and out and sideways, and its speed."""
    deep, high = middle(thing), middle(thing, 0.2 if not thing.energy.baseline.holds else -0.5)
    way, side = deep - high, np.array([0.001, 0.0005, 0.0]) * (not thing.energy.baseline.holds)
    w = 2 * np.pi / 0.2
    place = high + way * 0.5 * (1 - np.cos(w * t)) + side * np.sin(w * t)
    return place, way * 0.5 * w * np.sin(w * t) + side * w * np.cos(w * t)


@pytest.mark.parametrize(
    ("name", "version"), [("relaxation", "3.0"), ("creep", "2.0"), ("relaxation", "2.0")]
)
def test_model_exchange_is_the_limit_of_short_steps(name, version, files):
    """And the work of the hand, -∫F·dx, is what is stored and what is lost."""
    thing, end = BODIES[name](), 0.2
    with instances(files / f"{name}-{version}.fmu", True, False) as (description, exchange, steps):
        count = description.numberOfContinuousStates
        states = list(range(STATE, STATE + count))
        exchange.fmu.enterContinuousTimeMode()
        values = (ctypes_array(count), ctypes_array(count))
        rates = (
            exchange.fmu.getDerivatives if version == "2.0" else exchange.fmu.getContinuousStateDerivatives
        )

        def slope(t, y):
            place, speed = path(thing, t)
            exchange.write(PLACE, place.tolist())
            values[0][:] = y[:-1].tolist()
            exchange.fmu.setContinuousStates(values[0], count)
            rates(values[1], count)
            return [*values[1], -float(np.dot(exchange.read(FORCE), speed))]

        slope(0.0, np.zeros(count + 1))
        begun = exchange.read([STORED])[0]  # the hand is there at once
        times = np.linspace(0.0, end, 9)[1:]
        solved = solve_ivp(
            slope, (0.0, end), np.zeros(count + 1), "RK45", times, rtol=1e-7, atol=1e-11, max_step=0.002
        )
        exact = []
        for t, y in zip(times, solved.y.T, strict=True):
            slope(t, y)
            exact.append(exchange.read(FORCE))
            stored, lost = exchange.read([STORED, LOST])
            assert exchange.read(states) == list(y[:-1])
            assert abs(stored + lost - begun - y[-1]) < 1e-6 * abs(solved.y[-1]).max()
        exact = np.array(exact)

        def walked(n):
            steps.begin()
            rows = []
            for i in range(n):
                steps.write(PLACE, path(thing, end * (i + 1) / n)[0].tolist())
                steps.step(end * i / n, end / n)
                if (i + 1) % (n // 8) == 0:
                    rows.append(steps.read(FORCE))
            return np.abs(np.array(rows) - exact).max() / np.abs(exact).max()

        errors = [walked(n) for n in (200, 400, 800)]
    assert errors[2] < 2e-3
    assert errors[2] < 0.7 * errors[1] < 0.5 * errors[0]


def ctypes_array(count):
    import ctypes

    return (ctypes.c_double * count)()


@pytest.mark.full
def test_more_states_than_solvers_can_take_are_left_out(tmp_path):
    thing = BODIES["relaxation"]()
    for count, exchange in ((999, True), (1001, False)):
        patches = Patches(np.random.default_rng(0).uniform(-0.01, 0.01, (count, 3)), 0.004)
        many = dataclasses.replace(thing, memory=Relaxation(TERMS, patches=patches))
        done = export_fmu(many, tmp_path / "many.fmu", check=False)
        assert done.exchange == exchange
        assert (fmpy.read_model_description(str(done.path)).modelExchange is not None) == exchange


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["relaxation", "creep"])
def test_derivatives_in_model_exchange_are_those_of_one_energy(name, version, files):
    """F = −∂V/∂x and γ τ ż = −∂V/∂z, so γ τ ∂ż/∂x = ∂F/∂z, ∂F/∂x is symmetric, and so is γ τ ∂ż/∂z."""
    thing = BODIES[name]()
    with instances(files / f"{name}-{version}.fmu", True) as (description, exchange):
        count = description.numberOfContinuousStates
        states, rates = (
            list(range(STATE, STATE + count - 1)),
            list(range(STATE + count, STATE + 2 * count - 1)),
        )
        place = middle(thing)
        exchange.write(PLACE, place.tolist())
        elastic = thing.energy.stiffness(np.atleast_2d(felt(thing, place)))[0]
        by_place = columns(exchange, FORCE, PLACE)
        np.testing.assert_allclose(by_place, elastic, atol=1e-7 * np.abs(elastic).max())
        # away from where it remembers nothing
        exchange.fmu.enterContinuousTimeMode()
        remembered = ctypes_array(count)
        nominal = nominals(exchange, count, version)
        remembered[:] = (0.05 * nominal * np.random.default_rng(0).uniform(0.2, 1.0, count)).tolist()
        exchange.fmu.setContinuousStates(remembered, count)
        by_place, by_state = columns(exchange, FORCE, PLACE), columns(exchange, FORCE, states)
        rate_by_place, rate_by_state = columns(exchange, rates, PLACE), columns(exchange, rates, states)
        before = exchange.read([*FORCE, STORED, *states, *rates])
        assert before == exchange.read([*FORCE, STORED, *states, *rates])
        stored_by = columns(exchange, [STORED], [*PLACE, *states])[0]
        force = np.array(before[:3])
    if name == "creep":
        weights = np.array([0.3 * 0.05, 0.2 * 0.4])
    else:
        weights = np.tile([share * time for share, time in TERMS], len(states) // 2)
    np.testing.assert_allclose(by_place, by_place.T, atol=1e-7 * np.abs(by_place).max())
    np.testing.assert_allclose(
        weights[:, None] * rate_by_place, by_state.T, atol=1e-7 * np.abs(by_state).max()
    )
    symmetric = weights[:, None] * rate_by_state
    np.testing.assert_allclose(symmetric, symmetric.T, atol=1e-9 * np.abs(symmetric).max())
    np.testing.assert_allclose(stored_by[:3], -force, atol=1e-7 * np.abs(force).max())
    z_dot = np.array(before[4 + len(states) :])
    np.testing.assert_allclose(stored_by[3:], -weights * z_dot, atol=1e-7 * np.abs(weights * z_dot).max())


def columns(instance, unknown, known):
    """Return the matrix of derivatives, column by column."""
    seeds = np.eye(len(known)).tolist()
    return np.array([instance.slopes(unknown, known, seed) for seed in seeds]).T


def nominals(instance, count, version):
    """Return the usual sizes of the states."""
    values = ctypes_array(count)
    instance.fmu.getNominalsOfContinuousStates(values, count)
    return np.array(values)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["relaxation", "indentation", "iwan"])
def test_derivatives_in_co_simulation_are_those_of_the_last_step(name, version, files):
    """Compared with differences of palpate's own memory, whose last step ends at moved places."""
    thing, dt = BODIES[name](), 0.004
    k = len(thing.energy.baseline.directions)
    parameters = [(r.low + r.high) / 2 for r in thing.parameters]

    def last_force(n, moved):
        evaluate, state = thing.energy.evaluator(), thing.memory.start()
        for i in range(n):
            place = path(thing, dt * (i + 1))[0] + (moved if i == n - 1 else 0.0)
            evaluate(np.ascontiguousarray(place), np.array(parameters))
            state.step(place, evaluate.amplitude, evaluate.slope, dt)
        return state.force.copy(), state.stored

    h = 1e-5 * max(r.high - r.low for r in thing.inputs[:k])
    with instances(files / f"{name}-{version}.fmu", False) as (_, steps):
        for i in range(40):
            steps.write(PLACE, path(thing, dt * (i + 1))[0].tolist())
            steps.step(dt * i, dt)
            if i not in (17, 22, 39):
                continue
            got = columns(steps, [*FORCE, STORED], PLACE)
            twice = steps.slopes(FORCE, PLACE, [2.0, 0.0, 0.0])
            wanted = []
            for axis in range(3):
                e = np.eye(3)[axis] * 3 * h
                (up, more), (down, less) = last_force(i + 1, e), last_force(i + 1, -e)
                wanted.append([*(up - down) / (6 * h), (more - less) / (6 * h)])
            wanted = np.array(wanted).T
            for rows in (slice(0, 3), slice(3, 4)):
                np.testing.assert_allclose(
                    got[rows], wanted[rows], atol=2e-6 * np.abs(wanted[rows]).max() + 1e-12
                )
            np.testing.assert_allclose(twice, 2 * got[:3, 0], atol=1e-6 * np.abs(got[:3]).max() + 1e-12)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["relaxation", "indentation", "iwan"])
def test_a_state_that_was_kept_goes_on_in_another_instance(name, version, files):
    thing, dt = BODIES[name](), 0.005
    with instances(files / f"{name}-{version}.fmu", False, False) as (_, first, second):

        def walked(steps, begin, end):
            rows = []
            for i in range(begin, end):
                steps.write(PLACE, path(thing, dt * (i + 1))[0].tolist())
                steps.step(dt * i, dt)
                rows.append(steps.read([*FORCE, STORED, LOST]))
            return rows

        walked(first, 0, 15)
        kept = first.fmu.getFMUState()
        content = first.fmu.serializeFMUState(kept)
        gone_on = walked(first, 15, 30)
        first.fmu.setFMUState(kept)
        assert walked(first, 15, 30) == gone_on
        read = second.fmu.deserializeFMUState(content)
        second.fmu.setFMUState(read)
        assert walked(second, 15, 30) == gone_on
        first.fmu.freeFMUState(kept)
        second.fmu.freeFMUState(read)
    assert np.ptp(np.array(gone_on)[:, 3]) > 0


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["relaxation", "creep"])
def test_both_kinds_begin_with_the_states_that_are_set(name, version, files):
    thing = BODIES[name]()
    with instances(files / f"{name}-{version}.fmu", True, False) as (description, exchange, steps):
        count = description.numberOfContinuousStates
        states, rates = list(range(STATE, STATE + count)), list(range(STATE + count, STATE + 2 * count))
        begun = (1e-3 * np.random.default_rng(1).uniform(0.2, 1.0, count)).tolist()
        answers = []
        for instance in (exchange, steps):
            instance.fmu.reset()
            instance.write([*PLACE, *states], [*middle(thing).tolist(), *begun])
            instance.begin(again=False)
            answers.append(instance.read([*FORCE, STORED, LOST, *states, *rates]))
    np.testing.assert_array_equal(*answers)
    np.testing.assert_allclose(answers[0][5 : 5 + count], begun, rtol=1e-15)
    fresh = thing.energy.force(np.atleast_2d(felt(thing, middle(thing))))[0]
    assert np.linalg.norm(answers[0][:3]) < np.linalg.norm(fresh)  # what gave way pushes less
