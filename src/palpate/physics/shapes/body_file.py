"""Files of bodies: their unit and content, and names for parts of the surfaces that they hold.

digest_of, require_same   the body is the file's content, not its name
read_with_meshio          meshes and surfaces of other tools
segments                  parts of a surface between sharp edges
SurfacePatch              a part of a surface, chosen by a box or a function
"""

from __future__ import annotations

import contextlib
import hashlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import FileFormatError, UsageError
from palpate.physics.shapes.naming import require_name

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = [
    "FEATURE_ANGLE",
    "UNITS",
    "SurfacePatch",
    "apply_patches",
    "digest_of",
    "read_with_meshio",
    "require_same",
    "require_unit",
    "segments",
]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
FEATURE_ANGLE = 40.0  # degrees between neighbouring triangles from which the edge between them is sharp
Point = tuple[float, float, float]


def require_unit(unit: Any) -> None:
    """Refuse an unknown unit of length."""
    if unit not in UNITS:
        raise UsageError(
            f"The unit of a file is {unit!r}.",
            why=f"Units of length are {', '.join(UNITS)}.",
            fix='Pass unit="mm" if the file is in millimetres.',
        )


def digest_of(path: str) -> str:
    """SHA-256 of a file's content, as hexadecimal digits.

    Raises
    ------
    UsageError
        If there is no such file.
    FileFormatError
        If it is empty.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise UsageError(
            f"The file {path} can't be read.",
            why=f"{error.strerror}.",
            fix="Check the path; a relative one starts from the directory of the running program.",
        ) from error
    if not content.strip():
        raise FileFormatError(
            f"The file {path} is empty.", why="It has no content.", fix="Export the shape again."
        )
    return hashlib.sha256(content).hexdigest()


def require_same(path: str, digest: str) -> None:
    """Refuse a file whose content is no longer the one that the body was made from."""
    if digest_of(path) != digest:
        raise UsageError(
            f"The file {path} has changed.",
            why="Its content is not the one that this body was made from.",
            fix="Make the body anew from the file as it is now.",
        )


def read_with_meshio(path: str) -> Any:
    """Read a file of a mesh.

    Returns
    -------
    meshio.Mesh

    Raises
    ------
    FileFormatError
        If the format is unknown or the file corrupt.
    """
    import struct
    from xml.etree.ElementTree import ParseError

    import meshio

    try:
        # Where no reader takes the file, meshio prints and ends the program. Its reader of STL takes four letters
        # of an ASCII file for a count, which may overflow: no harm.
        silent = io.StringIO()
        with (
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
            np.errstate(over="ignore"),
        ):
            return meshio.read(path)
    except (meshio.ReadError, SystemExit, struct.error, ParseError) as error:
        raise _unreadable(path, error) from error
    except (
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AssertionError,
        AttributeError,
        OSError,
        EOFError,
    ) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: str, error: BaseException) -> FileFormatError:
    said = str(error).strip() or type(error).__name__
    said = "no reader of meshio takes it" if isinstance(error, SystemExit) else said
    return FileFormatError(
        f"The file {path} can't be read as a mesh.",
        why=f"It is corrupt, cut short or of another format than its name says ({said}).",
        fix="Open it in the program that made it and export it again, as VTU, MSH or STL for example.",
    )


@dataclass(frozen=True)
class SurfacePatch:
    """A name for a part of an imported surface.

    Attributes
    ----------
    name : str
        Name that the part gets.
    lower, upper : tuple of three floats, optional
        Corners in m of an upright box: what has its centre inside gets the name.
    where : callable, optional
        In place of a box: a function of centres (n, 3) in m to bool (n,). Define it in a module, so that other
        processes find it.

    Raises
    ------
    UsageError
        Unless there is either a box or a function.
    """

    name: str
    lower: Point | None = None
    upper: Point | None = None
    where: Callable[[np.ndarray], np.ndarray] | None = None

    def __post_init__(self) -> None:
        require_name("The name of a patch", self.name)
        boxed = self.lower is not None and self.upper is not None
        if boxed == (self.where is not None) or (self.lower is None) != (self.upper is None):
            raise UsageError(
                f"The patch {self.name!r} has no clear place.",
                why="It is either a box of two corners or a function.",
                fix="Pass lower=(x, y, z) and upper=(x, y, z), or where=function.",
            )
        if boxed:
            object.__setattr__(self, "lower", checks.triple("A patch's lower corner", self.lower, "m"))
            object.__setattr__(self, "upper", checks.triple("A patch's upper corner", self.upper, "m"))

    def contains(self, centres: np.ndarray) -> np.ndarray:
        """Mask (n,) of the centres (n, 3) in m that belong to the patch."""
        if self.where is not None:
            return np.asarray(self.where(centres), dtype=bool)
        return np.asarray(((centres >= self.lower) & (centres <= self.upper)).all(axis=1))

    def describe(self) -> dict[str, Any]:
        """Return the patch as plain data."""
        function = self.where and f"{self.where.__module__}.{self.where.__qualname__}"
        return {"name": self.name, "lower": self.lower, "upper": self.upper, "where": function}


def segments(surface: Trimesh, angle: float = FEATURE_ANGLE) -> np.ndarray:
    """Number the parts of a closed surface that sharp edges bound, the largest area first.

    Parameters
    ----------
    surface : trimesh.Trimesh
        A closed one: each edge belongs to two triangles.
    angle : float
        In degrees; an edge is sharp where the normals of its two triangles differ by more.

    Returns
    -------
    (t,) int array
        Number of each triangle's part.
    """
    from trimesh.graph import connected_component_labels

    smooth = surface.face_adjacency[surface.face_adjacency_angles < np.radians(angle)]
    label = connected_component_labels(smooth, node_count=len(surface.faces))
    areas = np.bincount(label, surface.area_faces)
    # rounded, so that equal parts keep the order of their first triangles
    rank = np.argsort(np.argsort(-np.round(areas / areas.max(), 6), kind="stable"), kind="stable")
    return np.asarray(rank[label])


def apply_patches(
    names: Sequence[str], index: np.ndarray, centres: np.ndarray, patches: Sequence[SurfacePatch]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Give the parts inside the patches their names; a later patch goes over an earlier one.

    Parameters
    ----------
    names : sequence of str
        Names of the parts.
    index : (n,) int array
        Index into `names` for each face.
    centres : (n, 3) array
        Centres of the faces, m.
    patches : sequence of SurfacePatch
        Names to give, and where.

    Returns
    -------
    names : tuple of str
        Names that are left, the patches' first.
    index : (n,) int array
        Index into them for each face.

    Raises
    ------
    UsageError
        If a patch contains nothing.
    """
    label = np.array([names[i] for i in index], dtype=object)
    for patch in patches:
        inside = patch.contains(centres)
        if not inside.any():
            low, high = (", ".join(f"{v:.4g}" for v in f(axis=0)) for f in (centres.min, centres.max))
            raise UsageError(
                f"The patch {patch.name!r} contains no part of the surface.",
                why=f"The centres of the surface's faces lie between ({low}) and ({high}) m.",
                fix="Move or enlarge its box, in m.",
            )
        label[inside] = patch.name
    present = set(label)
    left = tuple(dict.fromkeys(n for n in (*[p.name for p in patches], *names) if n in present))
    position = {name: i for i, name in enumerate(left)}
    return left, np.array([position[n] for n in label], dtype=np.int64)
