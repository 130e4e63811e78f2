"""One tick of touch, as a list of stages: read → map → evaluate → limit → write → publish.

    device position → workspace → force of the learnt body → limits → device → shared memory

All stages work in arrays made beforehand, most of them views of the record that is published, so that a tick
allocates next to nothing. Nothing raises: the first thing that goes wrong in a tick is its fault, and a tick
with a fault sends zero force. What is published is always finite: where a number is not, its last good value
stays.

A force computed from a sample is held for a tick and so trails the hand by half a tick on average, which is
what makes a sampled spring active (Colgate & Schenkel 1997, see `stability`): no stage may hold one back.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol

import numpy as np

from palpate.errors import UsageError
from palpate.runtime.devices import Device
from palpate.runtime.devices.page import PageDevice
from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.publisher import Publisher
from palpate.runtime.realtime import Metronome
from palpate.runtime.safety import Fault, Limits, Safety, stalled
from palpate.runtime.shared_state import MAX_INPUTS, MAX_PLACES, Shared, now
from palpate.runtime.workspace import Workspace
from palpate.units import Range

__all__ = ["Loop", "Model", "rehearsal"]


class Model(Protocol):
    """A learnt body as the loop asks for it; `palpate.runtime.touchable.Touchable` is one."""

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs that the hand doesn't supply."""
        ...

    def evaluator(self) -> HandEvaluator:
        """Return the allocation-free evaluator."""
        ...


