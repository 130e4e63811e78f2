"""Results of CalculiX: real files of a patch test, whose stress is known, and damage to them."""

from __future__ import annotations

import numpy as np
import pytest

from dataset.readers.solved_by_ccx import patch_deck, run
from palpate.dataset.readers import read_results
from palpate.dataset.readers.results import join_columns
from palpate.errors import FileFormatError, UsageError

YOUNG, POISSON = 1000.0, 0.3
GRADIENT = ((0.001, 0.0004, 0.0007), (0.0, -0.0005, 0.0003), (0.0, 0.0, 0.0008))
PLACES = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "yz": (1, 2), "zx": (2, 0)}
PRINTED = 1e-6  # seven digits
EXTRAPOLATED = 1e-4  # from integration points to nodes, with the coefficients that the solver has for that


def exact_stress() -> dict[str, float]:
    """Hooke's law of the constant strain."""
    strain = (np.array(GRADIENT) + np.array(GRADIENT).T) / 2
    lame = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    stress = lame * np.trace(strain) * np.eye(3) + YOUNG / (1 + POISSON) * strain
    return {name: stress[place] for name, place in PLACES.items()}


@pytest.fixture(scope="module")
def patch(ccx, tmp_path_factory):
    folder = tmp_path_factory.mktemp("patch")
    return run(ccx, folder, "patch", patch_deck(GRADIENT, YOUNG, POISSON))


def test_the_stress_of_a_patch_test_is_hookes(patch):
    frd = read_results(patch)
    names = {"xx": "SXX", "yy": "SYY", "zz": "SZZ", "xy": "SXY", "yz": "SYZ", "zx": "SZX"}
    for name, value in exact_stress().items():
        np.testing.assert_allclose(frd.columns[f"STRESS.{names[name]}"].values, value, atol=EXTRAPOLATED)


def test_the_printed_stress_has_its_shears_in_another_order(patch):
    dat = read_results(patch.with_suffix(".dat"))
    for name, value in exact_stress().items():
        name = "xz" if name == "zx" else name
        np.testing.assert_allclose(dat.columns[f"stresses.s{name} of BODY"].values, value, atol=PRINTED)


def test_displacements_are_the_gradient_times_the_place(patch):
    frd = read_results(patch)
    points = frd.places["nodes"].points()
    moved = np.stack([frd.columns[f"DISP.D{i}"].values[0] for i in (1, 2, 3)], axis=1)
    np.testing.assert_allclose(moved, points @ np.array(GRADIENT).T, atol=1e-7)


def test_the_outer_surface_is_that_of_the_cube(patch):
    places = read_results(patch).places["nodes"]
    corners = places.points()[places.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1).sum(), 6 * 100, rtol=1e-6)
    volume = np.einsum("ij,ij->", corners.mean(axis=1), normals) / 3
    assert volume == pytest.approx(1000, rel=1e-6)


def test_a_binary_file_is_read_like_a_text(ccx, tmp_path, patch):
    binary = read_results(run(ccx, tmp_path, "binary", patch_deck(GRADIENT, YOUNG, POISSON, "OUTPUT")))
    text = read_results(patch)
    assert list(binary.columns) == list(text.columns)
    for name, column in binary.columns.items():
        np.testing.assert_allclose(column.values, text.columns[name].values, rtol=2e-5, atol=1e-5)
    np.testing.assert_array_equal(binary.places["nodes"].triangles, text.places["nodes"].triangles)


def test_both_files_of_a_model_are_joined_by_their_times(patch):
    joined = join_columns([read_results(patch), read_results(patch.with_suffix(".dat"))])
    assert joined.cases == 1
    here, there = joined.places["nodes"], joined.places["nodes of ALL"]
    np.testing.assert_array_equal(here.points(), there.points())
    np.testing.assert_allclose(
        joined.columns["DISP.D3"].values, joined.columns["displacements.vz of ALL"].values, atol=1e-8
    )
    # the energy of a constant strain, and outer forces that hold each other
    stress, strain = exact_stress(), np.array(GRADIENT)
    work = sum(stress[name] * strain[place] for name, place in PLACES.items()) + sum(
        stress[name] * strain[place[::-1]] for name, place in PLACES.items() if place[0] != place[1]
    )
    assert joined.columns["total internal energy of BODY"].values == pytest.approx(work / 2 * 1000, rel=1e-5)
    assert np.abs(joined.columns["total force.fx of OUTER"].values).max() < 1e-6


