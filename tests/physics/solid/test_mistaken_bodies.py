"""Mistakes of those who make bodies and problems: each is refused with a word on what to do."""

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics import (
    Block,
    Body,
    BodyForce,
    GluedPad,
    Held,
    LinearElastic,
    LinearHardening,
    NeoHookean,
    Plastic,
    PrescribedDisplacement,
    SphereProbe,
    Viscoelastic,
    VoceHardening,
    roller,
)
from palpate.physics.pictures import write_vtu
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
        (lambda: Body(BLOCK, TISSUE, held=PUSH), "Wrap it: held=Held(interaction, values)"),
        (lambda: Body(BLOCK, TISSUE, order="2"), "Use order=2"),
        (lambda: Body(BLOCK, TISSUE, formulation="Mixed"), "Did you mean 'mixed'"),
        (lambda: Body(BLOCK, TISSUE, formulation=3), "'auto', 'displacement', 'mixed'"),
        (lambda: Body(BLOCK, TISSUE, gravity=(0, 0, -9.81)), "density in kg/m³"),
        (lambda: Body(BLOCK, TISSUE, gravity=9.81), "m/s²"),
        (lambda: Body(BLOCK, TISSUE, fixed="sides"), "Did you mean 'side'"),
        (lambda: Held("top", 1.0), "no interaction"),
        (lambda: Held(PUSH, "1 mm"), "In Python it is a number"),
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
        (lambda: sweep(BODY, PUSH, samples=0), "at least one"),
        (lambda: sweep(BODY, PROBE, samples=-3), "at least one"),
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


def test_a_large_sphere_is_a_flat_one():
    assert BODY.problem(SphereProbe(radius=0.4, depth=(0.0, 0.001))).interactions[0].radius == 0.4


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
    assert "no density" in text
    solver = PROBLEM.open()
    assert "block 40 × 40 × 20 mm (neo-Hookean)" in str(solver)
    solver.solve([-0.001])
    assert "1 equilibria" in str(solver)


def test_materials_with_a_history_say_what_makes_it():
    metal = LinearElastic(110e9, 0.35, 8700)
    assert "yields at 5e+07 Pa, no hardening" in str(Plastic(metal, LinearHardening(50e6)))
    assert "hardens by 6.7e+07 Pa (Voce, rate 52)" in str(Plastic(metal, VoceHardening(125e6, 67e6, 52)))
    assert "relaxes by 0.3 in 2 s and 0.1 in 40 s" in str(Viscoelastic(TISSUE, ((0.3, 2.0), (0.1, 40.0))))


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
