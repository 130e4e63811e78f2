"""`palpate run` on a body that is pressed: what it says of a stroke within the training, and far beyond it."""

from __future__ import annotations

import json

import pytest

import pressed as slab
from held import pad
from palpate.runtime.touchable import touchable

pytestmark = pytest.mark.timeout(60)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return slab.surrogate(meta={"name": "slab"}).save(tmp_path_factory.mktemp("run") / "slab.palpate")


def stroke(metres: float) -> str:
    """So far into the body and out again, twice in a second."""
    scale = touchable(slab.surrogate()).workspace(0.075).scale
    return f"stroke:frequency=2,amplitude={metres / scale:.6f}"


@pytest.mark.full
def test_a_stroke_within_the_training_is_told_as_such(palpate, file):
    answer = palpate("run", file, "--seconds", "1", "--device", stroke(0.004), "--json")
    assert answer.code == 0, answer.err
    told = json.loads(answer.out)
    assert told["largest_depth"] == pytest.approx(0.004, rel=0.05)  # a look may miss the deepest millisecond
    assert told["outside"] == told["let_go"] == 0.0


@pytest.mark.full
def test_a_stroke_through_the_body_tells_how_long_it_was_let_go(palpate, file):
    deep = slab.RADIUS + slab.face().inner
    answer = palpate("run", file, "--seconds", "1", "--device", stroke(1.5 * deep), "--json")
    told = json.loads(answer.out)
    assert told["largest_depth"] <= deep + 1e-4
    assert 0.0 < told["let_go"] < told["outside"] < 1.0
    words = palpate("run", file, "--seconds", "1", "--device", stroke(1.5 * deep)).out
    assert "outside what was trained for" in words
    assert "so deep that the body let go for" in words


@pytest.mark.full
def test_the_warning_of_a_correction_is_told_again(palpate, tmp_path):
    meta = {"name": "slab", "correction": {"counts": {"learnt": 3}, "warning": "Change their sign."}}
    wrong = slab.surrogate(meta=meta).save(tmp_path / "wrong.palpate")
    answer = palpate("run", wrong, "--seconds", "0.2", "--device", stroke(0.002))
    assert answer.code == 0
    assert "its correction was warned of: Change their sign." in answer.err


@pytest.mark.full
def test_a_pad_is_pulled_by_the_script(palpate, tmp_path):
    file = pad().save(tmp_path / "pad.palpate")
    answer = palpate("run", file, "--seconds", "0.5", "--device", "stroke:frequency=2")
    assert answer.code == 0, answer.err
    assert "mm from rest" in answer.out


@pytest.mark.full
def test_a_body_too_stiff_for_its_device_is_softened_and_that_is_told(palpate, tmp_path):
    stiff = slab.surrogate(factor=50.0).save(tmp_path / "stiff.palpate")
    device = "simulated:delay=0.004,damping=0.3,shape=press"
    answer = palpate("run", stiff, "--seconds", "1", "--rate", "200", "--device", device, "--json")
    assert answer.code == 0, answer.err
    told = json.loads(answer.out)
    assert told["delay"] == pytest.approx(0.004, rel=0.1)
    assert told["felt_stiffness"] == pytest.approx(0.3 / (0.0025 + told["delay"]))
    assert told["felt_stiffness"] < 100.0 < told["body_stiffness"]
    assert told["energy_lowest"] >= -told["leak_bound"] - 1e-9
    assert told["largest_force"] > 0.01
    assert "softened to" in told["stiffness"]
    words = palpate("run", stiff, "--seconds", "0.2", "--rate", "200", "--device", device)
    assert "softened to" in words.err
    answer = palpate("run", stiff, "--seconds", "0.2", "--rate", "200", "--device", device, "--unsoftened")
    assert "as asked" in answer.err
    assert "energy    never below" in answer.out


SERVICES = [("haply", ("--port", "0", "--events", "0"), 0.10), ("crtk", ("--port", "0"), 0.05)]


@pytest.mark.grid
@pytest.mark.parametrize(("device", "options", "radius"), SERVICES, ids=["haply", "crtk"])
@pytest.mark.parametrize("given", [True, False], ids=["for the body", "by default"])
def test_the_double_of_a_service_strokes_within_the_training(palpate, file, device, options, radius, given):
    body = touchable(slab.surrogate())
    words = ("--body", file) if given else ()
    answer = palpate("devices", "simulate", device, *options, *words, "--seconds", "0.1", "--json")
    assert answer.code == 0, answer.err
    depth = json.loads(answer.out)["amplitude"] * body.workspace(radius).scale
    assert 0.0 < depth < body.deepest
    assert not given or depth == pytest.approx(0.75 * body.deepest)


@pytest.mark.full
@pytest.mark.parametrize("device", ["forcedimension", "openhaptics"])
@pytest.mark.parametrize("given", [True, False], ids=["for the body", "by default"])
def test_the_first_trial_of_a_compiled_double_stays_within_the_training(
    palpate, c_compiler, file, tmp_path, device, given
):
    """As the guides have it: compile the double, then run with what it says."""
    words = ("--body", file) if given else ()
    double = palpate(
        "devices", "simulate", device, "--folder", tmp_path, "--frequency", "1", *words, "--json"
    )
    assert double.code == 0, double.err
    answer = palpate("run", file, "--seconds", "1.5", "--device", json.loads(double.out)["device"], "--json")
    assert answer.code == 0, answer.err
    told = json.loads(answer.out)
    assert 0.0 < told["largest_depth"] < touchable(slab.surrogate()).deepest
    assert told["outside"] == told["let_go"] == 0.0
