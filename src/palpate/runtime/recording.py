"""The loop's side of a recording: every tick as one record, in a ring that another process empties.

The loop never waits for a disk. It writes each tick into the next slot of a ring in shared memory; the process that
started the loop takes them out and writes them to a file (`recorder`). A ring that is not emptied in time loses its
oldest ticks, which are counted and told.

A record holds all that a tick depends on (its time, what the device said, the parameters in force, whether the driver
failed) and what came of it, so that a `replay` gives the same forces to the last bit and can say so. What a loop
remembers from before a recording is copied once, at its first tick (`snapshot`); a thread beside the loop puts the copy
into the ring.
"""

from __future__ import annotations

import json
import mmap
import pickle
import queue
import threading
import weakref
import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from palpate.devices.device import NO_TORQUE, Device, Sample, Traits
from palpate.devices.tick_record import BITS, FLAGS, TICK
from palpate.network import shared_memory
from palpate.runtime.realtime import obtain_beside
from palpate.runtime.snapshot import snapshot

if TYPE_CHECKING:
    from palpate.runtime.loop import Loop

__all__ = ["RecordedDevice", "Ring", "TickRecorder"]

_AS_PUBLISHED = (
    "tick",
    "hand",
    "position",
    "contact",
    "force",
    "torque",
    "depth",
    "stiffness",
    "delay",
    "coupling",
)

_SECONDS, _LEAST = 4.0, 4096  # s of ticks that the ring holds, and ticks at the least
_FASTEST = 10_000.0  # Hz; a loop at a higher rate is refused, and needs no room before that
_HEAD = 4096  # bytes before the slots: counters
_FACTS = 64 * 1024  # bytes for what the loop says of itself, JSON
_SNAPSHOT = 2 * 1024 * 1024  # bytes for what the loop remembers at the start of a recording
_MAGIC = b"palpate ring %08x\n" % zlib.crc32(repr(TICK.descr).encode())


