"""Exports at their edges: no numbers, numbers too large, batches of no rows, long steps of a master."""

from __future__ import annotations

import dataclasses
import math
import re
import shutil
import subprocess

import fmpy
import numpy as np
import onnx
import onnxruntime
import pytest
from fmpy.fmi1 import FMICallException
from test_fmu_exchange import FORCE, PLACE, instances

from exported_bodies import BODIES, body, networks
from palpate.errors import UsageError
from palpate.export import export_c, export_fmu
from palpate.export.c_export import block_of
from palpate.export.check_fmu import CheckFmu, open_instance
from palpate.export.check_points import NOT_A_NUMBER, TRUSTED, true_answers
from palpate.export.check_program import CheckProgram
from palpate.export.compilers import STRICT
from palpate.export.fmu_export import VERSIONS
from palpate.export.onnx_export import OnnxAsker, export_onnx
from palpate.export.wasm_core import WasmCore
from system_programs import require_program

HUGE = (math.nan, math.inf, -math.inf, 1e160, 1e300, -1e300)
ELASTIC = ("contact", "pad", "iwan")  # a probe, and two kinds of what is held


def elastic(name):
    return dataclasses.replace(body(name), memory=None, fields={})


def extremes(thing):
    """Places and parameters (N, 3 + p) of inputs of which one is no number, or huge."""
    D = thing.energy.baseline.directions
    U = np.tile([(r.low + r.high) / 2 for r in thing.inputs], (len(HUGE) * len(thing.inputs), 1))
    U[np.arange(len(U)), np.arange(len(U)) % len(thing.inputs)] = np.repeat(HUGE, len(thing.inputs))
    if len(D) == 3:
        return U
    with np.errstate(invalid="ignore"):
        return np.hstack([U[:, : len(D)] @ D, U[:, len(D) :]])


def from_gcc(thing, folder):
    done = export_c(thing, folder, check=False)
    return CheckProgram.compile(
        require_program("gcc"), done.sources, done.name, folder, options=(*STRICT, "-O0")
    )


def from_wasm(thing, folder):
    del folder
    return WasmCore(block_of(thing, field=None, with_field=False, deviation=True).to_bytes())


def from_onnx(thing, folder):
    export_onnx(thing, folder / "body.onnx", check=False)
    return OnnxAsker(onnxruntime.InferenceSession(str(folder / "body.onnx")), thing)


def from_fmu(thing, folder):
    export_fmu(thing, folder / "body.fmu", check=False)
    return CheckFmu(folder / "body.fmu")


EXPORTS = {"c": from_gcc, "wasm": from_wasm, "onnx": from_onnx, "fmu": from_fmu}


@pytest.mark.full
@pytest.mark.parametrize("export", EXPORTS)
@pytest.mark.parametrize("name", ["iwan", "pad", pytest.param("contact", marks=pytest.mark.full)])
def test_what_has_no_answer_pushes_nobody_and_is_flagged(export, name, tmp_path):
    """A probe that is far away touches nothing, which is an answer; what is held and far away has none."""
    thing = elastic(name)
    X = extremes(thing)
    wanted, got = true_answers(thing.energy, X), EXPORTS[export](thing, tmp_path).answers(X)
    flags = got[:, 20].astype(int)
    np.testing.assert_array_equal(flags, wanted[:, 20])
    assert np.isfinite(got[:, 2:5]).all()
    none = flags == NOT_A_NUMBER
    assert not got[none, 2:14].any()
    assert none[~np.isfinite(X).all(axis=1)].all()
    assert none.sum() > (~np.isfinite(X).all(axis=1)).sum() or name == "contact"
    assert not (flags[none] & TRUSTED).any()


