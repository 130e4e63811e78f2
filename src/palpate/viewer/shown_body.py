"""A body to look at, as plain arrays: of solutions, of VTU and PVD files, of datasets.

Nothing here knows a solver: whatever has a mesh (points, triangles) and a displacement can be shown.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.readers.vtk_files import Grid, read_series, read_vtu
from palpate.errors import FileFormatError, UsageError
from palpate.tools import Gripper, PosedTool
from palpate.viewer.drawn_tool import drawn_tool
from palpate.viewer.messages import PROTOCOL, FieldInfo, Shown, Step, StepInfo, Surface
from palpate.viewer.surfaces import Split, split

__all__ = ["ShownBody", "ShownStep", "body_of", "body_of_dataset", "body_of_file"]

# kinds of cells, and their corners: further nodes lie between these
_CORNERS = (("tetra", 4), ("triangle", 3))
VON_MISES, STRETCH = "von Mises stress", "largest principal stretch"


@dataclass(frozen=True, eq=False)
class ShownStep:
    """One state of a body."""

    displacement: np.ndarray  # (node, 3), m
    values: Mapping[str, np.ndarray] = field(default_factory=dict)  # (node,) each, to colour by
    ball: tuple[np.ndarray, float] | None = None  # centre and radius of the probe, m
    turn: np.ndarray | None = None  # (3,) rotation vector that turns the tool beside its own orientation, rad
    opening: float = 0.0  # of two jaws, m; `ball` then holds the middle between them
    label: str = ""  # beside the slider; the step's number where there is none
    figures: Mapping[str, str] = field(default_factory=dict)  # what is known of it, in words


@dataclass(frozen=True, eq=False)
class ShownBody:
    """A body's surface and its states."""

    name: str  # title of the page
    rest: np.ndarray  # (node, 3), positions at rest, m, z up
    triangles: np.ndarray  # (t, 3) int, outer surface, counter-clockwise as seen from outside
    steps: Sequence[ShownStep]  # at least one
    units: Mapping[str, str] = field(default_factory=dict)  # of the steps' values
    fixed: np.ndarray | None = None  # (t,) bool, triangles that don't move
    tool: PosedTool | Gripper | None = None  # what presses where it is no ball; `ball` holds its place

    def __post_init__(self) -> None:
        rest, triangles = np.asarray(self.rest), np.asarray(self.triangles)
        good = (
            rest.ndim == 2 and rest.shape[1:] == (3,) and triangles.ndim == 2 and triangles.shape[1:] == (3,)
        )
        if not good or not len(triangles) or not self.steps:
            raise UsageError(
                "There is nothing to show.",
                why=f"A body needs points (n, 3), triangles (t, 3) and a state; here they are {rest.shape}, "
                f"{triangles.shape} and {len(self.steps)}.",
                fix="Show solutions of a solid body, a VTU file with cells, or a dataset of a solid.",
            )
        for step in self.steps:
            if np.shape(step.displacement) != rest.shape:
                raise UsageError(
                    f"A displacement of shape {np.shape(step.displacement)} doesn't fit {len(rest)} points.",
                    fix="Show solutions of one mesh.",
                )

    def split(self) -> Split:
        """Return its surface, split along sharp edges."""
        fixed = np.zeros(len(self.triangles), bool) if self.fixed is None else self.fixed
        return split(np.asarray(self.rest, dtype=float), np.asarray(self.triangles), fixed)

    def shown(self, parts: Split) -> Shown:
        """Return what the page asks for first: name, quantities and states."""
        reach = max(float(np.linalg.norm(s.displacement[parts.nodes], axis=1).max()) for s in self.steps)
        fields = [FieldInfo("displacement", "m", 0.0, reach or 1e-3, 3, 0)]
        for name in self.names:
            columns = [np.asarray(step.values[name])[parts.nodes] for step in self.steps]
            low, high = min(float(c.min()) for c in columns), max(float(c.max()) for c in columns)
            # from zero, where the values allow; smoothed stresses dip a little below
            low = low if low < -0.05 * abs(high) or low > 0.5 * high else 0.0
            high = high if high > low else low + 1.0
            fields.append(FieldInfo(name, self.units.get(name, ""), low, high, 1, 0))
        steps = tuple(StepInfo(s.label or f"{i + 1}", dict(s.figures)) for i, s in enumerate(self.steps))
        tool = None if self.tool is None else drawn_tool(self.tool)
        return Shown(PROTOCOL, self.name, tuple(fields), steps, reach, tool)

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities that every state has."""
        return tuple(name for name in self.steps[0].values if all(name in step.values for step in self.steps))

    def surface(self, parts: Split) -> Surface:
        """Return its surface at rest as a message."""
        return parts.surface(self.rest)

    def step(self, index: int, parts: Split) -> Step:
        """Return one state as a message."""
        step = self.steps[index]
        centre, radius = (np.zeros(3), 0.0) if step.ball is None else step.ball
        values = [np.asarray(step.values[name], dtype=float)[parts.nodes] for name in self.names]
        return Step(
            index=index,
            probed=step.ball is not None,
            centre=(float(centre[0]), float(centre[1]), float(centre[2])),
            radius=float(radius),
            opening=float(step.opening),
            turn=(0.0, 0.0, 0.0)
            if step.turn is None
            else (float(step.turn[0]), float(step.turn[1]), float(step.turn[2])),
            displacement=np.asarray(step.displacement, dtype=float)[parts.nodes].ravel(),
            values=np.concatenate(values) if values else np.zeros(0),
        )


def body_of(source: Any, name: str = "") -> ShownBody:
    """Return a body to look at, of a ShownBody, solutions, a Dataset, or the path of a .vtu, .pvd or .zarr.

    Solutions that did not converge are left out. `name` is the title of the page.
    """
    if isinstance(source, ShownBody):
        return source
    if isinstance(source, str | os.PathLike):
        return body_of_file(Path(source), name)
    if hasattr(source, "ranges") and hasattr(source, "X"):
        return body_of_dataset(source, name or "dataset")
    solutions = list(source) if isinstance(source, Iterable) else [source]
    return _body_of_solutions(solutions, name or "solution")


def _body_of_solutions(solutions: list[Any], name: str) -> ShownBody:
    good = [s for s in solutions if hasattr(s, "mesh") and getattr(s, "converged", True)]
    if not good:
        reasons = {str(getattr(s, "message", "")) for s in solutions} - {""}
        raise UsageError(
            "There is no solution to show.",
            why=" ".join(sorted(reasons)) or "Solutions of solid bodies have a mesh; these have none.",
            fix="Show at least one solution of a solid that converged.",
        )
    mesh = good[0].mesh
    held = getattr(good[0], "fixed", ())
    numbers = [
        mesh.surfaces.index(s) for s in ((held,) if isinstance(held, str) else held) if s in mesh.surfaces
    ]
    return ShownBody(
        name=name,
        rest=mesh.points,
        triangles=mesh.triangles,
        steps=[_step_of(solution) for solution in good],
        units={VON_MISES: "Pa"},
        fixed=np.isin(mesh.surface_of, numbers),
        tool=getattr(good[0], "tool", None),
    )


def _step_of(solution: Any) -> ShownStep:
    from palpate.physics.deformed import ball_of  # a page of a study needs no bodies

    fields = {VON_MISES: "von_mises", STRETCH: "largest_stretch"}
    known = {name: getattr(solution, attribute, None) for name, attribute in fields.items()}
    tool, pose = getattr(solution, "tool", None), getattr(solution, "pose", None)
    placed = (
        {"ball": ball_of(solution, True)} if tool is None or pose is None else _tool_placement(tool, pose)
    )
    return ShownStep(
        displacement=solution.displacement,
        values={name: values for name, values in known.items() if values is not None},
        figures=_figures(
            getattr(solution, "response", None), getattr(solution, "potential_energy", None), **placed
        ),
        **placed,
    )


def _tool_placement(tool: PosedTool | Gripper, pose: np.ndarray) -> dict[str, Any]:
    """Return where a tool with inputs (3 + k,) is, as a `ShownStep` takes it."""
    ball = (pose[:3], tool.shape.size)
    if isinstance(tool, Gripper):
        return {"ball": ball, "opening": float(pose[3])}
    return {"ball": ball, "turn": np.append(pose[3:], np.zeros(6 - len(pose)))}


def _figures(
    response: Any,
    energy: Any,
    ball: tuple[np.ndarray, float] | None,
    opening: float | None = None,
    turn: Any = None,
) -> dict[str, str]:
    """Return the figures of a state in words, as far as they are known; `turn` is drawn only."""
    found: dict[str, str] = {}
    if ball is not None and opening is not None:
        found["opening"] = f"{1e3 * opening:.2f} mm"
        if np.size(response) == 4:
            found["effort"] = f"{float(np.ravel(response)[3]):.3g} N"
    if ball is not None:
        places = ", ".join(f"{1e3 * c + 0.0:.1f}" for c in ball[0].round(6))
        found["probe" if opening is None else "middle"] = f"{places} mm".replace("-", "−")
    if response is not None and np.size(response) >= 3 and ball is not None:
        size = float(np.linalg.norm(np.ravel(response)[:3]))
        found[f"force on the {'probe' if opening is None else 'jaws'}"] = f"{size:.3g} N"
    if energy is not None and math.isfinite(float(energy)):
        found["energy"] = f"{1e3 * float(energy):.3g} mJ"
    return found


def _unreadable(path: Path, why: str) -> FileFormatError:
    """Return the error of a file that can't be shown."""
    return FileFormatError(
        f"{path} can't be shown.",
        why=why,
        fix="Show a .vtu or .pvd file with tetrahedra or triangles, or the .zarr folder of a solid's sweep.",
    )


