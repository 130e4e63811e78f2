"""The touch model: projection, mirror, range, and the file."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from allocated import kept_by
from models import linear_network, spring_beam
from palpate.errors import FileFormatError, UsageError
from palpate.network import Archive, save_archive
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range

NONE = np.zeros(0)


def touched(model: TouchModel, position, parameters=NONE):
    evaluator = model.evaluator()
    evaluator(np.asarray(position, dtype=float), np.asarray(parameters, dtype=float))
    return evaluator


@given(st.floats(0.0, 0.25), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_spring_answers_with_its_own_law_wherever_the_hand_strays_sideways(down, aside, out):
    e = touched(spring_beam(stiffness=20.0), [aside, -down, out])
    np.testing.assert_allclose(e.force, [0.0, 20.0 * down, 0.0], atol=1e-9)
    np.testing.assert_allclose(e.contact, [0.0, -down, 0.0], atol=1e-9)
    np.testing.assert_allclose(e.loads, [20.0 * down], atol=1e-9)
    assert e.inside


@given(st.floats(1e-6, 0.5))
def test_the_other_side_is_the_mirror_image(y):
    below, above = touched(spring_beam(), [0.0, -y, 0.0]), touched(spring_beam(), [0.0, y, 0.0])
    np.testing.assert_array_equal(above.force, -below.force)
    np.testing.assert_array_equal(above.contact, -below.contact)
    assert (above.inside, above.mirrored, below.mirrored) == (below.inside, True, False)


def test_mirrored_shape_is_reflected_across_the_axis():
    model = spring_beam()
    shape = model.displacement(np.array([3.0]))
    np.testing.assert_array_equal(model.displacement(np.array([3.0]), mirrored=True), shape * [1, -1, 1])


def test_beyond_the_trained_range_the_force_is_held_and_the_flag_says_so():
    model = spring_beam(stiffness=20.0, load=5.0)
    edge, far = touched(model, [0, -0.25, 0]), touched(model, [0, -3.0, 0])
    assert edge.inside
    assert not far.inside
    np.testing.assert_allclose(far.force, edge.force, atol=1e-12)


def test_not_a_number_is_not_hidden():
    e = touched(spring_beam(), [0.0, np.nan, 0.0])
    assert not np.isfinite(e.force).all()


def test_force_is_minus_the_gradient_of_the_work_along_a_stroke():
    model = spring_beam()
    evaluator = model.evaluator()
    heights = np.linspace(0.0, -0.2, 400)
    forces = []
    for y in heights:
        evaluator(np.array([0.0, y, 0.0]), NONE)
        forces.append(evaluator.force[1])
    work = -np.trapezoid(forces, heights)  # done by the hand
    assert work == pytest.approx(0.5 * 20.0 * 0.2**2, rel=1e-9)


def plane(compliance: float = 0.01) -> TouchModel:
    """Two springs, 10 N/m along x and 40 N/m along y, behind a coupling."""
    loads = [Range("x", -2.0, 2.0, "N"), Range("y", -2.0, 2.0, "N")]
    rest = np.zeros((2, 3))
    rest[1, 0] = 1.0
    tail = np.zeros((4, 3))
    tail[2, 1], tail[3, 2] = 2.0 / 10.0, 2.0 / 40.0
    names = [Quantity(f"u{i}", "m") for i in range(4)]
    reach = [2.0 * (1 / k + compliance) for k in (10.0, 40.0)]
    hand = [Range(f"h{c}", -r, r, "m") for c, r in zip("xy", reach, strict=True)]
    force = linear_network(
        hand, [Quantity("x", "N"), Quantity("y", "N")], np.array([[0, 2.0, 0], [0, 0, 2.0]])
    )
    field = linear_network(loads, names, tail)
    return TouchModel(
        name="plane",
        networks={"nodes": field, "field": field, "force": force},
        rest=rest,
        nodes_of_interest=np.array([0, 1]),
        touch_node=1,
        touched=(0, 1),
        directions=np.array([[1.0, 0, 0], [0, 1.0, 0]]),
        compliance=compliance,
        mirrors=False,
        reach=0.2,
        stiffness_max=40.0,
        radius=0.005,
    )


@given(st.floats(-0.2, 0.2), st.floats(-0.06, 0.06))
def test_two_loads_in_series_with_their_coupling(x, y):
    e = touched(plane(), [x, y, 0.0])
    expected = -np.array([x / (0.1 + 0.01), y / (0.025 + 0.01), 0.0])
    np.testing.assert_allclose(e.force, expected, atol=1e-9)
    # the node itself is behind the hand by the coupling's stretch
    np.testing.assert_allclose(np.array([x, y, 0.0]) - e.contact, -0.01 * e.force, atol=1e-9)
    assert e.inside


def three_loads() -> TouchModel:
    """A tip load that the hand supplies, and a parameter load that pushes the tip down by 0.1 m/N."""
    loads = [Range("mid", 0.0, 1.0, "N"), Range("tip", 0.0, 2.0, "N")]
    rest = np.zeros((2, 3))
    rest[1, 0] = 1.0
    tail = np.zeros((4, 3))
    tail[3] = [-(0.5 * 0.1 + 1.0 * 0.2), -0.5 * 0.1, -1.0 * 0.2]
    field = linear_network(loads, [Quantity(f"u{i}", "m") for i in range(4)], tail)
    # P = (h − 0.1 mid)/0.2 over h in [0, 0.5], mid in [0, 1]
    hand = [Range("h", 0.0, 0.5, "m"), loads[0]]
    force = linear_network(hand, [Quantity("tip", "N")], np.array([[1.0, 1.25, -0.25]]))
    return TouchModel(
        name="three",
        networks={"nodes": field, "field": field, "force": force},
        rest=rest,
        nodes_of_interest=np.array([0, 1]),
        touch_node=1,
        touched=(1,),
        directions=np.array([[0, -1.0, 0]]),
        compliance=0.0,
        mirrors=False,
        reach=0.5,
        stiffness_max=5.0,
        radius=0.005,
    )


def test_parameters_are_the_loads_that_the_hand_does_not_supply():
    model = three_loads()
    assert [r.name for r in model.parameters] == ["mid"]
    e = touched(model, [0.0, -0.3, 0.0], [0.5])
    np.testing.assert_allclose(e.loads, [0.5, (0.3 - 0.05) / 0.2], atol=1e-12)
    np.testing.assert_allclose(e.force, [0.0, 1.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(e.contact, [0.0, -0.3, 0.0], atol=1e-12)


def test_a_parameter_outside_its_range_is_held_and_flagged():
    e = touched(three_loads(), [0.0, -0.3, 0.0], [7.0])
    assert e.loads[0] == 1.0
    assert not e.inside


def test_a_corner_that_no_load_reaches_is_flagged():
    """At mid = 1 N the tip hangs 0.1 m down by itself: the hand can't be above that with a load of 0 … 2 N."""
    e = touched(three_loads(), [0.0, -0.02, 0.0], [1.0])
    assert e.loads[1] == 0.0
    assert not e.inside


