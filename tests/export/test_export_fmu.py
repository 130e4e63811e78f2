"""FMUs: loaded and simulated by FMPy, called in legal and illegal orders under sanitizers, damaged weights refused."""

from __future__ import annotations

import re
import subprocess
import zipfile
from io import BytesIO
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
from lxml import etree

from binary_exports import exported_names
from exported_bodies import body
from palpate.errors import UsageError
from palpate.export import export_fmu
from palpate.export.check_fmu import CheckFmu
from palpate.export.check_points import compare_body
from palpate.export.fmu_binaries import built_binaries, fmu_source
from palpate.export.fmu_export import VERSIONS
from palpate.export.weights_block import WeightsBlock, fnv
from palpate.runtime.touchable import touchable
from palpate.surrogates import LearntEnergy, Surrogate
from system_programs import require_program

NAMES = ["contact", "relaxation", "indentation", "pad", "constant", "iwan", "friction"]
HERE = Path(__file__).parent
FMPY = Path(fmpy.__file__).parent


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Folder with FMUs of each body, in a path with a blank, a per cent sign and a letter beyond ASCII."""
    folder = tmp_path_factory.mktemp("fmus") / "with blank %20é"
    folder.mkdir()
    for version in VERSIONS:
        for name in NAMES:
            export_fmu(body(name), folder / f"{name}-{version}.fmu", name=name, fmi=version, check=False)
    return folder


@pytest.mark.full
@pytest.mark.grid
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", NAMES)
def test_it_answers_as_palpate_does(name, version, files):
    thing = body(name)
    with CheckFmu(files / f"{name}-{version}.fmu") as fmu:
        compared = compare_body(thing, fmu, deviation=thing.energy.root is not None, partial=True)
    assert compared.passed, str(compared)
    for part in {"memory", "stored"} & set(
        compared.parts
    ):  # stricter than the rule, whose condition is 1 at least
        assert compared.parts[part].relative <= 1e-12
    wanted = {"energy", "depth", "flags"}
    wanted |= {"force", "stiffness"} if thing.memory is None else {"memory", "stored"}
    wanted |= {"force"} if name == "relaxation" else set()
    assert wanted <= set(compared.parts)


def simulated(file, end, speed, output, **options):
    """Simulate a probe that goes down at a speed (m/s), 1 kHz."""
    t = np.linspace(0.0, end, round(1000 * end) + 1)
    kinds = [(k, float) for k in ("time", "x", "y", "z")]
    signals = np.array([(s, 0.001, 0.0, 0.01 - speed * s) for s in t], dtype=kinds)
    steps = {"stop_time": end, "step_size": 1e-3, "output_interval": 1e-3}
    return fmpy.simulate_fmu(file, input=signals, output=output, **steps, **options)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("name", ["contact", "relaxation"])
def test_fmpy_simulates_it(name, kind, version, files):
    file = str(files / f"{name}-{version}.fmu")
    result = simulated(file, 0.2, 0.03, ["fz", "energy", "contact"], fmi_type=kind)
    # an event more in model exchange: where it touches, a flag changes
    assert len(result) == (202 if kind == "ModelExchange" else 201)
    assert np.isfinite(result["fz"]).all()
    assert result["fz"].max() > 0
    assert (np.diff(result["contact"].astype(int)) != 0).sum() == 1


@pytest.mark.parametrize("version", VERSIONS)
def test_a_slide_with_friction_in_co_simulation_is_that_of_python(version, files):
    """Pressed, dragged until it slips, and turned back: each force to the digits of the two languages' arithmetic."""
    thing = body("friction")
    t = np.linspace(0.0, 0.4, 401)
    path = np.stack([0.01 * np.sin(4 * np.pi * t), 0.002 * t, 0.01 - 0.02 * np.minimum(t, 0.15)], axis=-1)
    signals = np.array([(s, *row) for s, row in zip(t, path, strict=True)], [(k, float) for k in "txyz"])
    signals.dtype.names = ("time", "x", "y", "z")
    result = fmpy.simulate_fmu(
        str(files / f"friction-{version}.fmu"), fmi_type="CoSimulation", input=signals,
        output=["x", "y", "z", "fx", "fy", "fz"], stop_time=0.4, step_size=1e-3, output_interval=1e-3,
    )  # fmt: skip
    places, forces = (
        np.column_stack([result[k] for k in names]) for names in (["x", "y", "z"], ["fx", "fy", "fz"])
    )
    hand = touchable(thing).evaluator()
    hand.elapsed, further = 1e-3, np.array([(r.low + r.high) / 2 for r in touchable(thing).parameters])
    wanted = []
    for place in places[1:]:
        hand(place, further)
        wanted.append(hand.force.copy())
    np.testing.assert_allclose(forces[1:], wanted, rtol=1e-9, atol=1e-12)
    assert np.abs(forces[:, 0]).max() > 0.2 * forces[:, 2].max()


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", NAMES)
def test_its_descriptions_are_valid(name, version, files):
    file = files / f"{name}-{version}.fmu"
    assert fmpy.validation.validate_fmu(str(file)) == []
    description = fmpy.read_model_description(str(file))
    assert description.coSimulation is not None
    # what indentations and sliders remember follows no differential equation
    assert (description.modelExchange is None) == (name in ("indentation", "iwan", "friction"))
    if version == "3.0":
        schema = etree.XMLSchema(etree.parse(FMPY / "schema" / "fmi3" / "fmi3BuildDescription.xsd"))
        with zipfile.ZipFile(file) as packed:
            schema.assertValid(etree.parse(BytesIO(packed.read("sources/buildDescription.xml"))))


