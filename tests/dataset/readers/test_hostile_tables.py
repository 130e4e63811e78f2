"""Damaged and hostile files for the readers of tables and results: a sentence, in bounded time and memory."""

import io
import os
import resource
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from palpate import read_results
from palpate.dataset.measured import read_measurements
from palpate.dataset.readers.vtk_files import read_series
from palpate.devices.tick_record import TICK
from palpate.devices.trace_file import TraceWriter, read_trace
from palpate.errors import FileFormatError, PalpateError
from palpate.learning.learning_history import History
from palpate.study.toml import read_study
from palpate.supervised import read_in_child
from palpate.tables import read_table

MOST_SECONDS, MOST_BYTES = 60.0, 2e9
LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "lollollollollollollol">'
    + "".join(f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 12}">' for i in range(9))
    + "]>"
)


def vtu(head="", points=4, cells=1, nodes="0 1 2 3"):
    array = '<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="ascii">{}</DataArray>'
    return (
        f'<?xml version="1.0"?>{head}<VTKFile type="UnstructuredGrid" version="0.1"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{points}" NumberOfCells="{cells}"><Points>'
        f"{array.format('Float64', 'p', 3, '0 0 0 1 0 0 0 1 0 0 0 1')}</Points><Cells>"
        f"{array.format('Int64', 'connectivity', 1, nodes)}{array.format('Int64', 'offsets', 1, '4')}"
        f"{array.format('UInt8', 'types', 1, '10')}</Cells></Piece></UnstructuredGrid></VTKFile>"
    )


def workbook(sheet):
    file = io.BytesIO()
    openpyxl = pytest.importorskip("openpyxl")
    openpyxl.Workbook().save(file)
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    namespace = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    parts["xl/worksheets/sheet1.xml"] = sheet.replace("<worksheet>", f"<worksheet {namespace}>").encode()
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return file.getvalue()


FAR = "".join(f'<row r="{i}"><c r="A{i}"><v>1</v></c><c r="XFD{i}"><v>1</v></c></row>' for i in range(1, 200))
HOSTILE = {
    "count.vtu": vtu(points=10**9, cells=10**9),
    "negative.vtu": vtu(points=-4, cells=-1),
    "index.vtu": vtu(nodes="0 1 2 1000000000"),
    "laughs.vtu": vtu(LAUGHS).replace("0 0 0 1", "&j; 0 0 0 1", 1),
    "deep.vtu": "<VTKFile>" * 50_000,
    "count.vtk": "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 1000000000 double\n",
    "laughs.pvd": LAUGHS + '<VTKFile><Collection><DataSet timestep="0" file="&j;"/></Collection></VTKFile>',
    "itself.pvd": '<VTKFile><Collection><DataSet timestep="0" file="itself.pvd"/></Collection></VTKFile>',
    "cell.csv": 'a,b\n"' + "x" * 200_000,
    "columns.csv": ",".join(f"c{i}" for i in range(20_000)) + "\n" + ",".join(["x"] * 20_000) + "\n",
    "zeros.csv": b"a,b\n" + b"\0\0\0\xff\xfe,1\n" * 30,
    "broken.xlsx": lambda: workbook("<worksheet><sheetData><row>"),
    "laughs.xlsx": lambda: workbook(LAUGHS + "<worksheet><sheetData>&j;</sheetData></worksheet>"),
    "far.xlsx": lambda: workbook(f"<worksheet><sheetData>{FAR}</sheetData></worksheet>"),
    "blanks.xlsx": lambda: workbook(f"<worksheet>{' ' * 70_000_000}<sheetData/></worksheet>"),
    "noise.xlsx": b"PK\x03\x04" + bytes(1000),
    "noise.parquet": b"PAR1" + bytes(range(256)) * 4 + b"PAR1",
    "noise.npz": b"PK\x03\x04" + bytes(100),
    "count.frd": "    1C\n    2C" + " " * 18 + "  1000000000" + " " * 37 + "1\n -1         1 0.0\n -3\n",
    "columns.txt": "% x y z "
    + " ".join(f"u (m) @ a={i}" for i in range(20_000))
    + "\n"
    + "0 " * 20_003
    + "\n",
}


def read(path):
    return (read_table if path.suffix in {".csv", ".xlsx"} else read_results)(path)


def largest_memory():
    """Return the most bytes that this process and its ended children have ever had in use, each for itself."""
    return 1024 * max(
        resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )


