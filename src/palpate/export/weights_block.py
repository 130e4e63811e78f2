r"""The weights block: all that the evaluator core reads of a body or a network, as arrays in fixed places.

The same arrays become tables of an exported C file and, through `WeightsBlock.to_bytes`, one binary block that a
generic program reads: little-endian, all arrays at multiples of eight bytes,

    64 bytes    "PALPATE\0", version (uint32), number of arrays (uint32), bytes in all (uint64), FNV-1a checksum of
                all that follows the head (uint64), SHA-256 of the same (32 bytes)
    40 bytes    for each array: kind (int32: 0 none, 1 float64, 2 int32, 3 float32, 4 int16, 5 float64 in tiles,
                6 digits of tiles), shape (4 int32), zero (int32), offset of its numbers and of its tiles' places in
                the block (2 uint64)
    the rest    the arrays

`core/palpate_core.h` tells the places. See docs/method/weights-block.md.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.network import Network, TrainedRegion
from palpate.network.network_kernels import gram, packed
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.surrogates import LearntEnergy, Surrogate, TouchedSurface
from palpate.surrogates.learnt_torque import ARM
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.export.answer_doubt import Doubt
    from palpate.export.answer_network import AnswerNetwork

__all__ = [
    "ANSWER_NETS",
    "ARM_NET",
    "ARRAYS",
    "BASELINE",
    "DOUBTS",
    "DOUBT_ARRAYS",
    "FIELD",
    "FIELD_NET",
    "LANES",
    "MOTION",
    "NET",
    "PLACES",
    "ROOT",
    "VERSION",
    "Table",
    "WeightsBlock",
    "fnv",
    "identifier",
    "net_tables",
]

VERSION = 1
ARRAYS, LANES, MOST = 64, 8, 16
HEAD, NUMBERS, LIMITS, POINTS, AXES, NET, ROOT, BASELINE, MEMORY, FIELD, FIELD_NET = (
    0,
    1,
    2,
    3,
    4,
    5,
    10,
    12,
    24,
    36,
    44,
)
ANSWER_NETS, RUNS, MOTION = (NET, BASELINE, BASELINE + 5), 22, 60  # see core/answers.c, core/fmi_motion.c
PLACES, DOUBTS, DOUBT_ARRAYS = 23, 36, 6  # see core/answers.c
ARM_NET = 56  # see core/torque.c
ROOM = 12  # arrays that a baseline may have, and a memory
ENDLESS = 1e30  # number that stands for infinity
FAR = 1e15  # coordinate of points that fill up a row
_KINDS = {"float64": 1, "int32": 2, "float32": 3, "int16": 4, "uint8": 6}
_TILES = 5  # kind of an array in tiles, beside those of `_KINDS`


@dataclass(frozen=True, eq=False)
class Table:
    """One array of a block.

    A table in tiles has its numbers (m,) as values, or its digits as rows of characters (uint8), see
    `palpate.export.lattice_tiles`. Its `tiles` say where each tile's numbers begin, see `pp_gather` in core/surface.c;
    of digits, (3 + t/8,), they hold what `lattice_tiles` tells.
    """

    values: np.ndarray  # float64, int32, float32 or int16; uint8 for digits
    shape: tuple[int, ...]  # at most four sizes; of a table in tiles that of the whole table
    tiles: np.ndarray | None = None  # (t,) int32

    @classmethod
    def of(cls, values: Any) -> Table:
        """Return an array, or a number, as the core takes it: whole numbers in 32 bits, all others in double."""
        array = np.atleast_1d(np.asarray(values))
        if array.dtype in (np.float32, np.int16):
            return cls(np.ascontiguousarray(array), array.shape)
        kind = np.int32 if array.dtype.kind in "iub" else np.float64
        array = np.ascontiguousarray(array, dtype=kind)
        if kind is np.float64:
            array = np.nan_to_num(array, nan=0.0, posinf=ENDLESS, neginf=-ENDLESS)
        return cls(array, array.shape)

    @property
    def four(self) -> tuple[int, ...]:
        """The shape, filled up with ones to four numbers."""
        return (*self.shape, *([1] * (4 - len(self.shape))))


@dataclass(frozen=True, eq=False)
class WeightsBlock:
    """Arrays in their places, and what belongs to them.

    Attributes
    ----------
    tables : mapping of int to Table
        The arrays by their places.
    baseline, memory : str
        Names, as identifiers of C; "" for none. A network has neither.
    sources : mapping of str to str
        C99 of the baseline and of the memory, by these names.
    field : str
        Name of the field whose modes are in; "" for none.
    torque : bool
        Whether it tells the torque on a tool: by a learnt arm, or by turns among its inputs.
    """

    tables: Mapping[int, Table]
    baseline: str = ""
    memory: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    field: str = ""
    torque: bool = False

    @property
    def label(self) -> str:
        """Name of the weights in a model card: their hash is another one with other parts."""
        if not self.baseline:
            return "weights"
        shown = f"with the field {self.field}" if self.field else "without a field"
        return f"weights {shown}" + ("" if ROOT in self.tables else ", without the deviation")

    @property
    def releases(self) -> bool:
        """True where the memory moves the rest of a body that nobody holds: its C source defines NAME_release."""
        return f" {self.memory}_release(" in self.sources.get(self.memory, "")

    @classmethod
    def of(cls, surrogate: Surrogate, *, field: str | None = None, deviation: bool = True) -> WeightsBlock:
        """Return the block of a learnt body.

        Parameters
        ----------
        surrogate : Surrogate
            Baseline and memory must have C sources.
        field : str, optional
            Name of the field that goes out with it; none by default.
        deviation : bool
            Whether the posterior goes out, from which the deviation of the force comes.

        Raises
        ------
        UsageError
            If a part of the body has no C source, or is larger than the core's workspace.
        """
        from palpate.export.field_tables import field_tables

        energy, memory = surrogate.hand_energy, surrogate.memory
        baseline, source = energy.baseline, energy.baseline.c_source()
        if source is None:
            raise _refused("baseline", baseline.name)
        if len(energy.inputs) > MOST:
            raise UsageError(
                f"{len(energy.inputs)} inputs are more than the {MOST} of the evaluator core.",
                fix="Learn the body with fewer parameters.",
            )
        kind = baseline.c_name
        sources = {identifier(kind): source}
        tables = _energy_tables(energy, deviation=deviation)
        tables |= _arm_tables(surrogate)
        arrays = [Table.of(a) for a in _flat(baseline.compiled().args)]
        for surface in baseline.surfaces:
            arrays = _with_tiles(arrays, surface)
        tables |= _numbered(BASELINE, arrays, f"baseline {baseline.name!r}")
        code, size = 0, 0
        if memory is not None:
            step = memory.c_source()
            if step is None:
                raise _refused("memory", memory.name)
            if memory.moves_rest and f" {identifier(memory.name)}_release(" not in step:
                raise _refused("memory", memory.name)
            sources[identifier(memory.name)] = step
            code, size = _code(memory.name, _MEMORIES), memory.c_size()
            if memory.of_body is not None and not _code(memory.of_body.name, _MEMORIES):
                code = 0  # under friction, one that the generic core does not hold
            tables |= _numbered(
                MEMORY, [Table.of(a) for a in memory.c_arguments()], f"memory {memory.name!r}"
            )
        own = baseline.radius_input
        head = [len(energy.inputs), len(baseline.directions), _code(kind, _BASELINES), code, 1]
        tables[HEAD] = Table.of(np.array([*head, -1 if own is None else own, size]))
        if field is not None:
            tables |= field_tables(surrogate, field, tables)
        names = identifier(kind), "" if memory is None else identifier(memory.name)
        return cls(tables, *names, sources, field or "", surrogate.torque_evaluator is not None)

    @classmethod
    def of_network(cls, network: Network) -> WeightsBlock:
        """Return the block of a network alone.

        Raises
        ------
        UsageError
            If it is larger than the core's workspace.
        """
        tables = net_tables(network, NET, 0)
        tables[HEAD] = Table.of(np.array([len(network.inputs), 0, 0, 0, len(network.outputs), -1, 0]))
        low, high = bounds(network.inputs)
        tables[LIMITS] = Table.of(np.array([low, high, high - low]))
        return cls(tables)

    @classmethod
    def of_answers(cls, answers: AnswerNetwork) -> WeightsBlock:
        """Return the block of a surrogate that no hand feels; see core/answers.c.

        Raises
        ------
        UsageError
            If a network is larger than the core's workspace, or the parts have more trained regions than it holds.
        """
        if len(answers.regions) > ROOM:
            raise UsageError(
                f"{len(answers.regions)} trained regions are more than the {ROOM} of the evaluator core.",
                why="Each part that was learnt from other samples has a region of its own.",
                fix="Learn all parts from one dataset.",
            )
        tables: dict[int, Table] = {}
        for place, network in zip(ANSWER_NETS, answers.networks, strict=False):
            tables |= net_tables(network, place, 0)
        low, high = bounds(answers.inputs)
        sizes = [len(answers.inputs), 0, 0, 0, len(answers.networks[0].outputs), -1, 0]
        radii = np.zeros(ROOM)
        for i, region in enumerate(answers.regions):
            radii[i] = region.radius
            tables[MEMORY + i] = Table.of(_points(region))
        tables |= {HEAD: Table.of(np.array(sizes)), LIMITS: Table.of(np.array([low, high, high - low]))}
        tables[NUMBERS] = Table.of(radii)
        if answers.rows is not None:
            tables[PLACES] = Table.of(answers.rows)
        for i, doubt in enumerate(answers.doubts):
            tables |= _doubt_tables(doubt, DOUBTS + DOUBT_ARRAYS * i)
        if answers.runs:
            runs = [[run.first, run.count, int(run.largest)] for run in answers.runs]
            tables[RUNS] = Table.of(np.array(runs))
        return cls(tables)

    @property
    def hash(self) -> str:
        """SHA-256 of the arrays, in hexadecimal digits."""
        return hashlib.sha256(self._body()).hexdigest()

    def _body(self) -> bytes:
        """Return everything that follows the head."""
        offset, rows, parts = 64 + 40 * ARRAYS, [], []
        written: dict[int, bytes] = {}
        for place in range(ARRAYS):
            table = self.tables.get(place)
            if id(table) in written:  # one table in two places is stored once
                rows.append(written[id(table)])
                continue
            if table is None or not table.values.size:
                rows.append(struct.pack("<6i2Q", 0, 0, 1, 1, 1, 0, 0, 0))
                continue
            starts = []
            for array in (table.values, table.tiles):
                starts.append(offset if array is not None else 0)
                data = (
                    b""
                    if array is None
                    else np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()
                )
                data += bytes(-len(data) % 8)
                parts.append(data)
                offset += len(data)
            kind = _KINDS[table.values.dtype.name]
            kind = _TILES if kind == 1 and table.tiles is not None else kind
            rows.append(struct.pack("<6i2Q", kind, *table.four, 0, *starts))
            written[id(table)] = rows[-1]
        return b"".join(rows + parts)

    def to_bytes(self) -> bytes:
        """Return the binary block."""
        body = self._body()
        head = struct.pack("<8sIIQQ", b"PALPATE\0", VERSION, ARRAYS, 64 + len(body), fnv(body))
        return head + hashlib.sha256(body).digest() + body


def fnv(data: bytes) -> int:
    """Return the checksum of a block: FNV-1a over little-endian words of eight bytes."""
    total, prime, mask = 0xCBF29CE484222325, 0x100000001B3, (1 << 64) - 1
    for (word,) in struct.iter_unpack("<Q", data):
        total = ((total ^ word) * prime) & mask
    return total


def identifier(name: str) -> str:
    """Return a name as C takes it: "iwan-elements" becomes iwan_elements."""
    word = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name)
    return f"_{word}" if word[:1].isdigit() else word


_BASELINES = ("contact", "pad", "constant", "overlap", "posed", "pinch")
_MEMORIES = ("relaxation", "indentation", "iwan-elements", "friction")


def _code(name: str, known: tuple[str, ...]) -> int:
    """Return the number by which the generic core finds a kind; 0 for one that it does not hold."""
    return known.index(name) + 1 if name in known else 0


def _refused(what: str, name: str) -> UsageError:
    return UsageError(
        f"The {what} {name!r} has no C source, so a body with it can't leave palpate.",
        why="Every export runs the evaluator core in C99, and knows no other way to compute it.",
        fix=f"Give it a method c_source() (docs/guide/export.md), or take a {what} of palpate's.",
    )


def _flat(args: Any) -> Iterator[Any]:
    """Return the arrays and numbers of nested tuples, one after the other."""
    for part in args:
        if isinstance(part, tuple):
            yield from _flat(part)
        else:
            yield part


def _with_tiles(arrays: list[Table], surface: TouchedSurface) -> list[Table]:
    """Return a baseline's arrays with the tables of its surface, where they are among them, in tiles."""
    from palpate.export.surface_tiles import surface_tables

    dense = [Table.of(a) for a in surface.compiled()]
    for first in range(len(arrays) - 2):
        some = arrays[first : first + 3]
        if all(np.array_equal(a.values, b.values) for a, b in zip(some, dense, strict=True)):
            return [*arrays[:first], *surface_tables(surface), *arrays[first + 3 :]]
    return arrays


