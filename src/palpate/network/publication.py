"""A network published to other processes: readers never wait, and never see half of one.

The publisher writes each network into the older of two slots and then says which is the newer, so a reader
fails only if two networks are published while it copies one; it then keeps what it has. Each slot has a sequence
number and a checksum (`shared_memory.Block`). A text before the slots says once what does not change: names, units,
ranges, capacities.

    publisher = Publisher.create(inputs, outputs, units=100)      # the process that learns
    publisher.publish(network)

    subscriber = Subscriber.attach(name)                          # the process that evaluates
    subscriber.fetch()                                            # each tick: new? else 1 µs
    y = subscriber(x)
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Self

import numpy as np

from palpate.errors import UsageError
from palpate.network import shared_memory
from palpate.network.archive import quantity_from_json, range_from_json
from palpate.network.network import Evaluator, Network, Scaling
from palpate.network.network_kernels import Precision
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.network.shared_memory import Block
from palpate.network.soundness import flaw
from palpate.units import Quantity, Range

__all__ = ["Publisher", "Subscriber"]

_MAGIC = b"palpate network 2\n".ljust(32, b"\0")
_LATEST, _LENGTH, _TEXT = 32, 40, 64  # places of the newest serial number, the text's length and the text
_HEAD = 8  # serial, h, r, k, whether there is a basis, radial function; two to spare


def _create(text: Mapping[str, Any]) -> _Memory:
    """Make the memory that `text` describes; an OSError says that there is no room for it."""
    content = json.dumps(text).encode()
    head = bytearray(_MAGIC.ljust(_TEXT, b"\0") + content)
    head[_LENGTH : _LENGTH + 8] = np.int64(len(content)).tobytes()
    return _Memory(
        shared_memory.create(bytes(head), _aligned(len(head)) + 2 * _slot_size(_record_type(text)))
    )


class _Memory:
    """The mapped file seen as its text, the serial number of the newest network, and two slots."""

    def __init__(self, name: str) -> None:
        try:
            self.map = shared_memory.attach(name, _MAGIC)
        except (OSError, ValueError) as error:
            raise UsageError(
                f"No network is published as {name!r}.",
                why=str(error),
                fix="Its publisher has ended, or the name is another process's: pass Publisher.name, and run both "
                "sides from one installation.",
            ) from error
        self.name = name
        length = int(np.frombuffer(self.map, np.int64, 1, _LENGTH)[0])
        self.text: dict[str, Any] = json.loads(self.map[_TEXT : _TEXT + length])
        dtype, begin = _record_type(self.text), _aligned(_TEXT + length)
        size = _slot_size(dtype)
        with memoryview(self.map) as view:
            self.slots = tuple(Block(view[begin + i * size : begin + (i + 1) * size], dtype) for i in (0, 1))
            self.latest = np.ndarray((), np.int64, view[_LATEST : _LATEST + 8])

    def close(self) -> None:
        """Unmap. Harmless when repeated."""
        for slot in self.slots:
            slot.release()
        self.latest = np.zeros((), np.int64)
        self.map.close()


def _parts_of(network: Network) -> tuple[np.ndarray, ...]:
    """The arrays of a network that travel, in order."""
    s = network.scaling
    scales = (s.input_centre, s.input_half, s.output_centre, s.output_scale, s.input_bend)
    own = (network.factors, network.shifts, network.weights, network.tail, *scales)
    return own if network.basis is None else (*own, network.basis)


def _shapes_of(n: int, m: int, h: int, r: int, k: int, basis: int) -> tuple[tuple[int, ...], ...]:
    """Shapes of `_parts_of`."""
    own = ((h, r, n), (h, r), (k, h), (k, 1 + n), (n,), (n,), (m,), (m,), (n,))
    return (*own, (m, k)) if basis else own


def _record_type(text: Mapping[str, Any]) -> np.dtype[np.void]:
    """Room for the largest network that may come."""
    n, m, h, r, k = (
        len(text["inputs"]),
        len(text["outputs"]),
        *(text[x] for x in ("units", "rank", "modes")),
    )
    sizes = [
        sum(math.prod(s) for s in _shapes_of(n, m, h, r, latent, basis))
        for latent, basis in ((m, 0), (k, 1))
        if latent
    ]
    return np.dtype([("head", np.int64, _HEAD), ("numbers", np.float64, max(sizes))])


def _aligned(size: int) -> int:
    return -(-size // 64) * 64


def _slot_size(dtype: np.dtype[np.void]) -> int:
    return _aligned(Block.HEADER + dtype.itemsize)


class Publisher:
    """The writing side: one process, one thread."""

    def __init__(self, memory: _Memory, inputs: tuple[Range, ...], outputs: tuple[Quantity, ...]) -> None:
        self._memory, self._inputs, self._outputs = memory, inputs, outputs
        self._serial = 0

    @classmethod
    def create(
        cls,
        inputs: Sequence[Range],
        outputs: Sequence[Quantity],
        *,
        units: int,
        rank: int | None = None,
        modes: int | None = None,
    ) -> Publisher:
        """Room for networks of up to `units` units, `rank` rows in a factor and `modes` output modes.

        Parameters
        ----------
        inputs, outputs : sequences of Range and of Quantity
            Of every network that will be published.
        units, rank, modes : int
            Capacities; rank is n unless given, and without modes only networks without a basis are taken.

        Raises
        ------
        UsageError
            If a capacity makes no sense, or the system gives no shared memory.
        """
        n, m = len(inputs), len(outputs)
        text = {
            "inputs": [asdict(r) for r in inputs],
            "outputs": [asdict(q) for q in outputs],
            "units": units,
            "rank": (rows := n if rank is None else rank),
            "modes": (columns := modes or 0),
        }
        if not (n and m and units >= 0 and 1 <= rows <= n and columns >= 0):
            raise UsageError(
                f"There is no room for networks of {n} inputs, {m} outputs, {units} units, rank {rank}, "
                f"{modes} modes.",
                fix="Give at least one input and output, and a rank between 1 and the number of inputs.",
            )
        try:
            memory = _create(text)
        except OSError as error:
            raise UsageError(
                "No shared memory to publish networks in.",
                why=str(error),
                fix=f"Free some space in {shared_memory.folder()}, or ask for less capacity.",
            ) from error
        return cls(memory, tuple(inputs), tuple(outputs))

    @property
    def name(self) -> str:
        """The name that `Subscriber.attach` needs."""
        return self._memory.name

    def publish(self, network: Network) -> int:
        """Make this the newest network; returns its serial number, from 1 on. `extras` and `meta` stay here.

        Raises
        ------
        UsageError
            If the network has other inputs or outputs, does not fit, or holds numbers that can't be evaluated.
        """
        text = self._memory.text
        (h, r, _), k = network.factors.shape, len(network.weights)
        fault = flaw(network)
        if (network.inputs, network.outputs) != (self._inputs, self._outputs):
            fault = "its inputs or outputs are not those that were declared"
        elif h > text["units"] or r > text["rank"] or (network.basis is not None and k > text["modes"]):
            fault = (
                f"{h} units of rank {r} with {k} latent outputs exceed the {text['units']} units, rank "
                f"{text['rank']} and {text['modes']} modes that were declared"
            )
        elif self._memory.map.closed:
            fault = "the publisher is closed"
        if fault:
            raise UsageError(
                f"A network can't be published: {fault}.", fix="Create the publisher with what it will need."
            )
        serial = self._serial + 1
        slot = self._memory.slots[serial % 2]
        basis = network.basis is not None
        slot.record["head"][:6] = serial, h, r, k, basis, RADIAL_FUNCTIONS.index(network.radial)
        used = 0
        for part in _parts_of(network):
            slot.record["numbers"][used : used + part.size] = part.ravel()
            used += part.size
        slot.publish(8 * (_HEAD + used))
        self._memory.latest[()] = self._serial = serial
        return serial

    def close(self) -> None:
        """Stop publishing: the name is gone, subscribers keep what they have. Harmless when repeated."""
        self._memory.close()
        shared_memory.remove(self._memory.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Subscriber:
    """The reading side, in any process; one thread.

    Parameters
    ----------
    name : str
        `Publisher.name`.
    precision, jacobian : str, bool
        Of the evaluator, see `Network.evaluator`.

    Attributes
    ----------
    serial : int
        Number of the network held; 0 before the first.
    """

    def __init__(self, name: str, *, precision: Precision = "double", jacobian: bool = False) -> None:
        self._memory = _Memory(name)
        self._options: dict[str, Any] = {"precision": precision, "jacobian": jacobian}
        self._inputs = tuple(range_from_json(r) for r in self._memory.text["inputs"])
        self._outputs = tuple(quantity_from_json(q) for q in self._memory.text["outputs"])
        self._network: Network | None = None
        self._evaluator: Evaluator | None = None
        self.serial = 0

    @classmethod
    def attach(cls, name: str, *, precision: Precision = "double", jacobian: bool = False) -> Subscriber:
        """Join a publisher of another process.

        Raises
        ------
        UsageError
            If nobody publishes under that name.
        """
        return cls(name, precision=precision, jacobian=jacobian)

    def fetch(self) -> bool:
        """Take over the newest network if there is a newer one; never waits.

        False, and nothing changes, where there is none, or where the publisher overtook the copy: the next
        call will see it.
        """
        latest = int(self._memory.latest)
        if latest == self.serial:
            return False
        slot = self._memory.slots[latest % 2]
        if not slot.fetch() or int(slot.record["head"][0]) <= self.serial:
            return False
        self.serial = int(slot.record["head"][0])
        self._network = self._rebuilt(slot.record)
        self._evaluator = self._network.evaluator(**self._options)
        return True

    def _rebuilt(self, record: np.ndarray) -> Network:
        _, h, r, k, basis, radial = (int(i) for i in record["head"][:6])
        n, m, used, parts = len(self._inputs), len(self._outputs), 0, []
        for shape in _shapes_of(n, m, h, r, k, basis):
            parts.append(record["numbers"][used : used + math.prod(shape)].reshape(shape))
            used += math.prod(shape)
        factors, shifts, weights, tail, *scales = parts
        return Network(
            inputs=self._inputs,
            outputs=self._outputs,
            factors=factors,
            shifts=shifts,
            weights=weights,
            tail=tail,
            scaling=Scaling(*(np.array(s) for s in scales[:5])),
            radial=RADIAL_FUNCTIONS[radial],
            basis=scales[5] if basis else None,
        )

    @property
    def network(self) -> Network:
        """The network held, a frozen value without `extras` and `meta`.

        Raises
        ------
        UsageError
            If none was fetched yet.
        """
        if self._network is None:
            raise _nothing_yet()
        return self._network

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) of the network held at x (n,), in an array that the next call overwrites.

        Raises
        ------
        UsageError
            If none was fetched yet, or x has not n numbers.
        """
        if self._evaluator is None:
            raise _nothing_yet()
        return self._evaluator(x)

    @property
    def jacobian(self) -> np.ndarray:
        """∂f/∂x (m, n) where the last call evaluated.

        Raises
        ------
        UsageError
            If none was fetched yet, or the Jacobian was not asked for.
        """
        if self._evaluator is None:
            raise _nothing_yet()
        return self._evaluator.jacobian

    def close(self) -> None:
        """Let go of the memory; the network held stays. Harmless when repeated."""
        self._memory.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _nothing_yet() -> UsageError:
    return UsageError("No network has been fetched yet.", fix="Call fetch() until it says True.")
