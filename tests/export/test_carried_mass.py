"""A mass that a learnt body carries in an FMU: energy, static limit, frequency, damping, both kinds of simulation."""

from __future__ import annotations

import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from exported_bodies import body
from models import spring_energy
from palpate.errors import UsageError
from palpate.export import CarriedMass, Choice, export_fmu
from palpate.export.fmu_export import VERSIONS
from palpate.surrogates import Surrogate
from palpate.units import Range

MASS, STIFFNESS = 0.1, 200.0  # kg, N/m
OMEGA = np.sqrt(STIFFNESS / MASS)  # rad/s


def spring(hardening: float = 0.0) -> Surrogate:
    """Return a body that is a spring along −y: U = ½ K w² exp(hardening w²)."""
    energy = spring_energy(STIFFNESS, [Range("w", -0.01, 0.01, "m")], hardening=hardening)
    return Surrogate(energy, meta={"name": "spring"})


def exported(folder, carried, version="2.0", surrogate=None):
    """Return the path of an FMU."""
    surrogate = surrogate or spring()
    return str(export_fmu(surrogate, folder / "spring.fmu", fmi=version, carried=carried, check=False).path)


def simulated(path, seconds, *, push=0.0, way=0.0, kind="CoSimulation", interval=0.001, **options):
    """Return a simulation under a constant push along y, N, from a way, m."""
    table = np.array([(0.0, push), (seconds, push)], dtype=[("time", float), ("push_y", float)])
    return fmpy.simulate_fmu(
        path,
        fmi_type=kind,
        stop_time=seconds,
        output_interval=interval,
        input=table,
        start_values={"way_1": way},
        output=["y", "vy", "fy", "energy", "kinetic"],
        **options,
    )


@pytest.mark.parametrize("version", VERSIONS)
def test_an_undamped_mass_swings_with_the_root_of_k_over_m(version, tmp_path):
    """x(t) = w cos(ωt) with ω = √(k/m), over ten periods."""
    path = exported(tmp_path, CarriedMass(MASS), version)
    told = simulated(path, 20.0 * np.pi / OMEGA, way=0.004)
    np.testing.assert_allclose(told["y"], -0.004 * np.cos(OMEGA * told["time"]), atol=4e-9)
    assert validate_fmu(path) == []


def test_an_undamped_mass_keeps_its_energy_where_the_spring_hardens(tmp_path):
    path = exported(tmp_path, CarriedMass(MASS), surrogate=spring(hardening=5e3))
    told = simulated(path, 2.0, way=0.01)
    whole = told["energy"] + told["kinetic"]
    np.testing.assert_allclose(whole, whole[0], rtol=1e-6)
    assert told["kinetic"].max() > 0.99 * whole[0]


def test_a_damped_mass_comes_to_rest_where_the_body_carries_the_push(tmp_path):
    """The static limit: U'(w) = push, found from the body's own force."""
    surrogate = spring(hardening=5e3)
    path = exported(tmp_path, CarriedMass(MASS, 4.0), surrogate=surrogate)
    told = simulated(path, 2.0, push=-1.2)
    assert abs(told["vy"][-1]) < 1e-12
    np.testing.assert_allclose(told["fy"][-1], 1.2, rtol=1e-9)
    y = told["y"][-1]
    force = surrogate.hand_energy.force(np.array([[-y]]))
    np.testing.assert_allclose(np.abs(force).max(), 1.2, rtol=1e-9)


def test_damping_lets_a_swing_decay_as_it_should(tmp_path):
    """x(t) = w exp(−δt) (cos ω₁t + δ/ω₁ sin ω₁t), δ = d/2m, ω₁² = ω² − δ²."""
    path = exported(tmp_path, CarriedMass(MASS, 0.5))
    told = simulated(path, 1.0, way=0.004)
    delta = 0.5 / (2.0 * MASS)
    omega, t = np.sqrt(OMEGA**2 - delta**2), told["time"]
    wanted = -0.004 * np.exp(-delta * t) * (np.cos(omega * t) + delta / omega * np.sin(omega * t))
    np.testing.assert_allclose(told["y"], wanted, atol=4e-9)


@pytest.mark.parametrize("version", VERSIONS)
def test_model_exchange_swings_alike(version, tmp_path):
    path = exported(tmp_path, CarriedMass(MASS, 0.5), version)
    inner = simulated(path, 0.5, way=0.004)
    outer = simulated(path, 0.5, way=0.004, kind="ModelExchange", relative_tolerance=1e-9)
    at = np.interp(outer["time"], inner["time"], inner["y"])
    np.testing.assert_allclose(outer["y"], at, atol=2e-6 * 0.4)


def test_long_steps_are_divided(tmp_path):
    """Steps of 20 ms, of which a period has seven, end where those of 1 ms do."""
    path = exported(tmp_path, CarriedMass(MASS))
    told = simulated(path, 1.0, way=0.004, interval=0.02)
    np.testing.assert_allclose(told["y"], -0.004 * np.cos(OMEGA * told["time"]), atol=4e-9)


@pytest.mark.full
@pytest.mark.parametrize("name", ["contact", "pad"])
def test_a_learnt_body_that_carries_a_mass_answers_as_palpate_does(name, tmp_path):
    done = export_fmu(body(name), tmp_path / "body.fmu", carried=CarriedMass(0.2, 0.1))
    assert done.comparison is not None
    assert {"force", "energy", "flags"} <= set(done.comparison.parts)


def test_its_card_says_that_the_body_is_quasi_static(tmp_path):
    with zipfile.ZipFile(exported(tmp_path, CarriedMass(MASS, 0.5))) as file:
        card = file.read("documentation/card.md").decode()
    assert "one mass of 0.1 kg at the tip" in card
    assert "The body itself is quasi-static" in card


@pytest.mark.parametrize(("mass", "damping"), [(0.0, 0.0), (-1.0, 0.0), (np.nan, 0.0), (1.0, -0.1)])
def test_a_mass_that_could_not_move_is_refused(mass, damping):
    with pytest.raises(UsageError, match=r"can't be moved|would make energy"):
        CarriedMass(mass, damping)


@pytest.mark.full
def test_bodies_that_carry_no_mass_are_refused_by_name(tmp_path):
    with pytest.raises(UsageError, match="relaxation"):
        export_fmu(body("relaxation"), tmp_path / "a.fmu", carried=CarriedMass(1.0))
    with pytest.raises(UsageError, match="values of its fields"):
        export_fmu(spring(), tmp_path / "a.fmu", choice=Choice(nodes=(1,)))
    assert not list(tmp_path.iterdir())
