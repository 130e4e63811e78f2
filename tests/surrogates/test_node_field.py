"""Bodies that a hand holds at a node: what is felt and seen, the mirror image, loads elsewhere, the file."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from models import DOWN, linear_network, planar_field, spring_beam, spring_energy
from palpate.errors import UsageError
from palpate.learning.loading import load
from palpate.runtime.touchable import touchable
from palpate.surrogates import ConstantBaseline, LearntEnergy, NodeField, Surrogate
from palpate.units import Quantity, Range

NONE = np.zeros(0)
LEVEL = 0.4  # J


def felt(model: Surrogate, position, parameters=NONE):
    """The hand's evaluator, the hand having taken hold at rest and moved to a position."""
    hand, place = touchable(model).evaluator(), np.asarray(position, dtype=float).copy()
    hand.place(place, holding=True, believed=True)
    hand(place, np.asarray(parameters, dtype=float))
    return hand


@given(st.floats(0.0, 0.25), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_spring_answers_with_its_own_law_wherever_the_hand_strays_sideways(down, aside, out):
    e = felt(spring_beam(stiffness=20.0), [aside, -down, out])
    np.testing.assert_allclose(e.force, [0.0, 20.0 * down, 0.0], atol=1e-9)
    np.testing.assert_allclose(e.contact, [0.0, -down, 0.0], atol=1e-9)
    np.testing.assert_allclose(e.loads, [20.0 * down], atol=1e-9)
    assert e.inside


@pytest.mark.full
@given(st.floats(1e-6, 0.5))
def test_the_other_side_is_the_mirror_image(y):
    below, above = felt(spring_beam(), [0.0, -y, 0.0]), felt(spring_beam(), [0.0, y, 0.0])
    np.testing.assert_array_equal(above.force, -below.force)
    np.testing.assert_array_equal(above.contact, -below.contact)
    np.testing.assert_array_equal(above.loads, -below.loads)
    assert above.inside == below.inside


def test_a_load_of_the_other_sign_gives_the_reflected_shape():
    field = spring_beam().fields["displacement"]
    shape = field.values(np.array([[3.0]]))
    np.testing.assert_array_equal(field.values(np.array([[-3.0]])), shape * [1, -1, 1])


def test_beyond_the_trained_range_the_flag_says_so_and_the_shape_is_that_at_the_edge():
    model = spring_beam(stiffness=20.0, load=5.0)
    edge, far = felt(model, [0, -0.25, 0]), felt(model, [0, -3.0, 0])
    assert edge.inside
    assert not far.inside
    np.testing.assert_array_equal(far.contact, edge.contact)
    field = model.fields["displacement"]
    np.testing.assert_array_equal(field.values([[50.0]]), field.values([[5.0]]))
    one_sided = dataclasses.replace(field, mirror=None)
    np.testing.assert_array_equal(one_sided.values([[-1.0]]), one_sided.values([[0.0]]))


def test_not_a_number_is_not_hidden():
    assert not np.isfinite(felt(spring_beam(), [0.0, np.nan, 0.0]).force).all()


def test_the_held_node_is_where_the_field_has_it():
    model = spring_beam()
    field = model.fields["displacement"]
    node = field.node(DOWN)
    for y in (-0.2, 0.13):
        node(np.array([0.0, y, 0.0]), np.array([0.0, -20.0 * y, 0.0]), NONE)
        np.testing.assert_allclose(node.value, field.values(node.inputs)[0, field.held], atol=1e-15)


# energies above a constant: U + LEVEL = LEVEL exp ℓ, made for a network that is affine in its inputs, so that the
# force along one coordinate is −LEVEL exp(ℓ) ∂ℓ/∂x in closed form


def two_loads(compliance: float = 0.01) -> Surrogate:
    """Two loads at the tip behind a coupling; ℓ = a·h, so P = LEVEL exp(a·h) a."""
    loads = [Range("x", -2.0, 2.0, "N"), Range("y", -2.0, 2.0, "N")]
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    tail = np.zeros((4, 3))
    tail[2, 1], tail[3, 2] = 2.0 / 10.0, 2.0 / 40.0
    field = planar_field(
        "displacement",
        linear_network(loads, [Quantity(f"u{i}", "m") for i in range(4)], tail),
        points,
        touched=np.arange(2),
    )
    hand = [Range("h along x", -0.2, 0.2, "m"), Range("h along y", -0.1, 0.1, "m")]
    network = linear_network(hand, [Quantity("ℓ", "")], np.array([[0.0, 0.3, 0.2]]))
    baseline = ConstantBaseline(LEVEL, np.eye(3)[:2], compliance)
    return Surrogate(LearntEnergy(network, baseline), {"displacement": field}, meta={"name": "plane"})


@pytest.mark.full
@given(st.floats(-0.2, 0.2), st.floats(-0.1, 0.1))
def test_two_loads_hold_the_node_where_the_field_says(x, y):
    e = felt(two_loads(), [x, y, 0.0])
    slope = np.array([0.3 / 0.2, 0.2 / 0.1])
    pull = LEVEL * math.exp(slope @ [x, y]) * slope
    np.testing.assert_allclose(e.force, [*-pull, 0.0], rtol=1e-12)
    np.testing.assert_allclose(e.loads, pull, rtol=1e-12)
    np.testing.assert_allclose(e.contact[:2], np.minimum(pull, 2.0) / [10.0, 40.0], rtol=1e-12)


def a_load_elsewhere() -> Surrogate:
    """A tip load that the hand supplies, and one at midspan that it doesn't; ℓ = 2 h + 0.5 m."""
    loads = [Range("mid", 0.0, 1.0, "N"), Range("tip", 0.0, 2.0, "N")]
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    tail = np.zeros((4, 3))
    tail[3] = [-(0.5 * 0.1 + 1.0 * 0.2), -0.5 * 0.1, -1.0 * 0.2]
    field = planar_field(
        "displacement",
        linear_network(loads, [Quantity(f"u{i}", "m") for i in range(4)], tail),
        points,
        touched=np.ones(1, np.int64),
    )
    hand = [Range("h along tip", 0.0, 0.5, "m"), loads[0]]
    network = linear_network(hand, [Quantity("ℓ", "")], np.array([[0.75, 0.5, 0.25]]))
    energy = LearntEnergy(network, ConstantBaseline(LEVEL, DOWN))
    return Surrogate(energy, {"displacement": field}, meta={"name": "three"})


def test_loads_that_the_hand_does_not_supply_are_parameters():
    model = a_load_elsewhere()
    assert [r.name for r in model.parameters] == ["mid"]
    e = felt(model, [0.0, -0.3, 0.0], [0.5])
    pull = 2.0 * LEVEL * math.exp(2.0 * 0.3 + 0.5 * 0.5)
    np.testing.assert_allclose(e.force, [0.0, pull, 0.0], rtol=1e-12)
    np.testing.assert_allclose(e.loads, [0.5, pull], rtol=1e-12)
    np.testing.assert_allclose(e.contact, [0.0, -0.1 * 0.5 - 0.2 * pull, 0.0], rtol=1e-12)
    assert not felt(model, [0.0, -0.3, 0.0], [7.0]).inside


def test_the_file_gives_the_body_back(tmp_path):
    for model in (spring_beam(), two_loads(), a_load_elsewhere()):
        again = load(model.save(tmp_path / "m.palpate"))
        assert str(again) == str(model)
        X = np.array([[0.5 * r.high for r in model.inputs]])
        np.testing.assert_array_equal(again.energy.force(X), model.energy.force(X))
        field, same = model.fields["displacement"], again.fields["displacement"]
        asked = np.array([[0.3 * r.high for r in field.inputs]])
        np.testing.assert_array_equal(same.values(asked), field.values(asked))
        assert (same.held, same.further) == (field.held, field.further)


@pytest.mark.parametrize(
    "change",
    [
        {"held": 99},
        {"touched": np.array([3])},
        {"touched": np.zeros(0, np.int64)},
        {"points": np.zeros((21, 2))},
        {"columns": np.zeros((42, 3), np.int64)},
        {"of_interest": np.array([21])},
        {"radius": math.nan},
        {"mirror": np.zeros(2)},
    ],
    ids="-".join,
)
def test_parts_that_do_not_fit_are_refused(change):
    with pytest.raises(UsageError, match="field at nodes"):
        dataclasses.replace(spring_beam().fields["displacement"], **change)


def test_a_field_of_another_body_is_refused():
    other: NodeField = two_loads().fields["displacement"]
    energy = spring_energy(20.0, [Range("h", -0.25, 0.25, "m")])
    with pytest.raises(UsageError, match="2 loads that a hand supplies, not 1"):
        Surrogate(energy, {"displacement": other})
    with pytest.raises(UsageError, match="has 2 inputs, not 1"):
        Surrogate(energy, {"displacement": a_load_elsewhere().fields["displacement"]})
