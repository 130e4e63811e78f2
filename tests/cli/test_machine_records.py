"""`palpate material fit` on records as testing machines write them: names, raw load, signs, cycles, clocks."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.physics.materials import NeoHookean
from palpate.physics.materials.homogeneous import uniaxial

MU = 6e3  # Pa
HEIGHT, AREA = 25.0, 12.0  # mm, mm²
GEL = NeoHookean(3 * MU, 0.5)


def nominal(strain):
    """Nominal stress of a free specimen in kPa."""
    return uniaxial(GEL, 1 + np.asarray(strain)).stress / 1e3


def write(folder, name, head, columns, decimal="."):
    """Write columns with a head of one or two lines; with decimal commas between semicolons."""
    rows = [",".join(f"{value:.6f}" for value in row) for row in np.column_stack(columns)]
    text = "\n".join([*head, *rows]) + "\n"
    if decimal == ",":
        text = text.replace(",", ";").replace(".", ",")
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def modulus(palpate, *words):
    """Return μ in Pa and the notes of a neo-Hookean fit."""
    answer = palpate("material", "fit", *words, "--law", "neo-hookean", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    return found["constants"]["mu"]["value"], " ".join(found["notes"])


STRAIN = np.linspace(0.0, 0.8, 21)


@pytest.mark.grid
@pytest.mark.parametrize(
    ("names", "decimal"),
    [
        ("λ [-],Nominal stress [kPa]", "."),
        ("Tensile strain [%],Tensile stress [kPa]", "."),
        ("Tensile strain (Strain 1) [%],Tensile stress [kPa]", "."),
        ("Dehnung [%],Zugspannung [kPa]", ","),
        ("Wahre Dehnung [-],Technische Spannung [kPa]", ","),
        ("Déformation [%],Contrainte nominal [kPa]", "."),
    ],
)
def test_columns_are_known_by_the_names_that_machines_write(palpate, tmp_path, names, decimal):
    first = names.split(",")[0].lower()
    unit = 100 if "%" in first else 1
    amount = 1 + STRAIN if (first[0] in "λs" and "strain" not in first) or "ratio" in first else STRAIN * unit
    amount = np.log(1 + STRAIN) if any(word in first for word in ("true", "log", "wahre")) else amount
    count, time = np.arange(len(STRAIN)), 0.5 * np.arange(len(STRAIN))
    columns = [count, time, amount, nominal(STRAIN), 0 * time + 0.01]
    head = ["Point [Count],Time [Sec],{},{},Strain rate [1/s]".format(*names.split(","))]
    mu, _ = modulus(palpate, write(tmp_path, "tension-7.csv", head, columns, decimal))
    assert mu == pytest.approx(MU, rel=1e-4)


@pytest.mark.parametrize(
    "names",
    [
        "Extension,Load",
        "Crosshead,Load cell",
        "Standardweg,Standardkraft",
    ],
)
def test_load_and_extension_become_stress_and_strain_by_the_specimen_s_size(palpate, tmp_path, names):
    load = nominal(STRAIN) * AREA  # mN
    path = write(tmp_path, "zugversuch.csv", ["Zeit," + names, "s,mm,mN"], [STRAIN, HEIGHT * STRAIN, load])
    sizes = ("--height", f"{HEIGHT} mm", "--area", f"{AREA} mm^2")
    mu, _ = modulus(palpate, path, *sizes)
    assert mu == pytest.approx(MU, rel=1e-4)


def test_sizes_that_are_missing_or_wrong_are_asked_for(palpate, tmp_path):
    path = write(
        tmp_path, "tension.csv", ["Extension [mm],Load [mN]"], [HEIGHT * STRAIN, nominal(STRAIN) * AREA]
    )
    for words, said in (
        ((), "--height"),
        (("--height", "25 mm"), "--area"),
        (("--height", "-2 mm", "--area", "12 mm^2"), "not positive"),
    ):
        answer = palpate("material", "fit", path, *words)
        assert answer.code == 2
        assert said in answer.err


def test_each_file_has_its_own_size(palpate, tmp_path):
    files = []
    for i, size in enumerate((10.0, 20.0)):
        columns = [size * STRAIN, nominal(STRAIN) * 3 * size]
        files.append(write(tmp_path, f"tension-{i}.csv", ["Extension [mm],Load [mN]"], columns))
    heights, areas = ("--height", "10 mm", "--height", "20 mm"), ("--area", "30 mm^2", "--area", "60 mm^2")
    assert modulus(palpate, *files, *heights, *areas)[0] == pytest.approx(MU, rel=1e-4)
    answer = palpate("material", "fit", *files, files[0], *heights, *areas)
    assert answer.code == 2
    assert "--height is given 2 times for 3 files" in answer.err


PRESSED = np.linspace(0.0, 0.4, 21)


@pytest.mark.grid
@pytest.mark.parametrize(
    ("name", "head", "signs", "words"),
    [
        ("press.csv", "compressive strain [%],compressive stress [kPa]", (1, 1), ("--test", "uniaxial")),
        ("press.csv", "compressive strain [%],compressive stress [kPa]", (-1, -1), ("--test", "uniaxial")),
        ("press.csv", "compressive strain [%],compressive stress [kPa]", (1, -1), ("--test", "uniaxial")),
        ("press.csv", "compressive strain [%],nominal stress [kPa]", (1, 1), ("--test", "uniaxial")),
        ("press.csv", "strain [%],nominal stress [kPa]", (1, 1), ("--test", "compression")),
        ("gel-compression.csv", "strain [%],nominal stress [kPa]", (1, 1), ()),
        ("gel-compression.csv", "strain [%],nominal stress [kPa]", (-1, -1), ()),
        ("press.csv", "Stauchung [%],Druckspannung [kPa]", (1, 1), ("--test", "uniaxial")),
        (
            "press.csv",
            "compressive strain [%],compressive stress [kPa]",
            (1, 1),
            (
                "--test",
                "uniaxial",
                "--column",
                "strain=compressive strain",
                "--column",
                "stress=compressive stress",
            ),
        ),
    ],
)
def test_compression_is_the_other_sign_however_it_is_written(palpate, tmp_path, name, head, signs, words):
    columns = [100 * PRESSED * signs[0], -nominal(-PRESSED) * signs[1]]
    mu, notes = modulus(palpate, write(tmp_path, name, [head], columns), *words)
    assert mu == pytest.approx(MU, rel=1e-4)
    assert ("taken with the other sign" in notes) == (max(signs) > 0)


def test_advice_names_the_column_that_fits(palpate, tmp_path):
    columns = [STRAIN, HEIGHT * STRAIN, STRAIN, 100 * STRAIN, nominal(STRAIN)]
    path = write(tmp_path, "tension.csv", ["Time [s],Gap [mm],Pull [N],Along [%],Pressure [kPa]"], columns)
    answer = palpate("material", "fit", path)
    assert answer.code == 2
    assert '--column "strain=Along"' in answer.err
    answer = palpate("material", "fit", path, "--column", "strain=Along")
    assert '--column "nominal=Pressure"' in answer.err
    words = ("--column", "strain=Along", "--column", "nominal=Pressure")
    assert modulus(palpate, path, *words)[0] == pytest.approx(MU, rel=1e-4)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("Strain 1 [%],Strain 2 [%],nominal stress [kPa]", "'Strain 1' and 'Strain 2' are both strain"),
        ("strain,x [mm],nominal stress [kPa]", "may be a strain, or per cent"),
        ("strain rate [1/s],strain energy [J],nominal stress [kPa]", "no column of stretch or strain"),
    ],
)
def test_a_column_that_may_be_another_is_asked_for(palpate, tmp_path, head, said):
    path = write(tmp_path, "tension.csv", [head], [10 * STRAIN, STRAIN, nominal(STRAIN)])
    answer = palpate("material", "fit", path)
    assert answer.code == 2
    assert said in answer.err.replace("\n", " ")


def softened(strain):
    """Stresses of three cycles whose later ones are softer and whose ways back are softer still, by factors."""
    up = np.linspace(0.0, strain, 25)
    parts = [(up, 1.0), (up[::-1], 0.7), (up, 0.8), (up[::-1], 0.65), (up, 0.75), (up[::-1], 0.6)]
    e = np.concatenate([x for x, _ in parts])
    return e, np.concatenate([share * nominal(x) for x, share in parts])


@pytest.mark.full
@pytest.mark.parametrize(
    ("words", "share", "said"),
    [
        ((), 1.0, "3 loadings and 3 unloadings: the first loading is fitted, 25 of 150 rows"),
        (("--cycle", "first"), 1.0, "the first loading"),
        (("--cycle", "2"), 0.8, "the loading 2"),
        (("--cycle", "last"), 0.75, "the last loading"),
        (("--cycle", "2 unloading"), 0.65, "the unloading 2"),
    ],
)
@pytest.mark.parametrize("end", [0.8, -0.4])
def test_one_loading_of_a_cyclic_record_is_fitted(palpate, tmp_path, end, words, share, said):
    path = write(tmp_path, "tension.csv", ["strain [1],nominal stress [kPa]"], softened(end))
    mu, notes = modulus(palpate, path, *words)
    assert mu == pytest.approx(share * MU, rel=1e-3)
    assert said in notes


def test_all_cycles_can_be_fitted_and_others_are_refused(palpate, tmp_path):
    path = write(tmp_path, "tension.csv", ["strain [1],nominal stress [kPa]"], softened(0.8))
    mu, notes = modulus(palpate, path, "--cycle", "all")
    assert mu == pytest.approx(0.75 * MU, rel=0.02)  # the mean of the six factors
    assert "all rows are fitted" in notes
    for wrong, said in (("4", "3 loadings and 3 unloadings"), ("third", "no cycle of a test")):
        answer = palpate("material", "fit", path, "--cycle", wrong)
        assert answer.code == 2
        assert said in answer.err


def test_a_stand_s_own_file_gives_the_law_that_made_it(palpate, tmp_path):
    strain = np.linspace(0.0, 1.5, 31)
    stretch, excess = 1 + strain, (1 + strain) ** 2 + 2 / (1 + strain) - 3  # I₁ − 3
    stress = 2 * (stretch - stretch**-2) * (0.12 - 0.008 * excess + 0.0018 * excess**2)  # MPa
    columns = [strain * 10, HEIGHT * strain, AREA * stress, 100 * strain, stress]
    rows = "\n".join(",".join(f'"{v:.5f}"' for v in row) for row in np.column_stack(columns))
    preamble = 'Specimen label,S-03\nTest date,12.03.2024\nRate 1,"10,00000",mm/min\nWidth,"6,00000",mm\n\n'
    head = '"Time","Extension","Load","Tensile strain","Tensile stress"\n"(s)","(mm)","(N)","(%)","(MPa)"\n'
    path = tmp_path / "tension_stand.csv"
    path.write_text(preamble + head + rows + '\n"Maximum","37.5","7","150","0.5"\n', encoding="utf-8")
    for words in ((), ("--height", "25 mm", "--area", "12 mm^2")):
        answer = palpate("material", "fit", path, *words, "--law", "yeoh", "--json")
        assert answer.code == 0, answer.err
        found = json.loads(answer.out)
        values = [found["constants"][name]["value"] for name in ("c10", "c20", "c30")]
        np.testing.assert_allclose(values, [0.12e6, -0.004e6, 0.0006e6], rtol=1e-3)
        notes = " ".join(found["notes"])
        assert "Maximum (line 39)" in notes
        assert ("as testing machines compute it" in notes) == (not words)


def relaxing(t, ramp=0.5):
    """Force in N of shares 0.35 in 1 s and 0.25 in 20 s, 0.1 N at once, t seconds after an even rise began."""

    def risen(u):
        u = np.maximum(u, 0.0)
        terms = [share * tau * (1 - np.exp(-u / tau)) for share, tau in ((0.35, 1.0), (0.25, 20.0))]
        return 0.4 * u + sum(terms)

    return 0.1 * (risen(t) - risen(t - ramp)) / ramp


CLOCK = 2.5 + np.geomspace(0.01, 200.0, 120)
WHOLE = np.concatenate([np.linspace(0.0, 2.45, 50), CLOCK])
PRELOAD = 2.0  # mN


def shares(palpate, *words):
    answer = palpate("material", "fit", *words, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    return found["prony"], found["instantaneous"], " ".join(found["notes"])


def test_a_hold_on_the_machine_s_clock_is_asked_for_and_given(palpate, tmp_path):
    force = 1e3 * relaxing(CLOCK - 2.0) + PRELOAD
    path = write(tmp_path, "relaxation_clock.csv", ["time [s],force [mN]"], [CLOCK, force])
    answer = palpate("material", "fit", path)
    assert answer.code == 2
    assert "begins at 2.51 s" in answer.err
    assert '--begin "2.51 s"' in answer.err
    words = ("--begin", "2.5 s", "--ramp", "0.5 s")
    terms, at_once, _ = shares(palpate, path, *words, "--preload", "2 mN")
    np.testing.assert_allclose(terms, [[0.35, 1.0], [0.25, 20.0]], rtol=1e-3)
    assert at_once == pytest.approx(0.1, rel=1e-3)
    terms, at_once, notes = shares(palpate, path, *words)
    assert at_once == pytest.approx(0.102, rel=1e-3)
    assert "a preload, if there was one" in notes


@pytest.mark.full
@pytest.mark.parametrize("sign", [1, -1])
def test_a_whole_record_tells_rise_hold_and_preload(palpate, tmp_path, sign):
    force = sign * (1e3 * relaxing(WHOLE - 2.0) + PRELOAD)
    path = write(tmp_path, "relaxation_raw.csv", ["Zeit,Kraft", "s,mN"], [WHOLE, force], ",")
    terms, at_once, notes = shares(palpate, path)
    np.testing.assert_allclose(terms, [[0.35, 1.0], [0.25, 20.0]], rtol=5e-3)
    assert at_once == pytest.approx(0.1 * sign, rel=5e-3)
    assert "the hold begins at 2.5" in notes
    assert f"the response was {'-' * (sign < 0)}0.002" in notes
    given = ("--begin", "2.5 s", "--ramp", "0.5 s", "--preload", f"{2 * sign} mN")
    terms, at_once, _ = shares(palpate, path, *given)
    np.testing.assert_allclose(terms, [[0.35, 1.0], [0.25, 20.0]], rtol=1e-3)
    answer = palpate("material", "fit", path, "--begin", "300 s")
    assert answer.code == 2
    assert "the record ends at 202.5 s" in answer.err
