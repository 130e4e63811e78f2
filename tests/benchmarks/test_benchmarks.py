"""Benchmarks run, their tables come out, and what must hold at any size holds."""

from __future__ import annotations

import importlib
import json
import math
import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks.records import Record
from benchmarks.runner import BENCHMARKS
from benchmarks.surrogate_plots import curves
from benchmarks.surrogate_rivals import RIVALS
from benchmarks.touch_studies import STUDIES

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.full

# those of which something holds at any size run once, for all tests
MEASURED = (
    "cantilever",
    "latency",
    "runtime",
    "surrogates",
    "sweep",
    "touching",
    "touching_cost",
    "touching_feel",
    "touching_mesh",
)


def run(*arguments):
    found = subprocess.run(
        [sys.executable, "-m", "benchmarks", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 0, found.stderr
    return found.stdout


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    return tmp_path_factory.mktemp("benchmarks") / "records"


@pytest.fixture(scope="module")
def quick(records):
    return json.loads(run("--quick", "--json", "--record", str(records), "--only", *MEASURED))


@pytest.fixture(scope="module")
def tables(quick):
    return {table["name"]: table for table in quick["tables"]}


def rows(table, **wanted):
    found = [row for row in table["rows"] if all(row[key] == value for key, value in wanted.items())]
    assert found, f"no row with {wanted}"
    return found


@pytest.mark.parametrize("name", sorted(set(BENCHMARKS) - set(MEASURED)))
def test_the_others_are_found(name):
    """They import what they measure, and are carried out where their tables are renewed."""
    assert callable(importlib.import_module(f"benchmarks.{name}").tables)


def test_machine_is_named_with_versions_and_date(quick):
    assert {"date", "processor", "system", "python", "numpy", "scipy", "BLAS threads"} <= set(
        quick["machine"]
    )


@pytest.mark.parametrize("beam", ["copper", "nylon"])
def test_refinement_beats_the_filter_with_fewer_solves_than_the_targets_allow(tables, beam):
    forms = tables["cantilever-forms"]
    (refined,) = rows(forms, beam=beam, form="refined network")
    (default,) = rows(forms, beam=beam, form="default form")
    assert refined["solves"] <= 26
    assert max(refined["units_all"]) <= 6
    assert max(refined["rmse_all"]) < 5e-6
    assert max(refined["rmse_all"]) < min(default["rmse_all"])


def test_tightened_founding_form_grows_on(tables):
    for beam in ("copper", "nylon"):
        (plain,) = rows(tables["cantilever-forms"], beam=beam, form="founding form")
        (tight,) = rows(tables["cantilever-forms"], beam=beam, form="founding form, thresholds ÷ 10")
        assert tight["units_all"][0] > plain["units_all"][0]


@pytest.mark.parametrize("beam", ["copper", "nylon"])
def test_every_rival_has_learnt_the_beam(tables, beam):
    found = rows(tables["cantilever-rivals"], beam=beam)
    assert len(found) >= 5
    for row in found:
        assert row["rmse"] < 0.02, row["method"]


def test_a_spline_error_falls_with_the_fourth_power(tables):
    # so the solves themselves are exact far below what the networks are judged by
    (row,) = rows(tables["cantilever-rivals"], beam="copper", method="CubicSpline (SciPy)")
    assert row["rmse"] < 1e-10


def test_compiled_query_is_not_slower_than_plain_numpy(tables):
    latency = tables["latency"]
    assert {row["query"] for row in latency["rows"] if row["who"] == "NumPy"} == {
        row["query"] for row in latency["rows"]
    }
    for claim in latency["claims"]:
        if claim["what"].endswith("over NumPy"):
            assert claim["values"][0] < 1.0, claim["what"]


def test_loop_ticked_without_faults(tables):
    (row,) = tables["runtime"]["rows"]
    assert row["ticks"] > 300
    assert row["faults"] == "none"
    assert 0 < row["work_p50"] < 1000


def test_sweep_is_set_against_a_plain_loop(tables):
    table = tables["sweep"]
    assert any(row["ratio"] == 1.0 for row in table["rows"])
    assert all(math.isfinite(row["rate"]) and row["rate"] > 0 for row in table["rows"])


def test_touches_are_equilibria_of_the_plain_script_too(tables):
    sweep = tables["touching-sweep"]
    assert all(row["converged"] == row["admissible"] == 1.0 for row in sweep["rows"])
    found = {claim["what"]: claim["values"][0] for claim in sweep["claims"]}
    assert found["the plain script's residual at palpate's states"] < 1e-6
    assert found["its force there, off by, of the largest force"] < 1e-10
    assert found["its own answer's force, off by, of the largest force"] < 1e-6


def test_touching_is_measured_in_all_respects(tables):
    (spring,) = tables["touching-springs"]["rows"]
    assert 0 < spring["springs"] < spring["force"]  # points leave gaps that elements don't
    (pad,) = tables["touching-pad"]["rows"]
    assert 0 < pad["share"] < 1
    (cost,) = tables["touching-cost"]["rows"]
    assert cost["converged"] == 1.0
    assert 0 < cost["factor"] < cost["tangent"]
    (size,) = tables["touching-sizes"]["rows"]
    assert size["displacement"] > size["mixed"] > 0  # it locks
    assert tables["touching-imprint"]["rows"][0]["stiffness"] < 0


def test_surrogates_are_measured_beside_every_rival(tables):
    found = {row["method"]: row for row in tables["surrogates-block-rivals"]["rows"]}
    assert set(found) == {"palpate", *RIVALS}
    # its force is a gradient, whatever was learnt
    assert found["palpate"]["loop"] < 1e-9
    assert found["cubic RBF (SciPy)"]["loop"] > 1e-6


def test_curves_of_error_are_drawn_for_the_studies_that_were_measured(tables, tmp_path):
    few, all_of = tmp_path / "few.png", tmp_path / "all.png"
    curves(tables, few)
    block = tables["surrogates-block-curve"]
    curves({f"surrogates-{name}-curve": block for name in STUDIES}, all_of)
    # a row of panels for each three studies
    heights = [int.from_bytes(path.read_bytes()[20:24], "big") for path in (few, all_of)]
    assert heights[1] == math.ceil(len(STUDIES) / 3) * heights[0]


def test_every_table_has_a_record(tables):
    for name, table in tables.items():
        record = Record.read(name)
        assert len(record.columns) > 2, table["title"]
        assert "quick" not in record.title, "figures of a quick run mean nothing"


def test_what_was_measured_is_written_down(quick, tables, records):
    assert {path.stem for path in records.iterdir()} == set(tables)
    record = Record.read("runtime", records)
    assert str(tables["runtime"]["rows"][0]["ticks"]) in record.rows[0]
    assert quick["machine"]["processor"] in record.machine
    assert len(record.claims) == len(tables["runtime"]["claims"])
