"""Arrays and tables that a script wrote: NumPy archives and Parquet."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.dataset.readers import read_results
from palpate.dataset.readers.array_files import name_and_unit
from palpate.errors import FileFormatError

FORCE = np.array([1.0, 2.0, 3.0])
POINTS = np.array([[0.0, 0.0], [50.0, 0.0]])
MOVED = np.arange(12.0).reshape(3, 2, 2)


def test_arrays_by_case_and_place(tmp_path):
    arrays = {
        "force [N]": FORCE,
        "u (mm)": MOVED,
        "p_kPa": MOVED[:, :, 0],
        "points": POINTS,
        "word": np.array("a"),
    }
    np.savez(tmp_path / "a.npz", **arrays)
    results = read_results(tmp_path / "a.npz")
    assert results.cases == 3
    assert {name: column.unit for name, column in results.columns.items()} == {
        "force": "N",
        "u.x": "mm",
        "u.y": "mm",
        "p": "kPa",
    }
    np.testing.assert_array_equal(results.columns["u.y"].values, MOVED[:, :, 1])
    np.testing.assert_array_equal(results.places["nodes"].points(), POINTS)
    assert results.notes[0].startswith("Skipped word")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("force [N]", ("force", "N")),
        ("force (N)", ("force", "N")),
        ("ratio [-]", ("ratio", "")),
        ("u_mm", ("u", "mm")),
        ("v_m", ("v_m", None)),
        ("tip_load", ("tip_load", None)),
        ("f(x)", ("f", "x")),
    ],
)
def test_units_stand_in_names(text, expected):
    assert name_and_unit(text) == expected


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        pytest.param({"force": FORCE, "u": MOVED[:2]}, r"'u' has the shape \(2, 2, 2\)", id="other cases"),
        pytest.param({"u": MOVED, "points": POINTS[:1]}, r"3 cases and 1 points", id="other places"),
        pytest.param({"points": POINTS}, "no array of numbers by case", id="no cases"),
        pytest.param({"force": np.array([None, 1])}, "holds objects", id="objects"),
        pytest.param({"u": MOVED, "points": POINTS[0]}, "1 points|'points' has the shape", id="points"),
        pytest.param(
            {"u": MOVED, "points": POINTS, "triangles": np.array([[0, 1, 2]])}, "'triangles'", id="triangles"
        ),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path, arrays, message):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(FileFormatError, match=message):
        read_results(tmp_path / "a.npz")


def test_a_damaged_archive_is_refused(tmp_path):
    np.savez(tmp_path / "a.npz", force=FORCE)
    content = (tmp_path / "a.npz").read_bytes()
    for end in (1, 60, len(content) // 2, len(content) - 5):
        (tmp_path / "cut.npz").write_bytes(content[:end])
        with pytest.raises(FileFormatError, match="the arrays can't be read"):
            read_results(tmp_path / "cut.npz")


@pytest.mark.full
def test_parquet_tables_keep_units_of_names_and_metadata(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    fields = [
        pyarrow.field("force [N]", pyarrow.float64()),
        pyarrow.field("depth", pyarrow.float32(), metadata={"unit": "mm"}),
        pyarrow.field("label", pyarrow.string()),
    ]
    table = pyarrow.table([[1.0, None, 3.0], [0.5, 1.0, 1.5], ["a", "b", "c"]], schema=pyarrow.schema(fields))
    parquet.write_table(table, tmp_path / "a.parquet")
    results = read_results(tmp_path / "a.parquet")
    np.testing.assert_array_equal(results.columns["force"].values, [1.0, np.nan, 3.0])
    assert (results.columns["force"].unit, results.columns["depth"].unit) == ("N", "mm")
    assert results.notes == ("Skipped label: a column of string.",)
    content = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "cut.parquet").write_bytes(content[: len(content) // 2])
    with pytest.raises(FileFormatError, match="cut short"):
        read_results(tmp_path / "cut.parquet")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.op2", b"\x89ODB\x00", "begins like no format"),
        ("a.txt", b"hello\nworld\n", r"a\.txt"),
        ("a.frd", b"hello\n", "line 1"),
        ("a.dat", b"", "empty"),
    ],
)
def test_an_unknown_layout_is_refused(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FileFormatError, match=message):
        read_results(tmp_path / name)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match="no such file"):
        read_results(tmp_path / "a.frd")


def test_a_text_table_has_a_case_in_each_row(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("F [N];w [mm];label\n0,5;1,25;a\n1,5;;b\n")
    results = read_results(path)
    np.testing.assert_array_equal(results.columns["F"].values, [0.5, 1.5])
    np.testing.assert_array_equal(results.columns["w"].values, [1.25, np.nan])
    assert {name: column.unit for name, column in results.columns.items()} == {"F": "N", "w": "mm"}
    assert any(note.startswith("Skipped label") for note in results.notes)
    path.write_text("F [N],w [mm]\n0.5,1\n1.5,oops\n2.5,3\n")
    with pytest.raises(FileFormatError, match="line 3"):
        read_results(path)