MOST_STEPS = 400  # steps of a dataset: on a longer slider single ones can't be reached


def body_of_file(path: Path, name: str = "") -> ShownBody:
    """Read a body from a .vtu, a .pvd or a dataset's folder."""
    if not path.exists():
        raise _unreadable(path, "There is no such file.")
    if path.is_dir():
        from palpate.dataset import Dataset

        return body_of_dataset(Dataset.open(path), name or path.stem)
    if path.suffix == ".pvd":
        return _series(path, name or path.stem)
    return _vtu_body([path], ["1"], name or path.stem)


def body_of_dataset(dataset: Any, name: str) -> ShownBody:
    """Return the converged samples of a solid's dataset as a body, at most 400 of them."""
    data = dataset.data
    if "triangles" not in data:
        raise UsageError(
            "This dataset has no surface to show.",
            why="It was made of a beam or of a function.",
            fix="Show the dataset of a solid; a beam's is learnt and then shown by palpate view.",
        )
    rows = np.flatnonzero(data["converged"].values)
    if len(rows) > MOST_STEPS:
        rows = rows[np.linspace(0, len(rows) - 1, MOST_STEPS).astype(int)]
    origin = dataset.provenance
    radius, tool = _radius(origin), _tool(origin)
    rest = np.asarray(data["rest"].values, dtype=float)
    steps = [_sample(data, int(row), radius, tool) for row in rows]
    return ShownBody(
        name, rest, np.asarray(data["triangles"].values), steps, fixed=_fixed(data, origin), tool=tool
    )


