"""Punctuality of a loop, measured: a histogram of durations, and a report of rate, lateness, work and faults.

The histogram has logarithmic bins from 1 µs to 1 s, constant memory, and allocates nothing per sample. Bin 0 counts
durations below 1 µs, the last bin those of 1 s or more; the 62 between are equal in log t, so that neighbouring edges
differ by a factor 10^(6/62) = 1.25 and a percentile is right to within that factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.runtime.safety import Fault

if TYPE_CHECKING:
    from palpate.runtime.shared_state import State

__all__ = ["BINS", "EDGES", "Histogram", "LoopReport", "percentile"]

BINS = 64
_LOW, _DECADES = 1e-6, 6.0  # s where the bins begin, 1 µs, and decades from there to 1 s
_PER_DECADE = (BINS - 2) / _DECADES

_AS_PUBLISHED = ("rate", "lateness_p50", "lateness_p99", "lateness_p999", "lateness_max", "work_p50", "work_p99",
                 "energy_lowest", "damping_energy", "sensor_noise")  # fmt: skip

EDGES = _LOW * 10.0 ** (np.arange(BINS - 1) / _PER_DECADE)  # (63,) s: bin k holds EDGES[k-1] ≤ t < EDGES[k]


class Histogram:
    """Counts durations into an array (64,) of int64 that it is given, for example a field of the shared state."""

    def __init__(self, counts: np.ndarray) -> None:
        self.counts = counts
        self.maximum = 0.0  # s

    def add(self, duration: float) -> None:
        """Count one duration, s."""
        self.maximum = max(self.maximum, duration)
        if duration < _LOW:
            self.counts[0] += 1
        else:
            self.counts[min(BINS - 1, 1 + int(math.log10(duration / _LOW) * _PER_DECADE))] += 1


def percentile(counts: np.ndarray, share: float) -> float:
    """Return the duration, s, that a `share` 0 … 1 of the samples of a `Histogram`, counts (64,), stay below.

    It is interpolated in log t inside its bin; 0 where nothing was counted or it lies below 1 µs, 1 s where it lies
    above.
    """
    total = int(counts.sum())
    if total == 0:
        return 0.0
    below = np.cumsum(counts)
    wanted = max(share * total, 1e-9)
    k = int(np.searchsorted(below, wanted))
    if k == 0:
        return 0.0
    if k >= BINS - 1:
        return float(EDGES[-1])
    inside = (wanted - below[k - 1]) / counts[k]
    return float(EDGES[k - 1] * 10.0 ** (inside / _PER_DECADE))


@dataclass(frozen=True)
class LoopReport:
    """Summary of a run.

    Attributes
    ----------
    ticks : int
        Since the start.
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
        What the operating system granted; see `palpate.runtime.realtime`.
    foreign : tuple of str
        Packages in the loop's process that have no business there.
    device_error : str
        First error of the device's driver, once the loop has ended; empty without one.
    device_note : str
        Words of the driver on what was no fault, such as saturated motors; empty for none.
    energy_lowest : float
        The lowest energy that the hand had put in, less what it was given back, J.
    leak_bound : float
        The most that sampling and delay can have leaked, J: `energy_lowest` is no lower than minus this.
    damping_energy : float
        Energy that the passivity controller's damping was meant to take, J.
    delay : float
        Measured, from the device's sample to its force, s.
    sensor_noise : float
        Standard deviation of the device's places along one axis, stated or measured, m.
    body_stiffness, felt_stiffness : float
        Of the body's stiffest touch, and of what the hand feels of it, N/m in hand metres; 0 where it isn't known.
    stiffness : str
        Both in words, with the bound of the device; empty for a device without motors.
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
    device_error: str = ""
    device_note: str = ""
    energy_lowest: float = 0.0
    leak_bound: float = 0.0
    damping_energy: float = 0.0
    delay: float = 0.0
    sensor_noise: float = 0.0
    body_stiffness: float = 0.0
    felt_stiffness: float = 0.0
    stiffness: str = ""

    @classmethod
    def of(
        cls,
        state: State,
        obtained: Mapping[str, str] | None = None,
        foreign: tuple[str, ...] = (),
        device_error: str = "",
        device_note: str = "",
    ) -> LoopReport:
        """Sum up a published state.

        Parameters
        ----------
        state : State
            The newest tick, which carries the histograms.
        obtained : mapping, optional
            What the system granted, once that is known.
        foreign : tuple of str
            Packages that the loop's process should not have loaded.
        device_error : str
            First error of the device's driver, in words.
        device_note : str
            Words of the driver on what was no fault.
        """
        bounds = state.felt_stiffness
        return cls(
            ticks=state.tick,
            **{name: getattr(state, name) for name in _AS_PUBLISHED},
            clamped=state.clamped_ticks / max(1, state.tick),
            faults={f.name.lower(): int(state.fault_counts[f]) for f in Fault if state.fault_counts[f]},
            obtained=dict(obtained or {}),
            foreign=foreign,
            device_error=device_error,
            device_note=device_note,
            leak_bound=bounds.felt * state.leak,
            delay=bounds.delay,
            body_stiffness=bounds.body,
            felt_stiffness=bounds.felt,
            stiffness="" if bounds.damping is None else str(bounds),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and texts, in SI units, for JSON."""
        return asdict(self) | {"foreign": list(self.foreign)}

    @property
    def _energy(self) -> str:
        return (
            f"energy    never below {1e3 * min(self.energy_lowest, 0.0):.3g} mJ (sampling can leak "
            f"{1e3 * self.leak_bound:.3g} mJ), added damping took {1e3 * self.damping_energy:.3g} mJ; "
            f"the sensor's noise {1e6 * self.sensor_noise:.2g} µm"
        )

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
                *([f"stiffness {self.stiffness}", self._energy] if self.stiffness else []),
                *(f"device    {text}" for text in (self.device_error, self.device_note) if text),
            ]
        )