class Ring:
    """Ticks on their way from the loop to the process that writes them down, in shared memory.

    One side fills it (`TickRecorder`), the other empties it (`take`); neither waits. `name` is the path of the shared
    memory, for `attach`, empty for one that a single process uses. In it lie three counters, () int64: `head`, the
    ticks written so far; `asked`, the number of the recording that the reader wants, 0 for none; and `begun`, that of
    the one which the loop has begun and whose first state is in the ring. `number` counts the recordings that this
    side, the reader, has asked for.
    """

    def __init__(self, name: str, memory: mmap.mmap) -> None:
        self.name, self._map = name, memory
        view = memoryview(memory)
        counters = np.frombuffer(view[64:_HEAD], np.int64, 8)
        self.head, self.asked, self.begun = (counters[k : k + 1].reshape(()) for k in range(3))
        # bytes of facts and of the snapshot; the latter -1 where there was no room
        self._sizes = counters[3:5]
        self._facts = view[_HEAD : _HEAD + _FACTS]
        self._snapshot = view[_HEAD + _FACTS : _HEAD + _FACTS + _SNAPSHOT]
        slots = view[_HEAD + _FACTS + _SNAPSHOT :]
        self.length = len(slots) // TICK.itemsize
        self.slots = np.frombuffer(slots, np.uint8, self.length * TICK.itemsize).reshape(
            self.length, TICK.itemsize
        )
        self.read, self.lost, self.number = 0, 0, 0

    @classmethod
    def create(cls, rate: float) -> Ring:
        """Make a ring that holds some seconds of ticks at `rate` (Hz)."""
        return cls.attach(shared_memory.create_for("a recording", _MAGIC, _size(rate)))

    @classmethod
    def attach(cls, name: str) -> Ring:
        """Join a ring made by `create` in another process; one of another version of palpate is a DeviceError."""
        return cls(name, shared_memory.attach_to("ring", name, _MAGIC))

    @classmethod
    def private(cls, rate: float = 1000.0) -> Ring:
        """Return a ring without a name, which no other process sees."""
        return cls("", mmap.mmap(-1, _size(rate)))

    def unlink(self) -> None:
        """Remove the name; who has attached keeps the memory. Harmless when repeated."""
        if self.name:
            shared_memory.remove(self.name)

    def describe(self, facts: Mapping[str, Any]) -> None:
        """Leave for the reader what the loop says of itself, as JSON."""
        self.describe_encoded(json.dumps(facts, allow_nan=False).encode())

    def describe_encoded(self, text: bytes) -> None:
        """Leave the same, already as JSON: it takes next to no time."""
        text = text[:_FACTS]
        self._facts[: len(text)] = text
        self._sizes[0] = len(text)

    @property
    def facts(self) -> dict[str, Any]:
        """Facts that the loop has left about itself; empty before it has."""
        return dict(json.loads(bytes(self._facts[: int(self._sizes[0])]) or b"{}"))

    def keep(self, state: Mapping[str, Any]) -> None:
        """Leave for the reader what the loop remembers as a recording begins."""
        data = pickle.dumps(dict(state), protocol=5)
        fits = len(data) <= _SNAPSHOT
        if fits:
            self._snapshot[: len(data)] = data
        self._sizes[1] = len(data) if fits else -1

    @property
    def state(self) -> dict[str, Any] | None:
        """Memory of the loop as the recording began; None where it was too much to keep."""
        size = int(self._sizes[1])
        # the bytes come from the loop that this process has started itself
        return None if size < 0 else dict(pickle.loads(bytes(self._snapshot[:size])))

    def take(self) -> np.ndarray:
        """Return the ticks (N,) written since the last call; those overwritten meanwhile are counted in `lost`."""
        head = int(self.head)
        start = max(self.read, head - self.length + 1)
        rows = self.slots[np.arange(start, head) % self.length].view(TICK).reshape(-1)
        behind = int(self.head) - self.length + 1 - start  # overwritten while they were copied
        if behind > 0:
            rows, start = rows[behind:], start + behind
        good = _intact(rows)  # the rest is on its way, and is taken next time
        self.lost += start - self.read
        self.read = start + good
        return rows[:good].copy()

    def close(self) -> None:
        """Let go of the memory. Harmless when repeated."""
        nothing = np.zeros(8, np.int64)
        self.head, self.asked, self.begun = (nothing[k : k + 1].reshape(()) for k in range(3))
        self._sizes, self.slots = nothing[3:5], np.zeros((1, TICK.itemsize), np.uint8)
        self._facts.release()
        self._snapshot.release()


def _size(rate: float) -> int:
    ticks = round(_SECONDS * min(max(0.0, rate), _FASTEST))
    return _HEAD + _FACTS + _SNAPSHOT + max(_LEAST, ticks) * TICK.itemsize


def _intact(rows: np.ndarray) -> int:
    """Return the number of ticks before the first one that is not whole."""
    data, size = rows.view(np.uint8).reshape(len(rows), TICK.itemsize), TICK.itemsize - 4
    for k, row in enumerate(data):
        if zlib.crc32(row[:size].data) != int(rows["checksum"][k]):
            return k
    return len(rows)


_Begun: TypeAlias = tuple[int, dict[str, Any] | None]


def _keep_states(states: queue.SimpleQueue[_Begun | None], ring: Ring) -> None:
    """Put what a loop remembers into the ring as each recording begins, until there is no more to come."""
    while (begun := states.get()) is not None:
        number, state = begun
        if state is not None:
            obtain_beside()
            ring.keep(state)
        ring.begun[()] = number


