"""The tables of curved surfaces as they go out: what is felt is the same to the last bit, damaged ones are refused."""

from __future__ import annotations

import dataclasses
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from exported_bodies import body
from palpate.export import export_c
from palpate.export.c_export import block_of, compare_c
from palpate.export.compilers import STRICT, compile_c
from palpate.export.core_source import generic_source
from palpate.export.lattice_tiles import ROW, lattice_table
from palpate.export.surface_tiles import felt_coefficients, surface_tables
from palpate.export.weights_block import BASELINE, WeightsBlock, fnv
from palpate.network.packing import whole_multiples
from palpate.surrogates import TouchedSurface
from system_programs import require_program

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
DIGITS = 6  # the kind of an array
PLACE = BASELINE + 2  # of the coefficients among the arrays


def with_surface(thing: pp.Surrogate, surface: TouchedSurface) -> pp.Surrogate:
    baseline = dataclasses.replace(thing.energy.baseline, touched=surface)
    return pp.Surrogate(dataclasses.replace(thing.energy, baseline=baseline), meta=dict(thing.meta))


def egg() -> TouchedSurface:
    return body("closed").energy.baseline.surface


def cap() -> TouchedSurface:
    return body("relaxation").energy.baseline.surface


def unrounded() -> TouchedSurface:
    """The egg as bodies from before have it, with arbitrary coefficients."""
    noise = np.random.default_rng(0).uniform(-1e-9, 1e-9, egg().coefficients.shape)
    return dataclasses.replace(egg(), coefficients=egg().coefficients + noise)


@pytest.mark.grid
@pytest.mark.parametrize("surface", [egg, cap, unrounded])
def test_all_that_is_felt_is_the_same_and_nothing_else_is_felt(surface):
    true = surface()
    kept = dataclasses.replace(true, coefficients=felt_coefficients(true))
    low, high = true.box
    C = np.random.default_rng(1).uniform(low - 0.01, high + 0.01, (40_000, 3))
    wanted, got = true.at(C), kept.at(C)
    felt = (wanted[0] < true.reach) & (wanted[0] >= -true.inner)
    assert felt.sum() > 1500
    for a, b in zip(wanted, got, strict=True):
        assert np.array_equal(a[felt], b[felt])
    air = wanted[0] >= true.reach
    assert (got[0][air] >= true.reach).all()
    assert (got[0][wanted[0] < -true.inner] < -true.inner).all()
    # a cell beside a felt one inside, too
    rim = felt & (wanted[0] < -true.inner + 1e-4)
    aside = C[rim] + 0.5 * true.spacing * np.array([1, -1, 1])
    inside = true.at(aside)[0] < 0
    for a, b in zip(true.at(aside), kept.at(aside), strict=True):
        assert np.array_equal(a[inside], b[inside])
    far = kept.at(np.vstack([1e3 * C[:100], 1e9 * C[:100]]))[0]
    assert (far >= true.reach).all()


def test_what_is_not_felt_takes_two_numbers_and_no_room():
    coefficients, table = felt_coefficients(egg()), surface_tables(egg())[1]
    off = (coefficients != egg().coefficients).mean()
    assert 0.05 < off < 0.9
    assert table.values.nbytes < 0.25 * egg().coefficients.nbytes
    assert surface_tables(unrounded())[1].values.nbytes > 2.5 * table.values.nbytes


def test_a_surface_whose_outermost_nodes_are_felt_is_left_as_it_is():
    wide = dataclasses.replace(egg(), reach=1.0)
    assert felt_coefficients(wide) is wide.coefficients


DUMP = """
#include "NAME.c"
#include <stdio.h>
int main(void) {
  const pp_array *table = &NAME_model.a[PLACE];
  int32_t i, j, k, step;
  pp_real c[64];
  for (step = 1; step <= 7; step += 2) {
    for (i = 0; i + 4 <= table->n[0]; i += step) {
      for (j = 0; j + 4 <= table->n[1]; j += 2 * step) {
        for (k = 0; k + 4 <= table->n[2]; k += 3 * step) {
          pp_gather(table, i, j, k, c);
          fwrite(c, sizeof c[0], 64, stdout);
        }
      }
    }
  }
  return 0;
}
"""


