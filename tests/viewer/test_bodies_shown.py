"""From solutions, files and datasets to what the page is sent."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import httpx
import numpy as np
import pytest
from blocks import SIZE, ball, block_mesh, dent, dents

from palpate.errors import FileFormatError, UsageError
from palpate.physics.shapes.mesh import outer_faces
from palpate.tools import Capsule, Gripper, Sphere
from palpate.tools.gripper import GRIP, OPENING
from palpate.viewer import BodyViewer
from palpate.viewer.messages import Shown, Step, Surface
from palpate.viewer.shown_body import ShownBody, body_of
from palpate.viewer.surfaces import split
from websocket_page import get


def test_a_block_is_split_into_six_faces():
    mesh = block_mesh()
    parts = split(mesh.points, mesh.triangles, mesh.surface_of == 0)
    assert np.array_equal(parts.nodes[parts.triangles], mesh.triangles)
    a, b, c = np.moveaxis(mesh.points[mesh.triangles], 1, 0)
    axis = np.abs(np.cross(b - a, c - a)).argmax(axis=1)
    far = np.take_along_axis(a, axis[:, None], axis=1)[:, 0] > 1e-9
    faces = [set(parts.triangles[(axis == k) & (far == f)].ravel()) for k in range(3) for f in (False, True)]
    assert sum(map(len, faces)) == len(parts.nodes)  # no point belongs to two
    ends = mesh.points[parts.nodes[parts.creases]]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(4 * SIZE.sum())
    rim = mesh.points[parts.nodes[parts.fixed]]
    assert np.linalg.norm(rim[:, 1] - rim[:, 0], axis=1).sum() == pytest.approx(2 * SIZE[:2].sum())
    assert np.all(rim[:, :, 2] == 0.0)


def test_a_ball_stays_whole():
    points, triangles = ball(24)
    parts = split(points, triangles, np.zeros(len(triangles), bool))
    assert len(parts.nodes) == len(np.unique(triangles))
    assert len(parts.creases) == 0


def test_the_skin_of_two_tetrahedra():
    skin = outer_faces(np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))
    assert len(skin) == 6
    assert {1, 2, 3} not in [set(t) for t in skin.tolist()]


@pytest.mark.full
def test_the_server_sends_what_the_solutions_say():
    solutions = dents(3)
    with BodyViewer(solutions, name="block", port=0) as viewer:
        shown = Shown.from_json(get(viewer, "shown").text)
        surface = Surface.unpack(get(viewer, "surface").content)
        step = Step.unpack(get(viewer, "steps/2").content)
        assert get(viewer, "steps/3").status_code == 404
        assert get(viewer).headers["content-security-policy"].startswith("default-src 'none'")
        assert get(viewer, host="elsewhere.example").status_code == 403
    with pytest.raises(httpx.ConnectError):
        httpx.get(viewer.url)
    assert [f.name for f in shown.fields] == ["displacement", "von Mises stress"]
    assert shown.reach == pytest.approx(0.010)
    assert [s.label for s in shown.steps] == ["1", "2", "3"]
    rest = surface.rest.reshape(-1, 3)
    moved = step.displacement.reshape(-1, 3)
    lowest = moved[:, 2].argmin()
    assert rest[lowest] == pytest.approx([0.05, 0.05, 0.05], abs=1e-7)
    assert moved[lowest] == pytest.approx([0, 0, -0.010], abs=1e-8)
    assert step.values.max() == pytest.approx(solutions[2].von_mises.max(), rel=1e-6)
    assert step.centre == pytest.approx((0.05, 0.05, 0.05))
    assert step.radius == pytest.approx(0.010)


def test_solutions_without_an_equilibrium_are_left_out():
    good, bad = dents(2)[1], dent(block_mesh(), 0.001)
    bad.converged, bad.message = False, "the element is inverted"
    assert len(body_of([bad, good]).steps) == 1
    with pytest.raises(UsageError, match="inverted"):
        body_of([bad])
    with pytest.raises(UsageError, match="no solution"):
        body_of(SimpleNamespace())
    with pytest.raises(UsageError, match="doesn't fit"):
        body_of([good, SimpleNamespace(mesh=good.mesh, displacement=np.zeros((3, 3)))])
    with pytest.raises(UsageError, match="nothing to show"):
        ShownBody("empty", np.zeros((0, 3)), np.zeros((0, 3), int), [])


def write_tetrahedron(path: Path, lift: float) -> None:
    import meshio

    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * 0.01
    u = np.zeros((4, 3))
    u[3, 2] = lift
    meshio.write(path, meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])], {"displacement": u, "heat": u[:, 2]}))


@pytest.mark.full
def test_files_of_other_programs_are_shown(tmp_path: Path):
    for i in range(2):
        write_tetrahedron(tmp_path / f"{i}.vtu", 0.001 * i)
    one = body_of(tmp_path / "1.vtu")
    assert (one.name, len(one.triangles), one.names) == ("1", 4, ("heat",))
    assert one.steps[0].displacement[3, 2] == 0.001
    rows = "".join(f'<DataSet timestep="{i}" file="{i}.vtu"/>' for i in range(2))
    (tmp_path / "path.pvd").write_text(f"<VTKFile><Collection>{rows}</Collection></VTKFile>")
    series = body_of(str(tmp_path / "path.pvd"), "lifted")
    assert [s.label for s in series.steps] == ["t = 0", "t = 1"]
    (tmp_path / "bad.vtu").write_text("<VTKFile")
    for path in ("bad.vtu", "missing.vtu"):
        with pytest.raises(FileFormatError, match="can't be shown"):
            body_of(tmp_path / path)


GRIPPER = Gripper(Capsule(0.006, 0.018), Sphere(0.005), axis="y", roll=0.3)


def solid_dataset(samples: int, gripper: Gripper | None = None):
    """Indentation of rising depth in the block as a dataset, the last row not converged, as if under a ball or jaws."""
    from palpate.dataset import Layout, assemble, solid_fields
    from palpate.units import Range

    mesh = block_mesh()
    names = ("c_x", "c_y", "c_z") if gripper is None else (*GRIP, OPENING)
    ranges = tuple(Range(name, 0.0, 0.1, "m") for name in names)
    schema = solid_fields(len(mesh.points), ranges)
    answers = {field.name: np.zeros((samples, *field.shape)) for field in schema}
    made = [dent(mesh, depth) for depth in np.linspace(0.001, 0.010, samples)]
    places = np.array([one.centre for one in made])
    if gripper is not None:
        places = np.column_stack([places, np.linspace(0.09, 0.08, samples)])
        for one, x in zip(made, places, strict=True):
            one.tool, one.pose, one.response = gripper, x, np.append(one.response, 2.5)
    answers["displacement"] = np.array([one.displacement for one in made])
    answers["response"] = np.array([one.response for one in made])
    said = {"converged": True, "iterations": 3, "residual": 0.0, "message": "", "solve_seconds": 1.0}
    answers |= {name: np.full(samples, value) for name, value in said.items()}
    answers["converged"][-1] = False
    layout = Layout(
        mesh.points, triangles=mesh.triangles, surfaces=mesh.surfaces, surface_of=mesh.surface_of.astype(int)
    )
    acting = (
        {"type": "SphereProbe", "radius": 0.010}
        if gripper is None
        else {"type": "Pinch", **gripper.describe()}
    )
    problem = {"body": {"type": "Body", "fixed": ["bottom"]}, "interactions": [acting]}
    return made, assemble(ranges, layout, places, answers, {"problem": problem}, schema=schema)


def test_a_dataset_is_shown_sample_by_sample(tmp_path: Path):
    made, data = solid_dataset(4)
    for body in (body_of(data), body_of(data.save(tmp_path / "dents.zarr"))):
        assert [s.label for s in body.steps] == ["sample 0", "sample 1", "sample 2"]
        assert np.array_equal(body.steps[1].displacement, made[1].displacement)
        assert body.steps[1].ball[0] == pytest.approx(made[1].centre)
        assert body.steps[1].ball[1] == 0.010
        assert np.array_equal(body.fixed, made[0].mesh.surface_of == 0)
    assert body.name == "dents"


def test_a_long_dataset_is_thinned_from_end_to_end(monkeypatch):
    monkeypatch.setattr("palpate.viewer.shown_body.MOST_STEPS", 3)
    _, data = solid_dataset(8)
    assert [s.label for s in body_of(data).steps] == ["sample 0", "sample 3", "sample 6"]


def test_the_jaws_of_a_pinch_are_drawn_where_they_press():
    made, data = solid_dataset(3, GRIPPER)
    x = data.X[1]
    for body, index in ((body_of(data), 1), (body_of(made[1]), 0)):
        parts = body.split()
        shown, step = body.shown(parts), Step.unpack(body.step(index, parts).pack())
        assert (step.probed, step.turn) == (True, (0.0, 0.0, 0.0))
        assert step.opening == pytest.approx(x[3], abs=1e-8)
        points, count = np.reshape(shown.tool.points, (-1, 3)) + x[:3], shown.tool.first
        half = x[3] / 2 * np.array(shown.tool.along)
        for own, (tool, place) in zip(
            (points[:count] + half, points[count:] - half), GRIPPER.solids(x), strict=True
        ):
            local = (own - place - tool.to_centre) @ tool.turn
            # rounded to a tenth of a micrometre
            np.testing.assert_allclose(tool.shape.distance(local), 0.0, atol=2e-7)
        figures = shown.steps[index].figures
        assert (figures["effort"], figures["opening"]) == ("2.5 N", "85.00 mm")