@pytest.mark.parametrize("name", ELASTIC)
def test_palpate_refuses_what_is_too_large_and_its_loop_calls_it_no_number(name):
    thing = elastic(name)
    k = len(thing.energy.baseline.directions)
    X = np.array([[(r.low + r.high) / 2 for r in thing.inputs]])
    X[0, :k] = 1e300
    if name == "contact":
        assert not thing.energy.force(X).any()
        return
    for ask in (thing.energy.force, thing.energy.energy, thing.energy.stiffness, thing.energy.inside):
        with pytest.raises(UsageError, match="too large to be answered"):
            ask(X)
    evaluate = thing.energy.evaluator()
    evaluate(np.full(3, 1e300), X[0, k:].copy())
    assert np.isnan(evaluate.force).all(), "which is a fault of the loop"
    assert not evaluate.inside


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["pad", "relaxation"])
def test_an_fmu_discards_steps_from_no_place_and_goes_on_afterwards(name, version, tmp_path):
    file = export_fmu(body(name), tmp_path / "body.fmu", fmi=version, check=False).path
    deep = [0.0, 0.0, -0.004] if name == "relaxation" else [0.003, 0.002, 0.0]
    with instances(file, False) as (_, steps):
        steps.write(PLACE, deep)
        steps.step(0.0, 1e-3)
        assert np.any(steps.read(FORCE))
        for bad in (math.nan, math.inf):
            steps.write(PLACE, [bad, 0.0, 0.0])
            with pytest.raises(FMICallException) as caught:
                steps.step(1e-3, 1e-3)
            assert caught.value.status == 2, "Discard"
            assert steps.read(FORCE) == [0.0, 0.0, 0.0]
            assert steps.flags()[0] is False
        steps.write(PLACE, deep)
        steps.step(1e-3, 1e-3)
        after = steps.read(FORCE)
        assert np.any(after)
        steps.begin()
        steps.write(PLACE, deep)
        for k in range(2):
            steps.step(1e-3 * k, 1e-3)
        assert after == steps.read(FORCE), "as if the discarded steps had not been"


@pytest.mark.parametrize("version", VERSIONS)
def test_an_fmu_has_no_rates_or_values_for_a_solver_at_no_place(version, tmp_path):
    file = export_fmu(body("relaxation"), tmp_path / "body.fmu", fmi=version, check=False).path
    with instances(file, True) as (_, exchange):
        exchange.fmu.enterContinuousTimeMode()
        exchange.write(PLACE, [math.nan, 0.0, 0.0])
        with pytest.raises(FMICallException) as caught:
            exchange.read(FORCE)
        assert caught.value.status == 2, "Discard"


def test_what_is_set_must_be_a_number(tmp_path):
    file = export_fmu(body("pad"), tmp_path / "body.fmu", check=False).path
    with instances(file, False) as (description, steps):
        for name, bad in (
            ("force_scale", math.nan),
            ("damping", -1.0),
            ("damping", math.nan),
            ("mass", math.inf),
        ):
            reference = next(v.valueReference for v in description.modelVariables if v.name == name)
            with pytest.raises(FMICallException):
                steps.write([reference], [bad])


MASS, SPEED, DEEP = 0.05, 0.2, 0.0047  # kg; m/s; m, the way that a mass of this speed goes into the block


@pytest.fixture(params=VERSIONS)
def master(request, tmp_path):
    """A function that lets a mass fly into a block, as a master with steps of dt does it.

    It returns the speed at which the mass leaves over that at which it came, and what the FMU logged. The force is held
    for a step, and the mass moves as it must under it.
    """
    file = export_fmu(body("contact"), tmp_path / "block.fmu", fmi=request.param, check=False).path
    description = fmpy.read_model_description(str(file))
    folder, numbers = fmpy.extract(str(file)), {v.name: v.valueReference for v in description.modelVariables}
    logged, opened = [], []

    def run(dt, **settings):
        steps = open_instance(description, folder, log=lambda *words: logged.append(words))
        opened.append(steps)
        height, speed, time, touched = 0.01, -SPEED, 0.0, False
        steps.write([*PLACE, *(numbers[name] for name in settings)], [0.0, 0.0, height, *settings.values()])
        logged.clear()
        steps.begin(again=False)
        while True:
            steps.write(PLACE, [0.0, 0.0, height])
            steps.step(time, dt)
            force = steps.read([5])[0]
            assert force >= 0.0, "nothing pulls a probe back"
            if touched and not force:
                return speed / SPEED, list(logged)
            touched = touched or force > 0.0
            height += dt * speed + dt**2 / 2 * force / MASS
            speed += dt * force / MASS
            time += dt

    yield run
    for steps in opened:
        steps.close()
    shutil.rmtree(folder)


def stiffness(thing, depth):
    """Stiffness (N/m) of a body against a probe at a depth, m, in the middle."""
    x = np.array([[(r.low + r.high) / 2 for r in thing.inputs]])
    x[0, 2] += thing.energy.depth(x)[0] - depth
    return -thing.energy.stiffness(x)[0, 2, 2]