@pytest.mark.full
@pytest.mark.parametrize("single", [False, True], ids=["double", "float"])
def test_c_has_the_numbers_of_python_bit_for_bit(single, tmp_path):
    compiler = require_program("gcc")
    export_c(body("closed"), tmp_path, single=single, check=False)
    (tmp_path / "dump.c").write_text(DUMP.replace("NAME", "egg").replace("PLACE", str(PLACE)), "utf-8")
    path = compile_c(compiler, [tmp_path / "dump.c"], tmp_path / "dump", options=STRICT, optimise="-O1")
    done = subprocess.run([path], capture_output=True, check=True)
    wanted = felt_coefficients(egg()).astype(np.float32 if single else np.float64)
    cells = np.lib.stride_tricks.sliding_window_view(wanted, (4, 4, 4))
    rows = [cells[::step, :: 2 * step, :: 3 * step].reshape(-1, 64) for step in (1, 3, 5, 7)]
    assert done.stdout == np.vstack(rows).tobytes()


READ = r"""
#include <stdio.h>
#include <stdlib.h>
static void *take(size_t size) {
  void *bytes = malloc(size ? size : 1);
  if (!bytes || fread(bytes, 1, size, stdin) != size) exit(2);
  return bytes;
}
static void give_table(void) {
  int32_t *head = take(5 * sizeof *head), i, j, k;
  char *digits = take((size_t)head[3]);
  int32_t *places = take((size_t)head[4] * sizeof *places);
  pp_array table = {0, 0, 0, 0, 0, {0, 1, 1, 1}};
  pp_real c[64];
  table.digits = digits;
  table.whole = places;
  for (i = 0; i < 3; i++) table.n[i] = head[i];
  for (i = 0; i + 4 <= head[0]; i++) {
    for (j = 0; j + 4 <= head[1]; j++) {
      for (k = 0; k + 4 <= head[2]; k++) {
        pp_gather(&table, i, j, k, c);
        fwrite(c, sizeof c[0], 64, stdout);
      }
    }
  }
  free(head), free(digits), free(places);
}
static void open_block(void) { /* of a size: says what is wrong with it, and asks a sound one at many places */
  int32_t *size = take(sizeof *size), fault, i;
  unsigned char *bytes = take((size_t)*size);
  static pp_array arrays[PP_ARRAYS];
  const pp_model model = {arrays};
  const pp_real p[PP_MOST] = {0};
  fault = pp_open(bytes, (uint64_t)*size, arrays);
  for (i = 0; i < 600 && fault == PP_OPEN; i++) {
    pp_real x[3], answer[PP_ANSWER];
    x[0] = 0.006 * (i % 10 - 5);
    x[1] = 0.006 * (i / 10 % 10 - 5);
    x[2] = 0.01 * (i / 100 - 3);
    pp_answer(&model, x, p, answer);
  }
  printf("%d\n", (int)fault);
  free(size), free(bytes);
}
int main(int count, char **words) {
  int left = count > 2 ? atoi(words[2]) : 0;
  for (; left > 0; left--) words[1][0] == 'b' ? open_block() : give_table();
  return 0;
}
"""


