"""FMUs: loaded and simulated by FMPy, called in legal and illegal orders under sanitizers, damaged weights refused."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest

from exported_bodies import body
from palpate.errors import UsageError
from palpate.export import export_fmu
from palpate.export.check_fmu import CheckFmu
from palpate.export.check_points import compare_body
from palpate.export.fmu_binaries import built_binaries, fmu_source
from palpate.export.weights_block import WeightsBlock, fnv
from palpate.surrogates import LearntEnergy, Surrogate
from system_programs import require_program

NAMES = ["contact", "relaxation", "indentation", "pad", "constant", "iwan"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Folder with an FMU of each body, in a path with a blank and a letter beyond ASCII."""
    folder = tmp_path_factory.mktemp("fmus") / "with blank é"
    folder.mkdir()
    for name in NAMES:
        export_fmu(body(name), folder / f"{name}.fmu", name=name, check=False)
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_it_answers_as_palpate_does(name, files):
    with CheckFmu(files / f"{name}.fmu") as fmu:
        compared = compare_body(body(name), fmu, deviation=body(name).energy.root is not None, partial=True)
    assert compared.passed, str(compared)
    wanted = {"energy", "depth", "flags"}
    wanted |= {"force", "stiffness"} if body(name).memory is None else {"memory", "stored"}
    assert wanted <= set(compared.parts)


def simulated(file, end, speed, output, **options):
    """Simulate a probe that goes down at a speed (m/s), 1 kHz."""
    t = np.linspace(0.0, end, round(1000 * end) + 1)
    kinds = [(k, float) for k in ("time", "x", "y", "z")]
    signals = np.array([(s, 0.001, 0.0, 0.01 - speed * s) for s in t], dtype=kinds)
    steps = {"stop_time": end, "step_size": 1e-3, "output_interval": 1e-3}
    return fmpy.simulate_fmu(file, input=signals, output=output, **steps, **options)


@pytest.mark.parametrize("name", ["contact", "relaxation"])
def test_fmpy_validates_and_simulates_it(name, files):
    file = str(files / f"{name}.fmu")
    assert fmpy.validation.validate_fmu(file) == []
    result = simulated(file, 0.2, 0.03, ["fz", "energy"])
    assert len(result) == 201
    assert np.isfinite(result["fz"]).all()
    assert result["fz"].max() > 0


def test_model_exchange_has_true_feed_through(files):
    thing, file = body("contact"), str(files / "contact.fmu")
    result = simulated(file, 0.1, 0.05, ["fz"], fmi_type="ModelExchange")
    r = thing.parameters[0]
    X = np.array([[0.001, 0.0, 0.01 - 0.05 * s, (r.low + r.high) / 2] for s in result["time"]])
    np.testing.assert_allclose(result["fz"], thing.energy.force(X)[:, 2], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["contact", "relaxation", "pad"])
def test_legal_and_illegal_orders_under_sanitizers(name, files, tmp_path):
    compiler = require_program("gcc")
    with zipfile.ZipFile(files / f"{name}.fmu") as packed:
        packed.extractall(tmp_path)
    source = tmp_path / "host.c"
    source.write_text(
        (tmp_path / "sources" / "palpate_fmu.c").read_text("utf-8")
        + (Path(__file__).parent / "fmu_host.c").read_text("utf-8"),
        "utf-8",
    )
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-O1", "-g", "-fsanitize=address,undefined"]
    command += ["-fno-sanitize-recover=all", str(source), "-o", str(tmp_path / "host"), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    guid = WeightsBlock.of(body(name)).hash
    kind = "forgets" if body(name).memory is None else "remembers"
    words = [tmp_path / "host", guid, (tmp_path / "resources").as_uri(), kind]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    damage(words, tmp_path / "resources" / "weights.bin")


def damage(words, weights: Path) -> None:
    """Damage the weights in many places: each is refused or harmless, also where the checksum is made to fit."""
    whole = weights.read_bytes()
    rng = np.random.default_rng(0)
    for i in range(12):
        content = bytearray(whole if i % 4 else whole[: len(whole) // 2 // 8 * 8])
        for at in rng.integers(0, min(len(content), 64 + 40 * 64 if i % 2 else len(content)), 3):
            content[at] ^= 1 << rng.integers(0, 8)
        if i % 2:  # as somebody with bad intent would
            content[24:32] = fnv(bytes(content[64:])).to_bytes(8, "little")
        weights.write_bytes(bytes(content))
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
        assert "ERROR: AddressSanitizer" not in done.stderr, done.stderr
        assert "runtime error" not in done.stderr, done.stderr
    weights.write_bytes(whole)


def test_one_source_and_its_binaries_of_all_platforms_go_out(files):
    with zipfile.ZipFile(files / "pad.fmu") as packed:
        names = set(packed.namelist())
        assert packed.read("sources/palpate_fmu.c").decode() == fmu_source()
        assert packed.read("resources/weights.bin")[32:64].hex() == WeightsBlock.of(body("pad")).hash
    assert {"binaries/linux64/pad.so", "binaries/win64/pad.dll", "binaries/darwin64/pad.dylib"} <= names


def test_a_baseline_that_the_binary_does_not_hold_is_refused(tmp_path):
    thing = body("contact")

    class Own(type(thing.energy.baseline)):
        name = "own"

    known = thing.energy.baseline
    own = Surrogate(LearntEnergy(thing.energy.network, Own(known.law, known.touched, known.radius)))
    with pytest.raises(UsageError, match="baseline 'own' is not in the generic binary"):
        export_fmu(own, tmp_path / "x.fmu")


FUNCTIONS = (  # noqa: SIM905
    "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment "
    "EnterInitializationMode ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean "
    "GetString SetReal SetInteger SetBoolean SetString GetFMUstate SetFMUstate FreeFMUstate "
    "SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative "
    "EnterEventMode NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime "
    "SetContinuousStates GetDerivatives GetEventIndicators GetContinuousStates "
    "GetNominalsOfContinuousStates SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep "
    "GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus GetStringStatus "
).split()


@pytest.mark.parametrize("file", ["linux64/.so", "win64/.dll", "darwin64/.dylib"])
def test_a_binary_exports_all_functions_of_fmi(file):
    """Those of Windows and macOS are not run here, so their symbols are looked for."""
    content = built_binaries()[file]
    assert [name for name in FUNCTIONS if f"fmi2{name}".encode() not in content] == []
    assert len(content) <= 200 * 1024
