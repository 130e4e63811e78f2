"""Tables of measured indentation: what they mean, and what is said of those that mean nothing."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.dataset.measured import read_measurements, write_measurements
from palpate.errors import FileFormatError, UsageError

ROWS = "0.0,50,40,59.5,1,-2,13\n10,50,40,59,1,-2,26\n"


def table(folder, text, side=None):
    path = folder / "specimen.csv"
    path.write_text(text, encoding="utf-8")
    if side is not None:
        (folder / "specimen.json").write_text(side if isinstance(side, str) else json.dumps(side))
    return path


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ("# made by hand\n\nt,x,y,z,Fx,Fy,Fz\nms,mm,mm,mm,mN,mN,mN\n" + ROWS, None),
        ("t [ms], x [mm], Y [mm], z [mm], Fx [mN], Fy [mN], fz [mN]\n" + ROWS, None),
        ("t;x;y;z;Fx;Fy;Fz\nms;mm;mm;mm;mN;mN;mN\n" + ROWS.replace(",", ";"), None),
        ("\ufefft\tx\ty\tz\tFx\tFy\tFz\r\n" + ROWS.replace(",", "\t"), "side"),
    ],
)
def test_units_stand_in_a_row_in_the_header_or_beside(tmp_path, text, side):
    units = {"t": "ms", **dict.fromkeys(("x", "y", "z"), "mm"), **dict.fromkeys(("Fx", "Fy", "Fz"), "mN")}
    found = read_measurements(table(tmp_path, text, side and {"units": units}))
    np.testing.assert_allclose(found.position, [[0.05, 0.04, 0.0595], [0.05, 0.04, 0.059]], rtol=1e-15)
    np.testing.assert_allclose(found.force, [[0.001, -0.002, 0.013], [0.001, -0.002, 0.026]], rtol=1e-15)
    np.testing.assert_allclose(found.time, [0.0, 0.01])
    assert not found.along.any()
    assert not found.pressed


def test_a_gram_force_is_a_gram_in_standard_gravity(tmp_path):
    found = read_measurements(table(tmp_path, "x [cm],y [um],z [m],Fz [gf]\n1,2,3,100\n"))
    np.testing.assert_allclose(found.position, [[0.01, 2e-6, 3.0]])
    np.testing.assert_allclose(found.force, [[0.0, 0.0, 0.980665]])
    np.testing.assert_array_equal(found.along, [[0.0, 0.0, 1.0]])


def test_depths_at_a_place(tmp_path):
    side = {"place": [0.05, 0.05, 0.05], "direction": [0, 3, -4]}
    found = read_measurements(table(tmp_path, "depth [mm],F [N]\n1,0.5\n2,1.5\n", side))
    assert found.pressed
    np.testing.assert_allclose(found.depth, [0.001, 0.002])
    np.testing.assert_allclose(found.along, np.tile([0.0, -0.6, 0.8], (2, 1)))
    np.testing.assert_allclose(found.force, [[0.0, -0.3, 0.4], [0.0, -0.9, 1.2]])
    own = read_measurements(table(tmp_path, "x [mm],y [mm],z [mm],depth [mm],F [N]\n1,2,3,1,0.5\n", {}))
    np.testing.assert_allclose(own.position, [[0.001, 0.002, 0.003]])
    np.testing.assert_array_equal(own.along, [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no table"),
        ("# nothing\n", "holds no table"),
        ("x,y,z,Fz\nm,m,m,N\n", "no rows of numbers"),
        ("x [m],y [m],z [m],Fz [N]\n1,2,3,4\n\n1,2,oops,4\n", "line 4: Column 3 (z) holds 'oops'"),
        ("x [m],y [m],z [m],Fz [N]\n1,2,3,nan\n", "1 of 1 rows left out"),
        ("x [m],y [m],z [m],Fz [N]\n1,2,3,1_0\n", "line 2: Column 4 (Fz) holds '1_0'"),
        ("x [m],y [m],z [m],Fz [N]\n1,2,3\n", "line 2: 3 values stand where 4 belong"),
        ("x [m],y [m],z [m],Fz [N]\n1,2,3,1e999\n", "line 2: Column 4"),
        ("x [m],y [m],z [m],Fz [lbf]\n1,2,3,4\n", "line 1: 'lbf' is no unit of force"),
        ("x [m],y [m],z [N],Fz [N]\n1,2,3,4\n", "line 1: 'N' is no unit of length"),
        ("x [m],y [m],z,Fz [N]\n1,2,3,4\n", "line 1: Column 3, 'z', has no unit"),
        ("x,y,z,Fz\n1,2,3,4\n", "line 1: Column 1, 'x', has no unit"),
        ("x,y,z,Fz\nm,m,m\n1,2,3,4\n", "line 2: The row of units has 3 cells"),
        ("# a bench\nx,y,z,Fz\n\nm,m,m,lbf\n1,2,3,4\n", "line 4: 'lbf' is no unit of force"),
        ("x,y,z,Fz\nm,m,,N\n1,2,3,4\n", "line 2: Column 3, 'z', has no unit"),
        ("x,y,w,Fz\nm,m,m,N\n1,2,3,4\n", "Columns of other names: w"),
        ("x [m],y [m],y [m],Fz [N]\n1,2,3,4\n", "line 1: 'y' is the name of columns 2 and 3"),
        ("x [m],y [m],w [m],Fz [N]\n1,2,3,4\n", "line 1: Columns x y fz make no measurement"),
        ("x;y;z;Fz\nmm;mm;mm;mN\n50;50;59;1,234\n", "line 3: '1,234' may be 1.234 or 1234"),
        ("x [m],y [m],z [m],Fx [N],Fz [N]\n1,2,3,4,5\n", "make no measurement"),
        ("x [m],y [m],Fz [N]\n1,2,3\n", "make no measurement"),
        ("depth [mm],F [N]\n1,2\n", "make no measurement"),
    ],
)
def test_what_is_wrong_is_named_with_file_line_and_column(tmp_path, text, said):
    path = table(tmp_path, text)
    with pytest.raises(FileFormatError) as error:
        read_measurements(path)
    assert said in error.value.what + error.value.why
    assert "specimen.csv" in error.value.what
    assert error.value.fix


def test_a_unit_of_the_sidecar_is_wrong_there(tmp_path):
    path = table(tmp_path, "x,y,z,Fz\n1,2,3,4\n", {"units": {"x": "m", "y": "m", "z": "m", "Fz": "lbf"}})
    with pytest.raises(FileFormatError, match=r"specimen\.json: 'lbf' is no unit of force"):
        read_measurements(path)


@pytest.mark.parametrize(
    "side",
    [
        "{",
        [],
        {"unit": {}},
        {"units": {"x": 1}},
        {"units": {"q": "m"}},
        {"place": [1, 2]},
        {"place": [1, 2, None]},
        {"direction": [0, 0, 0]},
    ],
)
def test_a_sidecar_that_says_nothing_is_refused_by_name(tmp_path, side):
    with pytest.raises(FileFormatError, match=r"specimen\.json"):
        read_measurements(table(tmp_path, "depth [mm],F [N]\n1,2\n", side))


def test_units_in_two_places_are_refused(tmp_path):
    with pytest.raises(FileFormatError, match="header and in the sidecar"):
        read_measurements(table(tmp_path, "x [m],y [m],z [m],Fz [N]\n1,2,3,4\n", {"units": {"x": "mm"}}))


def test_a_missing_file_and_one_of_bytes_are_refused(tmp_path):
    with pytest.raises(FileFormatError, match="can't be read"):
        read_measurements(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR")
    with pytest.raises(FileFormatError, match="can't be read"):
        read_measurements(tmp_path / "bytes.csv")


def test_what_is_written_is_read_back_bit_for_bit(tmp_path):
    position, force = np.random.default_rng(0).normal(size=(2, 50, 3)) * [[[1e-2]], [[3.0]]]
    found = read_measurements(write_measurements(tmp_path / "made.csv", position, force))
    np.testing.assert_array_equal(found.position, position)
    np.testing.assert_array_equal(found.force, force)
    with pytest.raises(UsageError):
        write_measurements(tmp_path / "no" / "made.csv", position, force)


def test_further_columns_and_rows_with_gaps_are_left_out_and_named(tmp_path):
    text = "x (mm);y (mm);z (mm);Fz (N);Stage;Room [°C]\n50;50;59,5;0,01;in;21\n50;50;59;;in;21\n50;50;58;NaN;in;21\n"
    path = table(tmp_path, text)
    found = read_measurements(path)
    np.testing.assert_allclose(found.position, [[0.05, 0.05, 0.0595]], rtol=1e-15)
    assert found.notes == (
        "2 columns left out: Stage, Room.",
        "2 of 3 rows left out, in which a value is missing: lines 3, 4.",
    )
    with pytest.raises(FileFormatError, match=r"line 3: Column 'fz' has no value\. 2 of 3 rows have a gap"):
        read_measurements(path, missing="refuse")
    with pytest.raises(UsageError, match="leave-out"):
        read_measurements(path, missing="zero")
    ambiguous = table(tmp_path, "x [mm];y [mm];z [mm];Fz [mN]\n50;50;59;1,234\n")
    assert read_measurements(ambiguous, decimal=",").force[0, 2] == pytest.approx(1.234e-3)
    assert read_measurements(ambiguous, decimal=".").force[0, 2] == pytest.approx(1.234)
