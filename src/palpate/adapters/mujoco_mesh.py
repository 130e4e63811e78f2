"""The deformed body as a mesh of a MuJoCo scene, for its viewer and its renderer.

    spec = mujoco.MjSpec.from_file("scene.xml")
    add_mesh(spec, body, at=(0.3, 0.0, 0.1))
    model = spec.compile()
    ...
    drawing = MeshDrawing(contact)
    drawing.draw(data, viewer.update_mesh)            # once a picture

Nothing touches the mesh: the force is the contact's. One mesh shows one tool's dent.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from palpate.adapters.extra import import_extra
from palpate.adapters.mujoco import SoftContact
from palpate.errors import UsageError
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.viewer.surfaces import split

__all__ = ["MeshDrawing", "add_mesh", "normals_of", "renderer_update"]

_COLOUR = (0.80, 0.45, 0.40, 1.0)
_NAME = "soft body"


def add_mesh(
    spec: Any,
    body: Surrogate | str | os.PathLike[str],
    *,
    at: Sequence[float],
    on: str = "world",
    name: str = _NAME,
    colour: Sequence[float] = _COLOUR,
) -> Any:
    """Add a learnt body's surface at rest to a scene that is not compiled yet, and return its geom.

    Parameters
    ----------
    spec : mujoco.MjSpec
        The scene.
    body : Surrogate or path
        The learnt body, or its file.
    at : (3,) or (7,)
        Place, m, and quaternion (w, x, y, z), as `palpate.adapters.mujoco.attach` takes them.
    on : str
        The scene's body that it stands on.
    name : str
        Name of the mesh and of its geom.
    colour : (4,)
        Red, green, blue and opacity, 0 to 1.

    Raises
    ------
    UsageError
        If the body has no drawn surface, or the scene no body `on`.
    """
    mujoco = import_extra("mujoco", "mujoco")
    learnt = body if isinstance(body, Surrogate) else Surrogate.load(body)
    points, triangles, _ = _patches(_displacement(learnt))
    base = spec.worldbody if on == "world" else spec.body(on)
    if base is None:
        raise UsageError(
            f"The scene has no body named {on!r}.",
            why="The drawn body stands on it.",
            fix="Name the body in the scene's XML, and give that name.",
        )
    spec.add_mesh(
        name=name,
        uservert=points.ravel(),
        userface=triangles.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    return base.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        pos=list(at[:3]),
        quat=list(at[3:]) or [1.0, 0.0, 0.0, 0.0],
        rgba=list(colour),
        contype=0,
        conaffinity=0,
        mass=0.0,
    )


def _displacement(body: Surrogate) -> FieldSurrogate:
    shown = body.surface_fields.get("displacement")
    if shown is None:
        raise UsageError(
            f"The body {body.name!r} has no surface to draw.",
            why="It was learnt without its displacement, or it is drawn as a line.",
            fix="Learn it with its shape, or leave the drawing out: the force needs none.",
        )
    return shown


def _patches(shown: FieldSurrogate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (p, 3), triangles (t, 3) and the drawn points (p,) they stand for: two at a sharp edge."""
    points, triangles = shown.pictured
    parts = split(points, triangles, np.zeros(len(triangles), dtype=np.bool_))
    return points[parts.nodes], parts.triangles, parts.nodes


class MeshDrawing:
    """The drawn surface of a contact's body, deformed as its tool presses it.

    Parameters
    ----------
    contact : SoftContact
        Whose tool presses.
    name : str
        Name that `add_mesh` gave the mesh.

    Raises
    ------
    UsageError
        If the scene has no such mesh, or one of another body.
    """

    def __init__(self, contact: SoftContact, name: str = _NAME) -> None:
        mujoco, model = import_extra("mujoco", "mujoco"), contact.model
        self._contact, self._field = contact, _displacement(contact.body)
        self._evaluator = self._field.evaluator()
        self._rest, self._triangles, self._nodes = _patches(self._field)
        self.mesh = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MESH, name))
        if self.mesh < 0 or int(model.mesh_vertnum[self.mesh]) != len(self._rest):
            raise UsageError(
                f"The scene has no mesh {name!r} of the body {contact.body.name!r}.",
                why=f"It must have that name, and {len(self._rest)} vertices.",
                fix="Add it before the scene is compiled: add_mesh(spec, body, at=…).",
            )
        # MuJoCo keeps a mesh in its own principal axes
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.mesh_quat[self.mesh])
        self._turn, self._centre = turn.reshape(3, 3), model.mesh_pos[self.mesh].copy()

    def points(self, data: Any) -> np.ndarray:
        """Return the deformed surface's points (p, 3) in the learnt body's frame, m."""
        self._evaluator(np.ascontiguousarray(self._contact.place(data)), self._contact.parameters)
        return self._rest + self._field.at_pictured(self._evaluator.field())[self._nodes]  # type: ignore[no-any-return]

    def draw(self, data: Any, update: Callable[[int], Any]) -> None:
        """Deform the mesh, and have it drawn.

        Parameters
        ----------
        data : mujoco.MjData
            The scene's state.
        update : callable of int
            Takes the mesh's number: ``viewer.update_mesh`` of MuJoCo's viewer, ``renderer_update(renderer)`` of its
            renderer.
        """
        model, points = self._contact.model, self.points(data)
        first, count = int(model.mesh_vertadr[self.mesh]), len(points)
        model.mesh_vert[first : first + count] = (points - self._centre) @ self._turn
        if int(model.mesh_normalnum[self.mesh]) == count:
            start = int(model.mesh_normaladr[self.mesh])
            normals = normals_of(points, self._triangles)
            model.mesh_normal[start : start + count] = normals @ self._turn
        update(self.mesh)


def normals_of(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return normals (p, 3) of length 1 at the points (p, 3) of triangles (t, 3), each face weighted by its area."""
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(points)
    for k in range(3):
        np.add.at(total, triangles[:, k], faces)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)  # type: ignore[no-any-return]


def renderer_update(renderer: Any) -> Callable[[int], None]:
    """Return what `MeshDrawing.draw` calls for a ``mujoco.Renderer``."""
    mujoco = import_extra("mujoco", "mujoco")
    return lambda mesh: mujoco.mjr_uploadMesh(renderer.model, renderer._mjr_context, mesh)
