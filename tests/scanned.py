"""Labelmaps of a ball in a ball, whose volumes and places are known, as files of scans."""

from pathlib import Path

import numpy as np
import SimpleITK

OUTER, INNER, UP = 20.0, 10.0, 5.0  # mm: radii, and how far the inner ball lies above the middle


def write_labels(path, labels, spacing=(1.0, 1.0, 1.0), axes=None, origin=None):
    """Write labels (i, j, k) with sizes of voxels in mm; return the path."""
    axes = np.eye(len(spacing)) if axes is None else axes
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(np.asarray(labels).T), isVector=False)
    image.SetSpacing([float(s) for s in spacing])
    image.SetDirection(np.asarray(axes, dtype=float).ravel().tolist())
    image.SetOrigin((np.zeros(len(spacing)) if origin is None else origin).tolist())
    SimpleITK.WriteImage(image, str(path))
    return Path(path)


def write_series(folder, path):
    """Write the slices of a labelmap's file as a DICOM series into a folder; return the folder."""
    image = SimpleITK.Cast(SimpleITK.ReadImage(str(path)), SimpleITK.sitkUInt8)
    Path(folder).mkdir()
    writer = SimpleITK.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    rows = np.array(image.GetDirection()).reshape(3, 3).T
    for k in range(image.GetSize()[2]):
        piece = image[:, :, k]
        header = {
            "0008|0060": "OT",
            "0008|0018": f"1.2.3.4.{k}",
            "0020|000d": "1.2.3",
            "0020|000e": "1.2.3.4",
            "0020|0032": "\\".join(map(str, image.TransformIndexToPhysicalPoint((0, 0, k)))),
            "0020|0037": "\\".join(f"{value:.12f}" for value in rows[:2].ravel()),
        }
        for key, value in header.items():
            piece.SetMetaData(key, value)
        # names in another order than the slices
        writer.SetFileName(str(Path(folder) / f"{(7 * k) % 101:03d}.dcm"))
        writer.Execute(piece)
    return Path(folder)


def ball_in_ball(path, spacing=(2.0, 2.0, 2.0), axes=None):
    """Write fat, 1, with a lump in it, 2; the middle of the outer ball is the origin, whatever the axes."""
    axes, spacing = np.eye(3) if axes is None else axes, np.asarray(spacing)
    counts = np.ceil(2 * (OUTER + 3 * spacing) / spacing).astype(int)
    along = [(np.arange(n) - n / 2 + 0.5) * s for n, s in zip(counts, spacing, strict=True)]
    places = np.stack(np.meshgrid(*along, indexing="ij"), axis=-1) @ axes.T
    labels = np.zeros(counts, np.uint8)
    labels[np.linalg.norm(places, axis=-1) < OUTER] = 1
    labels[np.linalg.norm(places - [0, 0, UP], axis=-1) < INNER] = 2
    return write_labels(path, labels, spacing, axes, axes @ np.array([line[0] for line in along]))
