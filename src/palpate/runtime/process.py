"""The parent's handle on the real-time process.

The loop runs as ``python -m palpate.runtime`` and not through `multiprocessing`: that would import the user's
main module again, which fails for scripts without a guard, notebooks and standard input.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self, TypeVar

from palpate import errors
from palpate.devices import device_traits
from palpate.errors import DeviceError, UsageError
from palpate.network import shared_memory
from palpate.network.kinds import outside_modules
from palpate.processes import helper_environment
from palpate.runtime.handover import hand_over, prepared
from palpate.runtime.loop_report import LoopReport
from palpate.runtime.recorder import TraceRecorder, model_facts
from palpate.runtime.recording import Ring
from palpate.runtime.shared_state import Shared, State, now
from palpate.runtime.swap import SECONDS, require_blend_time
from palpate.runtime.touchable import load_touchable

__all__ = ["LoopProcess"]

T = TypeVar("T")

_START = 60.0  # s: the first start on a machine compiles the kernels
_STOP = 2.0  # s that the process may take to end: then it is terminated, and as long after that killed
_SWAP = 60.0  # s until a surrogate is in the hand: its reading, and a blend before it


class LoopProcess:
    """Starts, watches and stops the loop; a context manager.

    Parameters
    ----------
    model : path
        File of a learnt body that can be touched.
    device : str
        ``page``, or ``stroke:amplitude=0.02``; see `palpate.devices`.
    rate : float
        Ticks per second, Hz.
    workspace : float, optional
        Radius, m; the device's own by default.
    max_force : float, optional
        N; the device's own by default.
    max_torque : float, optional
        N m, of a device that renders a torque; the device's own by default.
    slew : float
        N/s; 0 chooses full force in 20 ms.
    unsoftened : bool
        Whether a body that is too stiff for its device, its rate and delay shall feel so all the same; by default it
        is touched through a spring that makes it as soft as they bear.
    controller : bool
        Whether the passivity controller may damp; without it it only counts, and nothing protects from a body that
        gives energy but the watch on oscillations.
    dead_man : bool
        Whether the force acts only while the device's first button is held.
    parameters : (p,) floats
        Values of the inputs that the hand doesn't supply; the middle of their ranges by default.
    record : path, optional
        New file that takes every tick from the first on; see `start_recording`.
    replay : path, optional
        Recorded touch that is gone through instead of a device, at the pace at which it was recorded.
    aim : bool
        Whether a scripted stroke without a place presses where the body was trained to be pressed.
    friction : float, optional
        Coefficient of friction of the tool, a pure number; by default that of the body's file.

    Raises
    ------
    UsageError
        On an unknown device, a bad option or a bad model file.
    DeviceError
        If the process doesn't start.
    """

    def __init__(
        self,
        model: str | os.PathLike[str],
        *,
        device: str = "page",
        rate: float = 1000.0,
        workspace: float | None = None,
        max_force: float | None = None,
        max_torque: float | None = None,
        slew: float = 0.0,
        unsoftened: bool = False,
        controller: bool = True,
        dead_man: bool = False,
        parameters: Sequence[float] = (),
        record: str | os.PathLike[str] | None = None,
        replay: str | os.PathLike[str] | None = None,
        aim: bool = False,
        friction: float | None = None,
    ) -> None:
        traits = device_traits(device)
        if dead_man and not traits.buttons:
            raise UsageError(
                f"The device {device!r} has no button to hold.",
                why="A dead-man button is the first button of a device that none of its options takes.",
                fix="Leave it out; with the page the mouse button itself has to be held.",
            )
        self.device, self.rate = device, rate
        self._options: dict[str, Any] = {
            "model": os.fspath(model),
            "device": device,
            "rate": float(rate),
            "radius": float(traits.radius if workspace is None else workspace),
            "max_force": float(traits.max_force if max_force is None else max_force),
            "max_torque": math.inf if max_torque is None else float(max_torque),
            "slew": float(slew),
            "unsoftened": unsoftened,
            "control": controller,
            "dead_man": dead_man,
            "aim": aim,
            "friction": friction,
            "replay": "" if replay is None else os.fspath(replay),
        }
        self._model, self._record, self._replayed = model, record, replay is not None
        self._ring: Ring | None = None
        self.recording: TraceRecorder | None = None
        self._parameters = parameters
        self._process: subprocess.Popen[str] | None = None
        self._shared: Shared | None = None
        self._errors = ""
        self._last: State | None = None
        self._said: dict[str, Any] = {}
        self._listener: threading.Thread | None = None
        self._swapping, self._wishes = threading.Lock(), 0
        self._answers: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()

    def start(self) -> Self:
        """Start the process and wait for its first ticks.

        Raises
        ------
        UsageError
            If the process rejects the model or an option.
        DeviceError
            If it doesn't start, with what it said.
        """
        self._stderr = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        try:
            self._shared = Shared.create()
            self._ring = Ring.create(self.rate)
            if len(self._parameters):
                self.shared.write_command(parameters=self._parameters)
            if self._record is not None:
                self.recording = self._recorder(self._record)
            self._process = self._popen()
            self._listener = threading.Thread(target=self._listen, args=(self._process,), daemon=True)
            self._listener.start()
            self._await_first_tick()
        except BaseException:
            self.stop()
            self._stderr.close()
            if self.recording is not None:
                self.recording.discard()
            raise
        if self.recording is not None:
            self.recording.start()
        return self

    def swap(self, model: str | os.PathLike[str], *, seconds: float = SECONDS) -> int:
        """Put another surrogate of the touched body in the place of the one in the hand, while the loop ticks.

        It is read here, and handed to the loop ready to answer. Then the two are blended, so that the force has no
        jump; what the body remembers of its touch is handed on, and what the blend adds to its energy is booked. The
        workspace stays. Returns as the blend begins; another call waits until it has ended.

        Parameters
        ----------
        model : path
            File of the new surrogate.
        seconds : float
            Time of the blend, s, at least 0.1.

        Returns
        -------
        int
            Number of the tick with which the blend began.

        Raises
        ------
        UsageError, FileFormatError
            If the file is missing or damaged, or of a body that can't take the place: the old one stays in the hand.
        DeviceError
            If the process ends, or the blend has not begun within a minute.
        """
        require_blend_time(seconds)
        if self._replayed:
            raise UsageError(
                "A recorded touch is replayed: its surrogates are those that were recorded.",
                fix="Start the loop without a replay.",
            )
        with self._swapping:
            if not self.alive:
                raise self._failure("The real-time process has ended.")
            body = prepared(load_touchable(model, self._options["friction"]))
            facts = model_facts(Path(model).absolute())
            self._wishes += 1
            shared = hand_over(body)
            wish = {"swap": self._wishes, "shared": shared, "model": facts, "seconds": seconds}
            try:
                self._write(json.dumps(wish) + "\n")
                answer = self._answer_to(self._wishes)
            finally:
                shared_memory.remove(shared)  # where the loop has not taken it
        if refused := answer.get("refused"):
            kind = getattr(errors, refused["kind"], UsageError)
            raise kind(refused["what"], why=refused["why"], fix=refused["fix"])
        return int(answer["begun"])

    def _write(self, line: str) -> None:
        pipe = self._running.stdin
        try:
            assert pipe is not None
            pipe.write(line)
            pipe.flush()
        except (OSError, ValueError) as error:
            raise self._failure("The real-time process has ended.") from error

    def _answer_to(self, number: int) -> dict[str, Any]:
        until = now() + _SWAP
        while now() < until:
            try:
                answer = self._answers.get(timeout=0.1)
            except queue.Empty:
                if not self.alive:
                    raise self._failure(
                        "The real-time process ended while it read another surrogate."
                    ) from None
                continue
            if answer["swap"] == number:
                return answer
        raise DeviceError(
            f"The new surrogate was not in the hand within {_SWAP:.0f} s.",
            why="A blend before it is slow, as the hand presses where it would add energy, or the machine is busy.",
            fix="Take the hand out of the body; the new surrogate follows then.",
        )

    def start_recording(self, path: str | os.PathLike[str]) -> TraceRecorder:
        """Record every tick from now on into a new file, until `stop_recording` or `stop`.

        A file that can't be written any more ends the recording and not the loop: see `TraceRecorder.error`.

        Parameters
        ----------
        path : path
            A new file, for example ``touch.trace``.

        Raises
        ------
        UsageError
            If a recording runs already, the file exists, or its folder doesn't.
        ResourceError
            If the disk is full or the folder write-protected.
        """
        if self.recording is not None and self.recording.active:
            raise UsageError(f"{self.recording.path} is being recorded.", fix="Stop that recording first.")
        self.recording = self._recorder(path)
        self.recording.start()
        return self.recording

    def stop_recording(self) -> TraceRecorder | None:
        """End the recording and return it, None where there was none. Harmless when repeated."""
        if self.recording is not None:
            self.recording.stop()
        return self.recording

    def _recorder(self, path: str | os.PathLike[str]) -> TraceRecorder:
        header = {"device": self.device, "model": model_facts(self._model)}
        return TraceRecorder(_started(self._ring), path, header)

    def _popen(self) -> subprocess.Popen[str]:
        places = {"state": self.shared.name, "ring": _started(self._ring).name}
        told = json.dumps(self._options | places | {"modules": list(outside_modules())})
        try:
            return subprocess.Popen(
                [sys.executable, "-m", "palpate.runtime", told],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                text=True,
                env=helper_environment(),
            )
        except OSError as error:
            raise DeviceError(
                "The real-time process could not be started.",
                why=str(error),
                fix=f"Check that {sys.executable} may be run.",
            ) from error

    def _await_first_tick(self) -> None:
        until = now() + _START
        while self.shared.read_state().tick < 3:
            if not self.alive:
                raise self._failure("The real-time process ended before its first tick.")
            if now() > until:
                raise self._failure(f"The real-time process did not tick within {_START:.0f} s.")
            time.sleep(0.005)

    @property
    def shared(self) -> Shared:
        """The shared memory: `write_command` steers the loop."""
        return _started(self._shared)

    @property
    def pid(self) -> int:
        """Process id of the real-time process."""
        return self._running.pid

    @property
    def _running(self) -> subprocess.Popen[str]:
        return _started(self._process)

    @property
    def alive(self) -> bool:
        """True while the process runs."""
        return self._process is not None and self._process.poll() is None

    @property
    def scale(self) -> float:
        """Metres of body per metre of hand."""
        return self._state().scale

    def read(self) -> State:
        """Return the newest tick.

        Raises
        ------
        DeviceError
            If the process has ended: what it last published is no longer the force on the hand.
        """
        if not self.alive:
            raise self._failure("The real-time process has ended.")
        return self.shared.read_state()

    def stop(self) -> None:
        """Ask the loop to end, insist if it doesn't, and remove the shared memory. Harmless when repeated."""
        process = self._process
        if process is not None and process.stdin is not None and not process.stdin.closed:
            self.shared.write_command(quit=True)
            self._end(process)
            if self._listener is not None:
                self._listener.join()
            with contextlib.suppress(OSError):  # what a dead process was still to be told
                process.stdin.close()
        if self.recording is not None:
            self.recording.stop(lambda: {"report": self.report().as_dict()} if self._state().tick else {})
        if self._shared is not None and self._last is None:
            self._last = self._state()
            self._errors = self._complaint()
            if self._ring is not None:
                self._ring.unlink()
                self._ring.close()
            self._stderr.close()
            self._shared.close()
            self._shared.unlink()

    def _end(self, process: subprocess.Popen[str]) -> None:
        for insist in (process.terminate, process.kill):
            try:
                process.wait(_STOP)
            except subprocess.TimeoutExpired:
                insist()
        process.wait()

    def _listen(self, process: subprocess.Popen[str]) -> None:
        """Take what the process says, until it ends."""
        assert process.stdout is not None
        for line in process.stdout:
            try:
                said = json.loads(line)
            except ValueError:
                continue  # cut off by a kill
            if "swap" not in said:
                self._said |= said
                continue
            if "begun" in said:
                self._swapped(said)
            self._answers.put(said)
        process.stdout.close()

    def _swapped(self, said: dict[str, Any]) -> None:
        """Note that another surrogate has begun to take the place of the one in the hand."""
        self._model = said["model"]["path"]
        if self.recording is not None and self.recording.active:
            facts = {key: said[key] for key in ("model", "seconds")}
            self.recording.add_event("swap", loop_tick=said["begun"], **facts)

    def _state(self) -> State:
        if self._last is not None:
            return self._last
        try:
            return self.shared.read_state()
        except DeviceError:  # killed while publishing
            return State.of(self.shared.state.record, self.shared.indentation.record)

    def report(self) -> LoopReport:
        """Return the report of the loop, so far or in all; what the system granted is known once it has stopped."""
        foreign = tuple(self._said.get("foreign", ()))
        said, note = self._said.get("device_error", ""), self._said.get("device_note", "")
        return LoopReport.of(self._state(), self._said.get("obtained"), foreign, said, note)

    def _failure(self, what: str) -> DeviceError | UsageError:
        code = self._running.poll()
        why = self._complaint()
        if self._listener is not None and code is not None:
            self._listener.join(1.0)  # until the last words have come
        if (own := self._said.get("error")) is not None:  # the cause comes first, not that the process ended
            kind = UsageError if code == UsageError.exit_code else DeviceError
            return kind(own[0], why=own[1], fix=own[2])
        if code == UsageError.exit_code:
            return UsageError(why or what)
        return DeviceError(
            what,
            why=why or f"It said nothing; its exit code is {code}.",
            fix="See `palpate doctor`, then start it again.",
        )

    def _complaint(self) -> str:
        if self._stderr.closed:
            return self._errors
        self._stderr.seek(0)
        return self._stderr.read().strip()[-2000:]

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()


def _started(part: T | None) -> T:
    if part is None:
        raise UsageError("The real-time process was not started.", fix="Use LoopProcess in a with statement.")
    return part