@pytest.mark.parametrize("dt", [0.005, 0.008, 0.01])
def test_long_steps_of_a_master_are_warned_of_and_damping_makes_up_for_them(dt, master):
    """Held for a step, a force acts as a damping of -k dt/2: the speed grows by exp(π dt/4 √(k/m)) in a contact."""
    k = stiffness(body("contact"), DEEP)
    gained = math.exp(math.pi * dt / 4 * math.sqrt(k / MASS))
    fast, warnings = master(dt)
    assert fast == pytest.approx(gained, rel=0.15)
    assert fast > 1.2
    assert len(warnings) == 1
    even, _ = master(dt, damping=k * dt / 2)
    assert 0.7 < even < 1.05


def test_short_steps_of_a_master_need_no_damping_and_no_warning(master):
    assert master(0.0005)[0] == pytest.approx(1.0, abs=0.05)
    assert master(0.0005)[1] == []
    assert len(master(0.0005, mass=1e-4)[1]) == 1, "a lighter mass would gain speed"
    assert master(0.005, mass=0.0)[1] == []
    assert len(master(0.0005, damping=150.0)[1]) == 1, "such damping turns the mass round in a step"


def test_the_warning_says_what_to_do(tmp_path):
    file = export_fmu(body("contact"), tmp_path / "block.fmu", fmi="3.0", check=False).path
    folder, words = fmpy.extract(str(file)), []
    steps = open_instance(
        fmpy.read_model_description(str(file)), folder, log=lambda *args: words.append(args[-1])
    )
    steps.begin()
    steps.write(PLACE, [0.0, 0.0, 0.01 - DEEP])
    steps.step(0.0, 0.01)
    steps.close()
    shutil.rmtree(folder)
    damping = float(words[0].decode().rpartition("damping=")[2].rstrip("."))
    assert damping == pytest.approx(stiffness(body("contact"), DEEP) * 0.01 / 2, rel=0.06)
    assert "0.05 kg" in words[0].decode()


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["contact", "pad", "relaxation"])
def test_damping_is_against_the_velocity_and_its_derivatives_are_true(name, version, tmp_path):
    """Of what is held d v; of a probe along its force. By the place at the end of a step: differences of that step."""
    thing, dt, d = body(name), 0.004, 2.0
    file = export_fmu(thing, tmp_path / "body.fmu", fmi=version, check=False).path
    deep = np.array([0.003, 0.002, 0.001] if name == "pad" else [0.0, 0.0, 0.006])
    way = 1e-4 * np.array([1.0, -2.0, -3.0])

    def force(moved=(0.0, 0.0, 0.0), damping=d):
        steps.begin()
        steps.write([48], [damping])
        for k, place in enumerate((deep, deep + way + moved)):
            steps.write(PLACE, place.tolist())
            steps.step(dt * k, dt)
        return np.array(steps.read(FORCE))

    with instances(file, False) as (_, steps):
        free, damped = force(damping=0.0), force()
        along = np.eye(3) if name == "pad" else np.outer(free, free) / (free @ free)
        np.testing.assert_allclose(damped - free, -d * along @ way / dt, rtol=1e-9)
        got = np.array([steps.slopes(FORCE, [axis], [1.0]) for axis in PLACE]).T
        by_damping = steps.slopes(FORCE, [48], [1.0])
        h = 1e-6
        wanted = [(force(h * e) - force(-h * e)) / (2 * h) for e in np.eye(3)]
        np.testing.assert_allclose(got, np.array(wanted).T, atol=1e-4 * np.abs(got).max())
        np.testing.assert_allclose(by_damping, (damped - free) / d, rtol=1e-6)


ROWLESS = [(name, single) for name in BODIES for single in (False, True) if not single or name in ELASTIC]


@pytest.mark.full
@pytest.mark.parametrize(("name", "single"), ROWLESS)
def test_a_batch_of_no_rows_has_answers_of_no_rows(name, single, tmp_path):
    thing = elastic(name)
    export_onnx(thing, tmp_path / "body.onnx", single=single, check=False)
    session = onnxruntime.InferenceSession(str(tmp_path / "body.onnx"))
    X = np.zeros((0, len(thing.inputs)), np.float32 if single else np.float64)
    for output, value in zip(session.get_outputs(), session.run(None, {"x": X}), strict=True):
        assert value.shape == (0, *output.shape[1:]), output.name


