"""Tables as programs write them: read as what they say, or refused with line and remedy."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import FileFormatError, UsageError
from palpate.tables import read_table

HEAD, ROWS = "t [s],x [mm],Fz [mN]", "0.0,50.0,13\n0.1,49.5,-41.5\n"
PLAIN = f"{HEAD}\n{ROWS}"
SEMICOLONS = PLAIN.replace(",", ";")
UNDER = f"t,x,Fz\n(s),(mm),(mN)\n{ROWS}"


def read(folder, content, **options):
    path = folder / "bench.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_table(path, **options)


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        SEMICOLONS,
        SEMICOLONS.replace(".", ","),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", " | "),
        PLAIN.replace(",", "   "),
        PLAIN.replace(",", "   ").replace(".", ","),
        '"t [s]","x [mm]","Fz [mN]"\n"0.0","50.0","13"\n"0.1","49.5","-41.5"\n',
        '"t\n[s]", "x [mm]", "Fz [mN]"\n' + ROWS,
        "t (s),x (mm),Fz (mN)\n" + ROWS,
        "t / s,x/mm,Fz in mN\n" + ROWS,
        UNDER,
        UNDER.replace("(s),(mm),(mN)", "s,mm,mN"),
        UNDER.replace("(s),(mm),(mN)", "[s],[mm],[mN]"),
        UNDER.replace("\n", ",\n"),
        SEMICOLONS.replace("50.0;13\n", "50.0;13;\n"),
        "sep=;\n" + SEMICOLONS,
        '"sep=;"\n' + SEMICOLONS,
        "% Model:,press.mph\n% Nodes:,2\n% t (s),x (mm),Fz (mN)\n" + ROWS,
        "% Version:   6.2\n% t (s)     x (mm)    Fz (mN)\n" + ROWS.replace(",", "    "),
        "# t x Fz\n# s mm mN\n" + ROWS.replace(",", " "),
        "# a bench, of two\n\n" + PLAIN.replace("0.1", "# pause\n0.1"),
        "Specimen 7;;\n\n" + SEMICOLONS,
        "Program 3\nOperator;Smith\nRate;100\nDate;25.11.2026\n\n" + SEMICOLONS,
        "Time;Way;Force\nt;x;Fz\ns;mm;mN\n" + ROWS.replace(",", ";"),
        PLAIN + PLAIN + ";;\n"[:0],
        "| t [s] | x [mm] | Fz [mN] |\n|---|---|---|\n" + "| 0.0 | 50.0 | 13 |\n| 0.1 | 49.5 | -41.5 |\n",
        "\ufeff" + PLAIN,
        PLAIN.encode("utf-16"),
        PLAIN.replace(",", "\t").encode("utf-16-le"),
        PLAIN.encode("utf-16-be"),
        PLAIN.encode("utf-32"),
        PLAIN.replace("-41.5", "−4.15e1"),
        PLAIN.replace("13", "1.3D+01"),
        PLAIN + "\x1a",
    ],
)
def test_one_table_is_written_in_many_ways(tmp_path, content):
    table = read(tmp_path, content)
    assert table.names == ("t", "x", "Fz")
    assert [table.si_unit(name) for name in table.names] == ["s", "m", "N"]
    found = table.array(["t", "x", "Fz"])[:2]
    np.testing.assert_allclose(found, [[0.0, 0.05, 0.013], [0.1, 0.0495, -0.0415]], rtol=1e-14)


def test_both_signs_of_micro_and_an_encoding_that_is_a_guess(tmp_path):
    for mu, encoding in (
        ("\u00b5", "utf-8"),
        ("\u03bc", "utf-8"),
        ("\u00b5", "latin-1"),
        ("\u00b5", "cp1252"),
    ):
        table = read(tmp_path, f"x\n{mu}m\n5\n".encode(encoding))
        assert table.values("x", "m")[0] == pytest.approx(5e-6)
        assert bool(table.notes) == (encoding != "utf-8")
    assert read(tmp_path, "x [\u03bcm]\n5\n".encode("utf-16-le"), encoding="utf-16-le").values(
        "x"
    ) == pytest.approx(5e-6)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a;b\n1.234,5;2\n950,25;1.234\n", [[1234.5, 2], [950.25, 1234]]),
        ('a,b\n"1,234.5",2\n"2,345",3.5\n', [[1234.5, 2], [2345, 3.5]]),
        ("a;b\n1,234,567;2\n1,000;0.5\n", [[1234567, 2], [1000, 0.5]]),
        ("a;b\n1'234.5;2\n1’000;3\n", [[1234.5, 2], [1000, 3]]),
        ("a;b\n1 234,5;2\n1\u202f000;3\n", [[1234.5, 2], [1000, 3]]),
        ("a;b\n0,001;2\n1,234;3\n", [[0.001, 2], [1.234, 3]]),
        ("a;b\n1,234e3;2\n5;3\n", [[1234, 2], [5, 3]]),
        ("a;b\n9.500;1\n1.234;2\n", [[9.5, 1], [1.234, 2]]),
        ("a,b\n1.234,1\n5,2\n", [[1.234, 1], [5, 2]]),
        ("a;b\n1;\nNaN;4\n;;\nn/a;-\n", [[1, np.nan], [np.nan, 4], [np.nan, np.nan]]),
        ("a,b\n,.5\n+1.,-2E-1\n", [[np.nan, 0.5], [1, -0.2]]),
        ("3;4\n5;6\n", [[3, 4], [5, 6]]),
        ("a;b\n" + 3000 * "1;2\n" + "0,5;2\n", [*3000 * [[1, 2]], [0.5, 2]]),
    ],
)
def test_numbers_are_what_the_whole_table_says_they_are(tmp_path, text, values):
    table = read(tmp_path, text)
    np.testing.assert_array_equal(table.array(table.names), values)


@pytest.mark.parametrize(
    ("text", "said", "option"),
    [
        ("a;b\n5;6\n1,234;2\n", "line 3: '1,234' may be 1.234 or 1234", "decimal=','"),
        ('a,b\n"1,234",2\n', "line 2: '1,234' may be", "--decimal"),
        ("a;b\n0,5;6\n7;1.234\n", "line 3: '1.234' may be 1.234 or 1234", "decimal="),
        ("a;b\n950;1\n1.234;2\n", "line 3: '1.234' may be", "decimal="),
        ("a;b\n0,5;1\n1;1.5\n", "line 3: '1.5' has another decimal mark than '0,5' in line 2", "decimal="),
        ("a,b\n0,5,1,5\n0,6,1,6\n", "line 2: 4 values stand where 2 belong", "separator="),
        ("a;b\n1,5;2\n2,x;3\n", "line 3: Column 1 (a) holds '2,x'", "decimal="),
        ("a,b\n1,2\n3\n", "line 3: 1 values stand where 2 belong", "last="),
        ("a,b\n1,2\n3,4,5\n", "line 3: 3 values", "header="),
        ("a;b\n1;2\nBreak;2\n", "line 3: Column 1 (a) holds 'Break'", "--last"),
        ("a,b\n1,2\n3,1e999\n", "line 3: Column 2 (b) holds '1e999'", ""),
        ('a,b\n"1,2\n3,4\n', "line 2: a double quote opens a cell and does not close it", ""),
        ("a [mm],b [N]\nm,N\n1,2\n", "line 2: column 'a' is in m, in line 1 in mm", ""),
        ("a,a\n1,2\n", "line 1: 'a' is the name of columns 1 and 2", ""),
        ("a [C],b\n1,2\n", "line 1: column 'a': 'C' may be degrees Celsius or coulombs", "--unit"),
        ("a [furlongs],b\n1,2\n", "line 1: column 'a': 'furlongs' is no unit", "--unit"),
        ("", "holds no table", ""),
        ("a,b\n", "no rows of numbers", ""),
        ("a,b\n1,\x002\n", "line 2 holds the character", "--encoding"),
        (b"PK\x03\x04junk", "a ZIP archive", ""),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xls", "CSV"),
    ],
)
def test_what_is_not_certain_is_refused_with_line_and_remedy(tmp_path, text, said, option):
    def whole():
        table = read(tmp_path, text)
        return table.array(table.names)

    with pytest.raises(FileFormatError) as error:
        whole()
    assert said in error.value.what
    assert "bench.csv" in error.value.what
    assert option in error.value.fix


def test_options_settle_what_is_not_certain(tmp_path):
    assert read(tmp_path, "a;b\n1,234;2\n", decimal=",").values("a") == 1.234
    assert read(tmp_path, "a;b\n1,234;2\n", decimal=".").values("a") == 1234
    assert len(read(tmp_path, "a;b\n1;2\nBreak;2\n", last=2)) == 1
    assert read(tmp_path, "m;s\nt;F\nx;y\n1;2\n", header=2).names == ("t", "F")
    assert read(tmp_path, "a;b,c\n1;2,3\n", separator=";").names == ("a", "b,c")
    assert read(tmp_path, "a b\n1 2\n", separator="space").names == ("a", "b")
    assert read(tmp_path, "a [C]\n20\n", units={"A": "°C"}).values("a", "K") == pytest.approx(293.15)
    for wrong in (
        {"decimal": ";"},
        {"separator": "ab"},
        {"header": 9},
        {"encoding": "klingon"},
        {"units": {"q": "m"}},
    ):
        with pytest.raises(UsageError):
            read(tmp_path, "a;b\n1;2\n", **wrong)


def test_columns_are_found_by_name(tmp_path):
    table = read(tmp_path, "Position;;Force;;\nx;y;x;y;Mean  load\nmm;mm;N;N;kN\n1;2;3;4;5\n")
    assert table.names == ("Position x", "Position y", "Force x", "Force y", "Mean load")
    assert table.values("force Y", "N") == 4
    assert table.values("mean load", "N") == 5000
    long = read(tmp_path, "Time;Force\nt;F\ns;N\n1;2\n")
    assert long.values("Force") == long.values("F") == 2
    with pytest.raises(UsageError, match="no column 'forse'"):
        long.values("forse")
    with pytest.raises(UsageError, match="is in N; m is needed"):
        long.values("F", "m")
    with pytest.raises(UsageError, match=r"has no unit; m is needed"):
        read(tmp_path, "a;b\n1;2\n").values("a", "m")


@pytest.mark.parametrize(
    ("unit", "si", "value"),
    [
        ("N/mm²", "Pa", 2e6),
        ("N/mm^2", "Pa", 2e6),
        ("kN", "N", 2e3),
        ("N m", "N m", 2.0),
        ("N·mm", "N m", 2e-3),
        ("°C", "K", 275.15),
        ("deg", "rad", np.radians(2)),
        ("%", "", 0.02),
        ("-", "", 2.0),
        ("1/s", "1/s", 2.0),
        ("mm/min", "m/s", 2e-3 / 60),
        ("g/cm³", "kg/m³", 2e3),
        ("rpm", "rad/s", 2 * 2 * np.pi / 60),
    ],
)
def test_values_are_in_si_units(tmp_path, unit, si, value):
    for text in (f"a [{unit}];b\n2;1\n", f"a;b\n[{unit}];[N]\n2;1\n"):
        table = read(tmp_path, text)
        assert table.si_unit("a") == si
        assert table.values("a")[0] == pytest.approx(value, rel=1e-12)


@pytest.mark.full
def test_a_workbook_is_read_or_says_what_to_install(tmp_path):
    path = tmp_path / "bench.xlsx"
    try:
        import openpyxl
    except ImportError:
        path.write_bytes(b"PK")
        with pytest.raises(UsageError, match="openpyxl"):
            read_table(path)
        return
    book = openpyxl.Workbook()
    for row in (["Specimen 7"], ["t", "Fz"], ["s", "mN"], [0, 13], [0.1, None], [None, None]):
        book.active.append(row)
    book.save(path)
    table = read_table(path)
    np.testing.assert_allclose(table.array(["t", "Fz"]), [[0, 0.013], [0.1, np.nan]])
    book.create_sheet("more").append([1.0])
    book.save(path)
    with pytest.raises(FileFormatError, match="has 2 sheets: 'Sheet', 'more'"):
        read_table(path)
    assert len(read_table(path, sheet="Sheet")) == 2
