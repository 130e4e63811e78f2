"""The memory that the real-time process shares with everyone else: state and indentation out, commands in.

Three records are shared: `STATE` is one tick of the loop, `INDENTATION` what stays pressed in a body that yields, and
`COMMAND` what the loop is asked to do. All of them live in one memory-mapped file, whose path is its name, each behind
a sequence lock (`network.shared_memory`).
"""

from __future__ import annotations

import math
import mmap
import threading
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self, TypeAlias, get_origin, get_type_hints

import numpy as np

from palpate.devices.hand_kind import HandKind
from palpate.devices.tick_record import LEDGER, MAX_INPUTS
from palpate.errors import DeviceError, UsageError
from palpate.network import shared_memory
from palpate.network.shared_memory import Block
from palpate.runtime.loop_report import BINS, percentile
from palpate.runtime.safety import Fault
from palpate.runtime.stability import FeltStiffness

__all__ = [
    "COMMAND",
    "INDENTATION",
    "MAX_PLACES",
    "STATE",
    "Block",
    "Shared",
    "State",
    "now",
    "require_room",
    "size_of",
]

MAX_PLACES = 4096
FAULT_KINDS = 16
ONSETS = 32  # of faults, whose times are kept

INDENTATION = np.dtype(
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
        ("stops", "i8"),  # counts the stops
        ("resumes", "i8"),  # counts the ends of a stop
        ("target", "f8", 3),  # m, hand in device coordinates
        ("period", "f8"),  # s between heartbeats
        ("parameters", "f8", MAX_INPUTS),  # the untouched inputs; NaN: not set, middle of its range
    ],
    align=True,
)


_Count: TypeAlias = Annotated[int, "i8"]
_Kind: TypeAlias = Annotated[int, "i4"]
_Number: TypeAlias = Annotated[float, "f8"]
_Flag: TypeAlias = Annotated[bool, "u1"]
_Vector: TypeAlias = Annotated[np.ndarray, "f8", 3]