@pytest.mark.full
def test_networks_alone_take_a_batch_of_no_rows(tmp_path):
    for network in networks():
        export_onnx(network, tmp_path / "map.onnx", check=False, overwrite=True)
        session = onnxruntime.InferenceSession(str(tmp_path / "map.onnx"))
        y, slopes = session.run(["y", "jacobian"], {"x": np.zeros((0, 2))})
        assert y.shape == (0, len(network.outputs))
        assert slopes.shape == (0, len(network.outputs), 2)


def test_nodes_are_named_by_what_they_work_out(tmp_path):
    """So that an error of a runtime says where."""
    export_onnx(elastic("contact"), tmp_path / "body.onnx", check=False)
    nodes = [node.name for node in onnx.load(tmp_path / "body.onnx").graph.node]
    assert len(set(nodes)) == len(nodes)
    stages = {name.partition("/")[0] for name in nodes}
    assert stages == {
        *("inputs", "surface", "ranges", "network", "baseline", "slopes", "answers", "deviation", "outputs")
    }


@pytest.mark.grid
@pytest.mark.parametrize("compiler", ["g++", pytest.param("clang++", marks=pytest.mark.full)])
@pytest.mark.parametrize("name", ["contact", "iwan", pytest.param("relaxation", marks=pytest.mark.full)])
@pytest.mark.parametrize("single", [False, True])
def test_the_header_and_the_files_are_cpp_too(compiler, name, single, tmp_path):
    path = require_program(compiler)
    done = export_c(body(name), tmp_path, check=False, single=single)
    strict = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-x", "c++", "-fsyntax-only"]
    for file in (*done.sources, done.example):
        came = subprocess.run([path, *strict, str(file)], capture_output=True, text=True, check=False)
        assert came.returncode == 0, came.stderr[:3000]


def test_a_program_in_cpp_calls_a_library_in_c(tmp_path):
    gcc, cpp = require_program("gcc"), require_program("g++")
    done = export_c(body("pad"), tmp_path, check=False)
    subprocess.run([gcc, "-O1", "-c", str(done.sources[0]), "-o", str(tmp_path / "pad.o")], check=True)
    program = str(tmp_path / "press")
    subprocess.run(
        [cpp, "-x", "c++", str(done.example), "-x", "none", str(tmp_path / "pad.o"), "-o", program],
        check=True,
    )
    assert subprocess.run([program], capture_output=True, text=True, check=True).stdout.count(" N") == 11


@pytest.mark.full
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("name", ["contact", "network", pytest.param("relaxation", marks=pytest.mark.full)])
def test_the_stack_is_smaller_than_the_header_says(name, single, tmp_path):
    """All frames of the core together are more than any chain of calls takes: nothing calls itself."""
    gcc = require_program("gcc")
    thing = networks()[1] if name == "network" else body(name)
    done = export_c(thing, tmp_path, check=False, single=single)
    options = ("-O2", "-c", "-fstack-usage", str(done.sources[0]), "-o", str(tmp_path / "all.o"))
    subprocess.run([gcc, *options], check=True)
    rows = [line.split("\t") for line in (tmp_path / "all.su").read_text("utf-8").splitlines()]
    assert {kind for *_, kind in rows} == {"static"}
    own = [int(size) for place, size, _ in rows if f":{done.name}_" in place]
    core = [int(size) for place, size, _ in rows if f":{done.name}_" not in place]
    said = re.search(r"Stack: less than (\d+) kB", done.files[0].read_text("utf-8"))
    assert said is not None
    assert sum(core) + max(own) < 1000 * int(said[1])


def test_the_header_says_how_long_an_answer_takes_and_how_precise_it_is(tmp_path):
    thing = body("contact")
    texts = [
        export_c(thing, tmp_path / str(single), check=False, single=single).files[0].read_text("utf-8")
        for single in (False, True)
    ]
    assert "exported with --float they are single" in texts[0]
    assert "Numbers are of single precision" in texts[1]
    for text in texts:
        answer, deviation = map(float, re.findall(r"([\d.]+) thousand", text))
        root = thing.energy.root
        assert answer * 1e3 > 40 * len(thing.energy.network.factors), "an exponential for each unit"
        assert deviation * 1e3 > 4 * root.shape[1] ** 2, "a triangle of the root, four times"
