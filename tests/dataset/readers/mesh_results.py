"""Small files in other solvers' formats, written as their makers publish them: two bricks, a temperature, two times."""

from __future__ import annotations

from pathlib import Path

import numpy as np

TIMES = (0.5, 1.0)
POINTS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
BRICKS = np.array([(0, 1, 4, 3, 6, 7, 10, 9), (1, 2, 5, 4, 7, 8, 11, 10)])


def temperature(time: float) -> np.ndarray:
    """Temperature at the nodes."""
    return 300.0 + 10.0 * time * POINTS[:, 0] + POINTS[:, 2]


def displacement(time: float) -> np.ndarray:
    """Displacement of the nodes."""
    return time * POINTS * [0.1, -0.02, 0.03]


def write_exodus(path: Path) -> Path:
    """Exodus II in NetCDF 3, by SciPy: an element block of HEX8 and four nodal variables."""
    from scipy.io import netcdf_file

    names = ("T", "u_x", "u_y", "u_z")
    sizes = {"len_string": 33, "len_line": 81, "four": 4, "len_name": 33, "num_dim": 3, "num_el_blk": 1}
    sizes |= {
        "num_nodes": len(POINTS),
        "num_elem": 2,
        "num_el_in_blk1": 2,
        "num_nod_per_el1": 8,
        "num_nod_var": 4,
    }
    with netcdf_file(path, "w", version=2) as file:
        file.createDimension("time_step", None)
        for name, size in sizes.items():
            file.createDimension(name, size)
        for key, value in (("api_version", 5.0), ("version", 5.0)):
            setattr(file, key, np.float32(value))
        file.floating_point_word_size, file.file_size = np.int32(8), np.int32(1)
        file.title = "two bricks"

        def put(name, kind, dims, values):
            variable = file.createVariable(name, kind, dims)
            variable[:] = values
            return variable

        put("eb_status", "i", ("num_el_blk",), [1])
        put("eb_prop1", "i", ("num_el_blk",), [1]).name = "ID"
        for i, axis in enumerate("xyz"):
            put(f"coord{axis}", "d", ("num_nodes",), POINTS[:, i])
        put("connect1", "i", ("num_el_in_blk1", "num_nod_per_el1"), BRICKS + 1).elem_type = "HEX8"
        texts = np.array([list(name.ljust(33, "\0")) for name in names], dtype="S1")
        put("name_nod_var", "c", ("num_nod_var", "len_name"), texts)
        whole = file.createVariable("time_whole", "d", ("time_step",))
        values = [
            file.createVariable(f"vals_nod_var{i + 1}", "d", ("time_step", "num_nodes")) for i in range(4)
        ]
        for step, time in enumerate(TIMES):
            whole[step] = time
            for variable, numbers in zip(values, (temperature(time), *displacement(time).T), strict=True):
                variable[step] = numbers
    return path


def write_ensight(path: Path) -> Path:
    """EnSight Gold in ASCII: a case file, its geometry, and a file for each variable and time."""
    stem = path.stem
    path.write_text(
        f"FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: {stem}.geo\n\nVARIABLE\n"
        f"scalar per node: T {stem}.****.T\nvector per node: u {stem}.****.u\n\n"
        "TIME\ntime set: 1\nnumber of steps: 2\nfilename start number: 0\nfilename increment: 1\n"
        f"time values: {' '.join(map(str, TIMES))}\n"
    )
    head = [
        "two bricks",
        "EnSight Gold",
        "node id given",
        "element id given",
        "part",
        f"{1:10d}",
        "bricks",
        "coordinates",
    ]
    numbers = [f"{i + 1:10d}" for i in range(len(POINTS))]
    mesh = [f"{len(POINTS):10d}", *numbers, *(f"{v:12.5e}" for v in POINTS.T.ravel()), "hexa8", f"{2:10d}"]
    cells = [*numbers[:2], *("".join(f"{n + 1:10d}" for n in brick) for brick in BRICKS), ""]
    path.with_suffix(".geo").write_text("\n".join(head + mesh + cells))
    for step, time in enumerate(TIMES):
        for name, values in (("T", temperature(time)), ("u", displacement(time).T)):
            lines = [name, "part", f"{1:10d}", "coordinates", *(f"{v:12.5e}" for v in values.ravel()), ""]
            path.with_name(f"{stem}.{step:04d}.{name}").write_text("\n".join(lines))
    return path


def write_xdmf(path: Path, numbers: str = "XML") -> Path:
    """XDMF by meshio, with its numbers in the file, or as "HDF" in one beside it in the folder of the process."""
    import meshio

    with meshio.xdmf.TimeSeriesWriter(path, data_format=numbers) as series:
        series.write_points_cells(POINTS, [("hexahedron", BRICKS)])
        for time in TIMES:
            series.write_data(time, point_data={"T": temperature(time), "u": displacement(time)})
    return path


HEAD = (
    'FoamFile\n{{\n version 2.0;\n format ascii;\n class {kind};\n location "{where}";\n object {name};\n}}\n'
)


def write_foam(path: Path) -> Path:
    """OpenFOAM: the case of two cells, with a temperature that is uniform in each."""
    inner, outer = [(1, 4, 10, 7)], [
        (0, 6, 9, 3), (0, 1, 7, 6), (3, 9, 10, 4), (0, 3, 4, 1), (6, 7, 10, 9),
        (2, 5, 11, 8), (1, 2, 8, 7), (4, 10, 11, 5), (1, 4, 5, 2), (7, 8, 11, 10),
    ]  # fmt: skip
    owner = [0, *[0] * 5, *[1] * 5]
    vectors = "\n".join(f"({x} {y} {z})" for x, y, z in POINTS)
    faces = "\n".join(f"4({' '.join(map(str, face))})" for face in inner + outer)
    parts = {
        "points": ("vectorField", f"{len(POINTS)}\n(\n{vectors}\n)\n"),
        "faces": ("faceList", f"{len(owner)}\n(\n{faces}\n)\n"),
        "owner": ("labelList", f"{len(owner)}\n(\n" + "\n".join(map(str, owner)) + "\n)\n"),
        "neighbour": ("labelList", "1\n(\n1\n)\n"),
        "boundary": ("polyBoundaryMesh", "1\n(\nwalls\n{\n type wall;\n nFaces 10;\n startFace 1;\n}\n)\n"),
    }
    folder = path.parent / "constant" / "polyMesh"
    folder.mkdir(parents=True)
    for name, (kind, text) in parts.items():
        (folder / name).write_text(HEAD.format(kind=kind, where="constant/polyMesh", name=name) + text)
    for time in TIMES:
        place = path.parent / f"{time:g}"
        place.mkdir()
        text = "dimensions [0 0 0 1 0 0 0];\ninternalField nonuniform List<scalar> 2({} {});\n".format(
            *(300 + 10 * time * np.array([0.5, 1.5]))
        )
        walls = "boundaryField\n{\n walls\n {\n  type zeroGradient;\n }\n}\n"
        (place / "T").write_text(
            HEAD.format(kind="volScalarField", where=f"{time:g}", name="T") + text + walls
        )
    (path.parent / "system").mkdir()
    settings = "startTime 0;\nendTime 1;\ndeltaT 0.5;\nwriteControl timeStep;\nwriteInterval 1;\n"
    control = HEAD.format(kind="dictionary", where="system", name="controlDict") + settings
    (path.parent / "system" / "controlDict").write_text(control)
    path.touch()
    return path
