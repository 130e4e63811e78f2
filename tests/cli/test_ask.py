"""`palpate ask`: what a file holds, and what it answers at a place."""

from __future__ import annotations

import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from models import spring_beam
from palpate.dataset.measured import read_measurements, write_measurements
from palpate.learning.correction import correct
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import Relaxation

sys.path.append(str(Path(__file__).parents[1] / "learning" / "correction"))
from correction_made import model, touches


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("ask") / "model.palpate"
    return Surrogate(model()).save(path)


def text_of(x):
    return ",".join(map(repr, x.tolist()))


def test_a_file_says_what_it_holds(palpate, file):
    answer = palpate("ask", file)
    assert answer.code == 0
    for one in model().inputs:
        assert one.name in answer.out
    assert str(Surrogate(model())).splitlines()[0] in answer.out


def test_answers_are_the_surrogates(palpate, file):
    S = Surrogate.load(file).energy
    X = touches(3, 4, shallowest=0.001)
    X[2, 2] = 1.0  # in the air
    places = [word for x in X for word in ("--at", text_of(x))]
    answers = json.loads(palpate("ask", file, *places, "--json").out)["answers"]
    assert len(answers) == 3
    for key, wanted in {
        "inputs": X,
        "energy": S.energy(X),
        "force": S.force(X),
        "stiffness": S.stiffness(X),
        "inside": S.inside(X),
    }.items():
        np.testing.assert_array_equal([one[key] for one in answers], wanted)
    if S.root is not None:
        np.testing.assert_array_equal([one["deviation"] for one in answers], S.deviation(X))
    words = palpate("ask", file, *places).out
    assert f"{np.linalg.norm(S.force(X)[0]):.4g} N" in words
    assert words.count("no contact") == 1


def test_a_body_with_its_shape_answers_by_its_energy(palpate, file, tmp_path):
    S = Surrogate.load(file).energy
    both = Surrogate(S).save(tmp_path / "both.palpate")
    x = touches(1, 5)
    (answer,) = json.loads(palpate("ask", both, "--at", text_of(x[0]), "--json").out)["answers"]
    np.testing.assert_array_equal(answer["force"], S.force(x)[0])


def test_beyond_the_ranges_the_trust_is_not_known(palpate, file):
    S = Surrogate.load(file).energy
    deep = touches(1, 5)
    deep[0, 2] = S.inputs[2].low - 0.001
    assert S.force(deep).any()
    assert not S.inside(deep).any()
    words = palpate("ask", file, "--at", text_of(deep[0])).out
    assert "not known, OUTSIDE" in words
    assert f"c_z {deep[0, 2]:g} m is not in" in words
    assert "%" not in words
    (answer,) = json.loads(palpate("ask", file, "--at", text_of(deep[0]), "--json").out)["answers"]
    assert answer["deviation"] is None
    assert answer["inside"] is False
    # millimetres taken for metres
    words = palpate("ask", file, "--at", "0,0,50").out
    assert "no contact" in words
    assert "c_z 50 m is not in" in words


def test_deeper_than_the_distance_goes_no_force_is_told(palpate, file):
    S = Surrogate.load(file).energy
    end, middle = S.baseline.inner, touches(1, 5)
    line = np.repeat(middle, 3, axis=0)
    line[:, 2] = -end + np.array(
        [0.0005, -0.0005, -1.8 * S.baseline.radius]
    )  # just before, just behind, where d turns back
    behind, air = middle[0] - [0, 0, 10 * S.baseline.radius], middle[0] + [0.2, 0, 2 * S.baseline.radius]
    assert S.force(line).any(axis=1).all()
    assert S.force(line)[2] @ S.force(line)[0] < 0, "the energy has to end, and pulls the probe in"
    texts = [word for x in line for word in ("--at", text_of(x))]
    first, *rest = json.loads(palpate("ask", file, *texts, "--json").out)["answers"]
    np.testing.assert_array_equal(first["force"], S.force(line)[0])
    for one in rest:
        assert one["force"] == [None] * 3
        assert one["energy"] is None
        assert one["inside"] is False
        assert one["contact"] is None
    words = palpate("ask", file, *texts).out
    assert words.count("no force is known here") == 2
    assert not S.force(np.array([behind, air])).any()
    places = ("--at", text_of(behind), "--at", text_of(air), "--at", text_of(middle[0]))
    unknown, free, pressed = json.loads(palpate("ask", file, *places, "--json").out)["answers"]
    assert (unknown["force"], unknown["inside"], unknown["contact"]) == ([None] * 3, False, None)
    assert (free["force"], free["contact"], free["beyond"]) == ([0.0] * 3, False, ["c_x", "c_z"])
    assert (pressed["contact"], pressed["beyond"]) == (True, [])
    assert f"{1e3 * end:.3g} mm beneath" in words


def test_the_stiffness_along_the_force_is_positive_where_pressing_meets_more(palpate, file):
    S, x = Surrogate.load(file).energy, touches(1, 5)
    F, K = S.force(x)[0], -S.stiffness(x)[0]
    words = palpate("ask", file, "--at", text_of(x[0])).out
    assert f"stiffness  {F @ K @ F / (F @ F):.4g} N/m along the force" in words
    assert "∂F/∂c" in words


