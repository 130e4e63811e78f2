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
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import DICOM_ENDING, PART_FORMATS, part_ending, part_kind, way_for
from palpate.files import TemporaryFolder
from palpate.input_files import read_input
from palpate.physics.advice import advise
from palpate.physics.shapes.naming import require_known, require_name
from palpate.physics.shapes.packed_file import plain_file, read_part, require_counts, require_file
from palpate.physics.shapes.triangle_list import read_triangles
from palpate.processes import is_supervised

if TYPE_CHECKING:
    from trimesh import Trimesh

__all__ = [
    "FEATURE_ANGLE",
    "UNITS",
    "SurfacePatch",
    "apply_patches",
    "digest_of",
    "named_files",
    "read_with_meshio",
    "require_same",
    "require_unit",
    "segments",
    "tell_repairs",
    "tetgen_file",
]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
FEATURE_ANGLE = 40.0  # degrees between neighbouring triangles from which the edge between them is sharp
WITHIN = 60.0  # degrees from a direction within which a surface faces that way
# how files name others that are read with them
_NAMED = {
    ".xdmf": re.compile(rb">\s*([^<>:\s][^<>:\r\n]*\.(?:h5|hdf5?|hdf)):", re.I),
    ".inp": re.compile(rb"^\*\s*include\s*,\s*input\s*=\s*([^\r\n,]+)", re.I | re.M),
    ".mhd": re.compile(rb"^\s*ElementDataFile\s*=\s*([^\r\n]+)", re.I | re.M),
    ".nhdr": re.compile(rb"^data ?file:\s*([^\r\n]+)", re.I | re.M),
}
TETGEN = (".node", ".ele", ".face")  # ends of the files of one mesh
Point = tuple[float, float, float]
Corner = tuple[float | None, float | None, float | None]


def require_unit(unit: Any) -> None:
    """Refuse an unknown unit of length."""
    if unit not in UNITS:
        raise UsageError(
            f"The unit of a file is {unit!r}.",
            why=f"Units of length are {', '.join(UNITS)}.",
            fix='Pass unit="mm" if the file is in millimetres.',
        )


def named_files(path: str) -> tuple[Path, ...]:
    """Files that are read together with a file: TetGen's others, an XDMF file's or scan's numbers, a DICOM series."""
    file = Path(path)
    ending = part_ending(path)
    if file.is_dir():
        return tuple(sorted(other for other in file.iterdir() if other.is_file()))
    if ending == DICOM_ENDING:
        return tuple(sorted(other for other in file.parent.iterdir() if part_ending(other) == ending))
    if ending in TETGEN:
        return tuple(tetgen_file(path, other) for other in TETGEN if other != ending)
    if ending not in _NAMED:
        return ()
    names = dict.fromkeys(_NAMED[ending].findall(read_input(file)))
    return tuple(file.parent / name.decode("utf-8", "replace").strip(' "') for name in names)


def tetgen_file(path: str, ending: str) -> Path:
    """Return the file of TetGen's that has this ending, in any case, beside another one of the same mesh."""
    file = Path(path)
    if not file.parent.is_dir():
        return file.with_suffix(ending)
    beside = (other for other in file.parent.iterdir() if other.suffix.lower() == ending)
    return next((other for other in beside if other.stem == file.stem), file.with_suffix(ending))


@contextlib.contextmanager
def _for_meshio(path: str, content: bytes | None) -> Iterator[str]:
    """Yield the path of a file as meshio takes it; it knows endings in any case, but of TetGen's files."""
    if part_ending(path) in TETGEN and Path(path).suffix not in TETGEN:
        with TemporaryFolder() as folder:
            for ending in TETGEN:
                if (file := tetgen_file(path, ending)).is_file():
                    (folder / f"part{ending}").write_bytes(file.read_bytes())
            yield str(folder / f"part{part_ending(path)}")
    elif content is None and Path(path).suffix.lower() != ".gz":
        yield path
    else:
        with plain_file(path, content=content) as plain:
            yield plain


