"""Errors of the torque that a tool feels about its place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.format import share
from palpate.validation.figures.figure import Figure
from palpate.validation.subject import Subject
from palpate.validation.worst import Worst

__all__ = ["TorqueErrors", "torque_on_tool"]


@dataclass(frozen=True)
class TorqueErrors(Figure):
    """Errors ‖Δτ‖/(‖F‖ r) of the torque, relative to the force times the tool's size, of touches above f₀."""

    size: float  # r, m
    largest: float  # largest ‖τ‖ in the test set, N m
    median: float
    p95: float
    worst: Worst

    def lines(self) -> list[str]:
        """Return the errors as a line."""
        return [
            f"torque: off by {share(self.median)} (median), {share(self.p95)} (95th percentile) of the force times "
            f"{1e3 * self.size:.3g} mm, the tool's size; the largest is {1e3 * self.largest:.3g} mN m; "
            f"worst {self.worst}"
        ]


def torque_on_tool(subject: Subject) -> TorqueErrors | str | None:
    """Return the errors of the torque, where the model and the solves tell one."""
    body, data, samples = subject.tool, subject.data, subject.samples
    if body is None or data is None or samples is None:
        return None
    if "torque" not in data:
        return "The torque was not judged: the solves of the test tell none."
    rows = samples.heavy & np.isfinite(data["torque"]).all(axis=1)
    if not rows.any():
        return "The torque was not judged: no solve of the test presses enough."
    size = float(body.hand_energy.baseline.posed_tool.shape.size)  # type: ignore[attr-defined]  # only tools have a torque
    truth, X = data["torque"][rows], data.X[rows]
    off = np.linalg.norm(body.torque(X) - truth, axis=1) / (samples.size[rows] * size)
    median, p95 = np.quantile(off, (0.5, 0.95))
    i = int(off.argmax())
    largest = float(np.linalg.norm(truth, axis=1).max())
    return TorqueErrors(size, largest, float(median), float(p95), Worst.of(off[i], X[i], subject.ranges))