def test_of_a_body_that_relaxes_the_answer_is_that_of_an_instant(palpate, file, tmp_path):
    body = Surrogate.load(file).with_memory(Relaxation(((0.3, 0.1),)))
    path = body.save(tmp_path / "relaxing.palpate")
    assert "relaxes by 0.3 in 0.1 s" in palpate("ask", path).out
    assert "that of an instant" in palpate("ask", path, "--at", text_of(touches(1, 5)[0])).out
    assert "instant" not in palpate("ask", file, "--at", text_of(touches(1, 5)[0])).out


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    X = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))
    found = pp.fit(X, np.column_stack([np.sin(X[:, 0]), X[:, 1] ** 2]), effort=0.03)
    return found, found.save(tmp_path_factory.mktemp("fitted") / "fit.palpate")


@pytest.mark.full
def test_networks_of_arrays_answer_too(palpate, fitted):
    found, path = fitted
    words = palpate("ask", path).out
    assert "Fitted: 2 inputs → 2 outputs" in words
    X = np.array([[0.1, 0.2], [3.0, 0.1]])
    places = [word for x in X for word in ("--at", text_of(x))]
    first, beyond = json.loads(palpate("ask", path, *places, "--json").out)["answers"]
    assert first["outputs"] == dict(zip(["y0", "y1"], found.predict(X)[0], strict=True))
    assert first["deviations"] == found.deviation(X)[0].tolist()
    assert (first["inside"], beyond["inside"]) == (True, False)
    assert beyond["deviations"] == [None, None]
    words = palpate("ask", path, *places).out
    assert f"{found.predict(X)[0, 1]:.6g} ± {found.deviation(X)[0, 1]:.2g}" in words
    assert "x0 3 is not in" in words
    assert words.count("±") == 2
    assert palpate("ask", path, "--at", "1,2,3").code == 2


@pytest.mark.full
def test_a_network_alone_knows_its_ranges_and_no_deviation(palpate, fitted, tmp_path):
    net = fitted[0].network
    path = replace(net, extras={}, meta={}).save(tmp_path / "net.palpate")
    assert "Network" in palpate("ask", path).out
    (answer,) = json.loads(palpate("ask", path, "--at", "0.1,0.2", "--json").out)["answers"]
    assert list(answer["outputs"].values()) == net.predict(np.array([[0.1, 0.2]]))[0].tolist()
    assert answer["deviations"] is answer["inside"] is None
    assert "within the ranges" in palpate("ask", path, "--at", "0.1,0.2").out


def test_histories_of_a_held_body_say_what_they_are(palpate):
    path = Path(__file__).parents[1] / "data" / "former" / "histories.palpate"
    assert "1 history with 50 samples" in palpate("ask", path).out
    answer = palpate("ask", path, "--at", "0,0,0")
    assert (answer.code, "no learnt body and no network" in answer.err) == (2, True)


@pytest.mark.full
def test_what_was_suspicious_of_a_correction_is_told_again(palpate, tmp_path):
    S, X, path = model(), touches(30, 3), tmp_path / "wrong.palpate"
    measured = read_measurements(write_measurements(tmp_path / "pushed.csv", X, -S.force(X)))
    correct(Surrogate(S), measured).surrogate.save(path)
    for words in ((), ("--at", text_of(X[0]))):
        assert "Change their sign" in palpate("ask", path, *words).out
        assert "Change their sign" in json.loads(palpate("ask", path, *words, "--json").out)["warning"]
    assert "with a warning" in str(Surrogate.load(path))
    assert "with a warning" in touchable(Surrogate.load(path)).name


@pytest.mark.parametrize("place", ["0.01,0.02", "1,2,3,4", "a,b,c", "0.01,nan,0.02", ""])
def test_what_is_no_place_is_told_what_is(palpate, file, place):
    answer = palpate("ask", file, "--at", place)
    assert answer.code == 2
    assert f"{len(model().inputs)} inputs" in answer.err
    assert "--at" in answer.err


def test_a_beam_is_asked_at_its_loads(palpate, tmp_path):
    """The spring of 20 N/m moves by 0.1 m under 2 N, each node as x²."""
    path = spring_beam(stiffness=20.0).save(tmp_path / "beam.palpate")
    assert "displacement at 21 nodes" in palpate("ask", path).out
    answer = palpate("ask", path, "--at", "2", "--json")
    assert answer.code == 0, answer.err
    (told,) = json.loads(answer.out)["answers"]
    x, moved = np.array(told["nodes"])[:, 0], np.array(told["displacement"])
    np.testing.assert_allclose(moved[:, 1], -0.1 * x**2, atol=1e-12)
    assert told["beyond"] == []
    words = palpate("ask", path, "--at", "2.5").out
    assert "at tip 2.5 N" in words
    assert "at 1 m  u_x 0 mm, u_y -125 mm" in words
    assert "beyond the range" in palpate("ask", path, "--at", "7").out
    assert palpate("ask", path, "--at", "0,0,0").code == 2


def test_a_missing_file_is_named(palpate, tmp_path):
    answer = palpate("ask", tmp_path / "none.palpate")
    assert answer.code == 2
    assert "none.palpate" in answer.err


@pytest.mark.parametrize("is_beam", [False, True])
def test_the_command_that_a_file_prints_asks_it(palpate, file, tmp_path, is_beam):
    """A beam is asked by its loads, not by the place of its node; names of files may have blanks."""
    path = tmp_path / "my model.palpate"
    path.write_bytes(file.read_bytes())
    if is_beam:
        spring_beam(stiffness=20.0).save(path)
    (line,) = (one for one in palpate("ask", path).out.splitlines() if one.startswith("ask it"))
    program, *words = shlex.split(line.removeprefix("ask it"), comments=True)
    assert program == "palpate"
    answer = palpate(*words)
    assert answer.code == 0, answer.err
    assert ("tip in N" in line) == is_beam