def digest_of(path: str) -> str:
    """Return SHA-256 of the content of a file and those that it names, as hexadecimal digits; refuse what is empty."""
    if Path(path).is_dir() and part_kind(path) == "scan":  # of DICOM slices
        content = b"a folder"
    else:
        require_file(path)
        content = Path(path).read_bytes()
    if not content.strip():
        raise FileFormatError(
            f"The file {path} is empty.", why="It has no content.", fix="Export the shape again."
        )
    digest = hashlib.sha256(content)
    for other in named_files(path):
        if other.is_file():
            digest.update(read_input(other))
    return digest.hexdigest()


def require_same(path: str, digest: str) -> None:
    """Refuse a file whose content is no longer the one that the body was made from."""
    if digest_of(path) != digest:
        raise UsageError(
            f"The file {path} has changed.",
            why="Its content is not the one that this body was made from.",
            fix="Make the body anew from the file as it is now.",
        )


def tell_repairs(path: str, notes: Sequence[str]) -> None:
    """Warn of what was repaired in a file, passed over or decided; not in a child process, whose parent has told it."""
    if not notes or is_supervised():
        return
    advise(
        f"{path} was read with repairs.",
        why=" ".join(notes),
        fix="Look whether that is meant; `notes` of the body repeats it.",
    )


