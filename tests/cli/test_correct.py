"""`palpate correct` on files, on a real pipe and on a real connection."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.dataset.measured import write_measurements
from palpate.learning.correction import force_error
from palpate.surrogates import Surrogate

sys.path.append(str(Path(__file__).parents[1] / "learning" / "correction"))
from correction_made import MODULUS, model, scaled, touches

HELLO = "palpate 1 length=mm force=mN time=ms\n"
FACTOR = 1.4


@pytest.fixture
def folder(tmp_path):
    Surrogate(model()).save(tmp_path / "model.touch")
    return tmp_path


def measured(count=40, seed=0):
    X = touches(count, seed, shallowest=0.001)
    return X, scaled(model(), FACTOR).force(X)


def lines(X, F):
    rows = np.column_stack([np.arange(len(X)), 1e3 * X, 1e3 * F]).tolist()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows)


def ordered(folder):
    """The command that corrects the model by a table, in words."""
    made = ("--file", folder / "specimen.csv", "--out", folder / "new.touch")
    return ("correct", folder / "model.touch", *made)


def follows(path):
    X, F = measured(100, 9)
    return force_error(Surrogate.load(path).energy, X, F).median < 0.02


def started(folder, *words):
    command = [sys.executable, "-m", "palpate", "correct", "model.touch", "--out", "new.touch", *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, text=True)


@pytest.mark.full
def test_a_file_corrects_a_model(palpate, folder):
    X, F = measured()
    write_measurements(folder / "specimen.csv", X, F)
    answer = palpate(*ordered(folder))
    assert answer.code == 0
    assert follows(folder / "new.touch")
    before = re.search(r"before .* ([\d.]+) % median", answer.out)[1]
    after = re.search(r"after .* ([\d.]+) % median", answer.out)[1]
    assert float(before) == pytest.approx(100 * (1 - 1 / FACTOR), abs=1.0)
    assert float(after) < 2
    said = palpate(*ordered(folder), "--json")
    content = json.loads(said.out)
    assert content["counts"]["learnt"] == 40
    assert content["left_out"]["median"] < 0.03


@pytest.mark.full
@pytest.mark.parametrize(("factor", "said"), [(-1.0, "Change their sign"), (1e3, "1e+03 times the model's")])
def test_forces_that_can_hardly_be_this_bodys_are_a_failure_that_loses_nothing(palpate, folder, factor, said):
    X = touches(30, 3)
    write_measurements(folder / "specimen.csv", X, factor * model().force(X))
    words = ordered(folder)
    answer = palpate(*words)
    assert answer.code == 1
    assert said in answer.err
    assert "before" in answer.out
    assert said in Surrogate.load(folder / "new.touch").meta["correction"]["warning"]
    assert said in json.loads(palpate(*words, "--json").out)["warning"]


@pytest.mark.full
@pytest.mark.parametrize(
    ("factor", "more", "said"),
    [(1e3 * FACTOR, ("--offset", "0.005"), "units (pounds"), (-1e3, (), "Change their sign")],
)
def test_where_such_forces_teach_nothing_they_are_the_reason(palpate, folder, factor, more, said):
    X = touches(60, 3)
    F = factor * model().force(X) + np.random.default_rng(1).normal(0.0, 3.0, (60, 3))
    write_measurements(folder / "specimen.csv", X, F)
    words = ordered(folder)
    answer = palpate(*words, *more)
    assert answer.code == 2
    assert said in answer.err
    assert "Nothing could be learnt from them" in answer.err
    assert not (folder / "new.touch").exists()


def test_a_short_record_says_that_none_of_it_was_left_out(palpate, folder):
    X, F = measured(9)
    write_measurements(folder / "specimen.csv", X, F)
    words = ordered(folder)
    assert "left out  not judged: only files of 10" in palpate(*words).out


@pytest.mark.full
def test_a_body_with_its_shape_stays_one(palpate, folder):
    X, F = measured()
    write_measurements(folder / "specimen.csv", X, F)
    Surrogate(model()).save(folder / "body.palpate")
    words = ("correct", folder / "body.palpate", "--file", folder / "specimen.csv", "--out")
    assert palpate(*words, folder / "new.palpate").code == 0
    found = Surrogate.load(folder / "new.palpate")
    assert "corrected by 40 measured touches" in str(found)
    X, F = measured(100, 9)
    assert force_error(found.energy, X, F).median < 0.02
    answer = palpate(*words, folder / "body.palpate")
    assert (answer.code, "is the model itself" in answer.err) == (2, True)


@pytest.mark.full
def test_standard_input_of_a_real_process(folder):
    X, F = measured()
    with started(folder, "--stdin") as process:
        out, err = process.communicate(
            HELLO + lines(X[:20], F[:20]) + "oops\n" + lines(X[20:], F[20:]), timeout=60
        )
    assert process.returncode == 0, err
    assert "ok t x y z fx fy fz" in err
    assert "error line 22: 1 values stand where 7 belong." in err
    assert "40 learnt" in out
    assert follows(folder / "new.touch")


@pytest.mark.full
def test_a_pipe_that_falls_silent_ends_and_what_came_is_kept(folder):
    X, F = measured()
    with started(folder, "--stdin", "--stall", "1.5") as process:
        process.stdin.write(HELLO + lines(X, F))
        process.stdin.flush()
        assert process.wait(timeout=60) == 0  # its input is still open
        assert "40 learnt" in process.stdout.read()
        said = process.stderr.read()
        assert "Fatal" not in said
        assert "the stream ended: nothing came for 1.5 s; what had come is learnt from" in said
    assert follows(folder / "new.touch")


@pytest.mark.full
def test_a_connection_to_a_real_process(folder):
    X, F = measured()
    with started(folder, "--port", "0", "--json") as process:
        port, token = re.search(r"127\.0\.0\.1:(\d+); first line: (\S+)", process.stderr.readline()).groups()
        with (
            socket.create_connection(("127.0.0.1", int(port)), timeout=10) as sensor,
            sensor.makefile("rw") as talk,
        ):
            talk.write(f"{token}\n" + HELLO + lines(X[:30], F[:30]) + "1 2 3\n")
            talk.flush()
            assert talk.readline().startswith("ok")
            assert talk.readline().startswith("error line 32:")
            talk.write(lines(X[30:], F[30:]) + "end\n")
            talk.flush()
            assert talk.readline() == ""
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads(out)["counts"] == {"learnt": 40}
    assert follows(folder / "new.touch")


@pytest.mark.full
def test_a_family_takes_its_parameters_with_units(palpate, tmp_path):
    S = model(extra=[MODULUS])
    Surrogate(S).save(tmp_path / "family.touch")
    X = touches(30, 5, extra=[MODULUS])
    X[:, 3] = 9e3
    write_measurements(tmp_path / "specimen.csv", X[:, :3], scaled(S, 1.3).force(X))
    words = (
        "correct",
        tmp_path / "family.touch",
        "--file",
        tmp_path / "specimen.csv",
        "--out",
        tmp_path / "new",
    )
    assert palpate(*words, "--parameter", "modulus=9 kPa").code == 0
    for wrong, named in (
        ((), "modulus"),
        (("--parameter", "modulus=9 m"), "'9 m' is not a quantity in Pa"),
        (("--parameter", "height=1"), "modulus"),
    ):
        answer = palpate(*words, *wrong)
        assert answer.code == 2
        assert named in " ".join(answer.err.split())


@pytest.mark.full
def test_what_can_not_be_is_refused_with_its_reason(palpate, folder):
    model_, out = folder / "model.touch", folder / "new.touch"
    (folder / "bad.csv").write_text("x [mm],y [mm],z [mm],Fz [N]\n1,2,3,four\n")
    for words, said in (
        ((), "one source"),
        (("--stdin", "--port", "0"), "one source"),
        (("--file", folder / "none.csv"), "can't be read"),
        (("--file", folder / "bad.csv"), "line 2: Column 4 (Fz) holds 'four'"),
        (("--file", folder / "bad.csv", "--noise", "0"), "--noise: 0 is out of range"),
    ):
        answer = palpate("correct", model_, "--out", out, *words)
        assert answer.code == 2
        assert said in answer.err
        assert not out.exists()
    answer = palpate("correct", model_, "--file", folder / "bad.csv", "--out", folder / "no" / "new.touch")
    assert (answer.code, "does not exist" in answer.err) == (2, True)
    assert palpate("correct", folder / "bad.csv", "--stdin", "--out", out).code == 2
    silent = palpate("correct", model_, "--port", "0", "--wait", "0.1", "--out", out)
    assert (silent.code, "Nobody connected" in silent.err) == (3, True)
    assert "port 0" not in silent.err  # but the one that it took
    open_ = palpate("correct", model_, "--port", "0", "--wait", "0.1", "--no-token", "--out", out)
    assert "Warning: no token" in open_.err
