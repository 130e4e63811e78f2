"""What the shared blocks hold: the loop's state, prints that stay on the body, and the commands to the loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.runtime.histogram import BINS, percentile

__all__ = ["COMMAND", "MAX_INPUTS", "MAX_PLACES", "PRINTS", "STATE", "State", "size_of"]

MAX_INPUTS = 8
MAX_PLACES = 4096
FAULT_KINDS = 16

STATE = np.dtype(
    [
        ("tick", "i8"),
        ("time", "f8"),  # s, `now()` when the tick began
        ("hand", "f8", 3),  # m, device coordinates
        ("position", "f8", 3),  # m, body: offset from the touched node's rest position, or the probe's centre
        ("contact", "f8", 3),  # m, body: where the touched node is, or the probe's centre
        ("force", "f8", 3),  # N on the hand, as sent, in the body's axes
        ("depth", "f8"),  # m, of a probe in the surface at rest; 0 for a body held at a node
        ("stiffness", "f8"),  # N/m, felt along the force in body metres; 0 where it isn't known
        ("loads", "f8", MAX_INPUTS),  # N, the loads that hold the body there
        ("mirrored", "u1"),
        ("inside", "u1"),  # within the trained range
        ("let_go", "u1"),  # the body has let go of a probe that is too deep in it
        ("clamped", "u1"),  # the force limit acted
        ("grabbed", "u1"),  # a hand holds the body
        ("stalled", "u1"),  # the input is older than its device allows
        ("fault", "i4"),  # `Fault` of this tick
        ("last_fault", "i4"),  # the latest that was not NONE
        ("faults", "i8"),  # onsets since the start
        ("fault_counts", "i8", FAULT_KINDS),  # the same by kind
        ("clamped_ticks", "i8"),
        ("lateness", "f8"),  # s, this tick's start behind its schedule
        ("lateness_max", "f8"),
        ("work", "f8"),  # s, CPU time of the tick before
        ("rate", "f8"),  # Hz, achieved
        ("scale", "f8"),  # metres of body per metre of hand
        ("radius", "f8"),  # m, the hand's workspace
        ("max_force", "f8"),  # N
        ("histogram", "i8", BINS),  # lateness, `Histogram` bins
        ("work_histogram", "i8", BINS),
    ],
    align=True,
)

PRINTS = np.dtype(
    [
        ("count", "i8"),  # places that keep a print; 0 where nothing has yielded
        ("amplitude", "f4", MAX_PLACES),  # √J, of the print at each
    ],
    align=True,
)

COMMAND = np.dtype(
    [
        ("beat", "f8"),  # s, `now()` of the page's last heartbeat
        ("sequence", "i8"),  # counts the targets
        ("grabbed", "u1"),
        ("hidden", "u1"),  # the tab is in the background
        ("quit", "u1"),
        ("target", "f8", 3),  # m, hand in device coordinates
        ("period", "f8"),  # s between heartbeats
        ("parameters", "f8", MAX_INPUTS),  # the untouched inputs; NaN: not set, middle of its range
    ],
    align=True,
)


@dataclass(frozen=True, eq=False)
class State:
    """One published tick, copied out of the shared memory. Fields and units as in `STATE`.

    Percentiles are taken here, by the reader, and not in the loop.
    """

    tick: int
    time: float
    hand: np.ndarray
    position: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    depth: float
    stiffness: float
    loads: np.ndarray
    mirrored: bool
    inside: bool
    let_go: bool
    clamped: bool
    grabbed: bool
    stalled: bool
    fault: int
    last_fault: int
    faults: int
    fault_counts: np.ndarray
    clamped_ticks: int
    lateness: float
    lateness_max: float
    work: float
    rate: float
    scale: float
    radius: float
    max_force: float
    histogram: np.ndarray
    work_histogram: np.ndarray
    prints: np.ndarray  # (n,) √J, of the print at each place; empty where nothing has yielded

    @property
    def lateness_p50(self) -> float:
        """Median lateness since the start, s."""
        return self._late(0.5)

    @property
    def lateness_p99(self) -> float:
        """Lateness that one tick in a hundred exceeds, s."""
        return self._late(0.99)

    @property
    def lateness_p999(self) -> float:
        """Lateness that one tick in a thousand exceeds, s."""
        return self._late(0.999)

    def _late(self, share: float) -> float:
        return min(self.lateness_max, percentile(self.histogram, share))  # a bin reaches beyond its samples

    @property
    def work_p50(self) -> float:
        """Median CPU time of a tick, s."""
        return percentile(self.work_histogram, 0.5)

    @property
    def work_p99(self) -> float:
        """CPU time that one tick in a hundred exceeds, s."""
        return percentile(self.work_histogram, 0.99)

    @classmethod
    def of(cls, record: np.ndarray, prints: np.ndarray) -> State:
        """Copy records of dtype `STATE` and `PRINTS`, shape ()."""
        flags = {"mirrored", "inside", "let_go", "clamped", "grabbed", "stalled"}
        values: dict[str, Any] = {}
        for name in STATE.names or ():
            value = record[name]
            values[name] = value.copy() if value.ndim else bool(value) if name in flags else value.item()
        return cls(**values, prints=prints["amplitude"][: prints["count"]].astype(float))


def size_of(prints: np.ndarray) -> int:
    """Bytes of a record of dtype `PRINTS` that hold something."""
    return int(PRINTS.fields["amplitude"][1] + 4 * prints["count"])  # type: ignore[index]
