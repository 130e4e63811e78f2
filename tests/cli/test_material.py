"""`palpate material fit`: tables of tests in, constants, a picture and a study's table out."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from palpate.physics.materials import NeoHookean, PronySeries
from palpate.physics.materials.homogeneous import uniaxial
from palpate.study.material_records import SolidMaterialRecord

ROOT = Path(__file__).parents[2]
TRELOAR = ROOT / "examples" / "treloar"


def test_three_tables_are_fitted_by_one_command(palpate, tmp_path):
    picture, table = tmp_path / "fit.png", tmp_path / "rubber.toml"
    files = sorted(TRELOAR.glob("*.csv"))
    answer = palpate("material", "fit", *files, "--law", "yeoh", "--plot", picture, "-o", table, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert found["law"] == "yeoh"
    assert set(found["constants"]) == {"c10", "c20", "c30"}
    assert found["stable"] is True
    assert picture.stat().st_size > 10_000
    record = tomllib.loads(table.read_text())["body"]["material"]
    assert SolidMaterialRecord.model_validate(record).build().shear_modulus > 0


def test_strains_in_percent_and_decimal_commas_are_read(palpate, tmp_path):
    strain = np.linspace(0, 60, 12)
    stress = uniaxial(NeoHookean(30e3, 0.5), 1 + strain / 100).stress / 1e3
    rows = [f"{e:.2f};{s:.5f}".replace(".", ",") for e, s in zip(strain, stress, strict=True)]
    path = tmp_path / "gel-tension.csv"
    path.write_text("\n".join(["strain [%];nominal stress [kPa]", *rows, "70,0;"]), encoding="utf-8")
    answer = palpate("material", "fit", path, "--law", "neo-hookean", "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["constants"]["mu"]["value"] == pytest.approx(10e3, rel=1e-3)


def test_a_relaxation_gives_terms_for_a_study(palpate, tmp_path):
    time = np.geomspace(0.01, 50, 60)
    force = 80 * PronySeries(((0.3, 0.1), (0.2, 2.0))).relaxation(time)
    path = tmp_path / "relaxation.csv"
    path.write_text(
        "time [s],force [mN]\n" + "\n".join(f"{t:.6g},{f:.6g}" for t, f in zip(time, force, strict=True))
    )
    answer = palpate("material", "fit", path)
    assert answer.code == 0, answer.err
    terms = tomllib.loads(answer.out[answer.out.index("prony") :])["prony"]
    np.testing.assert_allclose(terms, [[0.3, 0.1], [0.2, 2.0]], rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "head", "words", "told"),
    [
        ("bar.csv", "stretch,nominal stress [kPa]", (), "kind of the test"),
        ("tension.csv", "stretch,stress [kPa]", (), "nominal or true"),
        ("tension.csv", "stretch,nominal stress", (), "has no unit"),
        ("tension.csv", "a,b", (), "no column of stretch or strain"),
        ("tension.csv", "stretch,nominal stress [kPa]", ("--column", "x=a"), "no column of a test"),
        ("tension.csv", "stretch,nominal stress [kPa]", ("--test", "pulling"), "given as pulling"),
        ("indent.csv", "depth [mm],force [mN]", (), "radius of the ball"),
    ],
)
def test_what_is_not_known_is_asked_for(palpate, tmp_path, name, head, words, told):
    path = tmp_path / name
    path.write_text(head + "\n1.0,0\n1.1,1\n1.2,2\n1.3,3\n")
    answer = palpate("material", "fit", path, *words)
    assert answer.code == 2
    assert told in answer.err.replace("\n", " ")


@pytest.mark.full
def test_the_page_on_materials_from_tests_runs(monkeypatch):
    page = (ROOT / "docs" / "guide" / "material-from-tests.md").read_text(encoding="utf-8")
    monkeypatch.chdir(ROOT / "examples")
    names: dict[str, object] = {"__name__": "page"}
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        exec(compile(block, "material-from-tests.md", "exec"), names)


def test_all_that_is_missing_is_asked_for_at_once(palpate, tmp_path):
    rows = "\n1.0,0\n1.1,1\n1.2,2\n1.3,3\n"
    (tmp_path / "a-tensile.csv").write_text("foo,bar" + rows)
    (tmp_path / "indent.csv").write_text("depth [mm],force [mN]" + rows)
    files = [tmp_path / name for name in ("a-tensile.csv", "indent.csv", "gone-tensile.csv", "unnamed.csv")]
    (tmp_path / "unnamed.csv").write_text("stretch,stress [Pa]" + rows)
    answer = palpate("material", "fit", *files)
    assert answer.code == 2
    assert answer.err.startswith("error: 5 things are wrong:")
    for told in (
        "no column of stretch",
        "no column of nominal",
        "radius of the ball",
        "no such file",
        "kind of the",
    ):
        assert answer.err.count(told) == 1, told
