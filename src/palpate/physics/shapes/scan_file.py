"""Labelmaps of segmented scans: NRRD, NIfTI and MetaImage files, DICOM series, as voxels with their tissues.

LabelImage    labels, size of a voxel, directions and origin, in m
read_scan     reads a file by SimpleITK, in a child process
name_labels   names for the numbers: those that are asked for, else those of the file
clear_specks  removes specks and fills pinholes, and tells of islands
"""

from __future__ import annotations

import gzip
import math
import re
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import DICOM_ENDING, SCAN_ENDINGS, part_ending
from palpate.format import millimetres
from palpate.physics.shapes.dicom_series import read_series
from palpate.physics.shapes.naming import plain_name
from palpate.supervised import read_in_child

__all__ = ["LabelImage", "clear_specks", "name_labels", "read_scan"]

MOST_LABELS = 64  # different numbers that a labelmap of tissues has at most; an image of grey values has more
SPECK = 8  # voxels: pieces of fewer are noise of the segmentation, and no mesh can hold them
PLACED = 0.1  # of a voxel: placements that are nearer are the same
UNCLEAR = np.iinfo(np.int32).min  # stands for no label while specks are given away
LISTED = 12  # numbers that a message names, at most
HEAD = 65_536  # bytes at a file's beginning among which its header states the size of a voxel
# the line by which a header states the size of a voxel; NIfTI's header always has the field
SPACING = {
    **dict.fromkeys((".nrrd", ".nhdr"), re.compile(rb"^(spacings|space directions):", re.M | re.I)),
    **dict.fromkeys((".mha", ".mhd"), re.compile(rb"^\s*Element(Spacing|Size)\s*=", re.M | re.I)),
}
SEGMENT = re.compile(r"Segment(\d+)_(Name|LabelValue)$")


@dataclass(frozen=True, eq=False)
class LabelImage:
    """Labels of voxels, and where they lie: left, posterior and superior of the patient are x, y and z."""

    labels: np.ndarray  # (i, j, k) number of the tissue of each voxel; 0 is no body
    spacing: np.ndarray  # (3,) size of a voxel along i, j and k, m
    axes: np.ndarray  # (3, 3) unit directions of i, j and k in its columns
    origin: np.ndarray  # (3,) centre of the first voxel, m
    names: dict[str, int]  # of the labels that belong to the body
    notes: tuple[str, ...] = ()  # a sentence about each thing that was passed over, removed or decided

    def with_notes(self, *notes: str) -> LabelImage:
        """Return the same image with further notes."""
        return replace(self, notes=(*self.notes, *notes))

    @property
    def volumes(self) -> dict[str, float]:
        """Volume of the voxels of each named label, m³."""
        voxel = float(np.prod(self.spacing))
        return {name: voxel * int((self.labels == number).sum()) for name, number in self.names.items()}


def read_scan(path: str) -> LabelImage:
    """Return the labelmap of a file, with the names of segments that the file states.

    Lengths become m. NIfTI's axes, which point to right, anterior and superior, are turned to left, posterior and
    superior, as the other formats have them. UsageError if it is no labelmap of a volume or states no size of a voxel.
    """
    if find_spec("SimpleITK") is None:
        raise UsageError(
            f"Reading {path} needs the package SimpleITK, which is not installed.",
            fix="pip install 'palpate[scan]'.",
        )
    _require_spacing(path)
    file = Path(path)
    if part_ending(path) == DICOM_ENDING and file.is_file():
        # time and memory that reading may take are those of all slices
        return read_in_child(_read, file.parent, file.name)
    return read_in_child(_read, file)


def _require_spacing(path: str) -> None:
    """Refuse a header without the size of a voxel, which readers would take as 1 mm."""
    pattern = SPACING.get(part_ending(path))
    if pattern is None:
        return
    opener = gzip.open if path.lower().endswith(".gz") else open
    try:
        with opener(path, "rb") as file:
            head = file.read(HEAD)
    except (OSError, EOFError) as error:
        raise FileFormatError(f"{path} can't be read.", why=str(error), fix="Export it again.") from error
    if not pattern.search(head):
        raise UsageError(
            f"{path} does not state the size of its voxels.",
            why="Its header has no spacing, so that the body's size is not known.",
            fix="Save it again with the spacing in mm, in the program that made it.",
        )