@dataclass(frozen=True, eq=False)
class State:
    """One published tick, copied out of the shared memory, whose record is `STATE`.

    Percentiles are taken here, by the reader, and not in the loop.
    """

    tick: _Count
    time: _Number  # s, `now()` when the tick began
    hand: _Vector  # m, device coordinates
    position: _Vector  # m, body: offset from the touched node's rest position, or the probe's centre
    contact: _Vector  # m, body: where the touched node is, or the probe's centre
    force: _Vector  # N on the hand, as sent, in the body's axes
    torque: _Vector  # N m on a tool about its place, in the body's axes: as sent, or as it would be felt
    depth: _Number  # m, of a probe in the surface at rest; 0 for a body held at a node
    stiffness: _Number  # N/m, felt along the force in body metres; 0 where it isn't known
    loads: Annotated[np.ndarray, "f8", MAX_INPUTS]  # N, the loads that hold the body there
    inside: _Flag  # within the trained range
    let_go: _Flag  # the body has let go of a probe that is too deep in it
    clamped: _Flag  # the force limit acted
    grabbed: _Flag  # a hand holds the body
    stalled: _Flag  # the input is older than its device allows
    fault: _Kind  # `Fault` of this tick
    last_fault: _Kind  # the latest that was not NONE
    faults: _Count  # onsets since the start
    fault_counts: Annotated[np.ndarray, "i8", FAULT_KINDS]  # the same by kind
    # s, of the latest onsets: number k is at k modulo their count
    onset_times: Annotated[np.ndarray, "f8", ONSETS]
    onset_kinds: Annotated[np.ndarray, "i4", ONSETS]
    withheld: _Kind  # `Fault` that took the force, until it may come back
    waiting: _Flag  # no force until the hand is where the body holds no energy
    stopped: _Flag  # no force until a person resumes
    released: _Flag  # no force until the dead-man button is held
    idle: _Flag  # nobody touches: the loop ticks more slowly
    words: Annotated[str, "S160"]  # of the driver's latest error, UTF-8
    device: Annotated[str, "S48"]  # what the device calls itself, UTF-8
    clamped_ticks: _Count
    lateness: _Number  # s, this tick's start behind its schedule
    lateness_max: _Number
    work: _Number  # s, CPU time of the tick before
    rate: _Number  # Hz, achieved
    scale: _Number  # metres of body per metre of hand
    radius: _Number  # m, the hand's workspace
    max_force: _Number  # N
    ledger: Annotated[np.ndarray, "f8", LEDGER]  # of the passivity controller, see `State`
    delay: _Number  # s, measured, from the device's sample to its force
    delay_known: _Flag  # it was stated or measured
    uncontrolled: _Flag  # the passivity controller only counts
    device_damping: _Number  # N·s/m; NaN for a device without motors
    device_stiffness: _Number  # N/m, the largest that its maker states; inf: none
    body_stiffness: _Number  # N/m in hand metres, the body's largest; 0 where it isn't known
    nominal_rate: _Number  # Hz, as asked
    coupling: _Number  # N/m in hand metres, of the spring in front of a body that is too stiff; inf: none
    unsoftened: _Flag  # the body shall feel as stiff as it is
    blending: _Flag  # another surrogate takes the place of the one in the hand
    swaps: _Count  # surrogates that have taken another one's place
    added: _Number  # J, that blending has given the body, in all
    histogram: Annotated[np.ndarray, "i8", BINS]  # lateness, `Histogram` bins
    work_histogram: Annotated[np.ndarray, "i8", BINS]
    indentation: np.ndarray  # (n,) √J, of the indentation at each place; empty where nothing has yielded

    @property
    def energy(self) -> float:
        """Energy that the hand has put in, less what it was given back, J; a credit ends where nothing is touched."""
        return float(self.ledger[0])

    @property
    def energy_lowest(self) -> float:
        """The lowest `energy` so far, J."""
        return float(self.ledger[1])

    @property
    def added_damping(self) -> float:
        """Damping of the passivity controller on this tick, N·s/m."""
        return float(self.ledger[2])

    @property
    def damping_energy(self) -> float:
        """Energy that added damping was meant to take, in all, J."""
        return float(self.ledger[3])

    @property
    def leak(self) -> float:
        """Σ (½ + d/T) |Δx̄|², m²: times the felt stiffness the most that sampling can have leaked, J."""
        return float(self.ledger[4])

    @property
    def sensor_noise(self) -> float:
        """Standard deviation of the device's places along one axis, stated or measured, m."""
        return float(self.ledger[5])

    @property
    def felt_stiffness(self) -> FeltStiffness:
        """The stiffness of the body in this hand, and its bound, with the delay that was measured."""
        damping = None if math.isnan(self.device_damping) else self.device_damping
        return FeltStiffness(
            self.body_stiffness,
            damping,
            self.nominal_rate,
            self.delay,
            self.unsoftened,
            self.device_stiffness,
            self.delay_known,
            not self.uncontrolled,
        )

    @property
    def onsets(self) -> tuple[tuple[float, Fault], ...]:
        """The latest onsets of faults, the newest last: time, s, and kind."""
        latest = range(max(0, self.faults - ONSETS), self.faults)
        return tuple(
            (float(self.onset_times[k % ONSETS]), Fault(self.onset_kinds[k % ONSETS])) for k in latest
        )

    def reason(self, hand: HandKind = HandKind.DEVICE) -> str:
        """Return why there is no force now, and what brings it back, for a kind of hand; empty where it may flow."""
        fault = Fault(self.fault)
        if self.stopped:
            since = f" since {fault.meaning}" if (fault := Fault(self.withheld)) is Fault.UNSTABLE else ""
            return f"Stopped{since}: the force stays zero until you resume."
        if fault is not Fault.NONE:
            said = f" ({self.words})" if self.words and fault in _DRIVER else ""
            return f"No force: {fault.meaning_for(hand)}{said}."
        if self.released:
            return "No force: the dead-man button is not held."
        if not self.waiting:
            return ""
        after = Fault(self.withheld)
        since = f" since {after.meaning_for(hand)}" if after is not Fault.NONE else ""
        return f"No force yet{since}: {hand.way_back}"

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
    def of(cls, record: np.ndarray, indentation: np.ndarray) -> State:
        """Copy records of dtype `STATE` and `INDENTATION`, shape ()."""
        values: dict[str, Any] = {}
        for name in STATE.names or ():
            value = record[name]
            if value.ndim:
                values[name] = value.copy()
            elif value.dtype.kind == "S":
                values[name] = value.item().decode(errors="replace")
            else:
                values[name] = bool(value) if value.dtype == np.uint8 else value.item()
        return cls(**values, indentation=indentation["amplitude"][: indentation["count"]].astype(float))


def _record_of(kind: type) -> np.dtype[np.void]:
    """Return the record of a class, whose annotations say how each number is stored."""
    hints = get_type_hints(kind, include_extras=True).items()
    return np.dtype(
        [(name, *hint.__metadata__) for name, hint in hints if get_origin(hint) is Annotated], align=True
    )


STATE = _record_of(State)
_DRIVER = (Fault.DEVICE_ERROR, Fault.DEVICE_STOPPED, Fault.DEVICE_LOST)  # whose words say more


def require_room(body: str, inputs: int, places: int) -> None:
    """Refuse a body that has more inputs, or keeps indentations at more places, than is shared."""
    kinds = (
        ("inputs", inputs, MAX_INPUTS, "Learn it with fewer inputs."),
        ("places with an indentation", places, MAX_PLACES, "Save it with a larger spacing."),
    )
    for kind, count, most, fix in kinds:
        if count > most:
            raise UsageError(
                f"{body} has {count} {kind}; the runtime carries {most}.",
                why="The memory that loop and viewer share has room for no more.",
                fix=fix,
            )


