"""A case of soft-touch whose forces are known: a ball on a half-space with the energy k(x, y) s^2.5/2.5."""

from __future__ import annotations

import csv

import numpy as np

RADIUS = 0.01  # m
STIFF, SLOPE = 1500.0, 4000.0  # N/m^1.5, and its slope along x, N/m^2.5


MESH = """<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 -1 1 0 -1 0 1 -1 0 0 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3</DataArray></Cells>
<CellData><DataArray type="Int64" Name="label" format="ascii">0</DataArray></CellData>
<PointData><DataArray type="Int64" Name="fixed" format="ascii">1 1 1 0</DataArray></PointData>
</Piece></UnstructuredGrid></VTKFile>"""  # one tetrahedron that ends at the surface


def energy(places, slope=SLOPE):
    depth = np.maximum(RADIUS - places[:, 2], 0.0)
    return (STIFF + slope * places[:, 0]) * depth**2.5 / 2.5


def force(places, slope=SLOPE):
    depth = np.maximum(RADIUS - places[:, 2], 0.0)
    stiff = STIFF + slope * places[:, 0]
    return np.stack([-slope * depth**2.5 / 2.5, 0.0 * depth, stiff * depth**1.5], axis=1)


def loop(radius=0.004, corners=72, depth=0.003):
    """Corners (n, 3) of a regular polygon, tilted so that depth and stiffness change along it."""
    t = 2 * np.pi * np.arange(corners) / corners
    return np.stack(
        [radius * np.cos(t), radius * np.sin(t), RADIUS - depth + 0.0005 * (1 - np.cos(t))], axis=1
    )


def write_case(folder, slope=SLOPE):
    """Write a case of four paths with five depths, and one closed path."""
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(
        'title = "half-space"\n[ball]\nradius = 0.01\n[materials.soft]\nyoung = 9000.0\npoisson = 0.45\n',
        "utf-8",
    )
    (folder / "mesh.vtu").write_text(MESH, "utf-8")
    touched = np.repeat(np.random.default_rng(3).uniform(-0.01, 0.01, (4, 2)), 5, axis=0)
    depth = np.tile(np.linspace(0.001, 0.005, 5), 4)
    places = np.column_stack([touched, RADIUS - depth])
    forces = force(places, slope)
    kn = 1.5 * (STIFF + slope * places[:, 0]) * np.sqrt(depth)
    head = "press path step x y z nx ny nz depth"
    rows = [
        (i, i // 5, i % 5, *place, 0, 0, 1, d) for i, (place, d) in enumerate(zip(places, depth, strict=True))
    ]
    write_rows(folder / "presses.csv", head, rows)
    head = "press fx fy fz kn energy force_error stiffness_error energy_error"
    values = zip(forces, kn, energy(places, slope), strict=True)
    write_rows(folder / "oracle.csv", head, [(i, *f, k, e, 0, 0, 0) for i, (f, k, e) in enumerate(values)])
    rows = [(0, i, *place) for i, place in enumerate(loop())]
    write_rows(folder / "loops.csv", "loop index x y z", rows)
    return folder


def write_rows(path, head, rows):
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head.split())
        writer.writerows(rows)