@pytest.mark.parametrize("share", [0.2, 0.5, 0.7, 0.9, 0.97])
@pytest.mark.parametrize("output", ["FILE", "OUTPUT"])
def test_a_file_that_is_cut_short_is_refused_or_has_fewer_columns(ccx, tmp_path, share, output):
    whole = run(ccx, tmp_path, "whole", patch_deck(GRADIENT, YOUNG, POISSON, output))
    content = whole.read_bytes()
    cut = tmp_path / "cut.frd"
    cut.write_bytes(content[: int(share * len(content))])
    with pytest.raises(FileFormatError, match=r"cut\.frd, line \d+: .*\n.*cut short"):
        read_results(cut)


def damaged(patch, tmp_path, suffix, change):
    lines = patch.with_suffix(suffix).read_text().splitlines(keepends=True)
    path = tmp_path / f"damaged{suffix}"
    path.write_text("".join(change(lines)))
    return path


def at_line(lines, start, offset, change):
    """Lines in which the one so far behind the first that begins so is changed; an empty change drops it."""
    row = next(i for i, line in enumerate(lines) if line.startswith(start)) + offset
    return [change(line) if i == row else line for i, line in enumerate(lines)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(lambda lines: at_line(lines, " -4  STRESS", 9, lambda _: ""), "rows", id="row lost"),
        pytest.param(
            lambda lines: at_line(lines, " -4  STRESS", 9, lambda line: line[:30] + "\n"),
            "1 numbers stand in a row",
            id="row cut",
        ),
        pytest.param(
            lambda lines: at_line(lines, " -4  STRESS", 2, lambda _: ""),
            "fewer than its 6",
            id="component lost",
        ),
        pytest.param(
            lambda lines: at_line(lines, "    3C", 0, lambda line: line.replace("8", "9", 1)),
            "elements end too soon",
            id="elements lost",
        ),
        pytest.param(
            lambda lines: at_line(lines, " -4  DISP", 0, lambda _: "nonsense\n"),
            "-4",
            id="name of block lost",
        ),
        pytest.param(lambda lines: [*lines[:20], "   77X\n", *lines[20:]], "77X", id="foreign line"),
        pytest.param(
            lambda lines: [line for line in lines if not line.startswith((" -3", " -5  SZZ"))],
            "end mark",
            id="ends lost",
        ),
    ],
)
def test_a_damaged_result_file_is_refused_with_its_line(patch, tmp_path, change, message):
    path = damaged(patch, tmp_path, ".frd", change)
    with pytest.raises(FileFormatError, match=rf"damaged\.frd, line \d+: [\s\S]*({message})"):
        read_results(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(
            lambda lines: at_line(lines, " stresses", 3, lambda line: line[:60] + "\n"),
            "numbers stand here, 8 are announced in line",
            id="row cut",
        ),
        pytest.param(
            lambda lines: at_line(lines, " stresses", 3, lambda line: line.replace("E", "?")),
            "is no number",
            id="not a number",
        ),
        pytest.param(lambda lines: ["S T E P\n", "  1.0 2.0\n"], "no table of a set", id="no table"),
    ],
)
def test_a_damaged_print_file_is_refused_with_its_line(patch, tmp_path, change, message):
    path = damaged(patch, tmp_path, ".dat", change)
    with pytest.raises(FileFormatError, match=rf"line \d+: .*{message}"):
        read_results(path)