def _sample(data: Any, row: int, radius: float | None, tool: PosedTool | Gripper | None) -> ShownStep:
    sample = data.isel(sample=row)
    inputs = np.asarray(sample["inputs"].values, dtype=float)
    count = 4 if isinstance(tool, Gripper) else 3 + (0 if tool is None else len(tool.angles))
    placed: dict[str, Any] = {"ball": None}
    if inputs.shape == (count,) and tool is not None:
        placed = _tool_placement(tool, inputs)
    elif inputs.shape == (count,) and radius is not None:
        placed = {"ball": (inputs, radius)}
    response = sample["response"].values if "response" in sample else None
    energy = sample["potential_energy"].values if "potential_energy" in sample else None
    return ShownStep(
        displacement=np.asarray(sample["displacement"].values, dtype=float),
        label=f"sample {row}",
        figures=_figures(response, energy, **placed),
        **placed,
    )


def _fixed(data: Any, origin: Any) -> np.ndarray | None:
    """Which triangles belong to the surfaces that the body is fixed at, as far as the dataset tells."""
    names = origin.get("problem", {}).get("body", {}).get("fixed", ())
    if "surface" not in data or "surface_of" not in data:
        return None
    known = [str(name) for name in data["surface"].values]
    numbers = [known.index(name) for name in ([names] if isinstance(names, str) else names) if name in known]
    return np.isin(data["surface_of"].values, numbers)


