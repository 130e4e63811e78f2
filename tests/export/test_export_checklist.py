"""The checklist of exports: every exporter on every body, and what all of them must refuse.

An exporter is a function of a body and an empty folder that exports it, asks the export at 1,000 places, along a stroke
and in its field, and returns how far that is from palpate. A new exporter is entered in `EXPORTERS`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import palpate as pp
from exported_bodies import BODIES, body, networks
from models import linear_network
from palpate.errors import AccuracyError, UsageError
from palpate.export import export_c, export_fmu, export_lib
from palpate.export.c_export import block_of, compare_c
from palpate.export.check_points import Comparison, Precision, compare_body, places, true_answers
from palpate.export.check_program import CheckProgram
from palpate.export.compilers import STRICT
from palpate.export.onnx_export import export_onnx
from palpate.export.wasm_core import WasmCore
from palpate.surrogates import LearntEnergy
from palpate.surrogates.memories import Memory, MemoryState
from system_programs import require_program

# what optimisation would remove is looked at too; other exporters here are optimised
SANITIZED = ("-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def c_with(compiler: str, *options: str, single: bool = False) -> Callable[[pp.Surrogate, Path], Comparison]:
    """Return the exporter to C99, compiled without a warning by a compiler."""

    def export(thing: pp.Surrogate, folder: Path) -> Comparison:
        path = require_program(compiler)
        done = export_c(thing, folder, single=single, check=False)
        block = block_of(thing, field=None, with_field=True, deviation=True)
        assert done.hash == block.hash
        return compare_c(thing, block, done, path, single=single, options=options)

    return export


def library(thing: pp.Surrogate, folder: Path) -> Comparison:
    """Export to a shared library, asked through its Python wrapper."""
    require_program("gcc")
    done = export_lib(thing, folder, compiler="gcc")
    assert done.comparison is not None
    return done.comparison


def page(thing: pp.Surrogate, folder: Path) -> Comparison:
    """Export to WebAssembly, as a page that is one file has it."""
    del folder
    name = next(iter(thing.fields), None)
    block = block_of(thing, field=name, with_field=name is not None, deviation=True)
    core = WasmCore(block.to_bytes(), [thing.fields[name]] if block.field else [])
    return compare_body(thing, core, field=block.field)


def onnx(thing: pp.Surrogate, folder: Path) -> Comparison:
    """Export to ONNX, run by ONNX Runtime; fields and memories do not go out."""
    thing = dataclasses.replace(thing, memory=None, fields={})
    done = export_onnx(thing, folder / "body.onnx")
    assert done.comparison is not None
    assert done.hash == block_of(thing, field=None, with_field=False, deviation=True).hash
    return done.comparison


EXPORTERS = {
    "onnx": onnx,
    "page": page,
    "gcc": c_with("gcc", *STRICT, *SANITIZED),
    "clang": c_with("clang", *STRICT),
    "tcc": c_with("tcc", "-Wall", "-Werror"),
    "lib": library,
    "float": c_with("gcc", *STRICT, *SANITIZED, single=True),
}
ON_ALL = ("gcc", "float", "page", "onnx")  # the others on two bodies: the sources are the same
ON_SOME = ("relaxation", "pad")
PLAIN = {("gcc", "relaxation"), ("lib", "pad"), ("page", "relaxation"), ("onnx", "pad")}


@pytest.mark.parametrize(
    ("exporter", "name"),
    [
        pytest.param(e, b, marks=[] if (e, b) in PLAIN else pytest.mark.full)
        for e in EXPORTERS
        for b in BODIES
        if e in ON_ALL or b in ON_SOME
    ],
)
def test_an_export_answers_as_palpate_does(exporter, name, tmp_path):
    thing = body(name)
    compared = EXPORTERS[exporter](thing, tmp_path)
    assert compared.passed, str(compared)
    wanted = {"energy", "force", "stiffness", "depth", "amplitude", "slope", "flags"}
    wanted |= {"deviation"} if thing.energy.root is not None else set()
    if exporter != "onnx":
        wanted |= {"field"} if thing.fields else set()
        wanted |= {"memory", "stored"} if thing.memory is not None else set()
    assert set(compared.parts) == wanted
    assert compared.parts["energy"].count > 900


@pytest.mark.full
@pytest.mark.parametrize("compiler", ["gcc", "tcc"])
def test_networks_alone_go_out(compiler, tmp_path):
    path = require_program(compiler)
    options = (*STRICT, *SANITIZED) if compiler == "gcc" else ("-Wall", "-Werror")
    for i, network in enumerate(map(pp.Surrogate.of, networks())):
        done = export_c(network, tmp_path / str(i), name="map", check=False)
        block = block_of(network, field=None, with_field=True, deviation=True)
        assert (compared := compare_c(network, block, done, path, single=False, options=options)).passed, str(
            compared
        )


@pytest.mark.full
def test_compilers_agree_to_the_last_bit(tmp_path):
    thing = body("indentation")
    done = export_c(thing, tmp_path, check=False)
    answers = []
    for compiler in ("gcc", "clang", "tcc"):
        (folder := tmp_path / compiler).mkdir()
        program = CheckProgram.compile(
            require_program(compiler), done.sources, done.name, folder, memory=True
        )
        answers.append(program.answers(places(thing))[:, :20])
    for other in answers[1:]:
        np.testing.assert_array_equal(other, answers[0])


@dataclass(frozen=True, eq=False)
class _Forgetful(Memory):
    name: ClassVar[str] = "forgetful"

    def start(self) -> MemoryState:
        raise NotImplementedError


def test_what_has_no_c_source_is_refused_by_name(tmp_path):
    thing = body("contact")

    class Silent(type(thing.energy.baseline)):
        name: ClassVar[str] = "silent"

        def c_source(self):
            return None

    known = thing.energy.baseline
    silent = pp.Surrogate(LearntEnergy(thing.energy.network, Silent(known.law, known.touched, known.radius)))
    with pytest.raises(UsageError, match="baseline 'silent' has no C source"):
        export_c(silent, tmp_path)
    with pytest.raises(UsageError, match="memory 'forgetful' has no C source"):
        export_c(thing.with_memory(_Forgetful()), tmp_path)
    with pytest.raises(UsageError, match="begin the names"):
        export_c(thing, tmp_path, name="2 bodies")
    with pytest.raises(UsageError, match="no field 'stress'"):
        export_c(thing, tmp_path, field="stress")
    assert not any(tmp_path.iterdir())


@pytest.mark.full
def test_a_baseline_of_ones_own_goes_out_as_the_guide_says(tmp_path):
    from test_new_kind import MEETS, RANGES, SpringBed

    guide = (Path(__file__).parents[2] / "docs" / "guide" / "export.md").read_text("utf-8")
    source = guide.split("```c\n")[1].split("```")[0]

    class Bed(SpringBed):
        def c_source(self):
            return source

    network = linear_network(list(RANGES), [pp.Quantity("ln U/U0")], np.array([[0.1, 0.3, -0.2, 0.4]]))
    thing = pp.Surrogate(LearntEnergy(network, Bed(120.0, MEETS)), meta={"name": "bed"})
    compared = c_with("gcc", *STRICT, *SANITIZED)(thing, tmp_path)
    assert compared.passed, str(compared)
    assert compared.parts["force"].count > 2000


class _Off:
    """An export whose force is off by a factor."""

    def __init__(self, thing, factor):
        self.thing, self.factor = thing, factor

    def answers(self, X):
        out = true_answers(self.thing.energy, X)
        out[:, 2:5] *= self.factor
        return out


@pytest.mark.full
def test_an_export_that_is_off_is_found():
    thing = pp.Surrogate(body("contact").energy)
    assert compare_body(thing, _Off(thing, 1.0)).passed
    off = compare_body(thing, _Off(thing, 1.0 + 1e-8))
    assert not off.passed
    assert off.parts["force"].wrong > 100
    assert compare_body(thing, _Off(thing, 1.0 + 1e-8), Precision(single=True)).passed


@pytest.mark.full
def test_a_damaged_table_is_found(tmp_path):
    compiler = require_program("gcc")
    thing = body("pad")
    done = export_c(thing, tmp_path, check=False)
    source = done.sources[0]
    text = source.read_text("utf-8")
    first = text.index("0x1.", text.index(f"{done.name}_8[]")) + 4  # a digit of the first unit
    source.write_text(f"{text[:first]}{'1' if text[first] != '1' else '2'}{text[first + 1 :]}", "utf-8")
    block = block_of(thing, field=None, with_field=True, deviation=True)
    assert not compare_c(thing, block, done, compiler, single=False).passed


@pytest.mark.full
def test_an_export_that_differs_is_refused_and_leaves_no_file(tmp_path, monkeypatch):
    require_program("gcc")
    thing = pp.Surrogate(body("pad").energy)
    off = compare_body(thing, _Off(thing, 1.1))
    monkeypatch.setattr("palpate.export.c_export.compare_c", lambda *_, **__: off)
    monkeypatch.setattr("palpate.export.lib_export.compare_body", lambda *_, **__: off)

    def differs(_, fmu, **__):
        fmu.answers(np.zeros((1, 3 + len(thing.parameters))))
        return off

    monkeypatch.setattr("palpate.export.fmu_export.compare_body", differs)
    for export in (export_c, export_lib):
        with pytest.raises(AccuracyError, match="not answer as palpate does"):
            export(thing, tmp_path / "out")
    with pytest.raises(AccuracyError, match="not answer as palpate does"):
        export_fmu(thing, tmp_path / "pad.fmu")
    assert list(tmp_path.iterdir()) == []