class RecordedDevice:
    """A device whose samples, failures and forces are noted for the recording, in a record () of dtype `TICK`."""

    def __init__(self, device: Device, record: np.ndarray) -> None:
        self.device = device
        self._position, self._sent = record["sample_position"], record["sent"]
        self._orientation, self._torque = record["sample_orientation"], record["sent_torque"]
        self._time, self._patience = record["sample_time"], record["patience"]
        self._turns, self._renders = device.traits.orients, device.traits.max_torque > 0.0
        self.flags = 0

    @property
    def traits(self) -> Traits:
        """The device's own."""
        return self.device.traits

    def read(self, now: float) -> Sample:
        """Return the device's sample, and note it."""
        self.flags = BITS["read_failed"]
        sample = self.device.read(now)
        self._position[:] = sample.position
        if self._turns:
            self._orientation[:] = sample.orientation
        self._time[()], self._patience[()] = sample.time, sample.patience
        self.flags = (
            (BITS["holding"] if sample.holding else 0)
            | (BITS["clutched"] if sample.clutched else 0)
            | (BITS["asleep"] if sample.asleep else 0)
        )
        return sample

    def write(self, force: np.ndarray, torque: np.ndarray = NO_TORQUE) -> None:
        """Push and turn with the device, and note force and torque."""
        self._sent[:] = force
        self._torque[:] = torque
        self.flags |= BITS["write_failed"]
        if self._renders:
            self.device.write(force, torque)  # type: ignore[call-arg]  # a device with a `max_torque`
        else:
            self.device.write(force)
        self.flags &= ~BITS["write_failed"]

    def close(self) -> None:
        """Close the device."""
        self.device.close()

    def __getattr__(self, name: str) -> Any:
        """Return whatever else the device has."""
        return getattr(self.device, name)


class TickRecorder:
    """Writes each tick of a loop into a ring, as long as the reader of the ring wants it.

    `record`, of dtype `TICK` and shape (), is the tick that was written last; `number` is that of the recording whose
    ticks are written, 0 for none.
    """

    def __init__(self, ring: Ring) -> None:
        self.ring, self.number = ring, int(ring.begun)
        self._states: queue.SimpleQueue[_Begun | None] = queue.SimpleQueue()
        self._bytes = np.zeros(TICK.itemsize, np.uint8)
        record = self._bytes.view(TICK).reshape(())
        self._covered = self._bytes[:-4].data
        self._views = {name: record[name] for name in TICK.names or ()}
        self.record = record
        self._device: Any = None

    def watch(self, device: Device) -> RecordedDevice:
        """Return the device to be used in place of `device`."""
        threading.Thread(target=_keep_states, args=(self._states, self.ring), daemon=True).start()
        weakref.finalize(self, self._states.put, None)
        self._device = RecordedDevice(device, self.record)
        return self._device  # type: ignore[no-any-return]

    def begin(self, loop: Loop) -> None:
        """Begin or end a recording with the next tick, where the reader has asked for it.

        None begins while two surrogates are blended: a replay finds one in the hand.
        """
        asked = int(self.ring.asked)
        if asked and loop.swap is not None:
            return
        if asked != self.number:
            # to encode the copy would take longer than the rest of a tick
            self._states.put((asked, snapshot(loop) if asked else None))
            self.number = asked

    def tick(self, loop: Loop, lateness: float) -> None:
        """Take over the tick that has just ended, `lateness` (s) behind its schedule."""
        ring = self.ring
        asked = int(ring.asked)
        if not asked or asked != self.number:
            self.begin(loop)
            return
        views, published, device = self._views, loop.out.record, self._device
        flags = device.flags
        for name in FLAGS[5:]:
            if published[name]:
                flags |= BITS[name]
        for name in _AS_PUBLISHED:
            views[name][...] = published[name]
        views["time"][()], views["lateness"][()] = loop.now, lateness
        views["wanted"][:] = loop.wanted
        views["ledger"][:] = loop.passivity.ledger
        views["parameters"][: len(loop.parameters)] = loop.parameters
        views["flags"][()], views["fault"][()] = flags, int(loop.fault)
        views["checksum"][()] = zlib.crc32(self._covered)
        head = int(ring.head)
        ring.slots[head % ring.length] = self._bytes
        ring.head[()] = head + 1
