"""Force on a ball in a ball from a labelmap, beside exact spheres and beside its voxels as hexahedra in CalculiX."""

from __future__ import annotations

import axisymmetric_ball
import calculix
import calculix_ball
import calculix_voxels
import ngsolve as ngs
import numpy as np
import pytest
from netgen.occ import Circle, Glue, MoveTo, OCCGeometry

from palpate.physics import Body, ImportedScan, SphereProbe, SurfacePatch
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes.scan_file import read_scan
from scanned import ball_in_ball

OUTER, INNER, UP = 0.020, 0.010, 0.005  # m, as `scanned` has them
VOXEL, ELEMENT, HELD, TOUCHED = 0.002, 0.0025, -0.010, 0.004  # m; of the surface: below, above
BALL, PAD, DEPTHS = 0.010, 2e6, [0.003]  # m, N/m³, m
FINE, CAP, NEAR = (
    5e-4,
    0.016,
    1e-8,
)  # m: elements of the exact spheres, least height of what is touched, the same place
LAWS = {name: NeoHookean(young, 0.45, form="isochoric") for name, young in (("fat", 3e3), ("lump", 30e3))}


def _exact() -> np.ndarray:
    """Return the forces in N at the pole of exact spheres, by NGSolve alone in a half-plane."""
    mesh = ngs.Mesh(OCCGeometry(_half_plane(), dim=2).GenerateMesh(maxh=FINE)).Curve(2)
    mu, bulk = (
        mesh.MaterialCF({name: getattr(law, modulus) for name, law in LAWS.items()})
        for modulus in ("shear_modulus", "bulk_modulus")
    )

    def energy(squares, volume):
        return mu / 2 * (squares * volume ** (-2 / 3) - 3) + bulk / 2 * (volume - 1) ** 2

    return axisymmetric_ball.press(mesh, energy, BALL, OUTER, DEPTHS, [[PAD]] * len(DEPTHS))[:, 0]


def _half_plane():
    """Return the section of the exact spheres with named faces and edges."""
    right = MoveTo(0, -2 * OUTER).Rectangle(2 * OUTER, 4 * OUTER).Face()
    outer, lump = (Circle((0, up), size).Face() * right for up, size in ((0, OUTER), (UP, INNER)))
    below = MoveTo(0, -2 * OUTER).Rectangle(2 * OUTER, 2 * OUTER + HELD).Face()
    above = MoveTo(0, CAP).Rectangle(2 * OUTER, OUTER).Face()
    tissues = [outer - below - above - lump, outer * below, outer * above, lump]
    for tissue, name in zip(tissues, ("fat", "fat", "fat", "lump"), strict=True):
        tissue.faces.name = name
    section = Glue(tissues)
    for edge in section.edges:
        x, y = np.transpose([(end.p.x, end.p.y) for end in edge.vertices])
        if np.abs(x).max() < NEAR:
            edge.name = "axis"
        elif np.abs(np.hypot(x, y) - OUTER).max() < NEAR:
            edge.name = "bottom" if y.max() < HELD + NEAR else "under" if y.min() > CAP - NEAR else "free"
    return section


def _scanned(path) -> np.ndarray:
    """Return the forces in N at the pole of the labelmap's body."""
    patches = (
        SurfacePatch("held", upper=(None, None, HELD)),
        SurfacePatch("touched", lower=(None, None, TOUCHED)),
    )
    shape = ImportedScan(str(path), {"fat": 1, "lump": 2}, element=ELEMENT, patches=patches)
    probe = SphereProbe(BALL, touches="touched", pad=PAD, stop=None, depth=(1e-4, 0.007))
    solver = Body(shape, LAWS, fixed="held").problem(probe, element=ELEMENT).open()
    places = [(0.0, 0.0, OUTER + BALL - depth) for depth in DEPTHS]
    return np.array([solver.solve(place).response[2] for place in places])


def _voxels(path, ccx, folder) -> np.ndarray:
    """Return the forces in N at the pole of the labelmap's voxels as hexahedra."""
    laws = {number: calculix.neo_hookean(law) for number, law in enumerate(LAWS.values(), 1)}
    text = calculix_voxels.deck(
        read_scan(str(path)).labels,
        VOXEL,
        laws,
        PAD,
        top=OUTER,
        held=HELD,
        touched=TOUCHED,
        ball=BALL,
        depths=DEPTHS,
    )
    return calculix_ball.forces(calculix.output(ccx, folder, text))


@pytest.mark.full
@pytest.mark.timeout(600)
def test_a_labelmap_is_nearer_to_the_spheres_that_were_scanned_than_its_voxels_are(ccx, tmp_path):
    path = ball_in_ball(tmp_path / "balls.nrrd")
    exact = _exact()
    ours, voxels = (np.abs(force - exact) for force in (_scanned(path), _voxels(path, ccx, tmp_path)))
    assert (ours < voxels).all()
