"""Mistakes of those who make bodies and problems: each is refused with a word on what to do."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics import (
    Block,
    Body,
    BodyForce,
    Fixed,
    GluedPad,
    LinearElastic,
    LinearHardening,
    ModelWarning,
    NeoHookean,
    Plastic,
    PrescribedDisplacement,
    SphereProbe,
    Viscoelastic,
    VoceHardening,
    roller,
)
from palpate.physics.interactions.pads import pad_depth
from palpate.physics.solid.solid_solver import step_lengths
from palpate.physics.vtu import write_vtu
from palpate.sweeps import sweep
from palpate.units import Range

BLOCK = Block((0.04, 0.04, 0.02), element=0.02)
TISSUE = NeoHookean(young=9e3, poisson=0.45)
BODY = Body(BLOCK, TISSUE)
PUSH = PrescribedDisplacement("top", "z", (-0.004, 0.0))
PROBE = SphereProbe(radius=0.01, depth=(0.0, 0.004))
PROBLEM = BODY.problem(PUSH)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Body(BLOCK, 9e3), "Pass for example NeoHookean"),
        (lambda: Body(BLOCK, "liver"), 'named_material("liver")'),
        (lambda: Body("block", TISSUE), "Pass for example Block"),
        (lambda: Body(Block, TISSUE), "Pass for example Block"),
        (lambda: Body(BLOCK, TISSUE, held=PUSH), "Wrap it: held=Fixed(interaction, values)"),
        (lambda: Body(BLOCK, TISSUE, order="2"), "Use order=2"),
        (lambda: Body(BLOCK, TISSUE, formulation="Mixed"), "Did you mean 'mixed'"),
        (lambda: Body(BLOCK, TISSUE, formulation=3), "'auto', 'displacement', 'mixed'"),
        (lambda: Body(BLOCK, TISSUE, gravity=(0, 0, -9.81)), "density in kg/m³"),
        (lambda: Body(BLOCK, TISSUE, gravity=9.81), "m/s²"),
        (lambda: Body(BLOCK, TISSUE, fixed="sides"), "Did you mean 'side'"),
        (lambda: Fixed("top", 1.0), "no interaction"),
        (lambda: Fixed(PUSH, "1 mm"), "In Python it is a number"),
        (lambda: SphereProbe(radius=0.01, depth=0.01), "Give (low, high)"),
        (lambda: BODY.problem(SphereProbe(radius=10)), "0.010 for 10 mm"),
        (lambda: BODY.problem(SphereProbe(radius=0.01, depth=(0, 5))), "0.010 for 10 mm"),
        (lambda: BODY.problem(PrescribedDisplacement("top", "z", (-4, 0))), "0.010 for 10 mm"),
        (lambda: BODY.problem(PROBE, element=3), "element size of the problem"),
        (lambda: BODY.problem(PROBE, element=-1), "must be positive"),
        (lambda: PROBLEM.solve("a"), "one number per input"),
        (lambda: PROBLEM.solve([30]), "0.030 for 30 mm"),
        (lambda: PROBLEM.chains([[30]]), "0.030 for 30 mm"),
        (lambda: sweep(BODY, PUSH, points=[[30]]), "0.030 for 30 mm"),
        (lambda: sweep(BODY, PUSH, samples=0), "at least 1"),
        (lambda: sweep(BODY, PROBE, samples=-3), "at least 1"),
        (lambda: PROBLEM.open(tolerance=-1), "must be positive"),
        (lambda: PROBLEM.open(tolerance=2.0), "relative error"),
        (lambda: PROBLEM.solve([-0.001], dt=1.0), "Leave dt out"),
        (lambda: PROBLEM.open().march([1.0], [[-0.001]]), "Leave dt out"),
        (lambda: write_vtu(None, "body.txt"), "body.vtu"),
        (lambda: Plastic(LinearElastic(110e9, 0.35), 1e4), "LinearHardening"),
    ],
)
def test_mistakes_are_refused_with_a_remedy(make, words):
    with pytest.raises(UsageError) as caught:
        make()
    assert words in str(caught.value)
    assert caught.value.why
    assert caught.value.fix


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([1.0, 2.0], "2 times and 1 rows"),
        ([0.0], "time 0 s comes first"),
        ([-1.0], "time -1 s comes first"),
        ([np.nan], "time nan s"),
        ("soon", "list of numbers in s"),
    ],
)
def test_times_of_a_march_are_refused_with_what_is_wrong(times, words):
    with pytest.raises(UsageError) as caught:
        PROBLEM.open().march(times, [[-0.001]])
    assert words in str(caught.value)
    assert "march(times=" in caught.value.fix


def test_times_that_turn_back_are_named():
    with pytest.raises(UsageError, match=r"The time 0\.5 s comes after the time 1 s"):
        step_lengths([1.0, 0.5], 2)
    assert step_lengths([0.5, 2.0], 2) == [0.5, 1.5]


def test_a_modulus_in_kilopascals_is_doubted():
    with pytest.warns(ModelWarning, match=r"is 9 Pa") as caught:
        Body(BLOCK, NeoHookean(young=9, poisson=0.45))
    assert "9e3 for 9 kPa" in str(caught[0].message)
    assert caught[0].filename == __file__
    Body(BLOCK, NeoHookean(young=60, poisson=0.45))  # a very soft gel


def test_a_pad_that_is_softer_than_the_body_is_doubted_once():
    rubber = Body(BLOCK, NeoHookean(young=1e6, poisson=0.49))
    with pytest.warns(ModelWarning, match="most of what is felt is the pad") as caught:
        problem = rubber.problem(PROBE)
    assert caught[0].filename == __file__
    assert len(caught) == 1
    advised = float(re.search(r"pad=(\S+)", str(caught[0].message))[1])
    assert pad_depth(replace(PROBE, pad=advised), 1e6 / (1 - 0.49**2), 0.004) <= 0.1 * 0.004
    rubber.problem(replace(PROBE, pad=advised))
    pickle.loads(pickle.dumps(problem))  # in another process it is not told again


@pytest.mark.parametrize("depth", [0.005, 0.01, 0.015])
@pytest.mark.parametrize("young", [3e3, 9e3])
def test_the_default_pad_serves_soft_tissue(young, depth):
    Body(Block(), NeoHookean(young=young, poisson=0.45)).problem(SphereProbe(radius=0.01, depth=(0.0, depth)))


def test_the_pads_depth_balances_the_two_forces():
    # a pad without a stop: 2πR k b²/2 = 4/3 E* √(R a³); with b = a = 1 mm it follows E*
    probe = SphereProbe(radius=0.01, pad=2e6, stop=None)
    modulus = 0.75 * np.pi * 0.01 * 2e6 * 1e-6 / np.sqrt(0.01 * 1e-9)
    assert pad_depth(probe, modulus, 0.002) == pytest.approx(1e-3, rel=1e-9)


def test_progress_is_logged(caplog):
    gel = Viscoelastic(TISSUE, ((0.5, 1.0),))
    with caplog.at_level("INFO", logger="palpate.physics.solid"):
        Body(BLOCK, gel).problem(PUSH).open().march([0.1, 0.2], [[-0.0005], [-0.001]])
    assert "time 1 of 2: a step of 0.1 s" in caplog.messages[0]
    assert "load step to 100.0% of the path" in caplog.messages[-1]


def test_a_sphere_that_is_larger_than_the_body_is_warned_of():
    with pytest.warns(ModelWarning, match=r"radius of 400 mm and is larger than the body, 40 mm"):
        assert BODY.problem(SphereProbe(radius=0.4, depth=(0.0, 0.001))).interactions[0].radius == 0.4


def test_elements_that_are_larger_than_the_probe_are_warned_of():
    with pytest.warns(
        ModelWarning, match=r"under the SphereProbe measure 20 mm, the SphereProbe itself 12 mm"
    ):
        BODY.problem(SphereProbe(radius=0.006, depth=(0.0, 0.004)), element=0.02)


@pytest.mark.full
def test_a_hopeless_solve_is_given_up(monkeypatch):
    """A ball that is pressed through nearly all of a body: several tries in a row fail, and it says so."""
    monkeypatch.setattr("palpate.physics.solid.solid_path.FUTILE_SECONDS", 0.0)
    probe = SphereProbe(radius=0.004, stop=None, pad=1e8, depth=(0.0, 0.019))
    answer = BODY.problem(probe, element=0.008).solve((0.02, 0.02, 0.02 - 0.0185 + 0.004))
    assert not answer.converged
    assert "given up after 4 tries in a row" in answer.message


def test_what_is_near_the_ranges_or_in_other_units_is_solved():
    assert PROBLEM.solve([-0.005]).converged  # a little beyond the range
    weight = BODY.problem(BodyForce((0.0, 10.0)))
    assert weight.inputs([500.0]) == [500.0]  # N/m³: its size tells nothing about lengths


def test_bodies_problems_and_solvers_are_told_in_words():
    assert str(BLOCK) == "block 40 × 40 × 20 mm"
    assert str(PROBE) == "sphere of radius 10 mm on 'top', pad 2e+06 N/m³ with a stop at 4 mm"
    assert str(GluedPad()) == "pad glued to 'top', 2e+06 N/m³"
    assert str(roller("bottom", "z")) == "'bottom' moved along z, free across, at 0"
    text = str(BODY.problem(PROBE))
    assert "Block(" not in text
    assert "SphereProbe(" not in text
    assert "ρ not given" in text
    solver = PROBLEM.open()
    assert "block 40 × 40 × 20 mm (neo-Hookean)" in str(solver)
    solver.solve([-0.001])
    assert "1 equilibria" in str(solver)


def test_materials_with_a_history_say_what_makes_it():
    metal = LinearElastic(110e9, 0.35, 8700)
    assert "yields at 5e+07 Pa, no hardening" in str(Plastic(metal, LinearHardening(50e6)))
    assert "hardens by 6.7e+07 Pa (Voce, rate 52)" in str(Plastic(metal, VoceHardening(125e6, 67e6, 52)))
    gel = Viscoelastic(TISSUE, ((0.3, 2.0), (0.1, 40.0)))
    assert "E = 9000 Pa at once" in str(gel)
    assert f"relaxes by 0.3 in 2 s and 0.1 in 40 s to E = {gel.relaxed_law().young:.4g} Pa" in str(gel)
    assert "to E = 0 Pa" in str(Viscoelastic(TISSUE, ((1.0, 2.0),)))


def test_printed_numbers_have_no_rounding_dust_and_no_signed_zero():
    assert repr(Range("c_z", 0.024999999999999994, 0.1, "m")) == "Range('c_z', 0.025, 0.1, 'm')"
    assert str(Range("c_z", -0.0, 0.1, "m")) == "c_z 0 … 0.1 m"
    solution = PROBLEM.solve([-0.001])
    object.__setattr__(solution, "response", np.array([-0.0]))
    assert "  response     0 N" in str(solution)


@pytest.mark.parametrize("whole", ["side", ("side", "x_min")])
def test_the_side_of_a_box_is_its_four_upright_faces(whole):
    faces = ("x_min", "x_max", "y_min", "y_max")
    by_word, by_name = (Body(BLOCK, TISSUE, fixed=fixed).problem(PUSH) for fixed in (whole, faces))
    assert by_word == by_name
    assert by_word.solve([-0.001]).response == by_name.solve([-0.001]).response