def _doubt_tables(doubt: Doubt, first: int) -> dict[int, Table]:
    """Return the six arrays of how sure a part of the answers is."""
    own = net_tables(doubt.network, 0, 0)
    sizes = [doubt.plus, doubt.minus, doubt.samples, doubt.members, len(doubt.variance)]
    numbers = np.concatenate([doubt.variance, doubt.missed.ravel(), doubt.floor])
    return {
        first: Table.of(np.concatenate([own[0].values.ravel(), sizes])),
        first + 1: own[2],
        first + 2: own[3],
        first + 3: own[4],
        first + 4: Table.of(numbers),
        first + 5: Table.of(doubt.squares),
    }


def _numbered(first: int, arrays: list[Table], what: str) -> dict[int, Table]:
    if len(arrays) > ROOM:
        raise UsageError(
            f"The {what} has {len(arrays)} arrays.", fix=f"The evaluator core has room for {ROOM}."
        )
    return dict(enumerate(arrays, first))


def _energy_tables(energy: LearntEnergy, *, deviation: bool) -> dict[int, Table]:
    """Return what every learnt energy has: numbers, limits, trained points, axes, network and posterior."""
    baseline, region, going = energy.baseline, energy.region, energy.going
    low, high = bounds(energy.inputs)
    radius = np.inf if region is None else region.radius
    tables = net_tables(energy.network, NET, len(baseline.directions))
    tables[NUMBERS] = Table.of(
        np.array([radius, going.deepest, going.depth_width, baseline.inner, baseline.radius])
    )
    tables[LIMITS] = Table.of(np.array([low, high, going.widths]))
    tables[AXES] = Table.of(baseline.directions)
    if region is not None:
        tables[POINTS] = Table.of(_points(region))
    if deviation and energy.root is not None:
        root, some = energy.posterior
        # a block's shapes have no zeros: where no unit has a covariance, the first one has one of zero
        units = min(max(some.units, 1), energy.network.units)
        tables[ROOT] = _root_table(np.pad(root, [(0, units - some.units), (0, 0)]), units)
    return tables


