"""From solutions, files and datasets to a body to look at, as plain arrays.

Nothing here knows a solver: whatever has a mesh (points, triangles) and a displacement can be shown.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.viewer.messages import PROTOCOL, FieldInfo, Shown, Step, StepInfo, Surface
from palpate.viewer.surfaces import Split, split

__all__ = ["ShownBody", "ShownStep", "body_of"]

VON_MISES, STRETCH = "von Mises stress", "largest principal stretch"


@dataclass(frozen=True, eq=False)
class ShownStep:
    """One state of a body.

    Attributes
    ----------
    displacement : (node, 3) array
        m.
    values : {name: (node,) array}
        Quantities to colour by, besides the displacement.
    ball : (centre, radius), optional
        The probe, m.
    label : str
    figures : {name: words}
    """

    displacement: np.ndarray
    values: Mapping[str, np.ndarray] = field(default_factory=dict)
    ball: tuple[np.ndarray, float] | None = None
    label: str = ""
    figures: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class ShownBody:
    """A body's surface and its states.

    Attributes
    ----------
    name : str
    rest : (node, 3) array
        Positions at rest, m, z up.
    triangles : (t, 3) int array
        Outer surface, counter-clockwise as seen from outside.
    steps : sequence of ShownStep
    units : {name: unit}
        Of the steps' values.
    fixed : (t,) bool array
        Which triangles don't move.
    """

    name: str
    rest: np.ndarray
    triangles: np.ndarray
    steps: Sequence[ShownStep]
    units: Mapping[str, str] = field(default_factory=dict)
    fixed: np.ndarray | None = None

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
        """Its surface, split along sharp edges."""
        fixed = np.zeros(len(self.triangles), bool) if self.fixed is None else self.fixed
        return split(np.asarray(self.rest, dtype=float), np.asarray(self.triangles), fixed)

    def shown(self, parts: Split) -> Shown:
        """What the page is told first."""
        reach = max(float(np.linalg.norm(s.displacement[parts.nodes], axis=1).max()) for s in self.steps)
        fields = [FieldInfo("displacement", "m", 0.0, reach or 1e-3)]
        for name in self.names:
            columns = [np.asarray(step.values[name])[parts.nodes] for step in self.steps]
            low, high = min(float(c.min()) for c in columns), max(float(c.max()) for c in columns)
            # from zero, where the values allow; smoothed stresses dip a little below
            low = low if low < -0.05 * abs(high) or low > 0.5 * high else 0.0
            fields.append(FieldInfo(name, self.units.get(name, ""), low, high if high > low else low + 1.0))
        steps = tuple(StepInfo(s.label or f"{i + 1}", dict(s.figures)) for i, s in enumerate(self.steps))
        return Shown(PROTOCOL, self.name, tuple(fields), steps, reach)

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities that every state has."""
        return tuple(name for name in self.steps[0].values if all(name in step.values for step in self.steps))

    def surface(self, parts: Split) -> Surface:
        """Its surface at rest as a message."""
        return Surface(
            rest=np.asarray(self.rest)[parts.nodes].ravel(),
            triangles=parts.triangles.ravel(),
            creases=parts.creases.ravel(),
            fixed=parts.fixed.ravel(),
        )

    def step(self, index: int, parts: Split) -> Step:
        """One state as a message."""
        step = self.steps[index]
        centre, radius = (np.zeros(3), 0.0) if step.ball is None else step.ball
        values = [np.asarray(step.values[name], dtype=float)[parts.nodes] for name in self.names]
        return Step(
            index=index,
            probed=step.ball is not None,
            centre=(float(centre[0]), float(centre[1]), float(centre[2])),
            radius=float(radius),
            displacement=np.asarray(step.displacement, dtype=float)[parts.nodes].ravel(),
            values=np.concatenate(values) if values else np.zeros(0),
        )


def body_of(source: Any, name: str = "") -> ShownBody:
    """A body to look at.

    Parameters
    ----------
    source : ShownBody, solution, sequence of solutions, Dataset, or path of a .vtu, .pvd or .zarr
        Solutions that did not converge are left out.
    name : str
        Title of the page.

    Raises
    ------
    UsageError
        If there is nothing to show.
    FileFormatError
        If the file can't be read.
    """
    if isinstance(source, ShownBody):
        return source
    if isinstance(source, str | os.PathLike):
        from palpate.viewer.files import body_of_file

        return body_of_file(Path(source), name)
    if hasattr(source, "ranges") and hasattr(source, "X"):
        from palpate.viewer.files import body_of_dataset

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
    )


def _step_of(solution: Any) -> ShownStep:
    from palpate.physics.deformed import ball_of  # a page of a study needs no bodies

    fields = {VON_MISES: "von_mises", STRETCH: "largest_stretch"}
    known = {name: getattr(solution, attribute, None) for name, attribute in fields.items()}
    ball = ball_of(solution, True)
    return ShownStep(
        displacement=solution.displacement,
        values={name: values for name, values in known.items() if values is not None},
        ball=ball,
        figures=figures(
            getattr(solution, "response", None), getattr(solution, "potential_energy", None), ball
        ),
    )


def figures(response: Any, energy: Any, ball: tuple[np.ndarray, float] | None) -> dict[str, str]:
    """Figures of a state in words, as far as they are known."""
    found: dict[str, str] = {}
    if ball is not None:
        places = ", ".join(f"{1e3 * c + 0.0:.1f}" for c in ball[0].round(6))
        found["probe"] = f"{places} mm".replace("-", "−")
    if response is not None and np.size(response) == 3 and ball is not None:
        size = float(np.linalg.norm(response))
        found["force on the probe"] = f"{size:.3g} N"
    if energy is not None and math.isfinite(float(energy)):
        found["energy"] = f"{1e3 * float(energy):.3g} mJ"
    return found


def unreadable(path: Path, why: str) -> FileFormatError:
    """The error of a file that can't be shown."""
    return FileFormatError(
        f"{path} can't be shown.",
        why=why,
        fix="Show a .vtu or .pvd file with tetrahedra or triangles, or the .zarr folder of a solid's sweep.",
    )