def _read(path: Path, name: str = "") -> LabelImage:
    """Return the content of a file, or of the series in a folder: for the child process in which ITK runs.

    `name` is that of a slice in the folder, whose series is meant.
    """
    import SimpleITK

    SimpleITK.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        image = read_series(path / name) if path.is_dir() else SimpleITK.ReadImage(str(path))
    except RuntimeError as error:
        said = str(error).strip().rpartition("\n")[2].strip() or "ITK reports an error"
        raise FileFormatError(
            f"The file {path} can't be read as a scan.",
            why=f"It is corrupt, cut short or of another format than its name says ({said}).",
            fix=f"Open it in the program that made it and export it again as {' or '.join(SCAN_ENDINGS[:2])}.",
        ) from error
    labels = np.ascontiguousarray(SimpleITK.GetArrayFromImage(image).T)
    _require_volume(path, image, labels)
    labels = _whole_numbers(path, labels)
    spacing = 1e-3 * np.array(image.GetSpacing()[:3])
    axes = np.array(image.GetDirection()).reshape(image.GetDimension(), -1)[:3, :3]
    if not (np.isfinite(spacing).all() and (spacing > 0).all() and abs(np.linalg.det(axes)) > 0.5):
        raise UsageError(
            f"The voxels of {path} have no volume.",
            why=f"Their sizes are {', '.join(map(millimetres, spacing))}, their axes {axes.T.round(3).tolist()}.",
            fix="Save it again with its spacing and directions, in the program that made it.",
        )
    header = {key: image.GetMetaData(key) for key in image.GetMetaDataKeys()}
    origin = 1e-3 * np.array(image.GetOrigin()[:3])
    return LabelImage(
        labels, spacing, axes, origin, _segment_names(header), _nifti_notes(header, labels.shape)
    )


def _nifti_notes(header: dict[str, str], shape: tuple[int, ...]) -> tuple[str, ...]:
    """Return a sentence where the two placements that a NIfTI header can state put a corner of the image apart."""
    if "0" in {header.get("qform_code", "0"), header.get("sform_code", "0")}:
        return ()
    x, y, z = (float(header[f"quatern_{letter}"]) for letter in "bcd")
    w = math.sqrt(max(0.0, 1.0 - x * x - y * y - z * z))
    turn = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w + y * y - x * x - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w + z * z - x * x - y * y],
        ]
    )
    size = np.array([float(header[f"pixdim[{d}]"]) for d in (1, 2, 3)])
    linear = np.array([[float(word) for word in header[f"srow_{axis}"].split()] for axis in "xyz"])
    offset = np.array([float(header[f"qoffset_{axis}"]) for axis in "xyz"])
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in shape], indexing="ij"), axis=-1).reshape(-1, 3)
    # ITK hides the sign of the quaternion's third axis: it is taken to be as left-handed as the other placement
    size[2] *= np.sign(np.linalg.det(linear[:, :3]))
    apart = ends @ (linear[:, :3] - turn * size).T + linear[:, 3] - offset
    far = float(np.linalg.norm(apart, axis=1).max())
    if far <= PLACED * float(np.abs(size).min()):
        return ()
    return (
        f"The header's sform and qform put a corner of the image {far:.3g} mm ({far / np.abs(size).min():.2g} voxels) "
        "apart; ITK's choice was taken, the sform unless it is skew.",
    )


def _require_volume(path: Path, image: object, labels: np.ndarray) -> None:
    """Refuse colours, series in time, and planes."""
    parts = image.GetNumberOfComponentsPerPixel()  # type: ignore[attr-defined]  # ITK's own type
    size = " × ".join(map(str, image.GetSize()))  # type: ignore[attr-defined]
    if parts == 1 and labels.ndim == 3 and min(labels.shape) > 1:
        return
    if parts > 1:
        what, why = f"holds {parts} numbers for each voxel", "Colours, vectors and overlapping segments do so"
    elif labels.ndim > 3:
        what, why = f"has {labels.ndim} dimensions, {size}", "It is a series, or holds segments that overlap"
    else:
        what, why = f"is a plane of {size} voxels", "A body has a volume"
    raise UsageError(
        f"{path} {what}.",
        why=f"{why}; one whole number for each voxel of a volume is needed.",
        fix="Export one labelmap of three dimensions; in 3D Slicer: Export to files, as a labelmap.",
    )


def _whole_numbers(path: Path, labels: np.ndarray) -> np.ndarray:
    """Return the labels as whole numbers; refuse grey values and probabilities."""
    numbers = np.unique(labels)
    if len(numbers) <= MOST_LABELS and np.array_equal(numbers, np.round(numbers)):
        return labels.astype(np.int32)
    raise UsageError(
        f"{path} is no labelmap.",
        why=f"It holds {len(numbers)} different values from {numbers[0]:g} to {numbers[-1]:g}: those of a scan itself, "
        f"or probabilities. A labelmap has a whole number for each tissue, {MOST_LABELS} at most.",
        fix="Segment the scan first, and give the labelmap.",
    )