def _arm_tables(surrogate: Surrogate) -> dict[int, Table]:
    """Return the network of the torque per newton, where there is one."""
    arm = surrogate.quantities.get(ARM)
    if arm is not None:
        own, scales = net_tables(arm.network, 0, 0), net_tables(surrogate.hand_energy.network, 0, 0)[1]
        if not np.array_equal(own[1].values, scales.values):
            raise UsageError(
                f"The torque of {surrogate.name!r} can't be exported.",
                why="It was learnt over other ranges than the energy.",
                fix="Learn both from one set of solves, as `palpate.learn` does.",
            )
        return {ARM_NET + i: own[place] for i, place in enumerate((0, 2, 3, 4))}
    return {}


def _points(region: TrainedRegion) -> np.ndarray:
    """Return the points of a region as columns, filled up with far ones to whole lanes."""
    points = region.points.T
    filled = np.full((len(points), -(-points.shape[1] // LANES) * LANES), FAR)
    filled[:, : points.shape[1]] = points
    return filled


def _root_table(root: np.ndarray, units: int) -> Table:
    """Return the lower triangular root of the same covariance, column by column, see `pp_deviation`."""
    lower = np.asarray(np.linalg.qr(root.T, mode="r")).T
    rows, columns = lower.shape
    whole = -(-rows // LANES) * LANES
    parts = []
    for c in range(columns):
        column = np.zeros(whole)
        column[c:rows] = lower[c:, c]
        parts.append(column[c - c % LANES :])
    return Table(np.concatenate(parts).astype(np.float32), (columns, units, whole))


def net_tables(network: Network, first: int, felt: int) -> dict[int, Table]:
    """Return a network's arrays in the places from `first` (its sizes) on.

    Curvature is asked by the first `felt` inputs of a network of one output; 0 asks for none. The core's workspace
    limits the numbers of inputs and of rows of the factors.
    """
    layout, scales, units, rows, modes, _ = packed(network, "double")
    n, e, latent = scales.shape[1], len(layout) - 1, rows.shape[1]
    r, h = len(units) - e, units.shape[1]
    if max(n, r) > MOST:
        raise UsageError(
            f"A network of {n} inputs and {r} rows is larger than the evaluator core's workspace of {MOST}.",
            fix="Learn it with fewer inputs.",
        )
    grams = gram(network, felt) if felt else np.zeros((0, h))
    lines = np.vstack([units, grams, rows[1 + n :].T])
    groups = -(-h // LANES)
    filled = np.zeros((len(lines), groups * LANES))
    filled[:, :h] = lines
    filled = filled.reshape(len(lines), groups, LANES).transpose(1, 0, 2)
    sizes = [n, e, r, h, latent, RADIAL_FUNCTIONS.index(network.radial), len(grams)]
    tail = np.concatenate([rows[: 1 + n].ravel(), modes.ravel()])
    return {
        first: Table.of(np.array(sizes)),
        first + 1: Table.of(scales if network.scaling.is_bent else scales[:2]),
        first + 2: Table.of(layout[1:].reshape(e, 2)),
        first + 3: Table.of(filled),
        first + 4: Table.of(tail),
    }