def test_a_set_with_fewer_rows_later_is_refused(tmp_path):
    table = " displacements (vx,vy,vz) for set TOP and time  {}\n\n"
    rows = "         5  1.0E-02  0.0E+00 -1.0E-02\n         6  1.0E-02  0.0E+00 -1.0E-02\n"
    path = tmp_path / "short.dat"
    path.write_text(
        table.format("0.5000000E+00") + rows + table.format("0.1000000E+01") + rows[: len(rows) // 2]
    )
    with pytest.raises(FileFormatError, match=r"line 5: .* has 1 rows, 2 in line 1"):
        read_results(path)


def test_overlong_exponents_and_overflows(tmp_path):
    path = tmp_path / "tiny.dat"
    head = " total force (fx,fy,fz) for set TOP and time  0.1000000E+01\n\n"
    path.write_text(f"{head}       1.000000-101  2.000000E+00        NaN\n")
    results = read_results(path)
    assert results.columns["total force.fx of TOP"].values == [1e-101]
    assert np.isnan(results.columns["total force.fz of TOP"].values).all()
    path.write_text(f"{head}       ************  2.000000E+00  1.0\n")
    with pytest.raises(FileFormatError, match=r"line 3: '\*+' is no number"):
        read_results(path)


def short_file(tmp_path, name="short.frd", *, last="9999\n"):
    """Two nodes with five-digit numbers, one field of seven components and touching negative numbers."""
    values = "".join(f"{v:12.5E}" for v in (-1.5, -2.5, -3.5, -4.5, -5.5, -6.5))
    lines = [
        "    1C",
        f"    2C{'':18}{2:12d}{'':37}0",
        f" -1{1:5d}{0.0:12.5E}{0.0:12.5E}{0.0:12.5E}",
        f" -1{7:5d}{1.0:12.5E}{-1.0:12.5E}{-2.0:12.5E}",
        " -3",
        f"    1PSTEP{1:26d}{1:12d}{1:12d}",
        f"  100CL  101{0.25:12.5E}{2:12d}{'':20}{0:2d}{1:5d}{'':10}{0:2d}",
        f" -4  STATE   {7:5d}{1:5d}",
        *(f" -5  S{i}      {1:5d}{1:5d}{i:5d}{0:5d}" for i in range(1, 8)),
        f" -1{1:5d}{values}",
        f" -2{'':5}{7.5:12.5E}",
        f" -1{7:5d}{values}",
        f" -2{'':5}{8.5:12.5E}",
        " -3",
    ]
    path = tmp_path / name
    path.write_text("\n".join(lines) + f"\n{last}")
    return path


def test_short_lines_that_go_on_are_read(tmp_path):
    results = read_results(short_file(tmp_path))
    assert results.places["nodes"].ids.tolist() == [1, 7]
    assert results.columns["STATE.S6"].values.tolist() == [[-6.5, -6.5]]
    assert results.columns["STATE.S7"].values.tolist() == [[7.5, 8.5]]
    assert results.columns["time"].values.tolist() == [0.25]
    assert results.notes == ()


def test_a_file_without_its_last_line_says_so(tmp_path):
    assert "9999" in read_results(short_file(tmp_path, last="")).notes[0]


def test_files_of_different_cases_without_common_times_are_refused(tmp_path):
    frd = short_file(tmp_path)
    dat = tmp_path / "short.dat"
    dat.write_text(
        " total force (fx,fy,fz) for set TOP and time  0.1000000E+01\n\n   1.0E+00  2.0E+00  3.0E+00\n"
    )
    with pytest.raises(UsageError, match="different cases"):
        join_columns([read_results(frd), read_results(dat)])


def test_every_mode_of_a_frequency_analysis_is_a_case(ccx, tmp_path):
    deck = patch_deck(GRADIENT, YOUNG, POISSON)
    deck = deck.replace("*SOLID SECTION", "*DENSITY\n1e-9\n*SOLID SECTION").replace(
        deck[deck.index("*STEP") : deck.index("*NODE FILE")],
        "*BOUNDARY\n1, 1, 3\n2, 2, 3\n4, 3, 3\n*STEP\n*FREQUENCY\n3\n",
    )
    path = run(ccx, tmp_path, "modes", deck)
    frd, dat = read_results(path), read_results(path.with_suffix(".dat"))
    assert frd.cases == dat.cases == 3
    assert (np.diff(frd.columns["frequency"].values) > 0).all()
    joined = join_columns([frd, dat])
    shapes = joined.columns["DISP.D1"].values, joined.columns["displacements.vx of ALL"].values
    np.testing.assert_allclose(*shapes, rtol=1e-4, atol=1e-5 * np.abs(shapes[0]).max())


def test_prints_with_local_axes_odd_heads_and_open_numbers_of_values(tmp_path):
    time = "and time  0.1000000E+01\n\n"
    path = tmp_path / "odd.dat"
    path.write_text(
        f" stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz) for set B {time}"
        "         1   1  1.0E+00  2.0E+00  3.0E+00  4.0E+00  5.0E+00  6.0E+00 _shell_0000000001   \n\n"
        f" equivalent plastic strain (elem, integ.pnt.,pe)for set B {time}         1   1  2.5E-01\n\n"
        f" internal state variables (elem, integ.pnt.,values) for set B {time}         1   1  1.0E+00  2.0E+00\n\n"
        f" center of gravity for set B {time}        1.0E+00  2.0E+00  3.0E+00\n\n"
        f" temperatures for set N {time}         3  2.93E+02\n\n"
        f" mass (element, mass) and mass moment of inertia (xx,yy) for set B {time}         1  1.0E+00  2.0E+00\n"
    )
    results = read_results(path)
    values = {name: column.values.ravel().tolist() for name, column in results.columns.items()}
    assert values["stresses.syz of B"] == [6.0]
    assert values["equivalent plastic strain of B"] == [0.25]
    assert values["internal state variables.v2 of B"] == [2.0]
    assert values["center of gravity.z of B"] == [3.0]
    assert values["temperatures of N"] == [293.0]
    assert any("local axes, _shell_0000000001" in note for note in results.notes)
    assert any(note.startswith("Skipped line 21") for note in results.notes)
