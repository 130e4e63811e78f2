"""`palpate run --record`, `palpate replay` and `palpate trace` on a body that is pressed."""

from __future__ import annotations

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest

import pressed as slab
from palpate.devices.trace_file import TraceWriter, read_trace
from palpate.errors import SolverError, UsageError
from palpate.runtime.touchable import touchable
from palpate.runtime.trace_export import trace_table
from palpate.units import Range
from palpate.validation.full_model import compare_full_model, stroke_moments
from palpate.validation.limits import FAINT_JND
from palpate.validation.touch_comparison import compare_traces

pytestmark = pytest.mark.timeout(60)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("traces")


@pytest.fixture(scope="module")
def file(folder):
    return slab.surrogate(meta={"name": "slab"}).save(folder / "slab.palpate")


@pytest.fixture(scope="module")
def trace(folder, file):
    from palpate.cli import main

    body = touchable(slab.surrogate())
    amplitude = 0.004 / body.workspace(0.075).scale
    path = folder / "touch.trace"
    with pytest.raises(SystemExit) as stop:
        main(["run", str(file), "--seconds", "1", "--device", f"stroke:frequency=2,amplitude={amplitude:.6f}",
              "--record", str(path), "--json"])  # fmt: skip
    assert not stop.value.code
    return path


@pytest.mark.full
def test_a_run_says_what_it_recorded_and_the_trace_knows_it(palpate, file, trace, tmp_path):
    told = json.loads(palpate("trace", "info", trace, "--json").out)
    assert told["complete"]
    assert told["replayable"]
    assert told["lost"] == 0
    assert told["body"] == "slab"
    assert told["bytes"] == trace.stat().st_size
    assert told["ticks"] == len(read_trace(trace)) > 500
    assert told["largest_force"] > 0.1
    words = palpate("trace", "info", trace).out
    assert "MB a minute" in words
    assert "to the last bit" in words
    limits = ("--max-force", "2", "--max-torque", "50 mN m")
    answer = palpate("run", file, "--seconds", "0.3", *limits, "--record", tmp_path / "b.trace")
    assert "recorded" in answer.out
    known = read_trace(tmp_path / "b.trace").header["limits"]
    assert (known["max_force"], known["max_torque"]) == (2.0, 0.05)
    assert palpate("run", file, "--record", trace).code == UsageError.exit_code, "no recording is replaced"


@pytest.mark.full
def test_a_replay_says_that_it_is_the_same_or_by_how_much_it_is_not(palpate, trace, tmp_path):
    answer = palpate("replay", trace, "--json")
    assert json.loads(answer.out)["identical"], answer.out
    harder = slab.surrogate(factor=1.1, meta={"name": "harder"}).save(tmp_path / "harder.palpate")
    out = tmp_path / "harder.trace"
    answer = palpate("replay", trace, "--model", harder, "--out", out)
    assert "forces differ, the first at tick" in answer.out
    assert "not the model that was recorded" in answer.err
    told = json.loads(palpate("trace", "compare", trace, out, "--json").out)
    assert told["jnd_p95"] == pytest.approx(0.1 / FAINT_JND, rel=0.02), "10 % of less than a newton"
    by_model = json.loads(palpate("trace", "compare", trace, "--model", harder, "--json").out)
    assert by_model["jnd_max"] == told["jnd_max"]
    assert palpate("trace", "compare", trace).code == UsageError.exit_code


@pytest.mark.full
def test_a_recording_that_never_began_is_told_and_no_option_is_passed_over(palpate, trace, tmp_path):
    path = tmp_path / "a.trace"
    TraceWriter(path, {"device": "page"}).abandon()
    answer = palpate("trace", "info", path)
    assert answer.code == 0
    assert "page: its loop had not begun" in answer.out
    assert palpate("replay", trace, "--view", "--out", tmp_path / "b.trace").code == UsageError.exit_code


def test_a_model_that_is_gone_is_asked_for(palpate, trace, tmp_path):
    copy = tmp_path / "copy.trace"
    copy.write_bytes(trace.read_bytes())
    moved = trace.parent / "moved.palpate"
    (trace.parent / "slab.palpate").rename(moved)
    try:
        answer = palpate("replay", copy)
        assert answer.code == UsageError.exit_code
        assert "--model" in answer.err
        assert json.loads(palpate("replay", copy, "--model", moved, "--json").out)["same_model"]
    finally:
        moved.rename(trace.parent / "slab.palpate")