class Loop:
    """The real-time loop around one device and one learnt body.

    Parameters
    ----------
    model : Model
        The learnt body that answers.
    device : Device
        Where the hand is; the loop closes it at its end.
    shared : Shared
        State out, commands in.
    workspace : Workspace
        How hand metres become body metres.
    limits : Limits
        Largest force and its rate of change.
    rate : float
        Ticks per second, 10 to 10,000 Hz.
    orphaned : callable
        Returns whether the process that wanted the loop has ended; asked once a tick.

    Raises
    ------
    UsageError
        If the model has more inputs, or keeps indentations at more places, than the shared memory carries, or the
        rate is out of range.
    """

    def __init__(
        self,
        model: Model,
        device: Device,
        shared: Shared,
        workspace: Workspace,
        limits: Limits,
        *,
        rate: float = 1000.0,
        orphaned: Callable[[], bool] = lambda: False,
    ) -> None:
        if not 10.0 <= rate <= 10_000.0:
            raise UsageError(
                f"The loop can't run at {rate:g} Hz.", fix="Choose 10 … 10000 Hz; 1000 is usual."
            )
        self.evaluator, self.device, self.workspace = model.evaluator(), device, workspace
        if max(len(self.evaluator.loads), len(model.parameters)) > MAX_INPUTS:
            raise UsageError(
                f"The model has {len(self.evaluator.loads)} inputs; the runtime carries {MAX_INPUTS}.",
                fix="Learn it with fewer inputs.",
            )
        self.period = 1.0 / rate
        if len(self.evaluator.indentation) > MAX_PLACES:
            raise UsageError(
                f"The body keeps indentations at {len(self.evaluator.indentation)} places; "
                f"the runtime carries {MAX_PLACES}.",
                fix="Save it with a larger spacing.",
            )
        self.out = Publisher(shared, len(self.evaluator.loads))
        self.safety = Safety(limits, self.period, self.out.force)
        self.out.describe(workspace, limits)
        self.parameters = np.array([(r.low + r.high) / 2.0 for r in model.parameters])
        self.fault, self.now, self.holding = Fault.NONE, 0.0, False
        self.device_error = ""
        self._answered, self._sent = math.inf, np.zeros(3)
        self._commands, self._quit = shared.command, shared.command.record["quit"]
        self._wished = shared.command.record["parameters"]
        self._orphaned = orphaned
        self.stages = (self.read, self.map, self.evaluate, self.limit, self.write)

    def run(self, rehearse: Callable[[], None] = lambda: None) -> None:
        """Tick until a command ends the loop or its parent is gone; leave the device at zero force.

        Parameters
        ----------
        rehearse : callable
            Called before each tick while there is time; see `palpate.runtime.loop`.
        """
        metronome = Metronome(self.period)
        gc.collect()
        gc.freeze()
        gc.disable()  # nothing in the loop makes cycles, and a collection would take milliseconds
        try:
            metronome.start()
            while not self._quit and self.fault is not Fault.PARENT_GONE:
                self.tick(metronome.wait(rehearse), metronome.lateness, jumped=metronome.jumped)
        finally:
            gc.enable()
            gc.unfreeze()
            self.end()

    def tick(self, now: float, lateness: float = 0.0, *, jumped: bool = False) -> None:
        """Pass through the stages once.

        Parameters
        ----------
        now : float
            When the tick began, s.
        lateness : float
            How far behind its schedule that was, s.
        jumped : bool
            Whether the clock jumped since the last tick.
        """
        began = time.thread_time()
        self.now, self.fault = now, Fault.NONE
        if jumped:
            self.fault = Fault.CLOCK_JUMP
        elif self._orphaned():
            self.fault = Fault.PARENT_GONE
        for stage in self.stages:
            stage()
        self.out.tick(now, lateness, self.fault)
        self.out.worked(time.thread_time() - began)

    def fail(self, fault: Fault) -> None:
        """Record what went wrong; the first fault of a tick stands."""
        if self.fault is Fault.NONE:
            self.fault = fault

    def device_failed(self, error: Exception) -> None:
        """Record an error of the device's driver; of many, the first one's words are kept."""
        self.device_error = self.device_error or f"{type(error).__name__}: {error}"
        self.fail(Fault.DEVICE_ERROR)

    def read(self) -> None:
        """Read device and commands: where the hand is, and whether that can be believed."""
        self._commands.fetch()  # an unfinished write leaves the last commands standing
        try:
            sample = self.device.read(self.now)
            late = sample.asleep or stalled(self.now, sample.time, sample.patience)
            x, y, z = sample.position.tolist()
            self.holding = bool(sample.holding)
        except Exception as error:  # noqa: BLE001 - a driver is foreign code: whatever it does, the loop goes on
            self.holding = False
            self.out.input(holding=False, late=True)
            self.device_failed(error)
            return
        self.out.input(holding=self.holding, late=late)
        if late and self.holding:  # nothing held, nothing at fault: a page may be hidden
            self.fail(Fault.INPUT_STALLED)
        if not math.isfinite(x + y + z):
            self.fail(Fault.INPUT_NOT_FINITE)
        if self.fault is Fault.NONE:
            self.out.hand[:] = sample.position

    def map(self) -> None:
        """Turn hand metres into body metres, and take over the parameters that were set."""
        self.workspace.to_body(self.out.hand, self.out.position)
        believed = self.fault is Fault.NONE
        self.evaluator.place(self.out.position, holding=self.holding, believed=believed)
        for i in range(len(self.parameters)):
            wish = float(self._wished[i])
            if math.isfinite(wish):
                self.parameters[i] = wish

    def evaluate(self) -> None:
        """Ask the learnt body."""
        if self.fault is not Fault.NONE:
            return
        answer = self.evaluator
        answer.elapsed = max(0.0, self.now - self._answered)
        self._answered = self.now
        try:
            answer(self.out.position, self.parameters)
        except (ArithmeticError, ValueError, TypeError, IndexError):
            self.fail(Fault.EVALUATOR_ERROR)
            return
        if math.isfinite(
            sum(answer.force.tolist()) + sum(answer.contact.tolist()) + sum(answer.loads.tolist())
        ):
            self.out.answer(answer)
        else:
            self.fail(Fault.OUTPUT_NOT_FINITE)

    def limit(self) -> None:
        """Limit force, slew and ramp; zero after a fault and for a hand that doesn't hold."""
        self.safety.apply(self.evaluator.force, gate=self.holding and self.fault is Fault.NONE)
        self.out.clamped(self.safety.clamped)

    def write(self) -> None:
        """Push on the hand."""
        self.workspace.force_on_hand(self.safety.force, self._sent)
        try:
            self.device.write(self._sent)
        except Exception as error:  # noqa: BLE001 - as for `read`
            self.safety.stop()  # nobody knows what was sent: don't claim it, and ramp in again
            self.device_failed(error)

    def end(self) -> None:
        """Send and publish zero force, whatever happened before, and close the device."""
        self.safety.stop()
        self.out.end()
        for last in (partial(self.device.write, self.safety.force), self.device.close):
            try:
                last()
            except Exception as error:  # noqa: BLE001 - as for `read`
                self.device_failed(error)


def rehearsal(model: Model, workspace: Workspace, limits: Limits, rate: float) -> Callable[[], None]:
    """Return a function that performs one dry tick, without any effect outside itself.

    Called just before the real tick, it brings code and data into the caches. Between two ticks the processor sleeps
    or does other people's work, and a tick that takes 15 µs when repeated takes 70 µs after a millisecond of that. The
    metronome spins for the last 200 µs anyway; one tick of a second loop, on a page device that nobody drags and in
    memory that nobody reads, spends part of that time and halves the delay between the hand and the force.
    """
    stage = Shared.private()
    stage.write_command(beat=math.inf, grabbed=True, target=(0.0, -0.1 * workspace.radius, 0.0))
    double = Loop(model, PageDevice(stage.command), stage, workspace, limits, rate=rate)
    return lambda: double.tick(now())
