"""A study of a part that somebody has: what the file holds, and settings that suit its size."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from palpate.errors import PalpateError, UsageError
from palpate.file_kinds import PART_FORMATS, part_ending, part_kind, way_for
from palpate.format import millimetres
from palpate.options import PartOptions, takes
from palpate.physics.shapes.cad_file import states_unit
from palpate.physics.shapes.labelled_mesh import CUT_FACE
from palpate.physics.shapes.mesh import BodyMesh, Face
from palpate.record_complaints import complaints
from palpate.study.part_records import PartRecord, PartShape, part_shape
from palpate.study.part_rim import with_rim
from palpate.study.part_tools import COARSE, tool_depth, under_tool
from palpate.study.probe_kind import ProbeRecord
from palpate.study.region_choices import read_labels, region_materials
from palpate.study.study import Study
from palpate.study.toml import to_toml
from palpate.tools.tool_sizes import BALL, read_tool, sizes_of
from palpate.units import parse_quantity

__all__ = ["AUTO", "part_study", "part_text", "require_suitable_ball", "study_file", "study_name"]

HELD, TOUCHED = "held", "touched"
AUTO = "auto"  # size of elements that finer solves decide
YOUNG, POISSON = 10e3, 0.45  # Pa; of soft tissue, until the user says what it is
SMALL = 5e-3  # m: a part that would be smaller in mm may have been drawn in m
# length of a plane's mean normal, and share of the height within which it is lowest
FLAT, LEVEL = 0.999, 0.02
FOOT = 0.05  # share of the box's footprint that a face has at least to stand on
HOLD = 0.12  # share of the height that is held where no flat face is below
RADIUS = 0.18  # radius of the probe over the least extent
# A press has to be seen, so it goes three quarters of the ball's radius deep; the pad takes about a quarter of that.
# Deeper than a quarter of what lies beneath, the support is felt rather than the part, and elements are crushed before
# they converge.
DEPTH, BENEATH = 0.75, 0.25  # depth over the radius, and over the part's thickness beneath the ball, at most
LARGEST = 0.3  # radius over the least extent, for a large surface, at most
CELLS = 300  # squares of an element's length on the footprint: about 15,000 unknowns, seconds a solve
PLACES = 64  # at which the thickness beneath is measured
NEAR = 1e-6  # of a triangle's size: nearer, a way meets the triangle that it begins at
COARSEST = 2.0  # element over the radius, at most, where somebody chooses it
LEAST_DEPTH = 1 / 25  # least depth over the largest
MARGIN = 3.0  # distance of places from the rim of the touched surface's box, in radii
# leading numbers to which a proposal is rounded
NICE = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
LISTED = 20  # faces that the comments name, at most


@takes(PartOptions)
def part_study(file: str | os.PathLike[str], *, options: PartOptions) -> tuple[Study, tuple[str, ...]]:
    """Return a study of a part, and what its file holds as lines of text.

    The part is held at its flat face below, or where it has none at the lowest eighth of its height; it is pressed
    where it faces up. The probe follows from its least extent; it goes three quarters of its radius deep, and no deeper
    than a quarter of the part's thickness beneath. The material is neo-Hookean.

    The `unit` is mm by default, or m where mm can't be; between 1 and 5 in numbers it has to be said.
    """
    path = Path(file)
    if not part_kind(path):
        raise UsageError(
            f"{path} is in none of the formats of parts and meshes.",
            why=f"Its name ends in {part_ending(path) or 'nothing'}.",
            fix=f"Give {PART_FORMATS}. {way_for(path)}".strip(),
        )
    is_scan, labels = part_kind(path) == "scan", read_labels(options.labels)
    if not is_scan and (labels or options.up):
        raise UsageError(
            f"--labels and --up are for scans, and {path} is none.", fix="Leave them out, or name a labelmap."
        )
    unit, faces = _read_scan(path, labels, options) if is_scan else _read(path, options.unit, options.wrap)
    low = np.min([face.lower for face in faces], axis=0)
    high = np.max([face.upper for face in faces], axis=0)
    content, named = _first_content(path, unit, faces, low, high, options)
    element, touched = content["sweep"]["element"], options.touched
    regions = _shape_of(content["body"]).regions
    poisson = POISSON if options.poisson is None else options.poisson
    materials = region_materials(options.materials, regions, poisson)
    content["body"]["materials"] = {name: entry.table for name, entry in materials.items()}
    content["varied"] = [entry.varied for entry in materials.values() if entry.varied]
    study = _study_of(content) if touched else _with_touched(content, named)
    assert isinstance(study.body, PartRecord)
    chosen = {name: length for name in ("radius", "depth") if (length := getattr(options, name)) is not None}
    require_suitable_ball(study.body, _touched_corners(study.body, touched or TOUCHED), chosen)
    study = _suit(study, content, element)
    if options.depth is None:
        study = _suit_depth(study)
    study = with_rim(study)
    if options.tool is not None:
        study = _with_tool(study, options)
    return study, tuple(_notes(path, unit, faces, regions, low, high))


def _first_content(
    path: Path,
    unit: str | None,
    faces: Sequence[Face],
    low: np.ndarray,
    high: np.ndarray,
    options: PartOptions,
) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the tables of a study under a ball, and the surfaces they name, of a part between corners (3,) in m."""
    footprint = float(np.prod((high - low)[:2]))
    radius = options.radius
    if radius is None:
        least = float((high - low).min())
        radius = _nice(min(max(RADIUS * least, math.sqrt(footprint / CELLS) / COARSE), LARGEST * least))
    element = _element_size(options.element, footprint, radius)
    deepest = _nice(DEPTH * radius) if options.depth is None else options.depth
    fixed, named = _support(faces, float(low[2]), float(high[2] - low[2]))
    if options.held:
        fixed, named = tuple(options.held), []
    content: dict[str, Any] = {
        "name": study_name(path, options.name),
        "body": {
            "kind": "part",
            "file": str(path),
            "unit": unit,
            "wrap": options.wrap,
            "labels": read_labels(options.labels),
            "up": options.up,
            "material": _material(options),
            "fixed": fixed,
            "surfaces": named,
        },
        "interaction": {
            "kind": "probe",
            "touches": options.touched or TOUCHED,
            "radius": radius,
            "depth": (_nice(LEAST_DEPTH * deepest), deepest),
        },
        "sweep": {"samples": 60, "depths": 3, "element": element},
        "test": {"samples": 24, "depths": 2},  # many places: several depths of one tell less
    }
    if part_kind(path) == "scan":  # its surfaces are as fine as what lies under the ball, and are round there
        content["body"]["element"] = element
    return content, named