def _segment_names(header: dict[str, str]) -> dict[str, int]:
    """Return the names of segments that 3D Slicer writes into headers, with their numbers."""
    said: dict[str, dict[str, str]] = {}
    for key, value in header.items():
        if match := SEGMENT.search(key):
            said.setdefault(match[1], {})[match[2]] = value.strip()
    return {
        plain_name(entry["Name"]): int(entry["LabelValue"])
        for entry in said.values()
        if entry.keys() == {"Name", "LabelValue"} and entry["LabelValue"].isdigit()
    }


def name_labels(path: str, image: LabelImage, wanted: dict[str, int]) -> LabelImage:
    """Return the image with these names; other labels are no part of the body.

    Without any, all labels belong to it: by the names that the file states, else as ``label 1``, ``label 2``, ….
    """
    numbers, counts = np.unique(image.labels, return_counts=True)
    present = {int(n): int(count) for n, count in zip(numbers, counts, strict=True) if n}
    listed = ", ".join(f"{n} ({count} voxels)" for n, count in list(present.items())[:LISTED]) or "none"
    if not present:
        raise UsageError(
            f"{path} is empty.", why="All of its voxels are 0, which is no body.", fix="Export it again."
        )
    if not wanted:
        stated = {number: name for name, number in image.names.items()}
        wanted = {stated.get(number, f"label {number}"): number for number in present}
        return replace(image, names=wanted)
    for name, number in wanted.items():
        if number not in present:
            raise UsageError(
                f"The label {name}={number} is empty.",
                why=f"No voxel of {path} has the number {number}; it has {listed}.",
                fix="Give the numbers that the labelmap has.",
            )
    left = {number: count for number, count in present.items() if number not in wanted.values()}
    told = [
        f"{count} voxels of the label {number} have no name and were left out."
        for number, count in left.items()
    ]
    kept = np.where(np.isin(image.labels, list(wanted.values())), image.labels, 0).astype(np.int32)
    return replace(image, labels=kept, names=wanted).with_notes(*told)


def clear_specks(image: LabelImage) -> LabelImage:
    """Return the image without specks of any label, pinholes among them: each takes the label that is next to it.

    Specks are pieces of fewer than 8 voxels. Larger pieces beside the largest of a label are kept and told.
    """
    from scipy import ndimage

    unclear = [np.empty((0, 3), dtype=int)]
    told = []
    voxel = float(np.prod(image.spacing))
    for name, number in {**image.names, "": 0}.items():
        mask = image.labels == number
        first = np.zeros(3, dtype=int)
        if number:  # what surrounds its box can't belong to it
            box = ndimage.find_objects(mask.astype(np.uint8))[0]
            mask, first = mask[box], np.array([side.start for side in box])
        else:  # outside all is one piece of 0
            mask, first = np.pad(mask, 1, constant_values=True), first - 1
        pieces, count = ndimage.label(mask)
        sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
        small = sizes < min(SPECK, sizes.max())
        if small.any():
            unclear.append(np.argwhere(np.concatenate([[False], small])[pieces]) + first)
            what = f"{int(small.sum())} specks of {name!r}" if name else f"{int(small.sum())} pinholes"
            told.append(
                f"{what} ({int(sizes[small].sum())} voxels in all) were given to what surrounds them."
            )
        islands = np.sort(sizes[~small])[::-1][1:]
        if len(islands):
            what = (
                f"{name!r} has {len(islands)} islands"
                if name
                else f"The body has {len(islands)} holes inside"
            )
            size = f"{int(islands[0])} voxels, {1e9 * voxel * int(islands[0]):.3g} mm³"
            told.append(
                f"{what} beside its largest piece, the largest of {size}; they were kept."
                if name
                else f"{what}, the largest of {size}; they were kept."
            )
    return _give_away(image, np.concatenate(unclear)).with_notes(*told)


def _give_away(image: LabelImage, unclear: np.ndarray) -> LabelImage:
    """Return the image whose unclear voxels (n, 3) have each the label of the nearest clear one.

    It shares a face with an unclear one: a step towards the voxel that it is nearest to leads to none that is clear.
    """
    from scipy.spatial import KDTree

    if not len(unclear):
        return image
    around = np.concatenate([unclear + step for step in (*np.eye(3, dtype=int), *-np.eye(3, dtype=int))])
    around = np.unique(around[((around >= 0) & (around < image.labels.shape)).all(axis=1)], axis=0)
    labels = image.labels.copy()
    labels[tuple(unclear.T)] = UNCLEAR
    clear = around[labels[tuple(around.T)] != UNCLEAR]
    nearest = KDTree(clear * image.spacing).query(unclear * image.spacing)[1]
    labels[tuple(unclear.T)] = labels[tuple(clear[nearest].T)]
    return replace(image, labels=labels)
