"""One tick of touch, as a list of stages: read → guard → map → evaluate → limit → control → write → publish.

    device position → hand's axes and clutch → workspace → coupling → learnt body and its memory
        → force, slew and ramp limits → passivity controller → device → shared memory

Each stage is a class of its own (`workspace`, `coupling`, `hand_evaluator`, `safety`, `passivity`) and gets the time
from outside: the loop runs live, on recorded samples, or by `run_for` as fast as it can be computed, and is the same.

All stages work in arrays made beforehand, most of them views of the record that is published, so that a tick
allocates next to nothing. Nothing raises: the first thing that goes wrong in a tick is its fault, and a tick
with a fault sends zero force. It lasts: a fault releases the body, which waits until the hand is where it holds no
energy, out of a body that is pressed and at rest of one that is held, and then the force ramps in. So does the start
on a device with motors, and the end of a stop. What is published is always finite: where a number is not, its last
good value stays.

A force computed from a sample is held for a tick and so trails the hand by half a tick on average, which is
what makes a sampled spring active (Colgate & Schenkel 1997, see `stability`): no stage may hold one back.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from palpate.devices import Device
from palpate.devices.device import HARDWARE_PATIENCE
from palpate.errors import DeviceLostError, DeviceStopError, UsageError
from palpate.runtime.blending import Blend
from palpate.runtime.coupling import STEPS, Coupling
from palpate.runtime.hand_evaluator import HandEvaluator, Model
from palpate.runtime.hand_turn import HandTurn, TorqueOnHand
from palpate.runtime.oscillation import OscillationWatch
from palpate.runtime.passivity import PassivityController
from palpate.runtime.publisher import Publisher
from palpate.runtime.realtime import Metronome, Rest
from palpate.runtime.recording import TickRecorder
from palpate.runtime.safety import Fault, Limits, PlaceCheck, Safety, Stop, stalled
from palpate.runtime.shared_state import Shared, require_room
from palpate.runtime.stability import FeltStiffness
from palpate.runtime.swap import Swap
from palpate.runtime.workspace import HandFrame, Workspace

__all__ = ["EDGE", "Loop"]

_PAUSE = 0.05  # s between two ticks of a page or script from which on the clock jumped; hardware bears less
# s, at most, before the end of a sample's patience: a slow loop with a late device needs the rest
_AHEAD = 2e-3
EDGE = 1.25  # radii of the workspace: no force beyond
_AIR, _REST = 0.01, 0.05  # radii: as good as outside a pressed body, and as good as at rest of a held one
_UP = np.array([0.0, 0.0, 1.0])
_DELAY_TIME = 0.1  # s, over which the age of the samples is averaged
_DELAY_CHANGE = 0.02  # of T/2 + d: smaller changes move no bound that matters


class Loop:
    """The real-time loop around one device, which it closes at its end, and one learnt body.

    It ticks 10 to 10,000 times a second. `stiffness` is the body's largest, N/m in its own metres; a body whose
    stiffness isn't known, 0, is never softened, and `override` lets one that is too stiff for its device feel so all
    the same. Without `control` the passivity controller only counts; with `dead_man` the force acts only while the
    device's first button is held. `orphaned` returns whether the process that wanted the loop has ended; it is asked
    once a tick.

    Its `swap` is set where another surrogate shall take the place of the one in the hand, and None again at its end. A
    model with more inputs, or indentations at more places, than the shared memory carries is refused.
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
        stiffness: float = 0.0,
        override: bool = False,
        control: bool = True,
        dead_man: bool = False,
        orphaned: Callable[[], bool] = lambda: False,
        recorder: TickRecorder | None = None,
    ) -> None:
        if not 10.0 <= rate <= 10_000.0:
            raise UsageError(
                f"The loop can't run at {rate:g} Hz.", fix="Choose 10 … 10000 Hz; 1000 is usual."
            )
        self.evaluator: HandEvaluator | Blend = model.evaluator()
        self.workspace, self.recorder = workspace, recorder
        self.device = device if recorder is None else recorder.watch(device)
        inputs = max(len(self.evaluator.loads), len(model.parameters))
        require_room("The body", inputs, len(self.evaluator.indentation))
        self.period = 1.0 / rate
        self.out = Publisher(shared, len(self.evaluator.loads))
        self.safety = Safety(limits, self.period, self.out.force)
        self.out.describe(workspace, limits)
        self.motors = device.traits.damping is not None
        self.swap: Swap | None = None
        self._prepare_safety(dead_man)
        self._prepare(limits, rate, stiffness, override, control)
        self.parameters = model.start
        self._prepare_turn(model, limits)
        self.fault, self.now, self.holding = Fault.NONE, 0.0, False
        self.device_error = ""
        self._answered, self._sent = math.inf, np.zeros(3)
        self._sent_to_device, self._heard = np.zeros(3), False
        self._before, self.wanted = math.nan, self.evaluator.force
        self._commands, self._quit = shared.command, shared.command.record["quit"]
        self._stops, self._resumes = shared.command.record["stops"], shared.command.record["resumes"]
        self._wished = shared.command.record["parameters"]
        self._orphaned = orphaned
        self.stages = (self.read, self.guard, self.map, self.evaluate, self.limit, self.control, self.write)

    def _prepare_safety(self, dead_man: bool) -> None:
        """Make all that decides whether there is a force."""
        traits, radius = self.device.traits, self.workspace.radius
        self.stop, self.dead_man = Stop(), dead_man
        self.released, self.open, self.withheld = dead_man, False, Fault.NONE
        self._buttons, self._switch, self._driver_fails = 0, False, False
        reach = traits.reach or 2.0 * traits.radius
        self._check = PlaceCheck(reach, traits.speed, self.period, traits.place_noise)
        self.longest = max(HARDWARE_PATIENCE if self.motors else _PAUSE, 2.5 * self.period)
        self._ticked, self._edge = math.nan, EDGE * radius
        # of hardware the force is gone at the end of its patience, and not a tick later
        self._ahead = min(self.period, _AHEAD) if self.motors else 0.0
        self.rest, self._was = Rest(self.period), (0.0, 0.0, 0.0)
        zone = _REST if self.evaluator.holds else _AIR
        self.evaluator.rest_zone = zone * radius * self.workspace.scale
        if self.motors:
            self.evaluator.release()

    def _prepare(self, limits: Limits, rate: float, stiffness: float, override: bool, control: bool) -> None:
        """Make the coupling and the passivity controller for this device, body and rate."""
        traits = self.device.traits
        self.frame = HandFrame(traits.axes)
        self.controlled = self.motors and control
        mass = traits.mass if self.controlled else 0.0
        self.passivity = PassivityController(
            self.period, max_force=limits.max_force, mass=mass, noise=traits.place_noise
        )
        controlled = self.controlled or not self.motors
        self.bounds = FeltStiffness.on(traits, self.workspace.felt(stiffness), rate, override, controlled)
        self.oscillation = OscillationWatch(self.period, limits.max_force)
        self.coupling = Coupling(hardest=stiffness)
        self._steps = 1 if self.evaluator.remembers else STEPS
        self._own_delay = self.bounds.delay
        self.take_delay(self._own_delay)

    def _prepare_turn(self, model: Model, limits: Limits) -> None:
        """Make what turns a tool with the hand, and what renders its torque, where the device has either."""
        traits, space, axis = self.device.traits, self.workspace, getattr(model, "tool_axis", _UP)
        self._turn_sent, self._turn_seen = np.zeros(3), math.nan
        self.turn = HandTurn.on(traits, space.upright, model.parameters, axis)
        mass, largest = traits.mass if self.controlled else 0.0, min(traits.max_torque, limits.max_torque)
        self.turn_torque = TorqueOnHand.by(self.turn, largest, self.period, space.scale, mass)

    def take_delay(self, delay: float) -> None:
        """Draw the consequences of a delay, s: for the coupling's spring, the ledger and the added damping."""
        self._age = delay
        self.bounds = replace(self.bounds, delay=delay)
        self.passivity.delay = delay
        self._take_spring()

    def take_stiffness(self, stiffness: float) -> None:
        """Take over the largest stiffness of a body whose surrogate is being replaced, N/m in its own metres."""
        touched = not self.coupling.active
        self.bounds = replace(self.bounds, body=self.workspace.felt(stiffness))
        self._take_spring()
        if touched and self.coupling.active:
            self.coupling.take_up(self.out.position, self.wanted)

    def _take_spring(self) -> None:
        self._spring = self.bounds.coupling / self.workspace.scale
        self.coupling.change(self._spring)
        self.passivity.stiffness = self.bounds.felt if math.isfinite(self.bounds.felt) else 0.0
        self.out.stiffness(self.bounds)

    def run(self, rehearse: Callable[[], None] = lambda: None) -> None:
        """Tick until a command ends the loop or its parent is gone; leave the device at zero force.

        `rehearse` is called before each tick while there is time; see `palpate.runtime.rehearsal`.
        """
        metronome = Metronome(self.period, jump=self.longest)
        gc.collect()
        gc.freeze()
        gc.disable()  # nothing in the loop makes cycles, and a collection would take milliseconds
        try:
            metronome.start()
            while not self._quit and self.fault is not Fault.PARENT_GONE:
                now = metronome.wait(rehearse, resting=self.rest.resting)
                self.tick(now, metronome.lateness, jumped=metronome.jumped)
        finally:
            gc.enable()
            gc.unfreeze()
            self.end()

    def run_for(self, seconds: float, start: float = 0.0) -> None:
        """Tick from `start` on, s, of the loop's own clock, as fast as it can be computed; the device stays open."""
        for k in range(round(seconds / self.period)):
            self.tick(start + k * self.period)

    def tick(self, now: float, lateness: float = 0.0, *, jumped: bool = False) -> None:
        """Pass through the stages once, from `now`, s, and `lateness`, s, behind the schedule.

        `jumped` says that the clock jumped since the last tick.
        """
        began = time.thread_time()
        self.now, self.fault = now, Fault.NONE
        pause = now - self._ticked
        self._ticked = now
        if jumped or pause > self.longest or pause < 0.0 or not math.isfinite(now):
            self.fail(Fault.CLOCK_JUMP)
        elif self._orphaned():
            self.fail(Fault.PARENT_GONE)
        if self.swap is not None:
            self.swap.step(self)
        for stage in self.stages:
            stage()
        stopped = self.fault is Fault.NONE and self.stop.stopped
        if self.fault is Fault.NONE:
            self._driver_fails = False
        self.out.hold_back(
            self.withheld,
            waiting=self.holding and self.evaluator.waiting,
            stopped=self.stop.stopped,
            released=self.released,
        )
        fault = Fault.STOPPED if stopped else self.fault
        self.out.tick(now, lateness, fault, resting=self.rest.resting)
        self._rest(pause)
        if self.recorder is not None:
            self.recorder.tick(self, lateness)
        self.out.worked(time.thread_time() - began)

    def _rest(self, elapsed: float) -> None:
        """Decide whether the next tick may take its time: see `palpate.runtime.realtime`."""
        x, y, z = self.out.hand.tolist()
        u, v, w = self._was
        self._was = (x, y, z)
        answer = self.evaluator
        if self.fault is not Fault.NONE:
            distance = 0.0
        elif not self.holding or self.stop.stopped or self.released:
            distance = math.inf
        else:
            distance = 0.0 if answer.holds or answer.waiting else -answer.depth / self.workspace.scale
        self.rest.see(elapsed, distance, math.hypot(x - u, y - v, z - w))

    def fail(self, fault: Fault) -> None:
        """Record what went wrong, and release the body; the first fault of a tick stands."""
        if self.fault is Fault.NONE:
            self.fault = self.withheld = fault
            self.evaluator.release()

    def device_failed(self, error: Exception) -> None:
        """Record an error of the device's driver; of several ticks in a row, the first one's words are published."""
        # a service's words may hold what can't be written
        said = str(error).encode(errors="replace").decode()
        if not self._driver_fails:
            self._driver_fails = True
            self.out.words(said or type(error).__name__)
        self.device_error = self.device_error or f"{type(error).__name__}: {said}"
        if isinstance(error, DeviceStopError):
            self.fail(Fault.DEVICE_STOPPED)
        else:
            lost = isinstance(error, DeviceLostError | ConnectionError)
            self.fail(Fault.DEVICE_LOST if lost else Fault.DEVICE_ERROR)

    def read(self) -> None:
        """Read device and commands: where the hand is, and whether that can be believed."""
        self._commands.fetch()  # an unfinished write leaves the last commands standing
        try:
            sample = self.device.read(self.now)
            late = sample.asleep or stalled(self.now + self._ahead, sample.time, sample.patience)
            x, y, z = sample.position.tolist()
            self.holding = bool(sample.holding) and not sample.clutched
            self._buttons, self._switch = int(sample.buttons), bool(sample.stop)
        except Exception as error:  # noqa: BLE001 - a driver is foreign code: whatever it does, the loop goes on
            self.holding = False
            self._buttons, self._switch = 0, False
            self.out.input(holding=False, late=True)
            self.device_failed(error)
            return
        self.out.input(holding=self.holding, late=late)
        if late and self.holding:  # nothing held, nothing at fault: a page may be hidden
            self.fail(Fault.INPUT_STALLED)
        if not math.isfinite(x + y + z):
            self.fail(Fault.INPUT_NOT_FINITE)
        elif not (self.motors and self.holding):
            self._check.forget()
        else:
            self._check.see(x, y, z, sample.time, self.now)
            if self._check.fault:
                self.fail(Fault.IMPOSSIBLE_PLACE)
        if self.fault is Fault.NONE and not self._check.doubts:  # a doubted place: the last good one stays
            self.frame.to_hand(sample.position, self.out.hand, clutched=sample.clutched)
            if self.turn is not None:
                self._see_turn(sample.orientation)
            if self.motors and not late and not self.rest.resting:
                self._measure_delay(self.now - sample.time)

    def _see_turn(self, orientation: np.ndarray) -> None:
        """Turn the tool with the hand, or fail where no wrist could have turned so."""
        assert self.turn is not None
        elapsed = self.now - self._turn_seen if math.isfinite(self._turn_seen) else self.period
        self._turn_seen = self.now
        self.turn.see(orientation, elapsed, holding=self.holding)
        if self.turn.fault and self.holding:
            self.fail(Fault.IMPOSSIBLE_PLACE)

    def guard(self) -> None:
        """Heed a person's stop and the dead-man button, and release the body for as long as they ask."""
        own = 1 if self.dead_man else 0
        pressed = self._switch or self._buttons & ~own != 0
        self.stop.heed(int(self._stops), int(self._resumes), pressed=pressed)
        self.released = self.dead_man and not self._buttons & 1
        if self.stop.stopped and self.withheld is not Fault.UNSTABLE:
            self.withheld = Fault.STOPPED
        if self.stop.stopped or self.released:
            self.evaluator.release()

    def _measure_delay(self, age: float) -> None:
        """Take the age of a sample into the mean delay, and soften a body that it makes too stiff.

        What leaks is proportional to the delay, so that the mean over a tenth of a second is what counts.
        """
        age = max(0.0, age) + self._own_delay
        self._age += (
            (age - self._age) * min(1.0, self.period / _DELAY_TIME) if self._heard else age - self._age
        )
        self._heard = True
        known = self.bounds.delay
        if abs(self._age - known) > _DELAY_CHANGE * (self.period / 2.0 + known):
            self.take_delay(self._age)

    def map(self) -> None:
        """Turn hand metres into body metres, and take over the parameters that were set."""
        self.workspace.to_body(self.out.hand, self.out.position)
        believed = self.fault is Fault.NONE and not (self.stop.stopped or self.released)
        self.evaluator.place(self.out.position, holding=self.holding, believed=believed)
        for i in range(len(self.parameters)):
            wish = float(self._wished[i])
            if math.isfinite(wish):
                self.parameters[i] = wish
        if self.turn is not None:
            self.turn.into(self.parameters)

    def evaluate(self) -> None:
        """Ask the learnt body, and decide whether its force may be felt."""
        self.open = False
        answer = self.evaluator
        if self.fault is not Fault.NONE or not self.holding or answer.waiting:
            self.coupling.reset()
        if self.fault is not Fault.NONE:
            return
        answer.elapsed = max(0.0, self.now - self._answered)
        self._answered = self.now
        try:
            if self.coupling.stiffness != self._spring:  # one that may only get stiffer where it is slack
                self.coupling.change(self._spring)
            if self.coupling.active and self.holding and not answer.waiting:
                self._answer_through_spring()
            else:
                answer(self.out.position, self.parameters)
                self.wanted = answer.force
        except Exception:  # noqa: BLE001 - a kind of body may be foreign code, too
            self.coupling.reset()
            self.fail(Fault.EVALUATOR_ERROR)
            return
        if math.isfinite(
            sum(answer.force.tolist())
            + sum(answer.contact.tolist())
            + sum(answer.loads.tolist())
            + sum(answer.torque.tolist())
        ):
            self.out.answer(answer)
        else:
            self.coupling.reset()
            self.fail(Fault.OUTPUT_NOT_FINITE)
        self._open()

    def _open(self) -> None:
        """Decide whether the force may be felt: a hand that is where it may be, and nothing that withholds it."""
        if self.holding and self.wanted.any() and math.hypot(*self.out.hand.tolist()) > self._edge:
            self.fail(Fault.OUT_OF_REGION)
        withheld = self.fault is not Fault.NONE or self.stop.stopped or self.evaluator.waiting
        if not withheld:
            self.withheld = Fault.NONE
        self.open = self.holding and not withheld and not self.released

    def _answer_through_spring(self) -> None:
        """Ask the learnt body at the proxy that a spring draws after the hand; the hand feels the spring."""
        answer, coupling, hand = self.evaluator, self.coupling, self.out.position
        for _ in range(self._steps):
            coupling.follow(hand, answer.force, answer.tangent)
            answer(coupling.proxy, self.parameters)
            if coupling.balanced(hand, answer.force):
                break
        self.wanted = coupling.pull(hand)

    def limit(self) -> None:
        """Limit force, slew and ramp; zero for a hand that doesn't hold, and where the force is withheld."""
        self.safety.apply(self.wanted, gate=self.open)
        self.out.clamped(self.safety.clamped)

    def control(self) -> None:
        """Count the energy, and damp what would give the hand more than it gave."""
        controller, force, sent, torque = self.passivity, self.out.force, self._sent, self.turn_torque
        if torque is not None:
            torque.count_way(sent, self.out.hand)
        if not self.open:
            self._stop_sending()
        else:
            self.workspace.force_on_hand(force, sent)
            free = not self.evaluator.force.any() and not sent.any()
            controller.max_force = self.safety.bearable_force
            elapsed, stored = self.now - self._before, self._stored() / self.workspace.scale
            stored -= torque.work if torque is not None and torque.shares else 0.0
            clamped = self.safety.clamped
            controller.apply(self.out.hand, sent, elapsed, stored=stored, clamped=clamped, free=free)
            if controller.damping > 0.0:
                self.workspace.force_on_body(sent, force)
            if self.safety.slew():
                self.workspace.force_on_hand(force, sent)
                controller.amend(sent)
            if self.motors and self.oscillation.see(sent, controller.stiffness * controller.noise):
                self.fail(Fault.UNSTABLE)
                self._stop_swinging()
        self._control_torque()
        self._before = self.now
        self.out.passivity(controller)

    def _stop_swinging(self) -> None:
        """Stop what has become unstable, until a person resumes: it would begin again."""
        self.stop.stopped = True
        self.safety.stop()
        self._stop_sending()

    def _control_torque(self) -> None:
        """Limit the torque and count its work, where the device renders one; publish the tool's own otherwise."""
        gate = self.open and self.fault is Fault.NONE
        answer, turn, torque = self.evaluator, self.turn, self.turn_torque
        if turn is None or torque is None:
            self.out.torque[:] = answer.torque if gate else 0.0  # times zero, not-a-number would be published
            return
        elapsed, free = self.now - self._before, not answer.torque.any() and not torque.torque.any()
        stored = self._stored() / self.workspace.scale
        if not torque.send(answer.torque, turn.angle, elapsed, stored, gate=gate, free=free):
            self.fail(Fault.UNSTABLE)
            self._stop_swinging()
        self.out.torque[:] = torque.torque
        turn.torque_to_device(torque.torque, self._turn_sent)

    def _stop_sending(self) -> None:
        """Send zero force."""
        self._sent[:] = 0.0
        self.passivity.interrupt()
        self.oscillation.reset()

    def _stored(self) -> float:
        """Energy that body and spring hold, J."""
        stored = self.evaluator.stored
        return stored + self.coupling.energy if self.coupling.active else stored

    def write(self) -> None:
        """Push on the hand."""
        self.frame.to_device(self._sent, self._sent_to_device)
        try:
            self._write_wrench()
        except Exception as error:  # noqa: BLE001 - as for `read`
            if self.turn_torque is not None:
                self.turn_torque.stop()
            self.safety.stop()  # nobody knows what was sent: don't claim it, and ramp in again
            self.out.torque[:] = 0.0
            self.passivity.amend()
            self.device_failed(error)

    def _write_wrench(self) -> None:
        """Give the device its force, and the torque too where it renders one."""
        if self.turn_torque is None:
            self.device.write(self._sent_to_device)
        else:
            self.device.write(self._sent_to_device, self._turn_sent)  # type: ignore[call-arg]  # renders both

    def end(self) -> None:
        """Send and publish zero force, whatever happened before, and close the device."""
        self.safety.stop()
        self.out.end()
        self._sent_to_device[:] = self._turn_sent[:] = 0.0
        for last in (self._write_wrench, self.device.close):
            try:
                last()
            except Exception as error:  # noqa: BLE001 - as for `read`
                self.device_failed(error)
