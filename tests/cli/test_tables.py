"""`palpate fit` and `palpate ask --table`: from a table of samples to a table of answers."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.cli.fit_command import few_rows
from palpate.surrogates import Surrogate

sys.path.append(str(Path(__file__).parents[1] / "learning" / "correction"))
from correction_made import model as pressed


def samples(count=40):
    rng = np.random.default_rng(0)
    depth, speed = rng.uniform(0, 10, count), rng.uniform(0, 1, count)
    return depth, speed, 100 * depth + 5000 * speed**2


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A table of a measuring program with a title, decimal commas, a word and one row with a gap; and its path."""
    path = tmp_path_factory.mktemp("bench") / "bench.csv"
    rows = [f"{d:.4f};{v:.4f};{F:.4f};up".replace(".", ",") for d, v, F in zip(*samples(), strict=True)]
    head = ["Experiment 7;;;", "depth [mm];speed [m/s];F, mean [mN];stage"]
    path.write_text("\n".join([*head, *rows, "3,5;;2,5;up", ""]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def learnt(bench):
    """The same learnt, in the file that is named after the table."""
    from palpate.cli import main

    words = ["--inputs", "depth,speed", "--outputs", "F, mean", "--effort", "0.02"]
    with pytest.raises(SystemExit) as stop:
        main(["fit", str(bench), *words])
    assert not stop.value.code
    return bench.with_suffix(".palpate")


def test_few_rows_are_said_to_be_few():
    (line,) = few_rows(30, 3)
    assert "10 for each input" in line
    assert "±26 %" in line, "two deviations of a root mean square of 30 errors: 2 / √60"
    assert few_rows(101, 3) == []
    assert few_rows(101, 20) != []


@pytest.mark.full
def test_a_table_is_learnt_in_si_units_by_the_names_of_its_columns(learnt):
    found = pp.load(learnt)
    assert [(r.name, r.unit) for r in found.inputs] == [("depth", "m"), ("speed", "m/s")]
    assert [(q.name, q.unit) for q in found.outputs] == [("F, mean", "N")]
    depth, speed, force = samples()
    table = {"speed": speed, "depth": depth / 1e3}
    np.testing.assert_allclose(found.predict(table)[:, 0], force / 1e3, atol=0.05)


@pytest.mark.full
def test_fit_says_what_it_left_out_and_what_it_lacks(palpate, bench, learnt, tmp_path):
    words = (
        "fit",
        bench,
        "--inputs",
        "speed",
        "--inputs",
        "depth",
        "--outputs",
        "F, mean",
        "--effort",
        "0.02",
    )
    answer = palpate(*words, "-o", tmp_path / "new.palpate", "--json")
    content = json.loads(answer.out)
    assert (answer.code, content["rows"], content["rows_left_out"]) == (0, 40, 1)
    assert content["notes"][0] == "1 of 41 rows left out, in which a value is missing: line 43."
    assert [r["name"] for r in content["inputs"]] == ["speed", "depth"]
    for more, said in (
        ((), "exists already"),
        (("--force", "--missing", "refuse"), "line 43: Column 'speed' has no value. 1 of 41 rows has a gap"),
        (("--force", "--missing", "zero"), "leave-out"),
        (("--force", "--inputs", "sped"), "Did you mean 'speed'?"),
        (("--force", "--inputs", "stage"), "line 3: Column 4 (stage) holds 'up'"),
        (("--force", "--outputs", "depth"), "is an input and an output"),
        (("--force", "--unit", "depth"), "no unit of a column"),
        (("--force", "--decimal", "."), "holds '"),
        (("-o", tmp_path / "no" / "new.palpate"), "does not exist"),
    ):
        answer = palpate(*words, *more)
        assert (answer.code, said in " ".join(answer.err.split())) == (2, True), answer.err


@pytest.mark.full
@pytest.mark.filterwarnings("ignore::palpate.errors.FitWarning")
def test_a_wild_row_is_named_by_its_line(palpate, tmp_path):
    rng = np.random.default_rng(0)
    x = rng.uniform(-1.0, 1.0, 80)
    y = np.sin(3.0 * x) + 0.03 * rng.normal(size=80)
    y[20] += 8.0
    rows = [f"{a:.6f},{b:.6f}" for a, b in zip(x, y, strict=True)]
    path = tmp_path / "wild.csv"
    path.write_text("\n".join(["x [m],F [N]", "0.5,", *rows, ""]), encoding="utf-8")  # a gap shifts the rows
    answer = palpate("fit", path, "--inputs", "x", "--outputs", "F", "--effort", "0.02", "--json")
    assert "1 of 80 samples is far from what the others say: line 23. A wrong" in str(
        json.loads(answer.out)["notes"]
    )


def test_all_rows_of_a_table_are_answered(palpate, learnt, tmp_path):
    new = tmp_path / "new.csv"
    new.write_text("speed [mm/s],room,depth [um]\n500,1,5000\n100,2,\n300,1,90000\n", encoding="utf-8")
    answer = palpate("ask", learnt, "--table", new)
    rows = list(csv.reader(io.StringIO(answer.out)))
    head = ["line", "depth [m]", "speed [m/s]", "F, mean [N]", "F, mean deviation [N]", "trusted"]
    assert rows[0] == head
    assert [row[0] for row in rows[1:]] == ["2", "3", "4"]
    assert float(rows[1][3]) == pytest.approx(pp.load(learnt).predict([[5e-3, 0.5]])[0])
    assert rows[2] == ["3", "", "0.1", "", "", ""]
    assert rows[3][-1] == "no"
    assert "does not ask for: room" in answer.err
    assert "1 of 3 rows has no answer, a value is missing: line 3" in answer.err
    out = tmp_path / "out.csv"
    assert palpate("ask", learnt, "--table", new, "-o", out).code == 0
    again = palpate("ask", learnt, "--table", new, "-o", out)
    assert (again.code, "--force" in again.err) == (2, True)
    assert palpate("ask", learnt, "--table", new, "-o", out, "--force").code == 0
    assert list(csv.reader(io.StringIO(out.read_text()))) == rows
    content = json.loads(palpate("ask", learnt, "--table", new, "--json").out)
    assert [one["line"] for one in content["answers"]] == [2, 4]


def test_a_table_that_does_not_fit_the_model_is_refused(palpate, learnt, tmp_path):
    new = tmp_path / "new.csv"
    for text, more, said in (
        ("speed [mm/s],deep [um]\n1,2\n", (), "lacks 1 column that"),
        ("speed [mm/s],depth\n1,2\n", (), "line 1: column 'depth' has no unit; m is needed"),
        ("speed [mm/s],depth [N]\n1,2\n", (), "column 'depth' is in N; m is needed"),
        ("speed,depth [m]\n1,2\n", ("--at", "1,2"), "Give one of them"),
        ("speed [m/s],depth [m]\n1,2\n", ("-o", new), "is a file that is read here"),
    ):
        new.write_text(text)
        answer = palpate("ask", learnt, "--table", new, *more)
        assert (answer.code, said in " ".join(answer.err.split())) == (2, True), answer.err
    new.write_text("speed [m/s],depth\n0.5,5\n")
    assert palpate("ask", learnt, "--table", new, "--unit", "depth=mm").code == 0
    answer = palpate("ask", learnt, "--decimal", ",")
    assert (answer.code, "for a table" in answer.err) == (2, True)


def test_a_pressed_body_answers_for_a_table(palpate, tmp_path):
    body = pressed()
    path = Surrogate(body).save(tmp_path / "model.palpate")
    names = [r.name for r in body.inputs]
    middle = [(r.low + r.high) / 2 for r in body.inputs]
    head, row = ",".join(f"{n} [mm]" for n in names), ",".join(f"{1e3 * v!r}" for v in middle)
    (tmp_path / "places.csv").write_text(f"{head}\n{row}\n")
    answer = palpate("ask", path, "--table", tmp_path / "places.csv")
    rows = list(csv.DictReader(io.StringIO(answer.out)))
    force = body.force(np.array([middle]))[0]
    np.testing.assert_allclose(
        [float(rows[0][f"F{axis} [N]"]) for axis in "xyz"], force, rtol=1e-9, atol=1e-12
    )