def _with_tool(study: Study, options: PartOptions) -> Study:
    """Return the study of a part under the tool of the options, in place of the ball that suits the part."""
    from palpate.viewer.shown_part import require_room_for_tool, require_round_edge

    body, ball = study.body, study.interaction
    assert isinstance(body, PartRecord)
    assert isinstance(ball, ProbeRecord)
    name, tool = read_tool(options.tool or BALL, ball.radius)
    if tool is None:
        return study
    if options.radius is not None:
        raise UsageError(
            f"--radius is that of a ball, and a {name} presses.",
            fix=f'Say its sizes with it, such as --tool "{name}, {next(iter(sizes_of(tool)))} 6 mm".',
        )
    low, high = body.bare().skin.corners
    require_room_for_tool(tool, high - low)
    require_round_edge(tool)
    content = under_tool(study.model_dump(), name, tool)
    if options.element not in (None, AUTO):  # as somebody wants it
        content["sweep"]["element"] = parse_quantity(options.element, "m", "--element", bare=False)
    if options.depth is None:
        deepest = tool_depth(tool.shape, ball.depth[1])
        content["interaction"]["depth"] = (_nice(LEAST_DEPTH * deepest), deepest)
    return _study_of(content)


def _element_size(wanted: str | None, area: float, radius: float) -> float:
    """Return the size in m of elements under a ball: the one that is wanted, or by the area in m² of the part's box."""
    if wanted is None or wanted == AUTO:
        return _nice(min(math.sqrt(area / CELLS), COARSE * radius))
    size = parse_quantity(wanted, "m", "--element", bare=False)
    _require_fine_elements(size, radius, "The elements", "smaller elements")
    return size


