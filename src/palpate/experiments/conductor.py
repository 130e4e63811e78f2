"""The conductor of a live sitting: leads one participant from consent to the end, and writes down every trial.

`step` is called some sixty times a second. It looks at the loop, moves through the phases, and waits for nobody. What
pages send comes in by `hear` and `command`; what they show is `participant_view` and `control_view`. The
participant's view holds nothing that tells: no level, no name, no trial's kind, and a force only where the page itself
is the device, whose drawn force is then the stimulus.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.devices import device_traits
from palpate.errors import PalpateError, UsageError
from palpate.experiments.append_record import jump_in_words
from palpate.experiments.experiment_plan import Plan
from palpate.experiments.sitting import Sitting, Trial
from palpate.experiments.stimuli import Felt, Stimuli
from palpate.experiments.study_folder import SittingFiles
from palpate.runtime import LoopProcess
from palpate.runtime.shared_state import now
from palpate.runtime.touchable import Touchable

__all__ = ["Conductor"]

STEP = 1.0 / 60.0  # s between two steps
_FEEDBACK = 1.2  # s that a practice trial's feedback stays
_JUMP = 1.0  # s between the machine's clock and the steady one, from which on it has jumped
_SILENT = 1.0  # s without a word of the participant's page, after which nobody steers
_TOUCHED = 1e-6  # m of depth from which on a body is touched
_BEYOND = 1.5  # of the guided depth: how far the page's hand reaches


@dataclass
class _Touch:
    """A touch of one interval."""

    presses: int = 0
    force: float = 0.0
    depth: float = 0.0
    clamped: bool = False
    in_contact: bool = False
    first: float | None = None  # s, of the first contact
    file: str = ""


@dataclass
class _Attempt:
    """A trial under way."""

    trial: Trial
    onset: float
    interval: int = 1
    touches: list[_Touch] = field(default_factory=list)
    felt: list[Felt] = field(default_factory=list)  # the body of each interval
    asked: float = 0.0


class Conductor:
    """One sitting, live, on a started loop; `clock` gives steady seconds, `wall` those of the machine's clock."""

    def __init__(
        self,
        plan: Plan,
        sitting: Sitting,
        stimuli: Stimuli,
        files: SittingFiles,
        loop: LoopProcess,
        *,
        part: int = 1,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], float] = time.time,
    ) -> None:
        self.plan, self.sitting, self.stimuli, self.files, self.loop = plan, sitting, stimuli, files, loop
        self.part, self._clock, self._wall = part, clock, wall
        self.by_page = device_traits(plan.device.name).damping is None and plan.device.name == "page"
        self.phase, self.words, self.said = "consent", "", ""
        self._lock = threading.RLock()
        self._start, self._until = clock(), 0.0
        self._offset = wall() - clock()  # as it was when the last answer came
        self._attempt: _Attempt | None = None
        self._felt: Felt | None = None
        self._heard, self._hand, self._held, self._hidden = -np.inf, 0.0, False, False
        self._force = self._depth = 0.0
        body = stimuli.bodies["reference"]
        self._target = plan.sitting.depth or 0.5 * body.deepest
        if self._target > body.deepest:
            raise UsageError(
                f"The guided depth, {1e3 * self._target:.3g} mm, is beyond what was trained.",
                why=f"The reference was trained to {1e3 * body.deepest:.3g} mm.",
                fix="Make sitting.depth smaller.",
            )
        stroke = body.stroke(loop.scale)
        way = (stroke["x"], stroke["y"], stroke["z"]) if stroke else (0.0, -1.0, 0.0)
        self._way = np.array(way) * self._target * _BEYOND / loop.scale
        self._full = min(plan.device.max_force, _largest_force(body, self._target * _BEYOND, plan.vary.high))

    # ------------------------------------------------------------------ what pages say

    def hear(self, message: Mapping[str, Any]) -> None:
        """Take a message of the participant's page: the hand, consent, going on, an answer."""
        with self._lock, self._errors_in_words():
            self._heard = self._clock()
            self._hidden = bool(message.get("hidden", False))
            hand = message.get("hand")
            if isinstance(hand, int | float) and math.isfinite(hand):
                self._hand = float(np.clip(hand, 0.0, 1.0))
                self._held = bool(message.get("held", False))
            if message.get("agree") is True and self.phase == "consent":
                self.files.note("The participant agreed to the consent text.", self.sitting.done + 1)
                self.phase = "ready"
            if message.get("go") is True and self.phase == "ready":
                self._begin()
            if "answer" in message and self.phase == "question":
                self._answer(message["answer"])

    def command(self, message: Mapping[str, Any]) -> None:
        """Take a message of the control page: pause, resume, end, a note."""
        with self._lock, self._errors_in_words():
            wish = message.get("wish")
            if wish == "pause" and self.phase not in {"paused", "done", "failed", "consent"}:
                self._drop("The experimenter paused.")
                self.loop.shared.write_command(stop=True)
                self.phase = "paused"
            elif wish == "resume" and self.phase == "paused":
                self.loop.shared.write_command(resume=True)
                self.phase = "ready"
            elif wish == "end" and self.phase not in {"done", "failed"}:
                self._finish("The sitting was ended. It can be taken up again.")
            text = str(message.get("note", "")).strip()[:2000]
            if text:
                self.files.note(text, self.sitting.done + 1)
                self.said = "The note is written down."

    # ------------------------------------------------------------------ what pages show

    def participant_view(self) -> dict[str, Any]:
        """Return what the participant's page shows."""
        with self._lock:
            view: dict[str, Any] = {"phase": self.phase, "words": self.words, "page": self.by_page}
            if self.phase == "consent":
                view["consent"] = self.plan.consent
            if self._attempt is not None:
                view |= {"interval": self._attempt.interval, "intervals": self.plan.intervals}
            if self.phase == "touch":
                view["depth"] = round(max(0.0, self._depth) / self._target, 3)
                view["beyond"] = _BEYOND
                if self.by_page:
                    view["force"] = round(self._force / self._full, 3)
            if self.phase == "question":
                view |= {
                    "ask": self.plan.question_words,
                    "rate": [r.text for r in self.plan.rating] if self._rates else [],
                }
            if self.phase == "break":
                view["left"] = max(0.0, round(self._until - self._clock()))
            return view

    def control_view(self) -> dict[str, Any]:
        """Return what the control page shows."""
        with self._lock:
            trial = None if self._attempt is None else self._attempt.trial
            return {
                "participant": self.sitting.participant,
                "phase": self.phase,
                "done": self.sitting.done,
                "total": self.sitting.total,
                "minutes": round((self._clock() - self._start) / 60.0, 2),
                "limit": self.plan.sitting.limit_minutes,
                "trial": None if trial is None else trial.number,
                "kind": "" if trial is None else trial.kind,
                "condition": "" if trial is None else trial.condition,
                "value": None if trial is None else round(trial.value, 4),
                "bodies": [] if trial is None else list(trial.bodies),
                "interval": None if self._attempt is None else self._attempt.interval,
                "force": round(self._force, 3),
                "depth": round(1e3 * self._depth, 3),
                "connected": self._clock() - self._heard < _SILENT,
                "words": self.words,
                "said": self.said,
            }

    @property
    def _rates(self) -> bool:
        return self.plan.question == "rating"

    # ------------------------------------------------------------------ the course of a sitting

    def step(self) -> None:
        """Look at the loop and go on; a device that fails ends the sitting in words."""
        with self._lock:
            if self.phase in {"done", "failed"}:
                return
            with self._errors_in_words():
                self._look()
                self._go_on()

    @contextlib.contextmanager
    def _errors_in_words(self) -> Iterator[None]:
        """End the sitting in words where a device or the disk fails."""
        try:
            yield
        except PalpateError as error:
            self.phase, self.said = "failed", f"{error} Run the same command again: the sitting goes on here."
            self.words = "There is an interruption. Please wait for the experimenter."
            with contextlib.suppress(PalpateError):  # a full disk takes no note either
                self._drop(str(error))
            self._attempt = None

    def _look(self) -> None:
        """Steer the page's hand, and take in force and depth."""
        present = self._clock() - self._heard < _SILENT and not self._hidden
        if self.by_page:
            held = present and self._held and self.phase == "touch"
            target = self._way * self._hand if held else None
            self.loop.shared.write_command(
                beat=now() if present else None, target=target, grabbed=held, hidden=not present, period=STEP
            )
        state = self.loop.read()
        held = state.grabbed and not state.stalled
        self._force = float(np.linalg.norm(state.force)) if held else 0.0
        body = self.stimuli.bodies["reference"]
        reach = float(np.linalg.norm(state.position)) if body.holds else state.depth
        self._depth = reach if held else 0.0
        self._clamped = bool(state.clamped)

    _clamped = False

    def _go_on(self) -> None:
        present = self._clock()
        if (
            self.phase in {"ready", "break", "question"}
            and present - self._start > 60.0 * self.plan.sitting.limit_minutes
        ):
            self._finish("The time of this sitting is over. Thank you; it can be taken up another day.")
        elif self.phase == "break" and present >= self._until:
            self.phase = "ready"
        elif self.phase == "feedback" and present >= self._until:
            self._after_trial()
        elif self.phase == "between":
            self._try_interval()
        elif self.phase == "touch":
            self._watch_touch()
        elif self.phase == "lift" and self._depth <= _TOUCHED:
            self._end_interval()

    def _begin(self) -> None:
        """Begin the next trial, or end."""
        trial = self.sitting.next()
        if trial is None:
            self._finish("That was all. Thank you!")
            return
        self._attempt = _Attempt(trial, self._clock() - self._start)
        self._pause()

    def _pause(self) -> None:
        """Let a time pass that is the same whether the next body is another one or not: its length must not tell."""
        self.words, self.phase = "", "between"
        self._until = self._clock() + self.plan.sitting.pause_seconds

    def _try_interval(self) -> None:
        """Put the interval's body into the hand while nothing is touched; then record and let touch."""
        attempt = self._attempt
        assert attempt is not None
        if self._depth > _TOUCHED:
            return
        self._lock.release()  # pages are shown and heard while bodies are made, and the loop takes the next one
        try:
            if (
                not attempt.felt
            ):  # all before the first interval: the time that it takes to make one would tell which it is
                attempt.felt = [
                    self.stimuli.felt(attempt.trial, k) for k in range(1, self.plan.intervals + 1)
                ]
            felt = attempt.felt[attempt.interval - 1]
            if self._felt is None or felt.file != self._felt.file:
                self.loop.swap(felt.file)
        finally:
            self._lock.acquire()
        self._felt = felt
        if felt.parameters:
            self.loop.shared.write_command(parameters=felt.parameters)
        if self._attempt is not attempt or self.loop.read().blending or self._clock() < self._until:
            return
        path = self.files.recording(attempt.trial.number, attempt.interval)
        self.loop.start_recording(path)
        attempt.touches.append(_Touch(file=path.name))
        self.phase = "touch"

    def _watch_touch(self) -> None:
        attempt = self._attempt
        assert attempt is not None
        touch = attempt.touches[-1]
        contact = self._depth > _TOUCHED
        touch.presses += contact and not touch.in_contact
        if contact and touch.first is None:
            touch.first = self._clock()
        touch.in_contact = contact
        touch.force, touch.depth = max(touch.force, self._force), max(touch.depth, self._depth)
        touch.clamped |= self._clamped and contact
        if touch.first is not None and self._clock() - touch.first >= self.plan.sitting.interval_seconds:
            self.phase = "lift"

    def _end_interval(self) -> None:
        attempt = self._attempt
        assert attempt is not None
        self._stop_recording()
        if attempt.interval < self.plan.intervals:
            attempt.interval += 1
            self._pause()
        else:
            attempt.asked, self.phase = self._clock(), "question"

    def _stop_recording(self) -> None:
        recording = self.loop.stop_recording()
        if recording is not None and recording.error is not None:
            raise recording.error

    def _answer(self, answer: Any) -> None:
        """Write the answer down; only then is the trial over."""
        attempt = self._attempt
        assert attempt is not None
        ratings = _ratings(answer, len(self.plan.rating)) if self._rates else []
        if self._rates:
            if ratings is None:
                return
        elif (
            not isinstance(answer, int) or isinstance(answer, bool) or not 1 <= answer <= self.plan.intervals
        ):
            return
        response = 1 if self._rates else answer
        trial, present = attempt.trial, self._clock()
        offset = self._wall() - present
        jump, self._offset = offset - self._offset, offset
        touches = attempt.touches
        correct = trial.is_correct(response)
        row: dict[str, Any] = {
            "onset": f"{attempt.onset:.3f}",
            "duration": f"{present - self._start - attempt.onset:.3f}",
            "part": self.part,
            "trial": trial.number,
            "kind": trial.kind,
            "condition": trial.condition,
            "level": f"{trial.level:.9g}",
            "value": f"{trial.value:.9g}",
            "intervals": ",".join(trial.bodies),
            "response": "n/a" if self._rates else response,
            "correct": "n/a" if self._rates else int(correct),
            "response_time": f"{present - attempt.asked:.3f}",
            "presses": ",".join(str(t.presses) for t in touches),
            "peak_force": ",".join(f"{t.force:.4g}" for t in touches),
            "peak_depth": ",".join(f"{t.depth:.4g}" for t in touches),
            "limits_hit": int(any(t.clamped for t in touches)),
            "clock_jump": f"{jump:.1f}" if abs(jump) > _JUMP else "0",
            "recordings": ",".join(t.file for t in touches),
        }
        row |= dict(zip((r.name for r in self.plan.rating), ratings or [], strict=False))
        if abs(jump) > _JUMP:
            self.said = f"{jump_in_words(jump)}; the trials' times are not affected."
        self.files.append(row)
        self.sitting.answer(response)
        self._attempt = None
        if trial.kind == "practice":
            self.words = "" if self._rates else ("Right." if correct else "Not quite.")
            self._until, self.phase = present + _FEEDBACK, "feedback"
        else:
            self._after_trial()

    def _after_trial(self) -> None:
        self.words = ""
        if self.sitting.next() is None:
            self._finish("That was all. Thank you!")
        elif self.sitting.break_is_due:
            self._until, self.phase = self._clock() + self.plan.sitting.break_seconds, "break"
        else:
            self.phase = "ready"

    def _drop(self, why: str) -> None:
        """Give up the attempt at a trial, which comes again; its recordings stay."""
        if self._attempt is not None and self.loop.recording is not None:
            self.loop.stop_recording()
            self.files.note(f"An attempt was given up: {why}", self._attempt.trial.number)
        self._attempt = None

    def _finish(self, words: str) -> None:
        self._drop("The sitting ended.")
        self.words, self.phase = words, "done"


def _largest_force(body: Touchable, depth: float, ratio: float) -> float:
    """Return the force (N) that fills the page's bar: of the reference at a depth, times the largest ratio."""
    if body.holds:
        return body.force_max * ratio
    place = (body.home - depth * body.normal)[: len(body.inputs) - len(body.parameters)]
    x = np.concatenate([place, [(r.low + r.high) / 2.0 for r in body.parameters]])
    force = float(np.linalg.norm(body.energy.force(x[None])[0])) * max(ratio, 1.0)
    return force or body.force_max


def _ratings(answer: Any, count: int) -> list[int] | None:
    """Return ratings from 1 to 7, one for each statement; None where they are not that."""
    if not isinstance(answer, list) or len(answer) != count:
        return None
    whole = all(isinstance(a, int) and not isinstance(a, bool) and 1 <= a <= 7 for a in answer)
    return answer if whole else None
