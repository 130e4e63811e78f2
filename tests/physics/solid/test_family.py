"""Bodies that differ in their materials, as one problem."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import palpate as pp
from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, LayeredBlock
from palpate.physics.solid import Body, BodyFamily, FamilyProblem, SolidProblem, Varied

PROBE = SphereProbe(0.01, depth=(0.0, 0.006), over=((0.03, 0.03), (0.05, 0.05)))
CENTRE = (0.042, 0.037, 0.045)  # 5 mm deep


def layered() -> Body:
    shape = LayeredBlock((0.08, 0.08), (("fat", 0.015), ("muscle", 0.025)), element=0.02)
    return Body(
        shape,
        {"fat": NeoHookean(4e3, 0.45, 1000.0), "muscle": NeoHookean(15e3, 0.45, 1000.0)},
        fixed="bottom",
    )


FAMILY = BodyFamily(layered(), (Varied("fat.young", 2e3, 8e3), Varied("muscle.poisson", 0.3, 0.47)))


def problem() -> FamilyProblem:
    return FAMILY.problem(PROBE, element=0.012)


@pytest.mark.full
def test_a_member_answers_as_the_body_that_it_is() -> None:
    member = FAMILY.member((5e3, 0.4))
    assert member.materials["fat"].young == 5e3
    assert member.materials["muscle"].poisson == 0.4
    assert member.materials["muscle"].young == 15e3
    alone = member.problem(PROBE, element=0.012).solve(CENTRE)
    found = problem().solve((*CENTRE, 5e3, 0.4))
    assert found.potential_energy == alone.potential_energy
    np.testing.assert_array_equal(found.response[:3], alone.response)
    np.testing.assert_array_equal(found.response_gradient[:3, :3], alone.response_gradient)
    assert np.isnan(found.response_gradient[3:]).all()
    np.testing.assert_array_equal(found.inputs, (*CENTRE, 5e3, 0.4))


@pytest.mark.full
@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), (0.0, 0.0, -9.81)])
def test_the_response_to_a_property_is_the_slope_of_the_energy(gravity: tuple[float, float, float]) -> None:
    # envelope theorem: ∂U/∂p at the equilibrium is the partial derivative at the same displacement
    family = BodyFamily(dataclasses.replace(layered(), gravity=gravity), FAMILY.varied)
    solver = family.problem(PROBE, element=0.012).open()
    x = np.array([*CENTRE, 4e3, 0.42])
    response = solver.solve(x).response
    for i, step in ((3, 20.0), (4, 5e-4)):
        ends = []
        for sign in (-1, 1):
            solver.reset()
            at = x.copy()
            at[i] += sign * step
            ends.append(solver.solve(at).potential_energy)
        slope = (ends[1] - ends[0]) / (2 * step)
        assert slope > 0  # stiffer in fat and less compressible: more energy at the same depth
        # differences of second order: (step/p)² of the slope, and the solver's energy to 1e-9 over the step
        assert response[i] == pytest.approx(-slope, rel=1e-4)


@pytest.mark.full
def test_columns_each_belong_to_one_member() -> None:
    family = problem()
    points = family.design(24, seed=3)
    chains = family.chains(points)
    assert sorted(np.concatenate(chains).tolist()) == list(range(24))
    for rows in chains:
        assert len(np.unique(points[rows, 3:], axis=0)) == 1
        assert (np.diff(points[rows, 2]) < 0).all()
    values = np.array([points[rows[0], 3:] for rows in chains])
    assert len(np.unique(values, axis=0)) == len(chains)
    low, high = np.array([2e3, 0.3]), np.array([8e3, 0.47])
    assert (values >= low).all()
    assert (values <= high).all()


@pytest.mark.full
def test_a_sweep_over_a_family_is_a_dataset_like_any() -> None:
    shape = Block((0.06, 0.06, 0.03), element=0.02)
    family = BodyFamily(Body(shape, NeoHookean(9e3, 0.4)), Varied("young", 5e3, 15e3))
    probe = SphereProbe(0.01, depth=(0.001, 0.004), over=((0.03, 0.03), (0.04, 0.04)))
    small = family.problem(probe, element=0.015)
    data = pp.sweep(small, samples=6, seed=1, workers=1, progress=False)
    assert data.ok.X.shape == (6, 4)
    assert [r.name for r in data.ranges] == ["c_x", "c_y", "c_z", "young"]
    assert data.ranges[3].unit == "Pa"
    row = data.take([4])
    again = small.solve(row.X[0])
    assert row["potential_energy"][0] == pytest.approx(again.potential_energy, rel=1e-7)


@pytest.mark.full
def test_layers_of_other_thickness_have_the_same_elements_moved() -> None:
    family = BodyFamily(layered(), Varied("fat.thickness", 0.010, 0.020))
    whole = family.problem(PROBE, element=0.008)
    member = whole.member((0.019,))
    assert member.body.geometry.layers == (("fat", 0.019), ("muscle", pytest.approx(0.021)))
    rest, moved = whole.mesh, member.mesh
    np.testing.assert_array_equal(moved.triangles, rest.triangles)
    np.testing.assert_array_equal(moved.points[:, :2], rest.points[:, :2])
    heights = np.interp(rest.points[:, 2], [0.0, 0.025, 0.040], [0.0, 0.021, 0.040])
    np.testing.assert_allclose(moved.points[:, 2], heights, atol=1e-12)
    # the touched surface stays, and the answers are those of a block that is meshed as it is
    top = np.unique(rest.triangles_of("top"))
    np.testing.assert_array_equal(moved.points[top], rest.points[top])
    found = whole.solve((*CENTRE, 0.019))
    drawn = LayeredBlock((0.08, 0.08), (("fat", 0.019), ("muscle", 0.021)), element=0.02)
    alone = dataclasses.replace(layered(), geometry=drawn).problem(PROBE, element=0.008).solve(CENTRE)
    np.testing.assert_allclose(found.response[:3], alone.response, atol=0.03 * alone.response[2])
    assert found.response[2] < whole.solve((*CENTRE, 0.011)).response[2]  # more fat is softer
    assert np.isnan(found.response[3])
    assert family.problem(PROBE).describe()["varied"] == [{"path": "fat.thickness", "range": [0.010, 0.020]}]


@pytest.mark.full
def test_a_probe_of_any_size_lies_as_deep_over_the_same_places() -> None:
    family = BodyFamily(layered(), (Varied("fat.young", 2e3, 8e3), Varied("probe.radius", 0.008, 0.012)))
    whole = family.problem(PROBE, element=0.012)
    assert [r.name for r in whole.ranges] == ["c_x", "c_y", "c_z", "fat.young", "probe.radius"]
    assert (whole.ranges[2].low, whole.ranges[2].high) == pytest.approx((0.04 + 0.008 - 0.006, 0.04 + 0.012))
    points = whole.design(24, seed=1)
    depth = points[:, 4] - (points[:, 2] - 0.04)
    assert 0 < depth.min() < 0.001
    assert 0.005 < depth.max() < 0.006
    assert {len(np.unique(points[rows, 4])) for rows in whole.chains(points)} == {1}
    # a member is what a probe of that size would be, on the family's mesh
    x = (0.042, 0.037, 0.04 + 0.0115 - 0.005, 5e3, 0.0115)
    member = whole.member(x[3:])
    assert member.interactions[0].radius == 0.0115
    np.testing.assert_array_equal(member.mesh.points, whole.mesh.points)
    assert whole.solve(x).response[:3] == pytest.approx(member.solve(x[:3]).response, rel=1e-9)
    with pytest.raises(UsageError, match="no one probe"):
        family.problem(PROBE, PROBE)


def test_what_can_not_vary_is_said() -> None:
    body = layered()
    with pytest.raises(UsageError, match="names no property"):
        BodyFamily(body, Varied("bone.young", 1e3, 2e3))
    with pytest.raises(UsageError, match="young, poisson"):
        BodyFamily(body, Varied("fat.stiffness", 1e3, 2e3))
    with pytest.raises(UsageError, match="no number in the energy"):
        BodyFamily(body, Varied("fat.density", 900.0, 1100.0))
    with pytest.raises(UsageError, match="each once"):
        BodyFamily(body, (Varied("fat.young", 1e3, 2e3), Varied("fat.young", 1e3, 2e3)))
    with pytest.raises(UsageError, match=r"[Pp]oisson"):
        BodyFamily(body, Varied("fat.poisson", 0.3, 0.6))
    with pytest.raises(UsageError, match="no layers"):
        BodyFamily(
            Body(Block((0.06, 0.06, 0.03)), NeoHookean(9e3, 0.4)), Varied("body.thickness", 0.01, 0.02)
        )
    with pytest.raises(UsageError, match="above the deepest"):
        BodyFamily(body, Varied("muscle.thickness", 0.02, 0.03))
    with pytest.raises(UsageError, match="40 mm"):
        BodyFamily(body, Varied("fat.thickness", 0.01, 0.05))
    with pytest.raises(UsageError, match="4 finite numbers"):
        BodyFamily(body, Varied("fat.young", 1e3, 2e3)).problem(PROBE).solve(CENTRE)
    assert isinstance(problem().member((4e3, 0.4)), SolidProblem)


@pytest.mark.full
def test_stress_is_in_every_row_that_asks_for_it() -> None:
    """Of a body and of a family; which questions are asked of a problem is part of its identity."""
    for whole, places in ((layered(), (CENTRE,)), (FAMILY, ((*CENTRE, 5e3, 0.4),))):
        plain, asked = (whole.problem(PROBE, element=0.014, stress=stress) for stress in (False, True))
        assert "von_mises" not in {field.name for field in plain.schema}
        assert plain.describe() != asked.describe()
        data = pp.sweep(asked, points=places, workers=1, progress=False)
        seen = asked.solve(places[0])
        np.testing.assert_allclose(data["von_mises"][0], seen.von_mises, rtol=1e-6, atol=1e-3)
        assert data["von_mises"][0].max() > 100.0  # Pa, under a ball pressed 5 mm deep


def test_a_range_of_words_is_refused():
    with pytest.raises(UsageError, match="'5 kPa', of type str"):
        Varied("young", "5 kPa", 15e3)