@pytest.mark.full
@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_file_is_refused(tmp_path, name):
    if name.endswith((".vtk", ".parquet")):
        pytest.importorskip("pyvista" if name.endswith(".vtk") else "pyarrow")
    content = HOSTILE[name]() if callable(HOSTILE[name]) else HOSTILE[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    before, begun = largest_memory(), time.monotonic()
    with pytest.raises(PalpateError) as caught:
        read(tmp_path / name)
    assert caught.value.exit_code in {2, 3}
    assert name in caught.value.what
    assert time.monotonic() - begun < MOST_SECONDS
    assert largest_memory() < max(before, MOST_BYTES)


def crash(path):
    os.abort()


def fill_memory(path):
    kept = [bytearray(b"x" * 100_000_000) for _ in range(40)]
    return len(kept)


@pytest.mark.full
@pytest.mark.parametrize(("fault", "reason"), [(crash, "SIGABRT"), (fill_memory, "GB of memory")])
def test_a_reader_that_is_ended_is_an_error_here(tmp_path, fault, reason):
    (tmp_path / "a.vtu").write_text("x")
    with pytest.raises(FileFormatError, match="can't be read") as caught:
        read_in_child(fault, tmp_path / "a.vtu")
    assert reason in caught.value.why


STUDY = '[body]\ntype = "cantilever"\nlength = "1 m"\n[[x]]\na = [1, 2]\n'
FRD = f"    1C\n    2C{1:30d}{1:38d}\n -1         1 0.00000E+00 0.00000E+00 0.00000E+00\n -3\n"


def arrays():
    file = io.BytesIO()
    np.savez_compressed(file, inputs=np.arange(4.0), output=np.arange(4.0))
    return file.getvalue()


def trace():
    with tempfile.TemporaryDirectory() as folder:
        writer = TraceWriter(Path(folder) / "a.trace", {"name": "nobody"})
        writer.add_ticks(np.zeros(100, TICK))
        writer.close({})
        return writer.path.read_bytes()


def cells():
    numbers = "".join(f'<row r="{i}"><c r="A{i}"><v>{i}</v></c></row>' for i in range(1, 5))
    return workbook(f"<worksheet><sheetData>{numbers}</sheetData></worksheet>")


def parquet_table():
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    file = io.BytesIO()
    parquet.write_table(pyarrow.table({"a": [1.0, 2.0], "b": [3.0, 4.0]}), file)
    return file.getvalue()


SMALL = {
    "a.vtu": (vtu, read_results),
    "a.pvd": (lambda: HOSTILE["itself.pvd"], read_series),
    "a.csv": (lambda: "t [s],x [mm]\n" + "".join(f"{i},{2 * i}\n" for i in range(9)), read_table),
    "b.csv": (lambda: "t [s];x [mm];y;z;Fx [N];Fy;Fz\n0;1;2;3;0;0;1\n", read_measurements),
    "a.xlsx": (cells, read_table),
    "a.parquet": (parquet_table, read_results),
    "a.npz": (arrays, read_results),
    "b.npz": (arrays, History.load),
    "a.frd": (lambda: FRD, read_results),
    "a.dat": (lambda: " displacements (vx,vy,vz) for set N and time  0.1E+01\n\n 1 0.0 0.0 0.1\n", read_results),
    "a.txt": (lambda: "% x  y  u (m)\n0 0 1\n1 0 2\n", read_results),
    "a.toml": (lambda: STUDY, read_study),
    "a.trace": (trace, read_trace),
}  # fmt: skip


@pytest.mark.grid
@pytest.mark.parametrize("name", SMALL)
def test_changed_bytes_are_read_or_refused(tmp_path, name):
    """Bytes changed, cut, doubled and spliced; the first change of each file is none."""
    make, reader = SMALL[name]
    content = make()
    content = content if isinstance(content, bytes) else content.encode()
    before, codes = largest_memory(), set()
    rng, begun = np.random.default_rng(len(name) + sum(map(ord, name))), time.monotonic()
    for change in range(40):
        data = bytearray(content)
        for _ in range(change and int(rng.integers(1, 5))):
            at, length = int(rng.integers(len(data) + 1)), int(rng.integers(1, 9))
            kind = int(rng.integers(4))
            piece = (rng.bytes(length), b"", bytes(data[at : at + length]) * 2, b"9" * length)[kind]
            data[at : at + length] = piece
        (tmp_path / name).write_bytes(data)
        try:
            reader(tmp_path / name)
        except PalpateError as error:
            codes.add(error.exit_code)
    assert codes <= {2, 3}
    assert time.monotonic() - begun < MOST_SECONDS
    assert largest_memory() < max(before, MOST_BYTES)
