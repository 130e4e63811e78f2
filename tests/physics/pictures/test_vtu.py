"""VTU files, read back by other people's readers."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from drawn import Made, dented

from palpate.errors import UsageError
from palpate.physics.vtu import write_pvd, write_vtu


def check_meshio(made: Made, path: Path) -> None:
    import meshio

    read = meshio.read(path)
    assert np.array_equal(read.points, made.mesh.points)
    assert np.array_equal(read.cells_dict["tetra"], made.mesh.tetrahedra)
    assert np.array_equal(read.cells_dict["triangle"], made.mesh.triangles)
    assert np.array_equal(read.point_data["displacement"], made.displacement)
    assert np.array_equal(read.point_data["von Mises stress"], made.von_mises)
    surfaces = read.cell_data_dict["surface"]
    assert np.array_equal(surfaces["triangle"], made.mesh.surface_of)
    assert np.all(surfaces["tetra"] == -1)
    assert np.array_equal(read.cell_data_dict["region"]["tetra"], made.mesh.region_of)
    top = int(read.field_data["surface: top"][0])
    assert made.mesh.surfaces[top] == "top"
    assert np.array_equal(read.field_data["response"], made.response[None])
    assert np.array_equal(read.field_data["probe centre and radius"], [[*made.centre, 0.010]])


def test_meshio_reads_all_of_it(made: Made, tmp_path: Path):
    check_meshio(made, write_vtu(made, tmp_path / "block.vtu"))


def test_vtk_reads_all_of_it(made: Made, tmp_path: Path):
    import vtkmodules.vtkIOXML as io_xml
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = io_xml.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(write_vtu(made, tmp_path / "block.vtu")))
    reader.Update()
    assert reader.GetErrorCode() == 0
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() == len(made.mesh.tetrahedra) + len(made.mesh.triangles)
    assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), made.mesh.points)
    displacement = grid.GetPointData().GetArray("displacement")
    assert np.array_equal(vtk_to_numpy(displacement), made.displacement)
    assert grid.GetFieldData().GetArray("potential energy").GetValue(0) == made.potential_energy
    volumes = [grid.GetCell(i) for i in (0, len(made.mesh.tetrahedra))]
    assert [cell.GetNumberOfPoints() for cell in volumes] == [4, 3]


def test_a_series_names_its_steps(made: Made, tmp_path: Path):
    steps = [dented(made.mesh, depth) for depth in (0.0, 0.003, 0.006)]
    path = write_pvd(steps, tmp_path / "press.pvd", values=[0.0, 0.5, 1.0])
    rows = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    assert [float(row.get("timestep")) for row in rows] == [0.0, 0.5, 1.0]
    for row, step in zip(rows, steps, strict=True):
        check_meshio(step, tmp_path / row.get("file"))
    with pytest.raises(UsageError, match="3 solutions and 1 values"):
        write_pvd(steps, tmp_path / "press.pvd", values=[0.0])


def test_a_solution_without_extras_is_written_too(made: Made, tmp_path: Path):
    bare = Made(made.mesh, made.displacement)
    assert write_vtu(bare, tmp_path / "bare.vtu").exists()
    with pytest.raises(UsageError, match="Could not write"):
        write_vtu(bare, tmp_path / "no" / "such" / "folder.vtu")
