"""Tables of testing machines and loggers: rows of statistics, blocks, units in words, LabVIEW measurements."""

from __future__ import annotations

import re

import numpy as np
import pytest

from palpate.dataset.measured import read_measurements
from palpate.errors import FileFormatError
from palpate.tables import read_table

READINGS = "".join(f"{i},{0.5 * i},{0.05 * i**1.5:.5f}\n" for i in range(1, 9))
MEANS = "Mean,2.25,0.5\nMaximum,4.0,1.1\nStandard deviation,1.2,0.4\n"


def write(folder, text, name="bench.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "Point,Extension [mm],Load [N]\n" + READINGS + MEANS,
        "Point,Extension [mm],Load [N]\n" + MEANS + READINGS,
        "Point,Extension [mm],Load [N]\n" + READINGS + "Mittelwert,2.25,0.5\nStd. dev.,1,0.4\nn,8,8\n",
        "Point,Extension [mm],Load [N]\n" + READINGS + ",Mean,0.5\n,Max.,1.1\n,min,0.1\n",
        "Note,Point,Extension [mm],Load [N]\n"
        + "".join(f",{row}\n" for row in READINGS.split())
        + "Mean value,4.5,2.25,0.5\nAverage (n=8),4.5,2.25,0.5\nSum,36,18,4\n",
        "Specimen,Point,Extension [mm],Load [N]\n"
        + "".join(f"S-{i},{row}\n" for i, row in enumerate(READINGS.split()))
        + "Mean,4.5,2.25,0.5\nMaximum,8,4,1.1\nRange,7,3.5,1\n",
    ],
)
def test_rows_of_statistics_are_no_readings(tmp_path, text):
    table = read_table(write(tmp_path, text))
    assert len(table) == 8
    np.testing.assert_allclose(table.values("Extension"), 0.5e-3 * np.arange(1, 9))
    lines = [
        i
        for i, line in enumerate(text.splitlines(), 1)
        if i > 1 and not line.endswith(tuple(READINGS.split()))
    ]
    assert len(table.notes) == 1
    assert f"lines {', '.join(map(str, lines))}" in table.notes[0]


def test_words_of_a_category_are_none_of_statistics(tmp_path):
    rows = "".join(f"{level},{i}\n" for level in ("min", "mean", "max") for i in range(3))
    assert len(read_table(write(tmp_path, "level,y\n" + rows))) == 9
    assert len(read_table(write(tmp_path, "statistic,y\nmean,1\nmax,2\nmin,3\n"))) == 3


def test_another_word_among_numbers_is_told(tmp_path):
    table = read_table(write(tmp_path, "Point,F [N]\n" + "1,2\n2,3\n3,4\nBreak,5\n5,6\n"))
    assert len(table) == 5
    assert "'Break' stands where 'Point' has numbers (line 5)" in table.notes[0]
    with pytest.raises(FileFormatError, match="line 5: Column 1"):
        table.values("Point")


HEAD = "Time\tx\ty\tz\tFz\n{}\tmm\tmm\tmm\tN\n"


def blocks(second=HEAD, first=HEAD, time="Sec"):
    rows = [f"{0.1 * i:.5f}\t50\t50\t{59.5 - 0.25 * i:.3f}\t{0.013 * i**1.5:.5f}\n" for i in range(9)]
    above = "\nData Acquisition: Cycle {}\tTime: {} Sec\n"
    text = "Test controller export\nDate:\t03/12/2024\n" + above.format(1, 0) + first.format(time)
    return text + "".join(rows[:5]) + above.format(2, 0.5) + second.format(time) + "".join(rows[5:])


@pytest.mark.parametrize("head", [HEAD, HEAD.replace("mm", "(mm)").replace("N\n", "[N]\n")])
def test_blocks_of_one_head_are_one_table(tmp_path, head):
    found = read_measurements(write(tmp_path, blocks(head, first=head)))
    np.testing.assert_allclose(found.time, 0.1 * np.arange(9))
    np.testing.assert_allclose(found.position[:, 2], 0.0595 - 0.00025 * np.arange(9))
    assert "stands again in lines 14, 15" in " ".join(found.notes)
    assert "line 13" in " ".join(found.notes)


@pytest.mark.parametrize(
    ("second", "said"),
    [
        (HEAD.replace("N\n", "mN\n"), "line 15: the table begins anew, with other units than in line 6"),
        (HEAD.replace("Fz", "Fx"), "line 14: the table begins anew, with other names than in line 5"),
        (HEAD.replace("x\ty", "y\tx"), "line 14: the table begins anew, with other names"),
    ],
)
def test_a_block_of_another_head_is_refused_with_its_line(tmp_path, second, said):
    path = write(tmp_path, blocks(second))
    with pytest.raises(FileFormatError) as error:
        read_table(path)
    assert said in error.value.what
    assert "last=11 (--last), from there on by header=14 (--header)" in error.value.fix
    assert len(read_table(path, last=11)) == 5
    assert len(read_table(path, header=14)) == 4


def test_a_reading_that_is_cut_short_before_a_block_is_refused(tmp_path):
    text = blocks().replace("0.40000\t50\t50\t58.500\t0.10400\n", "0.40000\t50\n")
    with pytest.raises(FileFormatError, match="line 11: 2 values stand where 5 belong"):
        read_table(write(tmp_path, text))