def test_nothing_is_allocated_by_a_call():
    evaluator, position = spring_beam().evaluator(), np.array([0.0, -0.1, 0.0])
    assert kept_by(lambda: evaluator(position, NONE)) < 500


def test_the_file_gives_the_model_back(tmp_path):
    model = spring_beam()
    again = TouchModel.load(model.save(tmp_path / "m.palpate"))
    assert str(again) == str(model)
    position = np.array([0.0, -0.123, 0.0])
    a, b = touched(model, position), touched(again, position)
    np.testing.assert_array_equal(a.force, b.force)
    np.testing.assert_array_equal(again.displacement(a.loads), model.displacement(a.loads))


@pytest.mark.parametrize("change", ["touch_node", "touched", "missing", "shape"])
def test_a_file_whose_parts_do_not_fit_is_refused(tmp_path, change):
    model = spring_beam()
    arrays = {
        "rest": model.rest,
        "directions": model.directions,
        "nodes_of_interest": model.nodes_of_interest,
    }
    plain = ("name", "touch_node", "compliance", "mirrors", "reach", "stiffness_max", "radius")
    meta = {k: getattr(model, k) for k in plain} | {"touched": [0], "meta": {}}
    if change == "touch_node":
        meta["touch_node"] = 99
    elif change == "touched":
        meta["touched"] = [3]
    elif change == "missing":
        del meta["reach"]
    else:
        arrays["rest"] = model.rest[:, :2]
    save_archive(tmp_path / "m.palpate", Archive(model.networks, arrays, meta, "touch"))
    with pytest.raises(FileFormatError, match=r"m\.palpate"):
        TouchModel.load(tmp_path / "m.palpate")


def test_plain_sequences_are_as_good_as_arrays():
    evaluator = spring_beam(stiffness=20.0).evaluator()
    evaluator([0, -0.1, 0])
    np.testing.assert_allclose(evaluator.force, [0.0, 2.0, 0.0], atol=1e-12)
    evaluator((0.0, -0.1, 0.0), ())
    np.testing.assert_allclose(evaluator.force, [0.0, 2.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(("position", "parameters"), [([0.0, 0.0], []), ([0.0, 0.0, 0.0], [1.0]), (0.0, [])])
def test_shapes_that_do_not_fit_are_refused(position, parameters):
    with pytest.raises(UsageError, match=r"\(3,\)"):
        spring_beam().evaluator()(position, parameters)


def test_displacement_holds_loads_at_their_trained_limits():
    model = spring_beam(load=5.0)
    np.testing.assert_array_equal(model.displacement([50.0]), model.displacement([5.0]))
    np.testing.assert_array_equal(model.displacement([-1.0]), model.displacement([0.0]))
