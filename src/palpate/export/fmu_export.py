"""Export as a Functional Mock-up Unit, FMI 2.0: a description, the weights, a generic binary for each platform.

Nothing is compiled: the binaries were built beforehand (`palpate.export.fmu_binaries`) and read the weights from
resources/weights.bin, whose SHA-256 is the guid. The sources are in the FMU too.
"""

from __future__ import annotations

import importlib.util
import os
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

from palpate.errors import AccuracyError, UsageError
from palpate.export.c_files import require_name
from palpate.export.check_fmu import CheckFmu
from palpate.export.check_points import Comparison, compare_body
from palpate.export.fmu_binaries import built_binaries, fmu_source
from palpate.export.weights_block import WeightsBlock, identifier
from palpate.files import write_file
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import card_of
from palpate.units import Range

__all__ = ["ExportedFmu", "export_fmu", "model_description"]

_PARAMETER = 16  # value reference of the first parameter
_WHEN = (1980, 1, 1, 0, 0, 0)  # the same file each time
_UNITS: Mapping[str, str] = {
    "m": 'm="1"',
    "N": 'kg="1" m="1" s="-2"',
    "J": 'kg="1" m="2" s="-2"',
    "Pa": 'kg="1" m="-1" s="-2"',
    "N/m": 'kg="1" s="-2"',
    "s": 's="1"',
    "1": "",
}
_KNOWN = (1, 2, 3)  # one-based places of x, y and z in the description


@dataclass(frozen=True)
class ExportedFmu:
    """An FMU that was written.

    Attributes
    ----------
    path : Path
        The .fmu file.
    hash : str
        SHA-256 of the weights, which is the guid.
    platforms : tuple of str
        Folders of binaries that are in.
    exchange : bool
        Whether it is for model exchange too.
    deviation : bool
        Whether the deviation of the force went out.
    comparison : Comparison, optional
        How far it is from palpate; None where FMPy is not installed, or nothing was to be compared.
    """

    path: Path
    hash: str
    platforms: tuple[str, ...]
    exchange: bool
    deviation: bool = True
    comparison: Comparison | None = None

    def compare(self, surrogate: Surrogate) -> Comparison | None:
        """Return how far the FMU is from its body, loaded by FMPy; None where there is none.

        Raises
        ------
        AccuracyError
            If it differs by more than it may.
        """
        if importlib.util.find_spec("fmpy") is None:
            return None
        known = self.deviation and surrogate.energy.root is not None
        with CheckFmu(self.path) as fmu:
            comparison = compare_body(surrogate, fmu, deviation=known, partial=True)
        if not comparison.passed:
            raise AccuracyError(
                f"The FMU does not answer as palpate does: {comparison}.",
                why="Its binary or this machine may bend the arithmetic.",
                fix="Report this: it must not be used.",
            )
        return comparison


def export_fmu(
    surrogate: Surrogate,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    deviation: bool = True,
    check: bool = True,
) -> ExportedFmu:
    """Write a body as an FMU, and compare it with palpate at 1,000 places if FMPy is installed.

    Parameters
    ----------
    surrogate : Surrogate
        The body; its baseline and memory must be palpate's own.
    out : path
        The file, NAME.fmu.
    name : str, optional
        Model identifier; by default the body's name.
    deviation : bool
        Whether the deviation of the force goes out.
    check : bool
        Whether it is compared.

    Raises
    ------
    UsageError
        If its baseline or memory is none of those that the generic binary holds.
    AccuracyError
        If it differs from palpate by more than it may; nothing is written.
    """
    name = require_name(identifier(surrogate.name) if name is None else name)
    block = WeightsBlock.of(surrogate, deviation=deviation)
    _, _, baseline, memory = block.tables[0].values[:4].tolist()
    if baseline == 0 or (surrogate.memory is not None and memory == 0):
        kind = f"baseline {surrogate.energy.baseline.name!r}"
        kind = kind if baseline == 0 or surrogate.memory is None else f"memory {surrogate.memory.name!r}"
        raise UsageError(
            f"The {kind} is not in the generic binary of FMUs.",
            why="That binary is built beforehand, of palpate's own baselines and memories.",
            fix="Take the body out as C99, which compiles the C source of your own.",
        )
    binaries = built_binaries()
    entries: dict[str, bytes] = {
        "modelDescription.xml": model_description(surrogate, name, block.hash).encode(),
        "resources/weights.bin": block.to_bytes(),
        "sources/palpate_fmu.c": fmu_source().encode(),
    }
    card = card_of(surrogate).with_hash("weights", block.hash)
    entries |= {
        "documentation/card.md": card.to_markdown().encode(),
        "documentation/card.json": card.to_json().encode(),
    }
    for file, content in binaries.items():
        folder, _, ending = file.partition("/")
        entries[f"binaries/{folder}/{name}{ending}"] = content
    content, platforms = _zip_entries(entries), tuple(f.partition("/")[0] for f in binaries)
    done = ExportedFmu(Path(out), block.hash, platforms, surrogate.memory is None, deviation)
    if check:
        with tempfile.TemporaryDirectory() as place:
            tried = replace(done, path=write_file(Path(place) / f"{name}.fmu", content))
            done = replace(done, comparison=tried.compare(surrogate))
    write_file(done.path, content)
    return done


def _zip_entries(entries: Mapping[str, bytes]) -> bytes:
    from io import BytesIO

    whole = BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries.items():
            info = zipfile.ZipInfo(name, _WHEN)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o755 << 16
            file.writestr(info, content)
    return whole.getvalue()


