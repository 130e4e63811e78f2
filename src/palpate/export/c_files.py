"""The files of an exported body or network: header, source with its weights as tables, example and CMake file."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.export.answer_network import MOST_DOUBTS, AnswerNetwork
from palpate.export.core_source import core_source, fill_template
from palpate.export.weights_block import (
    ANSWER_NETS,
    ARM_NET,
    ARRAYS,
    DOUBT_ARRAYS,
    DOUBTS,
    FIELD,
    NET,
    POINTS,
    ROOT,
    Table,
    WeightsBlock,
)
from palpate.surrogates import Surrogate
from palpate.units import Quantity, Range

__all__ = ["body_sizes", "c_files", "require_name"]

_WIDTH = 118  # characters of a line of numbers
# bytes of all stack frames of the core together: double (False) and single precision (True)
_STACK = {False: 12_000, True: 8_000}
_RADIAL, _SURFACE = 40, 8000  # operations of a radial function; of five distances to a curved surface
_KEYWORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long "  # noqa: SIM905
    "register restrict return short signed sizeof static struct switch typedef union unsigned void volatile "
    "while main".split()
)


def require_name(name: str) -> str:
    """Return a name that can begin the names of C functions; an error where it is no identifier."""
    if (
        not (name.isascii() and name.isidentifier())
        or name in _KEYWORDS
        or name.startswith(("pp_", "PP_", "_"))
    ):
        raise UsageError(
            f"{name!r} can't begin the names of C functions.",
            why="They have letters, digits and underscores, begin with a letter, and are no word of C.",
            fix="Give another one: --name liver.",
        )
    return name


@dataclass(frozen=True)
class _Facts:
    """Words for the files of a body or a network, besides its numbers."""

    name: str
    single: bool
    block: WeightsBlock
    title: str
    inputs: tuple[Range, ...]
    outputs: tuple[Quantity, ...]
    felt: int

    @property
    def real(self) -> str:
        return "float" if self.single else "double"


def c_files(
    surrogate: Surrogate, answers: AnswerNetwork | None, block: WeightsBlock, name: str, *, single: bool
) -> dict[str, str]:
    """Return the texts of all files by their names; `name` begins all names in C, `single` gives 32-bit numbers.

    `answers` are those of a surrogate that no hand feels.
    """
    outputs: tuple[Quantity, ...] = ()
    felt, title, parts = 0, str(surrogate), ["NETWORK"]
    if answers is not None:
        outputs, title = answers.outputs, str(answers)
    else:
        felt, title = len(surrogate.hand_energy.baseline.directions), title.splitlines()[0]
        has = {
            "BODY": True,
            "TORQUE": block.torque,
            "MEMORY": block.memory,
            "RELEASE": block.releases,
            "FIELD": block.field,
        }
        parts = [part for part, there in has.items() if there]
    facts = _Facts(name, single, block, title, surrogate.inputs, outputs, felt)
    words = _words(facts, surrogate)
    files = {
        f"{name}.h": _head(facts, _notes(facts, surrogate)) + fill_template("api.h", words, parts),
        f"{name}.c": _source(facts) + fill_template("api.c", words, parts),
    }
    if block.field:
        files[f"{name}_field.c"] = _field_source(facts)
    files["example.c"] = fill_template("example.c", words, parts)
    words["@SOURCES@"] = " ".join(file for file in files if file.endswith(".c") and file != "example.c")
    files["CMakeLists.txt"] = fill_template("CMakeLists.txt", words, parts)
    return files


def _words(facts: _Facts, surrogate: Surrogate) -> dict[str, str]:
    """Return what stands in the files for the words of the templates."""
    sizes, along = [len(facts.inputs)], ""
    if surrogate.can_be_touched:
        sizes = list(body_sizes(surrogate, facts.block))
        along = ", ".join(_braces_around(row, facts) for row in surrogate.hand_energy.baseline.directions)
    places = ("INPUTS", "FELT", "PARAMETERS", "WORK", "STATE", "SHAPE", "NODES", "COMPONENTS")
    middle = [_number((r.low + r.high) / 2, single=facts.single) for r in facts.inputs[facts.felt :]]
    return {
        "NAME": facts.name,
        "@REAL@": facts.real,
        "@MIDDLE@": ", ".join(middle) or "0",
        "@ALONG@": along,
        "@OUTPUTS@": str(len(facts.outputs)),
        "@SIZES@": ", ".join(map(str, sizes)),
        "@LATENT@": str(_latent(facts.block)),
        "@LAW@": facts.block.memory,
        "@HASH@": facts.block.hash,
    } | {f"@{place}@": str(size) for place, size in zip(places, sizes, strict=False)}


def _braces_around(row: np.ndarray, facts: _Facts) -> str:
    return "{" + ", ".join(_number(a, single=facts.single) for a in row.tolist()) + "}"


def _comment(lines: list[str]) -> str:
    wrapped = [part for line in lines for part in (textwrap.wrap(line, 110, subsequent_indent="  ") or [""])]
    return "/* " + "\n * ".join(line.replace("*/", "* /") for line in wrapped) + "\n */\n"


def _head(facts: _Facts, further: list[str]) -> str:
    from palpate.version import __version__

    rows = [f"{r.name} from {r.low:g} to {r.high:g} {r.unit}".rstrip() for r in facts.inputs]
    lines = [
        f"{facts.name}: a model learnt by palpate {__version__}.",
        "",
        facts.title,
        "",
        *(f"input {i}: {row}" for i, row in enumerate(rows)),
        *further,
        "",
        "All quantities are in SI units. No function allocates memory, writes to a variable of its own, or reads or",
        "prints anything: any number of threads may call them. Do not compile with options such as -ffast-math.",
        *_costs(facts),
        f"SHA-256 of the weights: {facts.block.hash}",
    ]
    return _comment(lines)


def _costs(facts: _Facts) -> list[str]:
    """Return what calls cost, and how precise their numbers are, in words."""
    answer, deviation = _thousands(_operations(facts)), _thousands(_deviation_operations(facts))
    return [
        f"Stack: less than {_stack_bytes(facts) / 1e3:.0f} kB with -O2. Time: no loop's length depends on a place; an",
        f"answer takes about {answer} thousand operations, a deviation {deviation} thousand more.",
        "Numbers are of single precision (--float): force and energy differ by about 1e-6 of the largest."
        if facts.single
        else "Numbers are of double precision; exported with --float they are single, and most tables half as large.",
        "All files are C99, and C++17 too.",
    ]


def _latent(block: WeightsBlock) -> int:
    """Return the latent outputs of the largest network."""
    places = ANSWER_NETS if not block.baseline else (NET,)
    rooms = [int(block.tables[place].values[4]) for place in places if place in block.tables]
    if not block.baseline:  # latent outputs of a doubt, then variances
        doubts = [block.tables.get(DOUBTS + DOUBT_ARRAYS * i) for i in range(MOST_DOUBTS)]
        rooms += [int(table.values[4] + table.values[11]) for table in doubts if table is not None]
    return max(rooms)


def _stack_bytes(facts: _Facts) -> int:
    """Return a bound of the stack, bytes: frames of the core, and the rows that a network alone keeps on it."""
    size, latent = (4 if facts.single else 8), _latent(facts.block)
    rows = latent * (1 + len(facts.inputs)) + len(facts.outputs) if facts.outputs else 0
    return _STACK[facts.single] + size * rows


def _operations(facts: _Facts) -> int:
    """Return about how many sums and products an answer takes: of the units, the trained points, the surface."""
    tables = facts.block.tables
    n, entries, rows, _, outputs, _, pairs = tables[NET].values.tolist()[:7]
    units = tables[NET + 3].values.size // (entries + rows + pairs + outputs)
    count = units * (4 * entries + 2 * rows + _RADIAL + 4 * pairs + 4 * min(n, 3) + 2 * outputs)
    count += 3 * tables[POINTS].values.size if POINTS in tables else 0
    return int(count) + (_SURFACE if facts.felt == 3 else 0)


def _deviation_operations(facts: _Facts) -> int:
    """Return about how many operations a deviation takes beside its answer: four lines of the root."""
    return 8 * int(facts.block.tables[ROOT].values.size) if ROOT in facts.block.tables else 0


def _thousands(count: int) -> str:
    return f"{count / 1e3:.2g}" if count < 1e5 else f"{count / 1e3:.0f}"


def _notes(facts: _Facts, surrogate: Surrogate) -> list[str]:
    """Return what the header tells of the arguments of its functions."""
    if not surrogate.can_be_touched:
        return ["", *(f"output {i}: {q.name} {q.unit}".rstrip() for i, q in enumerate(facts.outputs[:50]))]
    holds = surrogate.hand_energy.baseline.holds
    x = "displacement of what the hand holds from its rest" if holds else "centre of the probe"
    x = "foremost point of the tool" if surrogate.torque_evaluator is not None else x
    return ["", f"x (3) is the {x}, m; p are the inputs after the first {facts.felt}, in their units."]


def _work_size(block: WeightsBlock) -> int:
    return 4 * block.tables[ROOT].shape[2] if ROOT in block.tables else 1


def body_sizes(surrogate: Surrogate, block: WeightsBlock) -> tuple[int, ...]:
    """Return the eight sizes that `NAME_sizes` gives."""
    inputs, felt = len(surrogate.inputs), len(surrogate.hand_energy.baseline.directions)
    # the four numbers of a ledger come first in the state of a memory
    state = 4 + surrogate.memory.c_size() if block.memory and surrogate.memory is not None else 0
    nodes, components, shape = _shape_sizes(block) if block.field else (0, 0, 0)
    return inputs, felt, inputs - felt, _work_size(block), state, shape, nodes, components


def _shape_sizes(block: WeightsBlock) -> tuple[int, int, int]:
    nodes, components, modes, _, knots = block.tables[FIELD].values.tolist()
    return nodes, components, 8 + 16 + 1 + modes + knots * 4 * components


def _source(facts: _Facts) -> str:
    """Return the source before its public functions: the core and the weights."""
    first = f'#include "{facts.name}.h"\n' + ("#define PP_SINGLE\n" if facts.single else "")
    tables, external = [], []
    for place, table in _tables_to_store(facts.block):
        if FIELD <= place < ARM_NET and facts.block.field:
            external += [
                f"extern const {kind} {declarator};" for kind, declarator, _ in _parts(facts, place, table)
            ]
        else:
            tables += [
                _table_text(f"static const {kind} {declarator}", array, facts)
                for kind, declarator, array in _parts(facts, place, table)
            ]
    body = _comment(["the evaluator core of palpate"]) + core_source(facts.block)
    weights = "\n".join(["\n/* the weights */", *external, *tables, _model(facts)])
    return first + body + weights


def _field_source(facts: _Facts) -> str:
    lines = [
        f"/* {facts.name}: the field's tables, of the weights {facts.block.hash} */",
        "#include <stdint.h>",
    ]
    for place, table in _tables_to_store(facts.block):
        if FIELD <= place < ARM_NET:
            for kind, declarator, array in _parts(facts, place, table):
                kind = kind.replace("pp_real", facts.real)
                lines += [
                    f"extern const {kind} {declarator};",
                    _table_text(f"const {kind} {declarator}", array, facts),
                ]
    return "\n".join(lines) + "\n"


def _tables_to_store(block: WeightsBlock) -> list[tuple[int, Table]]:
    """Return the tables that are not empty, each once, with its first place."""
    first: dict[int, tuple[int, Table]] = {}
    for place, table in sorted(block.tables.items()):
        if table.values.size:
            first.setdefault(id(table), (place, table))
    return list(first.values())


_C_KINDS = {
    "float64": "pp_real",
    "int32": "int32_t",
    "float32": "float",
    "int16": "int16_t",
    "uint8": "char",
}


def _parts(facts: _Facts, place: int, table: Table) -> Iterator[tuple[str, str, np.ndarray]]:
    """Return kind, declarator and numbers of a table, and of its tiles."""
    rows = f"[{table.values.shape[1]}]" if table.values.dtype == np.uint8 else ""
    yield _C_KINDS[table.values.dtype.name], f"{facts.name}_{place}[]{rows}", table.values
    if table.tiles is not None:
        yield "int32_t", f"{facts.name}_{place}_tiles[]", table.tiles


def _model(facts: _Facts) -> str:
    rows = []
    first = {id(table): place for place, table in _tables_to_store(facts.block)}
    places = {"float64": 0, "int32": 1, "float32": 2, "int16": 3, "uint8": 4}
    for place in range(ARRAYS):
        table, pointers = facts.block.tables.get(place), ["0"] * 5
        if table is None or not table.values.size:
            rows.append("  {0, 0, 0, 0, 0, {0, 1, 1, 1}},")
            continue
        word = f"{facts.name}_{first[id(table)]}"
        pointers[places[table.values.dtype.name]] = word + "[0]" * (table.values.dtype == np.uint8)
        if table.tiles is not None:
            pointers[1] = f"{word}_tiles"
        rows.append(f"  {{{', '.join(pointers)}, {{{', '.join(map(str, table.four))}}}}},")
    text = f"static const pp_array {facts.name}_arrays[PP_ARRAYS] = {{\n" + "\n".join(rows) + "\n};\n"
    return text + f"static const pp_model {facts.name}_model = {{{facts.name}_arrays}};\n"


def _table_text(declared: str, array: np.ndarray, facts: _Facts) -> str:
    if array.dtype == np.uint8:  # rows of characters that need no care between quotes, each before a zero
        words = [f'"{row.tobytes().rstrip(bytes(1)).decode("ascii")}"' for row in array]
    elif array.dtype == np.float64:
        words = [_number(v, single=facts.single) for v in array.ravel().tolist()]
    elif array.dtype == np.float32:
        words = [_number(v, single=True) for v in array.ravel().tolist()]
    else:
        words = [str(v) for v in array.ravel().tolist()]
    lines, line = [], ""
    for word in words:
        if line and len(line) + len(word) + 1 > _WIDTH:
            lines.append(line)
            line = ""
        line += word + ","
    return f"{declared} = {{\n" + "\n".join([*lines, line]) + "};"


def _number(value: float, *, single: bool) -> str:
    """Return a number so that nothing of it is lost: in hexadecimal digits, unless it is a small whole one."""
    if single:
        value = float(np.float32(value))
    if value == int(value) and abs(value) < 1e6:
        return str(int(value))
    mantissa, _, exponent = value.hex().partition("p")
    text = f"{mantissa.rstrip('0').rstrip('.')}p{int(exponent)}"
    return text + "F" if single else text