@pytest.mark.full
def test_a_table_holds_every_bit(palpate, trace, tmp_path):
    known = trace_table(read_trace(trace))
    assert palpate("trace", "export", trace, "--out", tmp_path / "t.csv").code == 0
    with (tmp_path / "t.csv").open(encoding="utf-8") as text:
        head, *rows = csv.reader(text)
    assert len(rows) == len(known["time"])
    column = next(i for i, name in enumerate(head) if name == "force_z [N]")
    np.testing.assert_array_equal([float(row[column]) for row in rows], known["force_z"])
    again = palpate("trace", "export", trace, "--out", tmp_path / "t.csv")
    assert again.code == UsageError.exit_code
    assert "--force" in again.err
    assert palpate("trace", "export", trace, "--out", tmp_path / "t.csv", "--force").code == 0
    assert palpate("trace", "export", trace, "--out", tmp_path / "t.npz").code == 0
    with np.load(tmp_path / "t.npz") as archive:
        np.testing.assert_array_equal(archive["velocity_y"], known["velocity_y"])
        assert json.loads(str(archive["header"]))["name"] == "slab"
    assert palpate("trace", "export", trace, "--out", tmp_path / "t.xyz").code == UsageError.exit_code


def test_a_table_in_parquet(palpate, trace, tmp_path):
    pq = pytest.importorskip("pyarrow.parquet")
    assert palpate("trace", "export", trace, "--out", tmp_path / "t.parquet").code == 0
    table = pq.read_table(tmp_path / "t.parquet")
    np.testing.assert_array_equal(table["force_z"].to_numpy(), trace_table(read_trace(trace))["force_z"])


@pytest.mark.full
def test_a_plot_has_the_solves_beside_the_stroke(palpate, trace, tmp_path):
    X = np.zeros((60, 3))
    X[:, 2] = slab.RADIUS - np.linspace(0.0005, 0.0045, 60)
    X[30:, 0] = 0.015  # far from the stroke
    slab.dataset(slab.solves(X)).save(tmp_path / "data.zarr")
    out = tmp_path / "touch.png"
    answer = palpate("trace", "plot", trace, "--data", tmp_path / "data.zarr", "--out", out, "--json")
    assert json.loads(answer.out)["solves"] == 30, answer.err
    assert out.read_bytes()[:4] == b"\x89PNG"
    assert palpate("trace", "plot", trace, "--out", tmp_path / "touch.svg").code == 0
    assert "<svg" in (tmp_path / "touch.svg").read_text(encoding="utf-8")


class FullModel:
    """The slab's closed form as a full model, a share off and without an equilibrium where it is deep."""

    ranges = (slab.INPUTS[2], *slab.INPUTS[:2])  # in another order

    def __init__(self, share=0.0, deepest=np.inf):
        self.share, self.deepest, self.asked = share, deepest, []

    def open(self):
        return self

    def solve(self, x):
        X = np.array([[x[1], x[2], x[0]]])
        self.asked.append(X[0])
        return SimpleNamespace(
            converged=slab.RADIUS - x[0] < self.deepest, response=(1.0 + self.share) * slab.force(X)[0]
        )


def test_the_full_model_under_the_recorded_hand(trace):
    touch = read_trace(trace)
    exact = compare_full_model(touch, FullModel(), most=60)
    assert 40 < len(exact.time) <= 60
    assert exact.jnd.max() < 1e-6, "the surrogate is the closed form"
    assert exact.depth.max() == pytest.approx(touch.ticks["depth"].max())
    off = compare_full_model(touch, FullModel(0.05), most=60)
    np.testing.assert_allclose(off.jnd[off.samples.heavy], 0.05 / 1.05 / FAINT_JND, rtol=1e-6)
    part = compare_full_model(touch, FullModel(deepest=0.003), most=60)
    assert "had no equilibrium" in part.note
    assert part.depth.max() < 0.003
    with pytest.raises(SolverError, match="have an equilibrium"):
        compare_full_model(touch, FullModel(deepest=0.0), most=60)
    other = SimpleNamespace(ranges=(Range("P", 0.0, 1.0, "N"),))
    with pytest.raises(UsageError, match="Its inputs are P"):
        compare_full_model(touch, other)


def test_a_slow_full_model_still_covers_the_whole_stroke(trace):
    touch, seconds = read_trace(trace), iter(range(10_000))
    part = compare_full_model(touch, FullModel(), most=100, limit=20.0, clock=lambda: float(next(seconds)))
    whole = stroke_moments(touch, 100)
    assert 5 <= len(part.time) < 20
    assert part.time[0] == touch.time[whole[0]]
    assert part.time[-1] == touch.time[whole[-1]]


def test_traces_of_different_length_are_compared_where_both_are(trace):
    touch = read_trace(trace)
    short = type(touch)(touch.path, touch.header, touch.ticks[: len(touch) // 2])
    comparison = compare_traces(touch, short)
    assert comparison.time[-1] == short.time[-1]
    assert not comparison.error.any()
    assert not comparison.note