def read_with_meshio(path: str, content: bytes | None = None) -> Any:
    """Return a file of a mesh, or this content in place of its own, as a `meshio.Mesh`.

    Its attribute `said` is what meshio printed while it read. FileFormatError if no reader takes it or it is corrupt.
    """
    import struct
    from xml.etree.ElementTree import ParseError

    import meshio

    if part_ending(path) not in meshio.extension_to_filetypes:
        raise FileFormatError(
            f"{path} is in none of the formats of parts and meshes.",
            why=f"Its name ends in {Path(path).suffix or 'nothing'}.",
            fix=f"Give {PART_FORMATS}. {way_for(path)}".strip(),
        )
    require_counts(path, read_part(path))
    try:
        # Where no reader takes the file, meshio prints and ends the program. Its reader of STL takes four letters
        # of an ASCII file for a count, which may overflow: no harm.
        silent = io.StringIO()
        with (
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
            np.errstate(over="ignore"),
            _for_meshio(path, content) as plain,
        ):
            mesh = meshio.read(plain)
        mesh.said = silent.getvalue()
    except ImportError as error:
        package = error.name or "h5py"
        raise UsageError(
            f"Reading {path} needs the package {package}, which is not installed.",
            why="The format keeps its numbers in files that this package reads.",
            fix=f"pip install {package}, or export the mesh as VTU or MSH.",
        ) from error
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
        RuntimeError,
        MemoryError,
        OverflowError,
    ) as error:
        raise _unreadable(path, error) from error
    return mesh


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
    """A name for a part of an imported surface: what keeps all of its bounds.

    Attributes
    ----------
    name : str
        Name that the part gets.
    lower, upper : tuple of three floats or None, optional
        Corners in m of an upright box: what has its centre inside gets the name. None is no bound along that axis,
        so ``upper=(None, None, 0.005)`` is all below 5 mm, and a corner that is left out bounds nothing.
    where : callable, optional
        In place of a box: a function of centres (n, 3) in m to bool (n,). Define it in a module, so that other
        processes find it.
    facing : tuple of three floats, optional
        Direction of the outward normal: ``(0, 0, 1)`` is all that faces up. Faces of a STEP file are cut along the
        elements of the mesh.
    within : float
        Largest angle in degrees between normal and `facing`; by default 60.
    faces : tuple of str
        Names that the file gives, or that sharp edges give: the patch is in these surfaces only.
    triangles : str
        Triangles of the surface as it is read, such as ``"0-17 25 40-80 of 5120"``: what was picked on a page. Not for
        STEP files.
    around : str
        Name of another surface: the patch is what lies around it on the same side of the body, as far as `reach`. Not
        for STEP files.
    reach : float
        Largest distance in m between the centre of a part of the patch and that of a part of the surface `around`.
    spared : tuple of str
        Surfaces that a patch around another one leaves as they are, such as those that are held.

    Raises
    ------
    UsageError
        Unless there is a bound, or where there are both a box and a function.
    """

    name: str
    lower: Corner | None = None
    upper: Corner | None = None
    where: Callable[[np.ndarray], np.ndarray] | None = None
    facing: Point | None = None
    within: float = WITHIN
    faces: tuple[str, ...] = ()
    triangles: str = field(default="", repr=False)
    around: str = ""
    reach: float = 0.0
    spared: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_name("The name of a patch", self.name)
        object.__setattr__(self, "faces", tuple(self.faces))
        if self.triangles:
            read_triangles(self.triangles)
        boxed = self.lower is not None or self.upper is not None
        places = boxed + (self.where is not None)
        if self.around:
            checks.positive("The reach of a patch around a surface", self.reach, "m")
        if places > 1 or not (
            places or self.faces or self.facing is not None or self.triangles or self.around
        ):
            raise UsageError(
                f"The patch {self.name!r} has no clear place.",
                why="It is a box, a function, a direction that it faces, surfaces of the file, or what is around "
                "another surface; a box and a function exclude each other.",
                fix="Pass lower=(x, y, z) and upper=(x, y, z), or where=function, facing=(0, 0, 1), faces=(name,).",
            )
        for corner, word in (("lower", "lower"), ("upper", "upper")):
            if (value := getattr(self, corner)) is not None:
                object.__setattr__(self, corner, _corner(f"A patch's {word} corner", value))
        if self.facing is not None:
            direction = checks.triple("The direction that a patch faces", self.facing, "")
            length = math.hypot(*direction)
            if not length:
                raise UsageError(
                    f"The direction that the patch {self.name!r} faces points nowhere.",
                    why="All of its three parts are 0.",
                    fix="Pass for example facing=(0, 0, 1) for what faces up.",
                )
            object.__setattr__(self, "facing", tuple(part / length for part in direction))
        checks.fits("The angle of a patch's normals", self.within, "degrees", above=0, most=180)

    def contains(
        self, centres: np.ndarray, normals: np.ndarray | None = None, names: np.ndarray | None = None
    ) -> np.ndarray:
        """Return which parts of a surface belong to the patch.

        Parameters
        ----------
        centres : (n, 3) array
            Centres in m.
        normals : (n, 3) array, optional
            Outward unit normals; needed for `facing`.
        names : (n,) array of str, optional
            Names of the surfaces that they are parts of; needed for `faces`.

        Returns
        -------
        (n,) bool array

        Raises
        ------
        UsageError
            If `facing` needs normals that are missing, or a surface of `faces` is not among the names.
        """
        if self.where is not None:
            inside = np.asarray(self.where(centres), dtype=bool)
        else:
            low, high = _bounds(self.lower, -np.inf), _bounds(self.upper, np.inf)
            inside = np.asarray(((centres >= low) & (centres <= high)).all(axis=1))
        if self.facing is not None:
            if normals is None:
                raise UsageError(
                    f"The patch {self.name!r} is chosen by the direction that it faces.",
                    why="No normals were given.",
                    fix="Pass the outward unit normals (n, 3).",
                )
            # a hundred-thousandth of a degree: a plane that faces just so is meant to belong
            inside = inside & (normals @ np.array(self.facing) >= np.cos(np.radians(self.within)) - 1e-7)
        if self.faces:
            given = np.full(len(centres), "") if names is None else names
            known = tuple(dict.fromkeys(given.tolist()))
            for face in self.faces:
                require_known("surface", face, known)
            inside = inside & np.array([name in self.faces for name in given.tolist()], dtype=bool)
        if self.triangles:
            inside = inside & self._listed(len(centres))
        return inside

    def surrounds(self, centres: np.ndarray, normals: np.ndarray | None, labels: np.ndarray) -> np.ndarray:
        """Return which parts (n,) lie around the surface `around`, by the names (n,) that all parts have so far.

        The back of a thin wall is near the surface too, and faces the other way: it does not belong.
        """
        from scipy.spatial import cKDTree

        middle = labels == self.around
        if not middle.any() or normals is None:
            return np.zeros(len(centres), dtype=bool)
        distance, nearest = cKDTree(centres[middle]).query(centres)
        same_side = np.einsum("ni,ni->n", normals, normals[middle][nearest]) > 0
        return np.asarray((distance <= self.reach) & same_side & ~middle & ~np.isin(labels, self.spared))

    def _listed(self, present: int) -> np.ndarray:
        """Return which of the triangles that are present (present,) stand in the list."""
        listed, count = read_triangles(self.triangles)
        if count != present:
            raise UsageError(
                f"The patch {self.name!r} was picked on a surface of {count} triangles; there are {present}.",
                why="The file has changed, or is a STEP file, whose faces are named whole.",
                fix="Pick it anew, or name it by a box, a direction or faces of the file.",
            )
        mask = np.zeros(present, dtype=bool)
        mask[listed] = True
        return mask

    def describe(self) -> dict[str, Any]:
        """Return the patch as plain data."""
        function = self.where and f"{self.where.__module__}.{self.where.__qualname__}"
        plain: dict[str, Any] = {
            "name": self.name,
            "lower": self.lower,
            "upper": self.upper,
            "where": function,
        }
        if self.facing is not None:
            plain |= {"facing": self.facing, "within": self.within}
        plain |= {"faces": self.faces} if self.faces else {}
        if self.around:
            plain |= {"around": self.around, "reach": self.reach, "spared": self.spared}
        return plain | ({"triangles": self.triangles} if self.triangles else {})