@pytest.fixture(scope="module")
def reader(tmp_path_factory) -> Path:
    """A program that reads tables and blocks of weights, stopped by any access outside of them."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "read.c").write_text(generic_source() + READ, "utf-8")
    options = (*STRICT[:-1], *SANITIZED)
    return compile_c(
        require_program("gcc"), [folder / "read.c"], folder / "read", options=options, optimise="-O0"
    )


def ask(reader: Path, kind: str, questions: list[bytes]) -> bytes:
    words = [reader, kind, str(len(questions))]
    done = subprocess.run(words, input=b"".join(questions), capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


@pytest.mark.full
def test_tables_of_any_size_and_width_come_back_from_c(reader):
    rng, tables = np.random.default_rng(3), []
    for width in range(26):
        shape = tuple(rng.integers(4, 14, 3))
        whole = rng.integers(-(2**22), 2**22) + rng.integers(0, 2**width, shape)
        whole += np.tensordot(rng.integers(-3000, 3000, 3), np.indices(shape), axes=1)
        for level in (1, 2):
            whole[:4, :4, 4 * level : 4 * level + 4] = level
        tables.append((whole.astype(np.int32), lattice_table(whole.astype(np.int32), -27, 1, 2)))
    assert lattice_table(rng.integers(0, 2**28, (8, 8, 8)).astype(np.int32), -27, 1, 2) is None
    assert lattice_table(np.full((8, 8, 8), 2**30, dtype=np.int32), -27, 1, 2) is None
    assert {len(table.values) for _, table in tables} > {1}, "some go over the end of a row"
    questions, wanted = [], []
    for whole, table in tables:
        assert table is not None
        assert not set('"?\\') & set(table.values.tobytes().decode())
        assert (np.flatnonzero(table.values == 0)[: len(table.values) - 1] % (ROW + 1) == ROW).all()
        head = np.array([*table.shape, table.values.size, table.tiles.size], dtype=np.int32)
        questions.append(head.tobytes() + table.values.tobytes() + table.tiles.tobytes())
        cells = np.lib.stride_tricks.sliding_window_view(np.ldexp(whole.astype(float), -27), (4, 4, 4))
        wanted.append(cells.reshape(-1, 64).tobytes())
    assert ask(reader, "tables", questions) == b"".join(wanted)


def sealed(block: bytes) -> bytes:
    """The block with a checksum that fits, as somebody with bad intent would have it."""
    size = struct.pack("<Q", len(block))
    return block[:16] + size + struct.pack("<Q", fnv(block[64:])) + block[32:]


@pytest.mark.full
def test_damaged_digits_are_refused_or_harmless(reader):
    small = TouchedSurface.of(*_tetrahedron(), radius=0.006, reach=0.0105, inner=0.003, spacing=0.002)
    thing = with_surface(body("closed"), small)
    block = WeightsBlock.of(thing, deviation=False).to_bytes()
    row = 64 + 40 * PLACE
    kind, *shape, _, at, tiles = struct.unpack_from("<6i2Q", block, row)
    assert kind == DIGITS
    many = int(np.prod([-(-n // 4) for n in shape[:3]]))
    last_place = len(block) - len(block) % 4 - 4

    def put(content: bytes, place: int, number: int, form: str = "<i") -> bytes:
        return content[:place] + struct.pack(form, number) + content[place + struct.calcsize(form) :]

    wrong = {
        "a code that no tile has": put(block, at, ord("0"), "<B"),
        "a place before the digits": put(block, tiles + 12, -1),
        "a place beyond the block": put(block, tiles + 12, 1 << 30),
        "a place whose sum overflows": put(block, tiles + 12, (1 << 31) - 1),
        "more tiles than digits": put(put(block, row + 4, 1 << 10), row + 8, 1 << 10),
        "a table that is flat": put(block, row + 12, 1),
        "a fourth side": put(block, row + 16, 2),
        "digits at the end": put(block, row + 24, len(block) - 8, "<Q"),
        "digits beyond the end": put(block, row + 24, len(block) + 8, "<Q"),
        "places at the end": put(block, row + 32, len(block) - 8, "<Q"),
        "no places": put(block, row + 32, 0, "<Q"),
        "a frame of digits": put(block, row - 40, DIGITS),
        "whole numbers of digits": put(block, 64, DIGITS),
        "cut off": block[: last_place - last_place % 8],
    }
    rng = np.random.default_rng(5)
    spots = [*rng.integers(row, row + 40, 30), *rng.integers(at, at + many, 40)]
    spots += [*rng.integers(at, tiles, 40), *rng.integers(tiles, len(block), 60)]
    random = [put(block, int(s), int(rng.integers(0, 256)), "<B") for s in spots]
    every = [sealed(b) for b in (block, *wrong.values(), *random)]
    faults = ask(reader, "blocks", [struct.pack("<i", len(b)) + b for b in every]).decode().split()
    assert faults[0] == "0"
    assert dict(zip(wrong, faults[1:], strict=False)) == dict.fromkeys(wrong, "3")
    assert set(faults[1 + len(wrong) :]) == {"0", "3"}


def _tetrahedron() -> tuple[np.ndarray, np.ndarray]:
    points = 0.01 * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return points, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


@pytest.mark.full
@pytest.mark.parametrize("name", ["raised", "from before"])
def test_raised_and_older_surfaces_go_out_too(name, tmp_path):
    compiler = require_program("gcc")
    surface = egg().raised(4e-4) if name == "raised" else unrounded()
    thing = with_surface(body("closed"), surface)
    block = block_of(thing, field=None, with_field=False, deviation=True)
    in_digits = block.tables[PLACE].values.dtype == np.uint8
    assert in_digits == (name == "raised") == (whole_multiples(surface.coefficients) is not None)
    done = export_c(thing, tmp_path, check=False)
    compared = compare_c(thing, block, done, compiler, single=False, options=(*STRICT, "-O0"))
    assert compared.passed, str(compared)
    assert compared.parts["force"].count > 2000


def test_a_curved_body_takes_a_third_of_the_room_in_c(tmp_path):
    sizes = []
    for surface in (egg(), unrounded()):
        done = export_c(with_surface(body("closed"), surface), tmp_path, check=False)
        sizes.append(sum(Path(file).stat().st_size for file in done.sources))
    assert sizes[0] < sizes[1] / 3
