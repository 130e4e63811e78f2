"""The texts that describe an FMU: modelDescription.xml of FMI 2.0 and 3.0, and how to build the sources of 3.0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

from palpate.export.fmu_variables import FLAGS, Variable, defined_units

__all__ = ["SOURCE", "Described", "build_description", "model_description"]

SOURCE = "palpate_fmu.c"
_TIME = 15  # value reference of time, which is a variable in 3.0
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_CATEGORIES = (
    '<LogCategories><Category name="logStatusError"/><Category name="logStatusWarning"/></LogCategories>'
)
_EXPERIMENT = '<DefaultExperiment startTime="0" stopTime="1" stepSize="0.001"/>'


@dataclass(frozen=True)
class Described:
    """The facts of an FMU that its description tells.

    `exchange` says whether it is for model exchange too, `derivatives` whether it provides directional ones.
    """

    name: str  # model identifier
    words: str  # what it is, in a line
    variables: Sequence[Variable]
    exchange: bool = True
    derivatives: bool = True


def model_description(fmu: Described, guid: str, version: str) -> str:
    """Return the text of modelDescription.xml in version "2.0" or "3.0" of FMI.

    `guid`, the SHA-256 of the weights, is guid or instantiation token.
    """
    from palpate.version import __version__

    identity, parts = ("guid", _parts2) if version == "2.0" else ("instantiationToken", _parts3)
    kinds, listed, structure = parts(fmu)
    # there are no event indicators: in 2.0 that is said where a solver could ask for them
    indicators = ' numberOfEventIndicators="0"' if fmu.exchange and version == "2.0" else ""
    return (
        f'{_HEAD}<fmiModelDescription fmiVersion="{version}" modelName="{fmu.name}" {identity}="{guid}" '
        f'description={quoteattr(fmu.words)} generationTool="palpate {__version__}" '
        f'variableNamingConvention="flat"{indicators}>\n'
        f"{kinds}\n<UnitDefinitions>{_units(fmu.variables, time=version == '3.0')}</UnitDefinitions>\n"
        f"{_CATEGORIES}\n{_EXPERIMENT}\n<ModelVariables>\n{listed}\n</ModelVariables>\n"
        f"<ModelStructure>{structure}</ModelStructure>\n</fmiModelDescription>\n"
    )


def build_description(name: str) -> str:
    """Return the text of sources/buildDescription.xml of FMI 3.0."""
    return (
        f'{_HEAD}<fmiBuildDescription fmiVersion="3.0">\n<BuildConfiguration modelIdentifier="{name}">\n'
        f'<SourceFileSet language="C99"><SourceFile name="{SOURCE}"/></SourceFileSet>\n'
        '<Library name="m" external="true" description="of mathematics, where it is not in that of C"/>\n'
        "</BuildConfiguration>\n</fmiBuildDescription>\n"
    )


def _units(variables: Sequence[Variable], *, time: bool) -> str:
    units = defined_units(list(variables)) | ({"s": 's="1"'} if time else {})
    return "".join(
        f"<Unit name={quoteattr(unit)}/>"
        if base is None
        else f"<Unit name={quoteattr(unit)}><BaseUnit {base}/></Unit>"
        for unit, base in units.items()
    )


def _numbers(variable: Variable) -> str:
    """Return range, usual size and start as attributes."""
    numbers = {
        "min": variable.low,
        "max": variable.high,
        "nominal": variable.nominal,
        "start": variable.start,
    }
    return "".join(f' {k}="{float(v)!r}"' for k, v in numbers.items() if v is not None)


def _initial(variable: Variable) -> str:
    if variable.is_unknown:
        return ' initial="calculated"'
    return ' initial="exact"' if variable.is_state else ""


def _before(variables: Sequence[Variable], unknown: Variable) -> list[int] | None:
    """Return the references that an unknown depends on during initialization: parameters, too; None for all."""
    if unknown.depends is None:
        return None
    return sorted({*unknown.depends, *(v.reference for v in variables if v.causality == "parameter")})


def _dependencies(references: Sequence[int] | None) -> str:
    return "" if references is None else f' dependencies="{" ".join(map(str, references))}"'


def _parts2(fmu: Described) -> tuple[str, str, str]:
    """Return kinds of simulation, variables and structure of FMI 2.0, where variables are numbered from 1."""
    variables, name, exchange = fmu.variables, fmu.name, fmu.exchange
    place = {v.reference: i for i, v in enumerate(variables, 1)}
    files = f'<SourceFiles><File name="{SOURCE}"/></SourceFiles>'
    able = 'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    able += ' providesDirectionalDerivative="true"' if fmu.derivatives else ""
    kinds = f'<ModelExchange modelIdentifier="{name}" {able}>{files}</ModelExchange>\n' if exchange else ""
    kinds += (
        f'<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" {able}>{files}'
    )

    def scalar(v: Variable) -> str:
        reference = v.reference - FLAGS if not v.unit else v.reference  # Booleans have numbers of their own
        rate = "" if v.rate_of is None else f' derivative="{place[v.rate_of]}"'
        kind = f"<Real unit={quoteattr(v.unit)}{_numbers(v)}{rate}/>" if v.unit else "<Boolean/>"
        return (
            f'<ScalarVariable name="{v.name}" valueReference="{reference}" causality="{v.causality}" '
            f'variability="{v.variability}"{_initial(v)} description={quoteattr(v.words)}>{kind}</ScalarVariable>'
        )

    def unknown(v: Variable, references: Sequence[int] | None) -> str:
        places = None if references is None else sorted(place[r] for r in references)
        return f'<Unknown index="{place[v.reference]}"{_dependencies(places)}/>'

    rates = "".join(unknown(v, v.depends) for v in variables if v.rate_of is not None)
    structure = (
        f"<Outputs>{''.join(unknown(v, v.depends) for v in variables if v.causality == 'output')}</Outputs>"
        f"{f'<Derivatives>{rates}</Derivatives>' if rates else ''}<InitialUnknowns>"
        f"{''.join(unknown(v, _before(variables, v)) for v in variables if v.is_unknown)}</InitialUnknowns>"
    )
    return f"{kinds}</CoSimulation>", "\n".join(map(scalar, variables)), structure


def _parts3(fmu: Described) -> tuple[str, str, str]:
    """Return kinds of simulation, variables and structure of FMI 3.0, where variables go by their references."""
    variables, name, exchange = fmu.variables, fmu.name, fmu.exchange
    able = 'canGetAndSetFMUState="true" canSerializeFMUState="true"'
    able += ' providesDirectionalDerivatives="true"' if fmu.derivatives else ""
    steps = 'needsCompletedIntegratorStep="true"'  # it says where a flag has changed, which takes an event
    kinds = f'<ModelExchange modelIdentifier="{name}" {steps} {able}/>\n' if exchange else ""
    kinds += f'<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true" {able}/>'

    def variable(v: Variable) -> str:
        rate = "" if v.rate_of is None else f' derivative="{v.rate_of}"'
        unit = f" unit={quoteattr(v.unit)}" if v.unit else ""
        return (
            f'<{"Float64" if v.unit else "Boolean"} name="{v.name}" valueReference="{v.reference}" '
            f'causality="{v.causality}" variability="{v.variability}"{_initial(v)} '
            f"description={quoteattr(v.words)}{unit}{_numbers(v)}{rate}/>"
        )

    def unknown(kind: str, v: Variable, references: Sequence[int] | None) -> str:
        return f'<{kind} valueReference="{v.reference}"{_dependencies(references)}/>'

    time = (
        f'<Float64 name="time" valueReference="{_TIME}" causality="independent" variability="continuous" '
        'description="simulated time" unit="s"/>'
    )
    structure = [unknown("Output", v, v.depends) for v in variables if v.causality == "output"]
    structure += [
        unknown("ContinuousStateDerivative", v, v.depends) for v in variables if v.rate_of is not None
    ]
    structure += [unknown("InitialUnknown", v, _before(variables, v)) for v in variables if v.is_unknown]
    return kinds, "\n".join([time, *map(variable, variables)]), "".join(structure)
