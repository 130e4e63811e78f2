"""States whose deformation is the same everywhere are found exactly, in both forms."""

from __future__ import annotations

import numpy as np
import pytest
from solids import SIZE, Stretched, gel

from palpate.physics.deformed import nodal_strain
from palpate.physics.materials import LinearElastic
from palpate.physics.materials.tensors import gradient
from palpate.physics.shapes import Block, Dome, LayeredBlock
from palpate.physics.solid import Body, solid_path
from palpate.physics.solid.solid_field import SolidField

MATRIX = ((-0.1, 0.2, 0.05), (0.0, 0.15, -0.1), (0.1, 0.0, -0.2))
VOLUME = float(np.prod(SIZE))


def patch(material, formulation):
    body = Body(Block(SIZE, element=0.02), material, fixed=(), formulation=formulation)
    return body.problem(Stretched(MATRIX)).open()


@pytest.mark.parametrize("formulation", ["displacement", "mixed"])
@pytest.mark.parametrize("material", [gel(0.4), LinearElastic(9e3, 0.4)], ids=lambda m: type(m).__name__)
def test_the_patch_test_is_exact(material, formulation):
    """Energy, its derivative and the displacement inside are those of the homogeneous state."""
    solver = patch(material, formulation)
    found = solver.solve(0.8)
    assert found.converged, found.message
    F = np.eye(3) + 0.8 * np.array(MATRIX)
    expected = found.mesh.points @ (F - np.eye(3)).T
    np.testing.assert_allclose(found.displacement, expected, atol=1e-10 * np.abs(expected).max())
    middles = found.mid_sides
    np.testing.assert_allclose(middles.points, found.mesh.points[middles.edges].mean(axis=1), atol=1e-15)
    expected = middles.points @ (F - np.eye(3)).T
    np.testing.assert_allclose(middles.displacement, expected, atol=1e-10 * np.abs(expected).max())
    assert found.potential_energy == pytest.approx(VOLUME * material.energy(F), rel=1e-10)
    slope = VOLUME * np.sum(gradient(material.energy, F) * np.array(MATRIX))
    np.testing.assert_allclose(-found.response, slope, rtol=1e-9)
    if material.kinematics == "large":
        assert found.least_volume_ratio == pytest.approx(np.linalg.det(F), rel=1e-10)
        stretches = np.sqrt(np.linalg.eigvalsh(F.T @ F))
        assert found.largest_strain == pytest.approx(np.abs(stretches - 1).max(), rel=1e-10)
        np.testing.assert_allclose(nodal_strain(found), found.largest_strain, rtol=1e-8)


@pytest.mark.parametrize("shape", [LayeredBlock(element=0.02), Dome(element=0.03)], ids=["layers", "dome"])
def test_middles_of_edges_are_found_on_every_mesh(shape):
    """u = X: what is displaced is read at the place it belongs to, also between regions and on curved edges."""
    import ngsolve

    field = SolidField(shape.mesh(), shape.rest(), 2, ())
    field.show(field.interpolate(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))))
    middles = field.mid_sides()
    size = np.ptp(field.rest.points)
    np.testing.assert_allclose(middles.displacement, middles.points, atol=1e-9 * size)
    ends = field.rest.points[middles.edges]
    bulge = np.linalg.norm(middles.points - ends.mean(axis=1), axis=1)
    assert (bulge < 0.3 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)).all()
    assert (bulge.max() > 1e-4) == shape.curved
    assert len(middles.edges) == len(np.unique(middles.edges, axis=0))


def test_fields_are_those_of_the_homogeneous_state():
    material = gel(0.4)
    found = patch(material, "displacement").solve(0.8, fields=True)
    F = np.eye(3) + 0.8 * np.array(MATRIX)
    stress = gradient(material.energy, F) @ F.T / np.linalg.det(F)
    deviator = stress - np.trace(stress) / 3 * np.eye(3)
    np.testing.assert_allclose(found.von_mises, np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-7)
    np.testing.assert_allclose(found.largest_stretch, np.linalg.norm(F, 2), rtol=1e-8)


def test_an_inverted_body_is_called_so():
    """With q A = -1.05 e₃⊗e₃ the block is turned inside out, however small the steps."""
    turned = Stretched(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    body = Body(Block(SIZE, element=0.02), gel(0.4), fixed=())
    solver = body.problem(turned).open()
    found = solver.solve(1.05)
    assert not found.converged
    assert "inside out" in found.message or "not finite" in found.message
    # the last good state is an equilibrium: one may go there, and on from it
    assert 0.5 < found.reached[0] < 1.0
    assert np.isnan(found.displacement).all()
    assert solver.solve(0.5).converged


def test_a_long_step_is_cut_back(monkeypatch):
    """Nine tenths of the height are lost in one step that must be parted, as the log tells."""
    squeezed = Stretched(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    solver = Body(Block(SIZE, element=0.02), gel(0.4), fixed=()).problem(squeezed).open()
    # without the slope at the start the inside stays behind at first
    monkeypatch.setattr(solid_path, "_with_slope", lambda model, start: start)
    found = solver.solve(0.9)
    assert found.converged
    assert next(step.stop.name for step in found.log) != "CONVERGED"
    assert found.log[-1].position == 1.0
    assert found.iterations == sum(step.iterations for step in found.log)
    F = np.diag([1.0, 1.0, 0.1])
    assert found.potential_energy == pytest.approx(VOLUME * gel(0.4).energy(F), rel=1e-9)
