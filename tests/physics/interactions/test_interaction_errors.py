"""What interactions refuse, each with a word on what to do; and what all of them share."""

from __future__ import annotations

import json
import pickle

import pytest

from palpate.errors import UsageError
from palpate.physics.interactions import (
    BodyForce,
    GluedPad,
    Interaction,
    PointForce,
    PrescribedDisplacement,
    Pressure,
    SurfaceTraction,
    free_motions,
    require_support,
)
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.physics.solid.solid_field import SolidField

BLOCK = Block((0.04, 0.03, 0.02), element=0.02)
PLACE = (0.02, 0.015, 0.02)
ALL = (
    GluedPad(radius=0.01, at=PLACE, displacement=(0.0, 0.0, (-0.01, 0.0)), element=0.008),
    GluedPad("top"),
    GluedPad(radius=0.008, over=((0.01, 0.01), (0.02, 0.02)), element=0.008),
    PrescribedDisplacement("top", ("x", "z"), ((0.0, 0.01), (0.0, 0.01))),
    PointForce(PLACE, 0.008, (0.0, 1.0), element=0.008),
    SurfaceTraction("top", "normal", (0.0, 1.0)),
    BodyForce((0.0, 1.0)),
    Pressure("top", (0.0, 1.0)),
)


@pytest.mark.parametrize("interaction", ALL, ids=lambda i: type(i).__name__)
def test_every_interaction_is_a_value_that_describes_itself(interaction):
    assert isinstance(interaction, Interaction)
    assert pickle.loads(pickle.dumps(interaction)) == interaction
    assert hash(interaction) == hash(pickle.loads(pickle.dumps(interaction)))
    text = json.dumps(interaction.describe())
    assert json.loads(text)["type"] == type(interaction).__name__
    ranges = interaction.ranges(BLOCK)
    assert len({r.name for r in ranges}) == len(ranges) >= 1


@pytest.mark.parametrize("interaction", ALL, ids=lambda i: type(i).__name__)
def test_every_interaction_has_an_input_for_each_range(interaction):
    refinements = interaction.refinements(BLOCK)
    field = SolidField(BLOCK.mesh(refinements), BLOCK.rest(refinements), 2, ("bottom", "side"))
    attached = interaction.attach(field)
    assert len(attached.parameters) == len(interaction.ranges(BLOCK))


@pytest.mark.parametrize(
    "make",
    [
        lambda: GluedPad("roof"),
        lambda: GluedPad("roof", radius=0.01, at=PLACE),
        lambda: PrescribedDisplacement("roof"),
        lambda: PointForce(PLACE, 0.008, (0.0, 1.0), surface="roof"),
        lambda: SurfaceTraction("roof", "z", (0.0, 1.0)),
        lambda: Pressure("roof", (0.0, 1.0)),
    ],
)
def test_an_unknown_surface_is_refused_with_those_there_are(make):
    with pytest.raises(UsageError, match=r"There is no surface 'roof'[^§]*top, bottom, x_min"):
        Body(BLOCK, NeoHookean(9e3, 0.3)).problem(make()).ranges  # noqa: B018


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PointForce(PLACE, 0.008, (0.0, 1.0), (0, 0, 0)), "without a length"),
        (lambda: PointForce(PLACE, 0.008, (0.0, 1.0), "w"), "Axes are x, y and z"),
        (lambda: PointForce(PLACE, 0.008, (0.0, 1.0), (1, 0)), "three parts"),
        (lambda: PointForce(PLACE, 0.0, (0.0, 1.0)), "must be positive"),
        (lambda: PointForce(PLACE, 0.008, (1.0, 1.0)), "empty"),
        (lambda: PointForce(PLACE, 0.008, 1.0), "single number"),
        (lambda: PointForce(PLACE, 0.008, "1 N"), "number in N|type str"),
        (lambda: PointForce(PLACE, 0.008, (0.0, float("nan"))), "finite"),
        (lambda: SurfaceTraction("top", "z", (2.0, 1.0)), "empty"),
        (lambda: SurfaceTraction("top", "z", (0.0, 1.0, 2.0)), "two"),
        (lambda: GluedPad(radius=0.01), "needs one place"),
        (lambda: GluedPad(at=PLACE), "needs one place"),
        (lambda: GluedPad(radius=0.01, at=PLACE, over=((0, 0), (1, 1))), "needs one place"),
        (lambda: GluedPad(radius=-0.01, at=PLACE), "must be positive"),
        (lambda: GluedPad(radius=0.01, at=PLACE, pad="rigid"), "stress has no bound"),
        (lambda: GluedPad(pad=0.0), "must be positive"),
        (lambda: GluedPad(displacement=(0.0, 0.0, 0.001)), "fixed at"),
        (lambda: GluedPad(displacement=(0.0, (-1.0, 1.0))), "three components"),
        (lambda: GluedPad(radius=0.01, over=((0.02, 0.0), (0.01, 0.1))), "rectangle that is not empty"),
        (lambda: PrescribedDisplacement("top", ("x", "-x"), ((0, 1), (0, 1))), "depend on each other"),
        (lambda: PrescribedDisplacement("top", (1, 1, 0), (0, 1), sliding=True), "must be axes"),
        (lambda: PrescribedDisplacement("top", ("x", "y"), (0, 1)), "range of its own"),
        (lambda: PrescribedDisplacement("top", ()), "At least one"),
        (lambda: PrescribedDisplacement("top", "z", (0, 1), within=((1, 0, 0), (0, 1, 1))), "empty"),
        (lambda: PrescribedDisplacement("top", "z", (0, 1), within=(1, 0)), "three numbers"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(make, words):
    with pytest.raises(UsageError, match=words):
        make()


def test_a_box_without_elements_is_refused():
    nowhere = PrescribedDisplacement("top", "z", (0, 1), within=((0.019, 0.014, 0), (0.021, 0.016, 1)))
    field = SolidField(BLOCK.mesh(), BLOCK.rest(), 2, ("bottom",))
    with pytest.raises(UsageError, match="No element of the surface"):
        nowhere.attach(field)


def test_a_pressure_whose_rim_moves_has_no_potential():
    field = SolidField(BLOCK.mesh(), BLOCK.rest(), 2, ("bottom",))
    with pytest.raises(UsageError, match="has no potential"):
        Pressure("top", (0.0, 1.0)).attach(field)


@pytest.mark.parametrize(
    ("interaction", "fixed", "free"),
    [
        (ALL[4], (), 6),
        (ALL[4], ("bottom",), 0),
        (ALL[0], (), 0),
        (PrescribedDisplacement("top", "z", (0, 1), sliding=True), (), 3),
        (PrescribedDisplacement("side", ("x", "y"), ((0, 1), (0, 1)), sliding=True), (), 1),
        (PrescribedDisplacement("top", "z", (0, 1)), (), 0),
    ],
)
def test_motions_that_nothing_resists_are_counted(interaction, fixed, free):
    refinements = interaction.refinements(BLOCK)
    field = SolidField(BLOCK.mesh(refinements), BLOCK.rest(refinements), 2, fixed)
    attached = [interaction.attach(field)]
    assert len(free_motions(field, attached)) == free
    if free:
        with pytest.raises(UsageError, match="is not held"):
            require_support(field, attached)
    else:
        require_support(field, attached)