def require_suitable_ball(body: PartRecord, touched: np.ndarray, chosen: Mapping[str, float]) -> None:
    """Refuse a ball or a depth that a part leaves no room for, and elements of its mesh that are larger than the ball.

    `chosen` holds the ``radius`` and the ``depth`` in m that a person chose, on the page or in a command; `touched` are
    the corners (t, 3, 3) of the touched triangles in m.
    """
    from palpate.viewer.shown_part import require_room

    low, high = body.bare().skin.corners
    for name, length in chosen.items():
        require_room(name, length, high - low)
    if "radius" in chosen and part_kind(body.file) == "mesh":
        size = float(np.median(np.linalg.norm(touched - np.roll(touched, 1, axis=1), axis=2)))
        _require_fine_elements(size, chosen["radius"], "The elements of the mesh", "a finer mesh")


def _require_fine_elements(size: float, radius: float, what: str, instead: str) -> None:
    if size > COARSEST * radius:
        raise UsageError(
            f"{what}, {millimetres(size)}, are larger than the ball, {millimetres(2 * radius)}.",
            fix=f"Choose a larger ball, or {instead}.",
        )


def _material(options: PartOptions) -> str | dict[str, Any]:
    """Return the material of the options: a name, or Young's modulus and Poisson's ratio."""
    if options.material is None:
        young = YOUNG if options.young is None else options.young
        poisson = POISSON if options.poisson is None else options.poisson
        return {"young": young, "poisson": poisson, "name": "neo-Hookean"}
    if options.young is not None or options.poisson is not None:
        raise UsageError(
            f"The material {options.material} has a Young's modulus and a Poisson's ratio of its own.",
            fix="Give either the name of a material, or its numbers.",
        )
    return options.material.strip().lower()


def _suit(study: Study, content: dict[str, Any], element: float) -> Study:
    """Return the study with what the touched surface asks for: larger elements of a mesh, less margin on a ring.

    A mesh is only refined, by halving, where its elements are larger than asked; so its own are kept where they are no
    larger than the ball. The places that are touched lie three radii within the surface's box; where that misses the
    surface, as in the hole of a ring, one radius has to do.
    """
    assert isinstance(study.body, PartRecord)
    acting = content["interaction"]
    corners = _touched_corners(study.body, acting["touches"])
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    kept = float(np.median(edges)) if part_kind(study.body.file) == "mesh" else 0.0
    changes: dict[str, Any] = {}
    if element < kept <= acting["radius"]:
        changes["sweep"] = content["sweep"] | {"element": _nice(1.1 * kept)}
    centres = corners.mean(axis=1)[:, :2]
    low, high = corners[:, :, :2].min(axis=(0, 1)), corners[:, :, :2].max(axis=(0, 1))

    def is_hit(margin: float) -> bool:
        inside = (centres >= low + margin) & (centres <= high - margin)
        return bool(inside.all(axis=1).any())

    if not is_hit(MARGIN * acting["radius"]) and is_hit(acting["radius"]):
        box = low + acting["radius"], high - acting["radius"]
        changes["interaction"] = acting | {"over": tuple(tuple(corner.round(4).tolist()) for corner in box)}
    if not changes:
        return study
    body = study.body.model_dump()
    return _study_of(content | changes | {"body": body})


def _touched_corners(body: PartRecord, touches: str) -> np.ndarray:
    """Return the corners (t, 3, 3) in m of the triangles of the touched surface."""
    skin = body.shape().skin
    return np.asarray(skin.points[skin.triangles_of(touches)])


def _suit_depth(study: Study) -> Study:
    """Return the study with no more depth than the part has room for beneath three quarters of what is touched."""
    acting, body = study.interaction, study.body
    assert isinstance(body, PartRecord)
    assert isinstance(acting, ProbeRecord)
    most = BENEATH * float(np.quantile(_thickness(body.shape().skin, acting.touches), 0.25))
    if most >= acting.depth[1]:
        return study
    deepest = _nice(most)
    depth = (_nice(LEAST_DEPTH * deepest), deepest)
    return study.model_copy(update={"interaction": acting.model_copy(update={"depth": depth})})


