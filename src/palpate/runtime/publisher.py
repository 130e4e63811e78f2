"""The loop's side of state and indentations: the records are filled through views made once, then published."""

from __future__ import annotations

import math

from palpate.runtime.blending import Blend
from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.loop_report import Histogram
from palpate.runtime.passivity import PassivityController
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import ONSETS, STATE, Shared, size_of
from palpate.runtime.stability import FeltStiffness
from palpate.runtime.workspace import Workspace

__all__ = ["Publisher"]

_EVERY = 100  # ticks between two updates of the rate: 10 Hz is what an eye can read


class Publisher:
    """Fills and publishes state and indentations; stages write to its views `hand`, `position`, `force`, `torque` (3,).

    `record`, of dtype `STATE` and shape (), is the tick that is being filled. `offset`, s, is added to the time that is
    published: a replay that others look at has times of its own.
    """

    def __init__(self, shared: Shared, inputs: int) -> None:
        self._block, record = shared.state, shared.state.record
        self.offset = 0.0
        self._indentation, self._amplitude = shared.indentation, shared.indentation.record["amplitude"]
        self.record = record
        self.hand, self.position, self.force = record["hand"], record["position"], record["force"]
        self.torque = record["torque"]
        self._loads = record["loads"][:inputs]
        # views are written to in a tenth of the time that the record takes
        self._views = {name: record[name] for name in STATE.names or ()}
        self._late, self._worked = Histogram(record["histogram"]), Histogram(record["work_histogram"])
        self._count, self._before = 0, Fault.NONE
        self._counted, self._since = 1, math.inf  # when the rate was last taken

    def describe(self, workspace: Workspace, limits: Limits) -> None:
        """Take over all that does not change while the loop runs: scale, radius and force limit."""
        self.record["scale"], self.record["radius"] = workspace.scale, workspace.radius
        self.record["max_force"] = limits.max_force
        self.record["coupling"] = math.inf
        self._views["inside"][()] = True
        self.record["device_stiffness"] = math.inf

    def device(self, name: str) -> None:
        """Take over what the device calls itself."""
        self.record["device"] = name.encode(errors="replace")[:48]

    def words(self, text: str) -> None:
        """Take over the words of a driver's error."""
        self.record["words"] = text.encode(errors="replace")[:160]

    def hold_back(self, withheld: Fault, *, waiting: bool, stopped: bool, released: bool) -> None:
        """Take over why there is no force, besides a fault: see `STATE`."""
        self._views["withheld"][()], self._views["waiting"][()] = withheld, waiting
        self._views["stopped"][()], self._views["released"][()] = stopped, released

    def input(self, *, holding: bool, late: bool) -> None:
        """Take over whether a hand holds the body, and whether its input is too old."""
        self._views["grabbed"][()], self._views["stalled"][()] = holding, late

    def answer(self, answer: HandEvaluator | Blend) -> None:
        """Take over the learnt body's answer, and publish its indentations where one has grown."""
        views, self._loads[:] = self._views, answer.loads
        views["contact"][:], views["inside"][()], views["let_go"][()] = (
            answer.contact,
            answer.inside,
            answer.let_go,
        )
        views["depth"][()], views["stiffness"][()] = answer.depth, answer.stiffness
        if answer.grew:
            count = len(answer.indentation)
            self._indentation.record["count"] = count
            self._amplitude[:count] = answer.indentation
            self._indentation.publish(size_of(self._indentation.record))

    def clamped(self, acted: bool) -> None:
        """Take over whether the force limit acted, and count it."""
        self._views["clamped"][()] = acted
        if acted:
            self.record["clamped_ticks"] += 1

    def stiffness(self, bounds: FeltStiffness) -> None:
        """Take over how stiff the body is and may be, and through which spring it is touched."""
        record = self.record
        record["delay"], record["body_stiffness"] = bounds.delay, bounds.body
        record["coupling"] = bounds.coupling
        record["device_damping"] = math.nan if bounds.damping is None else bounds.damping
        record["unsoftened"], record["nominal_rate"] = bounds.override, bounds.rate
        record["device_stiffness"] = bounds.stated
        record["delay_known"], record["uncontrolled"] = bounds.delay_known, not bounds.controlled

    def passivity(self, controller: PassivityController) -> None:
        """Take over the energy ledger and the damping that it asked for."""
        self._views["ledger"][:] = controller.ledger

    def begin_blend(self) -> int:
        """Say that another surrogate takes over with the tick that begins now; return its number."""
        self.record["blending"] = True
        return self._count + 1

    def blended(self, added: float) -> None:
        """Take over the energy that blending has given the body, in all, J."""
        self.record["added"] = added

    def end_blend(self) -> int:
        """Say that it alone answers from the tick that begins now; return its number."""
        self.record["blending"] = False
        self.record["swaps"] += 1
        return self._count + 1

    def tick(self, now: float, lateness: float, fault: Fault, *, resting: bool = False) -> None:
        """Close the tick that began at `now` (s), `lateness` (s) behind its schedule, and publish it.

        The lateness of a `resting` loop, which no hand could feel, is not counted.
        """
        self._count += 1
        views = self._views
        views["tick"][()], views["time"][()] = self._count, now + self.offset
        views["lateness"][()], views["idle"][()] = lateness, resting
        if not resting:
            self._late.add(lateness)
        views["lateness_max"][()] = self._late.maximum
        if self._count == 1:
            self._since = now
        if fault is not self._before:
            self._changed(fault, now + self.offset)
        if self._count % _EVERY == 0:
            self._pace(now)
        self._block.publish()

    def worked(self, duration: float) -> None:
        """Count the CPU time, s, of the tick just published; it appears with the next."""
        self._views["work"][()] = duration
        self._worked.add(duration)

    def end(self) -> None:
        """Publish a last record: nothing held, nothing pushed."""
        self._views["grabbed"][()] = False
        self.torque[:] = 0.0
        if self._count < _EVERY:
            self._pace(float(self._views["time"]) - self.offset)
        self._block.publish()

    def stay(self, now: float) -> None:
        """Publish the last record again, as of `now`, s."""
        self._views["time"][()] = now
        self._block.publish()

    def _changed(self, fault: Fault, now: float) -> None:
        self._before = fault
        self._views["fault"][()] = fault
        if fault is not Fault.NONE:
            place = self.record["faults"] % ONSETS
            self.record["onset_times"][place], self.record["onset_kinds"][place] = now, fault
            self.record["last_fault"] = fault
            self.record["faults"] += 1
            self.record["fault_counts"][fault] += 1

    def _pace(self, now: float) -> None:
        if now > self._since:
            self.record["rate"] = (self._count - self._counted) / (now - self._since)
            self._counted, self._since = self._count, now