def model_description(surrogate: Surrogate, name: str, guid: str) -> str:
    """Return the text of modelDescription.xml."""
    from palpate import __version__

    elastic, parameters = surrogate.memory is None, surrogate.parameters
    variables = _variables(surrogate)
    outputs = [i for i, text in enumerate(variables, 1) if 'causality="output"' in text]
    known = [*_KNOWN, *range(4, 5 + len(parameters))]
    depend = " ".join(map(str, known))
    unknown = "".join(f'<Unknown index="{i}" dependencies="{depend}"/>' for i in outputs)
    units = {"m", "N", "J", "1", *(r.unit or "1" for r in parameters)}
    defined = "".join(_unit(u) for u in sorted(units))
    files = '<SourceFiles><File name="palpate_fmu.c"/></SourceFiles>'
    exchange = (
        f'<ModelExchange modelIdentifier="{name}" canGetAndSetFMUstate="true" canSerializeFMUstate="true" '
        f'providesDirectionalDerivative="true">{files}</ModelExchange>'
        if elastic
        else ""
    )
    simulation = (
        f'<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" '
        'canGetAndSetFMUstate="true" canSerializeFMUstate="true" '
        f'providesDirectionalDerivative="{"true" if elastic else "false"}">{files}</CoSimulation>'
    )
    body = quoteattr(str(surrogate).splitlines()[0])
    indicators = ' numberOfEventIndicators="0"' if elastic else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{guid}" description={body} '
        f'generationTool="palpate {__version__}" variableNamingConvention="flat"{indicators}>\n'
        f"{exchange}\n{simulation}\n<UnitDefinitions>{defined}</UnitDefinitions>\n"
        '<LogCategories><Category name="logStatusError"/><Category name="logStatusWarning"/></LogCategories>\n'
        f'<DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>\n<ModelVariables>\n'
        + "\n".join(variables)
        + f"\n</ModelVariables>\n<ModelStructure><Outputs>{unknown}</Outputs>"
        f"<InitialUnknowns>{unknown}</InitialUnknowns></ModelStructure>\n</fmiModelDescription>\n"
    )


def _unit(unit: str) -> str:
    if unit in _UNITS:
        return f"<Unit name={quoteattr(unit)}><BaseUnit {_UNITS[unit]}/></Unit>"
    return f"<Unit name={quoteattr(unit)}/>"


def _variables(surrogate: Surrogate) -> list[str]:
    """Return the scalar variables: inputs, force scale, parameters, outputs."""
    place = (
        "displacement of what the hand holds" if surrogate.energy.baseline.holds else "centre of the probe"
    )
    start = _start(surrogate)
    rows = [
        _real(axis, i, "input", "continuous", "m", f"{place}, {axis}", start=value)
        for i, (axis, value) in enumerate(zip("xyz", start, strict=True))
    ]
    rows.append(_real("force_scale", 9, "parameter", "tunable", "1", "factor of force and energy", start=1.0))
    for i, r in enumerate(surrogate.parameters):
        rows.append(_parameter(r, _PARAMETER + i))
    rows += [
        _real(f"f{axis}", 3 + i, "output", "continuous", "N", f"force on the hand, {axis}")
        for i, axis in enumerate("xyz")
    ]
    rows += [
        _real("energy", 6, "output", "continuous", "J", "elastic energy"),
        _real(
            "depth",
            7,
            "output",
            "continuous",
            "m",
            "depth of the probe, negative in the air; or way of the hand",
        ),
        _real(
            "deviation",
            8,
            "output",
            "continuous",
            "1",
            "standard deviation of the force relative to its size",
        ),
    ]
    if surrogate.memory is not None:
        rows += [
            _real("stored", 10, "output", "continuous", "J", "energy that can be had back"),
            _real("lost", 11, "output", "continuous", "J", "energy lost since the start"),
        ]
    flags = {
        "inside": "inside of the trained region",
        "contact": "the probe touches the body",
        "too_deep": "the body has let go of the probe: no force",
    }
    for i, (flag, words) in enumerate(flags.items()):
        rows.append(
            f'<ScalarVariable name="{flag}" valueReference="{i}" causality="output" variability="discrete" '
            f'initial="calculated" description={quoteattr(words)}><Boolean/></ScalarVariable>'
        )
    return rows


def _start(surrogate: Surrogate) -> list[float]:
    """Return a place at which nothing is felt: rest, or the highest place of the middle of the ranges."""
    baseline = surrogate.energy.baseline
    if baseline.holds:
        return [0.0, 0.0, 0.0]
    return [(r.low + r.high) / 2 for r in surrogate.inputs[:2]] + [surrogate.inputs[2].high]


def _parameter(r: Range, reference: int) -> str:
    middle = (r.low + r.high) / 2
    words = f'min="{r.low!r}" max="{r.high!r}" '
    return _real(
        identifier(r.name), reference, "parameter", "tunable", r.unit or "1", r.name, start=middle, more=words
    )


def _real(
    name: str,
    reference: int,
    causality: str,
    variability: str,
    unit: str,
    words: str,
    *,
    start: float | None = None,
    more: str = "",
) -> str:
    begin = "" if start is None else f'start="{float(start)!r}" '
    initial = 'initial="calculated" ' if causality == "output" else ""
    return (
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
        f'variability="{variability}" {initial}description={quoteattr(words)}>'
        f"<Real {begin}{more}unit={quoteattr(unit)}/></ScalarVariable>"
    )