def _thickness(skin: BodyMesh, surface: str) -> np.ndarray:
    """Return how far it is (n,), in m, from places all over a surface straight through the part to its other side.

    Each place stands for an equal part of the area. The way begins at a triangle's middle, against its normal, and ends
    at the first triangle that it meets.
    """
    corners, on = skin.points[skin.triangles], skin.on(surface)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    own = np.flatnonzero(on)
    total = np.cumsum(area[own])
    own = own[np.searchsorted(total, total[-1] * (np.arange(PLACES) + 0.5) / PLACES)]
    a, edges = corners[:, 0], (corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    ways = np.empty(PLACES)
    for i, t in enumerate(own):  # Möller & Trumbore 1997
        inward = -across[t] / area[t]
        offset, side = corners[t].mean(axis=0) - a, np.cross(inward, edges[1])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # triangles along the way
            turn = 1.0 / np.einsum("ti,ti->t", side, edges[0])
            other = np.cross(offset, edges[0])
            u, v = turn * np.einsum("ti,ti->t", side, offset), turn * (other @ inward)
            way = turn * np.einsum("ti,ti->t", other, edges[1])
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (way > NEAR * np.sqrt(area[t]))
        ways[i] = way[met].min(initial=np.inf)
    return ways


def part_text(study: Study, notes: Iterable[str]) -> str:
    """Return the study of a part, and notes on its file, as a study file that lies beside the part."""
    assert isinstance(study.body, PartRecord)
    body = study.body.model_copy(update={"file": Path(study.body.file).name})
    return to_toml(study.model_copy(update={"body": body}), notes)


def _read(path: Path, unit: str | None, wrap: float | None) -> tuple[str | None, Sequence[Face]]:
    """Return the unit, and the faces of the part."""
    if unit is not None or states_unit(path):
        return unit, part_shape(str(path), unit, wrap=wrap).faces
    try:
        faces = part_shape(str(path), "mm", wrap=wrap).faces
    except UsageError as error:
        try:
            return "m", part_shape(str(path), "m", wrap=wrap).faces
        except PalpateError as other:  # a scan in metres may be in need of a wrap
            raise (other if getattr(other, "wrap", 0.0) and not error.wrap else error) from None
    low = np.min([face.lower for face in faces], axis=0)
    length = float((np.max([face.upper for face in faces], axis=0) - low).max())
    if length >= SMALL:
        return "mm", faces
    raise UsageError(
        f"The longest side of {path} is {1e3 * length:.4g} in its numbers; their unit is not known.",
        why=f"The file does not state it: {1e3 * length:.4g} mm and {1e3 * length:.4g} m are both possible.",
        fix="Say it: --unit mm, or --unit m, cm, dm, in or um.",
    )


def _read_scan(path: Path, labels: dict[str, int], options: PartOptions) -> tuple[None, Sequence[Face]]:
    """Return no unit, which a scan states, and the faces of its tissues."""
    if options.unit is not None:
        raise UsageError(f"{path} is a scan and states its lengths.", fix="Leave --unit out.")
    element = (
        None if options.element in {None, AUTO} else parse_quantity(str(options.element), "m", "--element")
    )
    return None, part_shape(str(path), element=element, labels=labels, up=options.up).faces


def _shape_of(body: Mapping[str, Any]) -> PartShape:
    """Return the shape of a body's table, with the names of its file."""
    names = ("file", "unit", "element", "wrap", "labels", "up")
    return part_shape(**{name: body[name] for name in names if body.get(name) is not None})


def _support(faces: Sequence[Face], low: float, height: float) -> tuple[str | tuple[str, ...], list[Any]]:
    """Return what is fixed, and the surfaces that this needs names for."""
    if any(face.name == CUT_FACE for face in faces):  # where a scan ends, the rest of the patient holds it
        return CUT_FACE, []
    below = [f for f in faces if f.normal[2] < -FLAT and f.upper[2] < low + LEVEL * height]
    lower, upper = (
        np.array(pick([getattr(f, end) for f in faces], axis=0))
        for pick, end in ((np.min, "lower"), (np.max, "upper"))
    )
    footprint = float(np.prod((upper - lower)[:2]))
    if sum(face.area for face in below) > FOOT * footprint:
        names = tuple(face.name for face in below)
        return (names[0] if len(names) == 1 else names), []
    top = low + HOLD * height
    digits = 3 - math.floor(math.log10(height))  # to a thousandth of the height or so
    return HELD, [{"name": HELD, "below": round(top, digits)}]


def _with_touched(content: dict[str, Any], held: list[Any]) -> Study:
    """Return the study whose touched surface faces up, or is all that is not held where nothing does."""
    failure: UsageError | None = None
    fixed = content["body"]["fixed"]
    # without a held face, all that is left would take the faces of the file, too
    kept = held or [{"name": HELD, "faces": fixed}]
    ways: tuple[tuple[dict[str, Any], list[Any], Any], ...] = (
        ({"name": TOUCHED, "facing": "up"}, held, fixed),
        ({"name": TOUCHED}, kept, fixed if held else HELD),
    )
    for touched, named, holding in ways:
        # what is held goes over what is touched
        body = content["body"] | {"surfaces": (touched, *named), "fixed": holding}
        try:
            return _study_of(content | {"body": body})
        except UsageError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _study_of(content: dict[str, Any]) -> Study:
    try:
        return Study.model_validate(content)
    except ValidationError as error:
        raise UsageError(
            f"No study of {content['body']['file']} can be made with these choices.",
            why="\n".join(f"  {line}" for line in complaints(error, Study)),
            fix="Change them; `palpate init` of the part lists its surfaces.",
        ) from error


def study_file(part: str | os.PathLike[str], name: str | None = None) -> Path:
    """Return the path of the study of a part, beside it: under a name of its own, or under that of the part."""
    return Path(part).with_name(f"{study_name(part, name)}.toml")


def study_name(part: str | os.PathLike[str], name: str | None = None) -> str:
    """Return the name of the study of a part and of its files: the one that is given, or one made of the part's."""
    if name is None:
        return _file_name(_stem(Path(part)))
    stem = name.removesuffix(".toml")
    if stem and stem == _file_name(stem):
        return stem
    raise UsageError(
        f"A study can't be called {name!r}.",
        why="Its files are named after it, and lie beside the part.",
        fix=f"Use letters, digits, dots, hyphens and underscores: {_file_name(stem)}.",
    )


def _stem(part: Path) -> str:
    """Return the name of a part's file without its endings: body of body.stl.gz."""
    return Path(part.stem).stem if part.suffix.lower() == ".gz" else part.stem


def _file_name(stem: str) -> str:
    """Return a name that files can have, made of another."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", stem).strip("-._") or "part"


def _nice(value: float) -> float:
    """Return the largest number that reads well and is no larger."""
    power = 10.0 ** math.floor(math.log10(value))
    digit = max(number for number in NICE if number <= value / power + 1e-9)
    return float(f"{digit * power:.3g}")


def _notes(
    path: Path,
    unit: str | None,
    faces: Sequence[Face],
    regions: tuple[str, ...],
    low: np.ndarray,
    high: np.ndarray,
) -> Iterator[str]:
    taken = "" if unit is None else f", numbers taken as {unit}"
    size = " × ".join(f"{1e3 * side:.4g}" for side in high - low)
    yield ""
    yield f"The part {path.name}{taken}: {size} mm, from {_millimetres(low)} to {_millimetres(high)}."
    yield f"Regions: {', '.join(regions)}."
    yield "Left to palpate, the ball goes three quarters of its radius deep, at most a quarter of what lies beneath."
    yield "Surfaces of the file; [[body.surfaces]] gives names to other parts of the surface:"
    ordered = sorted(faces, key=lambda face: -face.area)
    for face in ordered[:LISTED]:
        length = float(np.linalg.norm(face.normal))
        facing = "facing all ways" if length < 0.1 else f"facing {_direction(face.normal)}"
        yield f"  {face.name}: {1e6 * face.area:.4g} mm² around {_millimetres(face.centre)}, {facing}"
    if len(ordered) > LISTED:
        yield f"  and {len(ordered) - LISTED} smaller ones"


def _millimetres(values: Any) -> str:
    return f"({', '.join(f'{_clean(1e3 * float(value), 4)}' for value in values)}) mm"


def _direction(normal: tuple[float, float, float]) -> str:
    """Return a direction as an axis, where it is one, else its parts."""
    axis = int(np.argmax(np.abs(normal)))
    if abs(normal[axis]) > FLAT:
        sign = "+" if normal[axis] > 0 else "-"
        return {"+z": "up", "-z": "down"}.get(sign + "xyz"[axis], sign + "xyz"[axis])
    return f"({', '.join(_clean(float(value), 2) for value in normal)})"


def _clean(value: float, digits: int) -> str:
    return f"{0.0 if abs(value) < 1e-9 else value:.{digits}g}"
