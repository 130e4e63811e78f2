"""How a loop did: rate, lateness, work, faults. A value that prints itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from palpate.runtime.faults import Fault
from palpate.runtime.shared import State

__all__ = ["LoopReport"]


@dataclass(frozen=True)
class LoopReport:
    """Summary of a run.

    Attributes
    ----------
    ticks : int
    rate : float
        Achieved over the last hundred ticks, Hz.
    lateness_p50, lateness_p99, lateness_p999, lateness_max : float
        Start of a tick behind its schedule, s.
    work_p50, work_p99 : float
        CPU time of a tick, device to shared memory, s.
    clamped : float
        Share of the ticks on which the force limit acted.
    faults : mapping
        Onsets by the fault's name.
    obtained : mapping
        What the operating system granted; see `palpate.runtime.priority`.
    foreign : tuple of str
        Packages in the loop's process that have no business there.
    """

    ticks: int
    rate: float
    lateness_p50: float
    lateness_p99: float
    lateness_p999: float
    lateness_max: float
    work_p50: float
    work_p99: float
    clamped: float
    faults: Mapping[str, int]
    obtained: Mapping[str, str]
    foreign: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, state: State, obtained: Mapping[str, str] | None = None, foreign: tuple[str, ...] = ()
    ) -> LoopReport:
        """Sum up a state block."""
        return cls(
            ticks=state.tick,
            rate=state.rate,
            lateness_p50=state.lateness_p50,
            lateness_p99=state.lateness_p99,
            lateness_p999=state.lateness_p999,
            lateness_max=state.lateness_max,
            work_p50=state.work_p50,
            work_p99=state.work_p99,
            clamped=state.clamped_ticks / max(1, state.tick),
            faults={f.name.lower(): int(state.fault_counts[f]) for f in Fault if state.fault_counts[f]},
            obtained=dict(obtained or {}),
            foreign=foreign,
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, in SI units, for JSON."""
        return asdict(self) | {"foreign": list(self.foreign)}

    def __str__(self) -> str:
        def us(seconds: float) -> str:
            return f"{1e6 * seconds:.0f}"

        late = " / ".join(
            map(us, (self.lateness_p50, self.lateness_p99, self.lateness_p999, self.lateness_max))
        )
        faults = ", ".join(f"{count} × {name.replace('_', ' ')}" for name, count in self.faults.items())
        granted = ", ".join(f"{key} {value}" for key, value in self.obtained.items())
        return "\n".join(
            [
                f"{self.ticks} ticks at {self.rate:.1f} Hz",
                f"lateness  {late} µs (median / p99 / p99.9 / max)",
                f"work      {us(self.work_p50)} / {us(self.work_p99)} µs of CPU (median / p99)",
                f"clamped   {100 * self.clamped:.1f} % of the ticks",
                f"faults    {faults or 'none'}",
                f"system    {granted or 'not known'}",
            ]
        )