def _tool(origin: Any) -> PosedTool | Gripper | None:
    """Return the tool of which a record of how a dataset was made tells."""
    acting = origin.get("problem", {}).get("interactions", ())
    kinds: dict[str, Callable[..., PosedTool | Gripper]] = {"SurfaceTool": PosedTool.of, "Pinch": Gripper.of}
    tools = [kinds[one["type"]](one) for one in acting if isinstance(one, dict) and one.get("type") in kinds]
    return tools[0] if len(tools) == 1 else None


def _radius(record: Any) -> float | None:
    """The radius of a sphere probe in a record of how a dataset was made."""
    if isinstance(record, dict):
        if record.get("type") == "SphereProbe":
            return float(record["radius"])
        record = list(record.values())
    if isinstance(record, list | tuple):
        return next((r for r in map(_radius, record) if r is not None), None)
    return None


def _series(path: Path, name: str) -> ShownBody:
    try:
        entries = read_series(path)
    except FileFormatError as error:
        raise _unreadable(path, f"{error.what} {error.why}".strip()) from error
    return _vtu_body([file for _, file in entries], [f"t = {time}" for time, _ in entries], name)


def _vtu_body(paths: list[Path], labels: list[str], name: str) -> ShownBody:
    from palpate.physics.shapes.mesh import outer_faces

    first = _read(paths[0])
    tetrahedra, flat = ([nodes[:, :n] for k, nodes in first.cells if k == kind] for kind, n in _CORNERS)
    if tetrahedra:
        triangles = outer_faces(np.concatenate(tetrahedra))
    elif flat:
        triangles = np.concatenate(flat)
    else:
        kinds = ", ".join(kind for kind, _ in first.cells) or "none"
        raise _unreadable(paths[0], f"Its cells are {kinds}; tetrahedra or triangles are needed.")
    meshes = [first, *map(_read, paths[1:])]
    steps = [_vtu_step(mesh, label) for mesh, label in zip(meshes, labels, strict=True)]
    return ShownBody(name, np.asarray(first.points, dtype=float), triangles, steps, units={VON_MISES: "Pa"})


def _vtu_step(mesh: Grid, label: str) -> ShownStep:
    count = len(mesh.points)
    values = {k: np.asarray(v, dtype=float) for k, v in mesh.point_data.items() if np.shape(v) == (count,)}
    notes = {name: values for name, values in mesh.field_data.items() if np.size(values)}
    ball = None
    if "probe centre and radius" in notes:
        probe = np.asarray(notes["probe centre and radius"], dtype=float).ravel()
        ball = (probe[:3], float(probe[3]))
    energy = np.ravel(notes["potential energy"])[0] if "potential energy" in notes else None
    response = np.ravel(notes["response"]) if "response" in notes else None
    displacement = np.asarray(mesh.point_data.get("displacement", np.zeros((count, 3))), dtype=float)
    figures = _figures(response, energy, ball)
    return ShownStep(displacement, values, ball, label=label, figures=figures)


def _read(path: Path) -> Grid:
    try:
        return read_vtu(path)
    except FileFormatError as error:
        raise _unreadable(path, error.why or error.what) from error
