"""A timing test of the real-time loop on this machine, and its verdict: good, usable, or not fit for a device.

The loop runs as it would with a device, but against a spring: the same metronome, stages, rehearsal and scheduling, in
a process of its own (``python -m palpate.runtime.timing_test``). What a learnt body costs on top is in the report of
`palpate run`.

The limits follow from what a late tick does. A force that trails the hand by the delay d lets a body feel no stiffer
than K = b/(T/2 + d) on a device with damping b (Colgate & Schenkel 1997, see `stability`): a lateness of a tenth of
the period T costs a sixth of that, one of half a period costs half of it. From 20 ms on a watchdog turns the force off.

References
----------
J. E. Colgate, G. G. Schenkel (1997), Passivity of a class of sampled-data systems: application to haptic
interfaces, J. Robotic Systems 14(1), 37–47.
"""

from __future__ import annotations

import argparse
import gc
import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.devices import device_named, device_traits
from palpate.devices.device import HARDWARE_PATIENCE
from palpate.errors import DeviceError
from palpate.processes import helper_environment
from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.loop import Loop
from palpate.runtime.loop_report import LoopReport
from palpate.runtime.machine import Check
from palpate.runtime.realtime import Metronome, obtain
from palpate.runtime.rehearsal import Rehearsal
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared, now
from palpate.runtime.workspace import Workspace
from palpate.units import Range

__all__ = ["Verdict", "judge_timing", "main", "measure_timing", "run_timing_test"]

_START = 60.0  # s that a child may take to start: the first start on a machine compiles the kernels
_STIFFNESS = 100.0  # N/m, of the spring that stands for a body
_GOOD, _USABLE = 0.1, 0.5  # of a period, the lateness at 99 %
_MISSED = 1e-3  # share of the ticks that may be missed on a machine that is usable


class _Spring:
    """The elastic answer F = −k x of a body that is held."""

    amplitude, depth, inside, energy = 0.0, 0.0, True, 0.0

    def __init__(self) -> None:
        self.force, self.slope = np.zeros(3), np.zeros(3)
        self.stiffness = -_STIFFNESS * np.eye(3)

    def __call__(self, position: np.ndarray, parameters: np.ndarray) -> None:
        np.multiply(position, -_STIFFNESS, out=self.force)
        self.energy = 0.5 * _STIFFNESS * float(position @ position)


class _SpringModel:
    """The spring behind the loop's `Model`."""

    parameters: tuple[Range, ...] = ()
    start = np.zeros(0)
    tool_axis = np.array([0.0, 0.0, 1.0])

    def evaluator(self) -> HandEvaluator:
        return HandEvaluator(_Spring(), holds=True)


def measure_timing(
    seconds: float,
    rate: float = 1000.0,
    *,
    clock: Callable[[], float] = now,
    sleep: Callable[[float], None] = time.sleep,
) -> LoopReport:
    """Run the loop against a spring for a while, in this thread, and return its report.

    It runs for `seconds` by `clock`, at `rate`, Hz; a test winds `clock` and `sleep`, s, by hand.
    """
    device, model, shared = "stroke", _SpringModel(), Shared.private()
    traits = device_traits(device)
    limits, workspace = Limits(traits.max_force, 0.0), Workspace(traits.radius, 1.0)
    loop = Loop(model, device_named(device, shared.command), shared, workspace, limits, rate=rate)
    rehearse = Rehearsal(model, workspace, limits, rate)
    rehearse()  # the first use of everything is no tick of the test
    metronome = Metronome(1.0 / rate, clock=clock, sleep=sleep)
    gc.collect()
    gc.disable()  # as the loop itself does
    try:
        end = clock() + seconds
        metronome.start()
        while loop.now < end:
            loop.tick(metronome.wait(rehearse), metronome.lateness, jumped=metronome.jumped)
        return LoopReport.of(shared.read_state())
    finally:
        gc.enable()
        loop.end()


@dataclass(frozen=True)
class Verdict:
    """Judgement of a machine for a loop at one rate."""

    grade: str  # good, usable or not fit
    sentence: str  # the grade as a sentence with the rate
    # the figures that led to it, where it is not good, and then what on this machine may be their cause
    reasons: tuple[str, ...]
    missed: float  # share of the ticks that were left out


_SENTENCES = {
    "good": "good: this machine can drive a device at {rate:g} Hz",
    "usable": "usable: a device at {rate:g} Hz runs, with softer bodies or now and then a drop of the force",
    "not fit": "not fit for a device at {rate:g} Hz; the page works",
}


def judge_timing(
    report: LoopReport, seconds: float, rate: float = 1000.0, checks: Sequence[Check] = ()
) -> Verdict:
    """Return the verdict on a run of the loop that lasted `seconds`, s, at the `rate` asked for, Hz.

    A miss among the `checks` of the machine is named as a possible cause.
    """
    period, wanted = 1.0 / rate, max(1, round(seconds * rate))
    missed = max(0.0, 1.0 - (report.ticks + 1) / wanted)  # the last tick may fall on the end
    late, worst, work = report.lateness_p99, report.lateness_max, report.work_p99
    bad = [
        (late > _USABLE * period, f"1 tick in 100 is later than {_us(late)}, half a period or more"),
        (
            worst >= HARDWARE_PATIENCE,
            f"one tick was {1e3 * worst:.0f} ms late: a device's watchdog had let go",
        ),
        (missed > _MISSED, f"{100 * missed:.2g} % of the ticks were missed"),
        (work > _USABLE * period, f"a tick takes {_us(work)} of CPU time, half a period or more"),
    ]
    fair = [
        (late > _GOOD * period, f"1 tick in 100 is later than {_us(late)}, a tenth of a period or more"),
        (worst >= period, f"one tick was {_us(worst)} late, a period or more"),
        (missed > 0.0, "some ticks were missed"),
    ]
    reasons = [words for broken, words in bad if broken]
    grade = "not fit" if reasons else "usable"
    reasons = reasons or [words for broken, words in fair if broken]
    if not reasons:
        grade = "good"
    causes = [f"possible cause: {c.name}, {c.detail}" for c in checks if not c.ok] if reasons else []
    return Verdict(grade, _SENTENCES[grade].format(rate=rate), (*reasons, *causes), missed)


def _us(seconds: float) -> str:
    return f"{1e6 * seconds:.0f} µs"


def run_timing_test(seconds: float, rate: float = 1000.0) -> LoopReport:
    """Run the test (seconds, Hz) in a process of its own, with the scheduling of the loop, and return its report."""
    command = [sys.executable, "-m", "palpate.runtime.timing_test", str(seconds), str(rate)]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            check=True,
            timeout=seconds + _START,
            env=helper_environment(),
        )
        return LoopReport(**json.loads(done.stdout))
    except (OSError, ValueError, TypeError, subprocess.SubprocessError) as error:
        said = getattr(error, "stderr", None) or str(error)
        raise DeviceError(
            "The timing test of the loop did not run to its end.",
            why=str(said).strip()[-500:],
            fix="Look at the other findings; palpate doctor --seconds 0 leaves the test out.",
        ) from error


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure in this process and print the report as JSON."""
    parser = argparse.ArgumentParser("python -m palpate.runtime.timing_test", description=__doc__)
    parser.add_argument("seconds", type=float)
    parser.add_argument("rate", type=float)
    options = parser.parse_args(arguments)
    granted = obtain()
    report = replace(measure_timing(options.seconds, options.rate), obtained=granted)
    sys.stdout.write(json.dumps(report.as_dict()) + "\n")


if __name__ == "__main__":
    main()
