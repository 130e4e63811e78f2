"""Labelmaps as DICOM series: a folder of slices, or a slice among its series, read by ITK as a volume."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import UsageError

__all__ = ["read_series"]

UNEVEN = 0.02  # share of the distance between slices by which rounded positions in the header may vary
SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66.4"  # class of objects whose frames hold a segment each
CLASS, POSITION, ROWS = "0008|0016", "0020|0032", "0020|0037"
# tags of the size of a pixel: of a scanner, of a detector, of a print
PIXEL = ("0028|0030", "0018|1164", "0018|2010")
EXPORT = "Export one labelmap as NRRD or NIfTI; in 3D Slicer: Export to files, as a labelmap."


def read_series(path: Path) -> Any:
    """Return the `SimpleITK.Image` of the series in a folder, or of the one that a slice belongs to."""
    import SimpleITK

    folder = path if path.is_dir() else path.parent
    finder: Any = SimpleITK.ImageSeriesReader
    series = {
        name: finder.GetGDCMSeriesFileNames(str(folder), name)
        for name in finder.GetGDCMSeriesIDs(str(folder))
    }
    if not path.is_dir():
        mine = path.resolve()
        series = {key: files for key, files in series.items() if mine in {Path(f).resolve() for f in files}}
    if len(series) != 1:
        listed = ", ".join(f"{len(files)} files from {Path(files[0]).name}" for files in series.values())
        raise UsageError(
            f"{path} holds {len(series) or 'no'} DICOM series.",
            why=f"They are {listed}; a body is made from one."
            if series
            else "ITK finds no DICOM images in it.",
            fix="Name a file of the series that is meant." if series else "Name a folder of DICOM slices.",
        )
    (files,) = series.values()
    places = np.array([_position(path, file) for file in files])
    order = np.argsort(places, kind="stable")  # ITK leaves oblique slices in the order of their names
    files = tuple(files[k] for k in order)
    if len(files) > 1:
        _require_even(path, files, places[order])
    reader = finder()
    reader.SetFileNames(files)
    return reader.Execute()


def _position(path: Path, file: str) -> float:
    """Return where a slice is along its normal, in mm; refuse what states no size, and segments as frames."""
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetFileName(file)
    reader.ReadImageInformation()
    stated = {key: reader.GetMetaData(key).strip() for key in reader.GetMetaDataKeys()}
    if stated.get(CLASS) == SEGMENTATION:
        raise UsageError(
            f"{Path(file).name} is a DICOM segmentation object.",
            why="Its frames hold a segment each, and ITK would take all of them for slices of one body.",
            fix=f"{EXPORT} dcmqi's segimage2itkimage does so, too.",
        )
    if not any(stated.get(key) for key in PIXEL):
        raise UsageError(
            f"{path} does not state the size of its voxels.",
            why=f"The header of {Path(file).name} has no pixel spacing, so that the body's size is not known.",
            fix="Save it again with the spacing in mm, in the program that made it.",
        )
    place, rows = (np.array(stated.get(key, "0").split("\\"), dtype=float) for key in (POSITION, ROWS))
    return float(np.cross(rows[:3], rows[3:]) @ place) if (len(place), len(rows)) == (3, 6) else 0.0


def _require_even(path: Path, files: tuple[str, ...], places: np.ndarray) -> None:
    """Refuse a series with a gap, or two slices at one place, which ITK would take as evenly spaced."""
    steps = np.diff(places)
    usual = float(np.median(steps))
    worst = int(np.abs(steps - usual).argmax())
    if abs(steps[worst] - usual) > UNEVEN * usual or usual <= 0:
        raise UsageError(
            f"The slices of {path} are not evenly spaced.",
            why=f"From {Path(files[worst]).name} to {Path(files[worst + 1]).name}, slices {worst + 1} and {worst + 2}, "
            f"it is {steps[worst]:.3g} mm, and {usual:.3g} mm between others: a slice is missing or there twice.",
            fix=f"Complete the folder. {EXPORT}",
        )