@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        ("Sec", "s", 1),
        ("SEC", "s", 1),
        ("msec", "s", 1e-3),
        ("mm/Sec", "m/s", 1e-3),
        ("Count", "", 1),
        ("percent", "", 0.01),
        ("Newton", "N", 1),
        ("KN", "N", 1e3),
        ("MPA", "Pa", 1e6),
        ("mPa", "Pa", 1e-3),
    ],
)
def test_units_are_what_machines_write(tmp_path, unit, si, factor):
    table = read_table(write(tmp_path, f"Points,value\nCount,{unit}\n1,2\n2,4\n"))
    assert table.si_unit("value") == si
    np.testing.assert_allclose(table.values("value"), [2 * factor, 4 * factor], rtol=1e-12)


@pytest.mark.parametrize("name", ["t", "Time", "Elapsed Time", "Zeit"])
def test_the_time_of_a_logger_is_that_of_the_readings(tmp_path, name):
    found = read_measurements(
        write(tmp_path, f"Points,{name},x,y,z,Fz\nCount,Sec,mm,mm,mm,N\n1,0,5,5,5,1\n2,.1,5,5,5,1\n")
    )
    np.testing.assert_allclose(found.time, [0.0, 0.1])


def labview(columns="One", mark="\t", decimal=".", segments=1, second="N"):
    """A file of two channels in the layout that National Instruments publishes."""
    lines = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2"]
    lines += [f"Separator\t{'Tab' if mark == chr(9) else 'Comma'}", f"Decimal_Separator\t{decimal}"]
    lines += ["Multi_Headings\tYes", f"X_Columns\t{columns}", "Time_Pref\tRelative", "Operator\tbench"]
    lines += ["Date\t2024/12/03", "Time\t10:15:30.5", "***End_of_Header***", ""]
    for k in range(segments):
        multi = columns == "Multi"
        labels = ["Weg", "X_Value", "Kraft"] if multi else ["Weg", "Kraft"]
        gap = [""] if multi else []
        lines += ["Channels\t2", "\t".join(["Samples", "3", *gap, "3"]), "Notes\tabove 1.5"]
        lines += [
            "\t".join(["Y_Unit_Label", "mm", *gap, second if k else "N"]),
            "\t".join(["X_Dimension", "Time", *gap, "Time"]),
        ]
        lines += [
            "\t".join(["X0", f"{0.3 * k}", *gap, f"{0.3 * k}"]),
            "\t".join(["Delta_X", "0.1", *gap, "0.1"]),
        ]
        lines += ["***End_of_Header***", "\t".join(["X_Value", *labels, "Comment"])]
        for i in range(3 * k, 3 * k + 3):
            x = "" if columns == "No" else f"{0.1 * i:.6f}"
            cells = [x, f"{0.25 * i:.6f}", *([x] if multi else []), f"{0.5 * i:.6f}"]
            lines.append("\t".join([*cells, "start"] if i == 0 else cells))
        lines.append("")
    body = "\n".join(lines).replace("\t", mark)
    return "\r\n".join(body.replace(".", decimal).split("\n")) if decimal == "," else body


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
@pytest.mark.parametrize(("mark", "decimal"), [("\t", "."), ("\t", ","), (",", ".")])
@pytest.mark.parametrize("segments", [1, 3])
def test_a_labview_measurement_is_read(tmp_path, columns, mark, decimal, segments):
    table = read_table(write(tmp_path, labview(columns, mark, decimal, segments), "bench.lvm"))
    count = np.arange(3 * segments)
    assert table.names[0] == "Time"
    assert {"Weg", "Kraft"} < set(table.names)
    assert [table.si_unit(name) for name in ("Time", "Weg", "Kraft")] == ["s", "m", "N"]
    np.testing.assert_allclose(
        table.array(["Time", "Weg", "Kraft"]), count[:, None] * [[0.1, 0.25e-3, 0.5]], atol=1e-12
    )
    if columns != "Multi":
        np.testing.assert_allclose(table.values("X_Value"), 0.1 * count, atol=1e-12)
    assert (f"{segments} segments" in " ".join(table.notes)) == (segments > 1)


def test_segments_whose_time_begins_anew_are_told(tmp_path):
    text = labview("No", segments=3)
    assert "begins anew" not in " ".join(read_table(write(tmp_path, text, "bench.lvm")).notes)
    again = re.sub(r"(X0\t)[\d.]+", r"\g<1>0.0", text)
    assert "Time [s] begins anew in each" in " ".join(read_table(write(tmp_path, again, "bench.lvm")).notes)


def test_a_damaged_labview_measurement_is_refused(tmp_path):
    with pytest.raises(FileFormatError, match="does not end"):
        read_table(write(tmp_path, labview().split("***")[0], "bench.lvm"))
    with pytest.raises(FileFormatError, match="other channels or units"):
        read_table(write(tmp_path, labview(segments=2, second="mN"), "bench.lvm"))
    with pytest.raises(FileFormatError, match="holds no table"):
        read_table(write(tmp_path, labview().split("X_Value")[0], "bench.lvm"))