def _corner(what: str, value: Any) -> Corner:
    """Return a corner whose bounds are numbers in m or None."""
    parts = tuple(value) if isinstance(value, Iterable) else value
    if not isinstance(parts, tuple) or None not in parts:
        return checks.triple(what, parts, "m")
    numbers = checks.triple(what, tuple(0.0 if part is None else part for part in parts), "m")
    x, y, z = (None if part is None else number for part, number in zip(parts, numbers, strict=True))
    return x, y, z


def _bounds(corner: Corner | None, missing: float) -> np.ndarray:
    """Return a corner (3,) in m, infinite where it has no bound."""
    return np.array([missing if part is None else part for part in corner or (None, None, None)])


def segments(surface: Trimesh, angle: float = FEATURE_ANGLE) -> np.ndarray:
    """Number the parts of a closed surface that sharp edges bound, the largest area first.

    The surface is closed: each edge belongs to two triangles, and is sharp where their normals differ by more than
    `angle` degrees. Returns the number of each triangle's part, (t,).
    """
    from trimesh.graph import connected_component_labels

    smooth = surface.face_adjacency[surface.face_adjacency_angles < np.radians(angle)]
    label = connected_component_labels(smooth, node_count=len(surface.faces))
    areas = np.bincount(label, surface.area_faces)
    # rounded, so that equal parts keep the order of their first triangles
    rank = np.argsort(np.argsort(-np.round(areas / areas.max(), 6), kind="stable"), kind="stable")
    return np.asarray(rank[label])


def apply_patches(
    names: Sequence[str],
    index: np.ndarray,
    centres: np.ndarray,
    patches: Sequence[SurfacePatch],
    normals: np.ndarray | None = None,
) -> tuple[tuple[str, ...], np.ndarray]:
    """Give the parts inside the patches their names; a later patch goes over an earlier one.

    `index` (n,) points into `names` for each face, with `centres` (n, 3) in m and outward unit `normals` (n, 3);
    without normals no patch can be chosen by the way that it faces. Returns the names that are left, the patches'
    first, and the index into them.
    """
    label = np.array([names[i] for i in index], dtype=object)
    given = label.copy()
    for patch in patches:
        inside = patch.contains(centres, normals, given)
        if patch.around:
            inside = inside & patch.surrounds(centres, normals, label)
        if not inside.any():
            low, high = (", ".join(f"{v:.4g}" for v in f(axis=0)) for f in (centres.min, centres.max))
            raise UsageError(
                f"The patch {patch.name!r} contains no part of the surface.",
                why=f"The centres of the surface's faces lie between ({low}) and ({high}) m.",
                fix="Move or enlarge its bounds, in m.",
            )
        label[inside] = patch.name
    present = set(label)
    left = tuple(dict.fromkeys(n for n in (*[p.name for p in patches], *names) if n in present))
    position = {name: i for i, name in enumerate(left)}
    return left, np.array([position[n] for n in label], dtype=np.int64)
