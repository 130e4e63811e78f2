"""Methods are asked setting by setting, then the best one for the rest; a second call asks for what is missing."""

from __future__ import annotations

from argparse import Namespace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.soft_touch.judge import compare, read_case
from half_space_case import force, write_case

from benchmarks.soft_touch import ask_methods

OPTIONS = {"settings": None, "paths": 12}


class Scaled:
    """The exact force times a factor, by steps where it has any."""

    def __init__(self, factor, counts):
        self.factor, self.counts, self.settings = factor, counts, f"times {factor:g}"

    def force(self, places):
        self.counts.append(len(places))
        return self.factor * force(places)


class Stepping(Scaled):
    """A simulator of that force, which holds no state."""

    def start(self, place):
        pass

    def step(self, place, seconds):
        return self.factor * force(place[None])[0]


@pytest.fixture
def case(tmp_path, monkeypatch):
    folder = write_case(tmp_path / "half-space")
    monkeypatch.setattr(ask_methods, "read_case", partial(read_case, folder=tmp_path))
    monkeypatch.setattr(ask_methods, "case_names", lambda: ["half-space"])
    return folder


def module(monkeypatch, kind, **more):
    counts = []
    made = SimpleNamespace(
        SETTINGS=tuple({"factor": factor} for factor in (1.3, 1.1, 0.8)),
        load=lambda case, factor: kind(factor, counts),
        **more,
    )
    monkeypatch.setattr(ask_methods, "_module", lambda name: made)
    return counts


def last(kept, **options):
    return list(ask_methods.ask("scaled", "half-space", kept, Namespace(**OPTIONS, **options)))[-1:]


def test_the_best_setting_is_asked_for_the_rest(case, monkeypatch):
    module(monkeypatch, Scaled)
    kept = {}
    last(kept, loops=True)
    assert [row["settings"] for row in kept["sweep"]] == ["times 1.3", "times 1.1", "times 0.8"]
    assert kept["best"]["setting"] == {"factor": 1.1}
    assert len(kept["best"]["deeper"]) == len(kept["best"]["press"])
    assert kept["best"]["loop_work"] < 1e-3
    assert not last(kept, loops=True)  # nothing is missing


def test_closed_paths_are_asked_for_later(case, monkeypatch):
    counts = module(monkeypatch, Stepping)
    kept = {}
    last(kept, loops=False)
    assert "loop_work" not in kept["best"]
    del counts[:]
    last(kept, loops=True)
    corners = {n for n in counts if n > 1}
    whole = read_case("half-space", case.parent)
    assert max(corners) < max(len(whole.way_in(k)) + len(whole.around(k)) for k in whole.loops)
    assert kept["best"]["loop_work"] < 1.0  # %: sides six times as long


def test_presses_that_the_oracle_lacks_are_asked_for(case, monkeypatch):
    module(monkeypatch, Scaled)
    path = case / "oracle.csv"
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join(lines[:11]), "utf-8")
    kept = {}
    last(kept, loops=False)
    path.write_text("\n".join(lines), "utf-8")
    figures = compare(kept["best"], read_case("half-space", case.parent))
    assert figures["presses"] == len(lines) - 1
    assert figures["jnd_median"] == pytest.approx(1.0)
    assert np.isfinite(figures["stiffness_median"])
    assert not last(kept, loops=False)


def test_a_method_may_say_which_setting_is_shown(case, monkeypatch):
    module(monkeypatch, Scaled, shown_of=lambda case: {"factor": 1.3})
    kept = {}
    last(kept, loops=False)
    assert kept["best"]["setting"] == {"factor": 1.3}