@pytest.mark.parametrize("version", VERSIONS)
def test_model_exchange_has_true_feed_through(version, files):
    thing, file = body("contact"), str(files / f"contact-{version}.fmu")
    result = simulated(file, 0.1, 0.05, ["fz"], fmi_type="ModelExchange")
    r = thing.parameters[0]
    X = np.array([[0.001, 0.0, 0.01 - 0.05 * s, (r.low + r.high) / 2] for s in result["time"]])
    np.testing.assert_allclose(result["fz"], thing.energy.force(X)[:, 2], rtol=1e-9, atol=1e-12)


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """The program that calls all functions, of the source that is in each FMU."""
    compiler, folder = require_program("gcc"), tmp_path_factory.mktemp("host")
    (folder / "palpate_fmu.c").write_text(fmu_source(), "utf-8")
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-O0", "-fsanitize=address,undefined"]
    command += ["-fno-sanitize-recover=all", f"-I{folder}", f"-I{HERE}", str(HERE / "fmu_host.c")]
    subprocess.run([*command, "-o", str(folder / "host"), "-lm"], check=True, capture_output=True)
    return folder / "host"


@pytest.mark.full
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["contact", "relaxation", "indentation", "pad"])
def test_legal_and_illegal_orders_under_sanitizers(name, version, host, files, tmp_path):
    with zipfile.ZipFile(files / f"{name}-{version}.fmu") as packed:
        packed.extractall(tmp_path / "é %41")
    resources, memory = tmp_path / "é %41" / "resources", body(name).memory
    groups = () if memory is None else memory.c_states()
    states = -1 if groups is None else sum(map(len, groups)) + (memory is not None)
    # a file: URI in 2.0, a path in 3.0
    place = resources.as_uri() if version == "2.0" else f"{resources}/"
    words = [host, version, WeightsBlock.of(body(name)).hash, place, str(states)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    damage(words, resources / "weights.bin")


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
    for version, folders in {
        "2.0": {"linux64/pad.so", "win64/pad.dll", "darwin64/pad.dylib"},
        "3.0": {
            "x86_64-linux/pad.so",
            "x86_64-windows/pad.dll",
            "x86_64-darwin/pad.dylib",
            "aarch64-darwin/pad.dylib",
        },
    }.items():
        with zipfile.ZipFile(files / f"pad-{version}.fmu") as packed:
            names = set(packed.namelist())
            assert packed.read("sources/palpate_fmu.c").decode() == fmu_source()
            assert packed.read("resources/weights.bin")[32:64].hex() == WeightsBlock.of(body("pad")).hash
        assert {f"binaries/{folder}" for folder in folders} == {n for n in names if n.startswith("binaries/")}


def test_what_the_binary_does_not_hold_is_refused(tmp_path):
    thing = body("contact")

    class Own(type(thing.energy.baseline)):
        name = "own"

    known = thing.energy.baseline
    own = Surrogate(LearntEnergy(thing.energy.network, Own(known.law, known.touched, known.radius)))
    with pytest.raises(UsageError, match="baseline 'own' is not in the generic binary"):
        export_fmu(own, tmp_path / "x.fmu")
    with pytest.raises(UsageError, match=r"no export to FMI 1\.0"):
        export_fmu(thing, tmp_path / "x.fmu", fmi="1.0")
    assert list(tmp_path.iterdir()) == []


def standard_functions(version: str) -> set[str]:
    """Return the names of all functions of a version, by its own header."""
    header = (FMPY / "c-code" / f"fmi{version[0]}Functions.h").read_text("utf-8")
    return set(re.findall(r"#define (fmi[23]\w+)\s+fmi[23]FullName", header))


@pytest.mark.parametrize("file", [*built_binaries("3.0"), pytest.param("darwin64/.dylib", id="both-macs")])
def test_a_binary_exports_all_functions_of_both_versions_and_no_others(file):
    """Those of Windows and macOS are not run here, so their tables of exports are read."""
    content = (built_binaries("2.0") | built_binaries("3.0"))[file]
    standard = {version: standard_functions(version) for version in VERSIONS}
    assert len(standard["3.0"]) == 75
    own = {name for name in exported_names(content) if not name.startswith("_")}  # the linker's begin so
    assert own == set.union(*standard.values())
    assert len(content) <= 200_000 * (
        2 if file.startswith("darwin64") else 1
    )  # which holds two machines' code


def test_the_universal_binary_holds_both_macs_at_their_pages():
    whole = built_binaries("2.0")["darwin64/.dylib"]
    words = np.frombuffer(whole[:48], ">u4").tolist()
    assert words[:2] == [0xCAFEBABE, 2]
    parts = {
        (kind, bits): whole[at : at + size]
        for kind, _, at, size, bits in (words[2:7], words[7:12])
        if at % (1 << bits) == 0
    }
    kept = built_binaries("3.0")
    assert parts == {
        (0x01000007, 12): kept["x86_64-darwin/.dylib"],
        (0x0100000C, 14): kept["aarch64-darwin/.dylib"],
    }


def test_the_functions_have_the_signatures_of_the_standard(tmp_path):
    """The compiler compares them with the standard's headers, which FMPy brings."""
    source = tmp_path / "source.c"
    source.write_text(f'#include "fmi2Functions.h"\n#include "fmi3Functions.h"\n{fmu_source()}', "utf-8")
    command = [require_program("gcc"), "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    subprocess.run([*command, f"-I{FMPY / 'c-code'}", str(source)], check=True, capture_output=True)
