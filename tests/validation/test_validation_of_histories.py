"""Judging a held body by histories whose answer is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from models import DOWN, linear_network, planar_field, spring_energy
from palpate.dataset import Dataset, Layout, LoadHistory
from palpate.dataset.histories import history_dataset
from palpate.errors import AccuracyError, UsageError
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import IwanElements
from palpate.units import Quantity, Range
from palpate.validation import Chapter, Limits, validate, write_report

REST = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
OFF = 0.02
"""What the solved force is made to be more than the body's, N."""


def rod() -> Surrogate:
    """U = ½ 200 w²: a spring and a slider of 100 N/m each, which slips at 10 mm; the tip goes down by w."""
    tail = np.zeros((4, 3))
    tail[3, 1] = -0.1
    asked = [Range("w", -0.1, 0.1, "m"), Range("P", -20.0, 20.0, "N")]
    network = linear_network(asked, [Quantity(c, "m") for c in "abcd"], tail)
    field = planar_field(
        "displacement", network, REST, touched=np.ones(1, np.int64), asked_by="place and load"
    )
    half = np.full(2, 0.5)
    elements = IwanElements.sliders(half, np.array([math.inf, 0.01 * math.sqrt(200.0)]), np.zeros(2))
    energy = spring_energy(200.0, [Range("w", -0.1, 0.1, "m")])
    return Surrogate(energy, {"displacement": field}, elements, {"name": "rod"})


def solved(off: float = OFF, dented: float = 0.0, rest: np.ndarray = REST) -> Dataset:
    """To 30 mm, where 4 N hold it and 20 mm have slipped, and back to 10 mm, where nothing does."""
    place = np.concatenate([np.linspace(0.001, 0.03, 30), np.linspace(0.029, 0.01, 20)])
    led = rod().follow(place[:, None])
    force = -led.force @ DOWN[0] + off
    force[-1] = 0.0
    shape = np.zeros((len(place), 2, 2))
    shape[:, 1, 1] = -place - dented
    path = LoadHistory(np.arange(1.0, 1.0 + len(place)), place, force, led.stored, led.lost, shape)
    layout, origin = Layout(rest[:, :2], None, [1], [[0.0, -1.0]]), {"problem": {"body": {"type": "rod"}}}
    return history_dataset([path], Range("P", -5.0, 5.0, "N"), layout, origin)


def test_each_figure_is_what_was_put_in() -> None:
    judged = validate(rod(), solved(dented=0.003))
    assert judged.passed
    found = judged.histories
    assert found.largest_force == pytest.approx(4.0 + OFF)
    assert found.median == pytest.approx(OFF / (4.0 + OFF))
    assert found.max == pytest.approx(OFF / (4.0 + OFF))
    # let go, both springs pull by as much against each other: 20 mm back from 30 mm
    assert found.residual_largest == pytest.approx(0.01)
    assert found.residual_max == pytest.approx(0.0, abs=1e-12)
    assert found.lost == pytest.approx(100.0 * 0.01 * 0.02)
    assert found.lost_error == pytest.approx(0.0, abs=1e-12)
    # the clamped node is where it was solved, the tip 3 mm off
    assert found.shape_mean == pytest.approx(0.0015)
    assert found.shape_max == pytest.approx(0.003)
    # elastic: 200 N/m all the way, by 2 N too much at the end of slipping and of unloading
    assert found.elastic_p95 == pytest.approx(2.0 / (4.0 + OFF), rel=0.02)
    assert f"{found.elastic_p95 / found.p95:.0f}" in str(judged)


def test_a_miss_is_an_error_with_the_worst_place() -> None:
    found = validate(rod(), solved(), limits=Limits(history_force_median=OFF / 5, history_force_p95=OFF / 5))
    assert [c.criterion.key for c in found.failures] == ["history_force_median", "history_force_p95"]
    with pytest.raises(AccuracyError, match="misses 2 of 3 limits"):
        found.raise_if_failed()
    assert "in history 1 at w =" in str(found.failures[1])


@pytest.mark.full
def test_energy_that_comes_back_is_a_miss() -> None:
    """Elements are checked when made; a body that was tampered with is not believed."""
    made = rod()
    wrong = made.memory
    object.__setattr__(wrong, "stiffness", np.array([1.5, -0.5]))
    found = validate(made.with_memory(wrong), solved())
    assert "history_energy" in [c.criterion.key for c in found.failures]


def test_histories_of_another_mesh_are_refused() -> None:
    with pytest.raises(UsageError, match="are not the 2 nodes"):
        validate(rod(), solved(rest=REST + 0.1))
    with pytest.raises(UsageError, match="no history"):
        validate(rod(), solved().take([]))


@pytest.mark.full
def test_the_report_tells_of_it(tmp_path: Path) -> None:
    found = validate(rod(), solved())
    chapter = Chapter("bent <rod>", rod(), solved(), found, timings={"validate": 1.0})
    page = write_report(tmp_path / "report.html", [chapter]).read_text(encoding="utf-8")
    assert "bent &lt;rod&gt;" in page
    assert "<rod>" not in page
    for heading in ("Force against displacement", "Energy stored and lost", "Where the limits come from"):
        assert page.count(f">{heading}<") == 1
    assert "second law of thermodynamics" in page