def size_of(indentation: np.ndarray) -> int:
    """Return the bytes of a record of dtype `INDENTATION` that hold something."""
    return int(INDENTATION.fields["amplitude"][1] + 4 * indentation["count"])  # type: ignore[index]


now = time.perf_counter  # s; monotonic and the same for every process of the machine

_PAGE = 4096
_INDENTATION_AT = 3 * _PAGE  # behind header, state and command
_SIZE = _INDENTATION_AT + -(-(INDENTATION.itemsize + Block.HEADER) // _PAGE) * _PAGE
_MAGIC = b"palpate runtime %08x\n" % zlib.crc32(
    repr((STATE.descr, COMMAND.descr, INDENTATION.descr)).encode()
)


class Shared:
    """The blocks of state, indentation and commands under one name.

    `create` makes them (the parent: viewer or command line), `attach` joins them (the loop). The loop writes
    `state` and `indentation` and reads `command`; everybody else calls `read_state` and `write_command`.
    """

    def __init__(self, name: str, memory: mmap.mmap) -> None:
        self.name = name
        self._map = memory
        self._lock = threading.Lock()
        view = memoryview(memory)
        self.state = Block(view[_PAGE : 2 * _PAGE], STATE)
        self.command = Block(view[2 * _PAGE : _INDENTATION_AT], COMMAND)
        self.indentation = Block(view[_INDENTATION_AT:], INDENTATION)
        view.release()

    @classmethod
    def create(cls) -> Shared:
        """Make the blocks, empty: tick 0, nothing grabbed, parameters not set.

        Raises
        ------
        DeviceError
            If the system gives no shared memory.
        """
        shared = cls.attach(shared_memory.create_for("the real-time process", _MAGIC, _SIZE))
        shared.command.record["parameters"] = np.nan
        shared.command.publish()
        shared.state.publish()
        shared.indentation.publish()
        return shared

    @classmethod
    def attach(cls, name: str) -> Shared:
        """Join the blocks made by `create` in another process.

        Raises
        ------
        DeviceError
            If there are none of that name, or another version of palpate made them.
        """
        return cls(name, shared_memory.attach_to("shared memory", name, _MAGIC, _SIZE))

    @classmethod
    def private(cls) -> Shared:
        """Blocks without a name, which no other process sees."""
        return cls("", mmap.mmap(-1, _SIZE))

    def read_state(self) -> State:
        """Return the newest published tick.

        Raises
        ------
        DeviceError
            If a write never ends: the real-time process died in the midst of one.
        """
        until = now() + 0.5
        with self._lock:  # a server's threads share this side's copy
            while not self.state.fetch():
                if now() > until:
                    raise DeviceError(
                        "The real-time process stopped while it was publishing.",
                        why="Its process was killed.",
                        fix="Start it again.",
                    )
                time.sleep(0)
            self.indentation.fetch()  # in the midst of a write those before it stand
            return State.of(self.state.record, self.indentation.record)

    def write_command(
        self,
        *,
        beat: float | None = None,
        target: Sequence[float] | np.ndarray | None = None,
        grabbed: bool | None = None,
        hidden: bool | None = None,
        period: float | None = None,
        parameters: Sequence[float] | np.ndarray | None = None,
        quit: bool | None = None,
        stop: bool = False,
        resume: bool = False,
    ) -> None:
        """Change what is given, keep the rest, publish.

        Parameters
        ----------
        beat : s, optional
            `now()` when the page was last heard.
        target : (3,) m, optional
            Hand in device coordinates; each one counts as a fresh sample.
        grabbed, hidden, quit : bool, optional
            A hand holds the body; the page is in the background; the loop shall end.
        period : s, optional
            What the page promises between two heartbeats.
        parameters : (p,), optional
            The untouched inputs in SI units, p ≤ 8.
        stop, resume : bool
            A person stops the force now, or ends a stop.

        Raises
        ------
        UsageError
            If there are more parameters than the block holds.
        """
        values = {"beat": beat, "grabbed": grabbed, "hidden": hidden, "period": period, "quit": quit}
        with self._lock:
            record = self.command.record
            for name, value in values.items():
                if value is not None:
                    record[name] = value
            if target is not None:
                record["target"] = target
                record["sequence"] += 1
            record["stops"] += stop
            record["resumes"] += resume
            if parameters is not None:
                if len(parameters) > MAX_INPUTS:
                    raise UsageError(
                        f"{len(parameters)} parameters were given; the runtime carries {MAX_INPUTS}.",
                        fix="Fix the least important inputs when the model is made.",
                    )
                record["parameters"][: len(parameters)] = parameters
            self.command.publish()

    def close(self) -> None:
        """Unmap; the name stays for others. Harmless when repeated."""
        self.state.release()
        self.command.release()
        self.indentation.release()
        self._map.close()

    def unlink(self) -> None:
        """Remove the name; who has attached keeps the memory. Harmless when repeated."""
        if self.name:
            shared_memory.remove(self.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        self.unlink()
