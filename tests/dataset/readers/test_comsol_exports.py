"""Text exports of COMSOL, written out here in each kind and dressing, and damage to them."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.dataset.readers import read_results
from palpate.dataset.readers.comsol_names import parse_name, split_names
from palpate.errors import FileFormatError

HEAD = """% Model:              {model}
% Version:            COMSOL 6.1.0.252
% Date:               Nov 3 2025, 10:12
% Dimension:          2
% Nodes:              3
% Expressions:        2
% Description:        Verschiebungsfeld, Übergröße
% Length unit:        mm
"""
SHEET = HEAD + (
    "% X                       Y                        v (um)                   ht.mises (N/m^2)\n"
    "0                         0                        0                        5.5E5\n"
    "50                        0                        -12.5                    2.5E5\n"
    "100                       1.5                      -40                      NaN\n"
)
SWEEP = HEAD + (
    "% X                       Y                        u2 (mm) @ F=1            p @ F=1   "
    "u2 (mm) @ F=2.5          p @ F=2.5\n"
    "0                         0                        0                        1E-3   0    2E-3\n"
    "50                        0                        -1                       1E-3   -2   2E-3\n"
    "100                       1.5                      -3                       1E-3   -7   2E-3\n"
)


def read(tmp_path, text, name="export.txt", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return read_results(path)


def as_csv(text, mark=",", decimal="."):
    """The same export as a .csv: keys and names with the separator, values with commas in quotes."""
    lines = []
    for line in text.splitlines():
        if line.startswith("%") and ":" in line and "@" not in line:
            key, value = (part.strip() for part in line[1:].split(":", 1))
            value = f'"{value}"' if mark in value else value
            lines.append(f"% {key}{mark}{value}")
        else:
            head, line = ("% ", line[1:]) if line.startswith("%") else ("", line)
            cells = [cell for cell in line.strip().split("  ") if cell.strip()]
            cells = [cell.strip() if head else cell.strip().replace(".", decimal) for cell in cells]
            lines.append(head + mark.join(cells))
    return "\n".join(lines) + "\n"


def saved_by_a_spreadsheet_program(text):
    """Comments in quotes, a byte-order mark, semicolons and decimal commas."""
    lines = as_csv(text, ";", ",").splitlines()
    quoted = [f'"{line.replace(chr(34), chr(34) * 2)}"' if line.startswith("%") else line for line in lines]
    return "\ufeff" + "\r\n".join(quoted)


@pytest.mark.parametrize(
    ("dress", "name", "encoding"),
    [
        pytest.param(str, "sheet.txt", "utf-8", id="txt"),
        pytest.param(as_csv, "sheet.csv", "utf-8", id="csv"),
        pytest.param(lambda text: as_csv(text, ";"), "sheet.csv", "utf-8", id="semicolons"),
        pytest.param(saved_by_a_spreadsheet_program, "sheet.csv", "utf-8", id="saved again"),
        pytest.param(str, "sheet.txt", "utf-16", id="UTF-16"),
        pytest.param(str, "sheet.txt", "latin-1", id="Latin-1"),
    ],
)
def test_a_spreadsheet_in_every_dressing(tmp_path, dress, name, encoding):
    results = read(tmp_path, dress(SHEET), name, encoding)
    assert results.cases == 1
    places = results.places["nodes"]
    assert {axis: column.unit for axis, column in places.coordinates.items()} == {"X": "mm", "Y": "mm"}
    np.testing.assert_array_equal(places.points(), [[0, 0], [50, 0], [100, 1.5]])
    assert results.columns["v"].unit == "um"
    np.testing.assert_array_equal(results.columns["v"].values, [[0, -12.5, -40]])
    np.testing.assert_array_equal(results.columns["ht.mises"].values, [[5.5e5, 2.5e5, np.nan]])


@pytest.mark.parametrize("dress", [str, as_csv, saved_by_a_spreadsheet_program])
def test_solutions_in_columns_are_cases_with_their_parameter(tmp_path, dress):
    results = read(tmp_path, dress(SWEEP), "sweep.csv" if dress is not str else "sweep.txt")
    assert results.cases == 2
    np.testing.assert_array_equal(results.columns["F"].values, [1, 2.5])
    assert results.columns["F"].unit is None
    np.testing.assert_array_equal(results.columns["u2"].values, [[0, -1, -3], [0, -2, -7]])
    assert results.columns["p"].unit == ""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("T (K) @ t=0.40462", ("T", "K", {"t": (0.40462, None)})),
        ("v (mm) @ 3: F=2, E=1e9", ("v", "mm", {"F": (2.0, None), "E": (1e9, None)})),
        ("int1(x, y) (m^2)", ("int1(x, y)", "m^2", {})),
        ("a (kg*m^2/(s^3*A))", ("a", "kg*m^2/(s^3*A)", {})),
        ("nu (1)", ("nu", "", {})),
        ("v @ F=5[mN]", ("v", "", {"F": (5.0, "mN")})),
        ("Displacement (mm), Point: 3", ("Displacement, Point: 3", "mm", {})),
        ("f(x, y)", ("f(x, y)", "", {})),
        ("v (m) @ law=soft, F=1", ("v", "m", {"F": (1.0, None)})),
    ],
)
def test_names_of_columns(text, expected):
    name = parse_name(text)
    assert (name.text, name.unit, dict(name.assignments)) == expected


def test_commas_in_names_part_nothing():
    line = 'x,y,int1(x, y) (m^2),"max(u, v) (mm)",v (m) @ F=1, E=2,w (m) @ F=1, E=2'
    names = ["x", "y", "int1(x, y) (m^2)", "max(u, v) (mm)", "v (m) @ F=1, E=2", "w (m) @ F=1, E=2"]
    assert split_names(line, ",", 6) == names


SECTIONS = """% Model:              body.mph
% Dimension:          3
% Nodes:              4
% Elements:           4
% Expressions:        2
% Length unit:        m
% Coordinates
0 0 0
1 0 0
0 1 0
0 0 1
% Elements (triangles)
1 3 2
1 2 4
2 3 4
1 4 3
% Data
% w (mm)
0
0.1
0.2
0.3
% Data (solid.mises (Pa))
10
20
30
40
"""


def test_sections_hold_nodes_a_surface_and_data(tmp_path):
    results = read(tmp_path, SECTIONS)
    places = results.places["nodes"]
    a, b, c = places.points()[places.triangles].transpose(1, 0, 2)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(1 / 6)
    np.testing.assert_array_equal(results.columns["w"].values, [[0, 0.1, 0.2, 0.3]])
    assert results.columns["solid.mises"].unit == "Pa"


def test_tetrahedra_give_the_same_surface(tmp_path):
    solid = SECTIONS.replace("(triangles)\n1 3 2\n1 2 4\n2 3 4\n1 4 3", "(tetrahedra)\n1 2 3 4").replace(
        "Elements:           4", "Elements:           1"
    )
    first, second = (read(tmp_path, text).places["nodes"] for text in (SECTIONS, solid))
    assert {frozenset(t) for t in first.triangles.tolist()} == {
        frozenset(t) for t in second.triangles.tolist()
    }


def test_a_grid_runs_along_its_first_axis(tmp_path):
    values = "\n".join(" ".join(str(10 * y + x) for x in range(3)) for y in range(2))
    text = f"% Dimension: 2\n% Length unit: cm\n% Grid\n0 1 2\n0 1\n% Data\n% T (degC)\n{values}\n"
    results = read(tmp_path, text)
    points = results.places["nodes"].points()
    np.testing.assert_array_equal(results.columns["T"].values[0], points @ [1, 10])
    assert results.places["nodes"].coordinates["x"].unit == "cm"


def test_a_point_has_each_name_above_its_value(tmp_path):
    text = "% Model: p.mph\n% Dimension: 0\n% Expressions: 2\n% F_reaction (N)\n12.5\n% W (mJ)\n3E-2\n"
    results = read(tmp_path, text)
    assert not results.places
    assert {name: (c.values.tolist(), c.unit) for name, c in results.columns.items()} == {
        "F_reaction": ([12.5], "N"),
        "W": ([0.03], "mJ"),
    }


TABLE = """% Model,table.mph
% Version,COMSOL 5.6.0.401
% Date,"Dec 22 2025, 11:37"
% Table,Table 1 - Derived Values 1
% v_rotation (rpm),F (N),"Torque, total (N*m)",Z (V)
100,1.5,0.25,85.5+1.2i
200,2.5,0.50,90-3i
300,NaN,0.75,1+0i
"""


def test_a_table_has_a_case_in_each_row(tmp_path):
    results = read(tmp_path, TABLE, "table.csv")
    assert results.cases == 3
    assert results.columns["v_rotation"].unit == "rpm"
    np.testing.assert_array_equal(results.columns["F"].values, [1.5, 2.5, np.nan])
    np.testing.assert_array_equal(results.columns["Torque, total"].values, [0.25, 0.5, 0.75])
    assert "Z" not in results.columns
    assert "complex" in results.notes[0]


def without(text, line):
    return "".join(part for i, part in enumerate(text.splitlines(keepends=True), 1) if i != line)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(without(SHEET, 11), r"line 11: 2 rows stand here, the head announces 3", id="row lost"),
        pytest.param(SHEET[:-40], r"line 12: \d values stand here, 4 are announced", id="row cut"),
        pytest.param(SHEET.replace("2.5E5", "2.5?5"), r"line 11: '2.5\?5' is no number", id="no number"),
        pytest.param(without(SHEET, 9), r"line 9: no line above the rows", id="names lost"),
        pytest.param(
            SHEET.replace("Expressions:        2", "Expressions:        5"),
            r"line 9: 2 columns of values stand here; the head announces 5",
            id="columns lost",
        ),
        pytest.param("".join(SHEET.splitlines(keepends=True)[:9]), "no rows follow the head", id="no rows"),
        pytest.param(SHEET + SHEET, r"line 13: another head|line 21: another head", id="two files in one"),
        pytest.param(SECTIONS.replace("0.3\n", ""), r"end after 3 values, 4 are needed", id="datum lost"),
        pytest.param(
            SECTIONS.replace("1 4 3", "1 4 9"), r"line 16: an element has a node beyond 1 … 4", id="node"
        ),
        pytest.param(
            without(SECTIONS, 15), r"3 elements stand here, the head announces 4", id="element lost"
        ),
        pytest.param(SECTIONS[: SECTIONS.index("% Data")], "ends without data", id="no data"),
        pytest.param(
            SECTIONS.replace("0 0 1\n", ""), r"line 10: 3 rows of coordinates", id="coordinates lost"
        ),
        pytest.param(
            TABLE.replace("200,2.5,", "200,"), r"line 7: 3 values stand here, 4 are announced", id="cell"
        ),
        pytest.param("% Grid\n0 1\n0 1\n0 1\n0 1\n% Data\n% v\n1\n", "4 lines follow % Grid", id="grid"),
        pytest.param("% Grid\n0 1\n0 1\n% Data\n% v\n1 2\n3\n", "end after 3 values, 4", id="grid cut"),
        pytest.param("% Hello\n", "no rows follow", id="only a comment"),
        pytest.param(
            SWEEP.replace("@ F=2.5          p @ F=2.5", "@ F=2.5          q @ F=2.5"), "'p'", id="sweep"
        ),
        pytest.param(SWEEP.replace("p @ F=1 ", "u2 (mm) @ F=1 "), "twice", id="column twice"),
    ],
)
def test_damage_is_refused_with_its_line(tmp_path, text, message):
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path, text)


def test_every_truncation_is_refused_or_leaves_whole_rows(tmp_path):
    """A spreadsheet cut at any byte never gives another number of nodes, or nodes with fewer values, in silence."""
    whole = read(tmp_path, SHEET)
    for end in range(0, len(SHEET) - 1, 7):
        try:
            results = read(tmp_path, SHEET[:end])
        except FileFormatError:
            continue
        assert len(results.places["nodes"]) == len(whole.places["nodes"])
