"""Options that pass through several layers, each declared once: name, default, unit, bounds and text.

A record of options is a frozen dataclass whose fields are made by `option`. From that one declaration come

    Python         checks of the values, the text in `help`, and keywords of functions (`takes`)
    study files    keys of a table (`palpate.study.stage_records` and those of each kind)
    command line   options of a command (`palpate.cli.number_options`)

Nothing heavy is imported here: the command line reads the declarations to print its help.
"""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

from palpate import checks
from palpate.errors import UsageError
from palpate.processes import CASE_LIMIT

__all__ = [
    "Discrepancy",
    "EnergyOptions",
    "FieldOptions",
    "FitOptions",
    "ImprovementOptions",
    "Noise",
    "Option",
    "Options",
    "PartOptions",
    "Refinement",
    "SearchOptions",
    "StopOptions",
    "declarations",
    "option",
    "takes",
]

R = TypeVar("R")


@dataclass(frozen=True)
class Option:
    """The declaration of one option of a record."""

    default: Any
    text: str  # a phrase without a full stop: its meaning, and what the default does
    unit: str = ""  # SI unit; "" for a pure number
    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None
    infinite: bool = False  # infinity is a sensible value
    choices: tuple[str, ...] = ()  # of a word
    bare: bool = True  # a command takes a number without a unit, in `unit`
    flag: str = ""  # of a command, where it is not --name; "none" where commands lack it
    name: str = ""
    kind: str = ""  # type as its annotation writes it

    @property
    def ends(self) -> dict[str, float | None]:
        """The bounds, as `checks.fits` takes them."""
        return {"least": self.least, "most": self.most, "above": self.above, "below": self.below}

    @property
    def sentence(self) -> str:
        """Text of a help: the phrase as a sentence, with its unit."""
        unit = f" In {self.unit}." if self.unit and self.bare else ""
        return f"{self.text[0].upper()}{self.text[1:]}.{unit}"

    @property
    def entry(self) -> str:
        """Entry of a parameter list: name and type, and the text below."""
        kind = f"{{{', '.join(map(repr, self.choices))}}}" if self.choices else self.kind
        return f"    {self.name} : {kind.replace(' | None', ', optional')}\n        {self.sentence}"

    def check(self, value: Any) -> None:
        """Refuse a value beyond the bounds, or a word among no choices, and say what the option is."""
        if (value is None and "None" in self.kind) or (self.infinite and value == math.inf):
            return
        what = f"The option {self.name}"
        try:
            if self.choices:
                checks.one_of(what, value, self.choices)
            elif self.kind.startswith(("int", "float")):
                number = str(value) if isinstance(value, bool) else value  # True is no number here
                checks.fits(what, number, self.unit, **self.ends, whole=self.kind.startswith("int"))
        except UsageError as error:
            raise UsageError(error.what, why=f"{error.why} {self.sentence}", fix=error.fix) from None


def option(default: Any, text: str, unit: str = "", **more: Any) -> Any:
    """Return a field of a record of options; `more` are further attributes of `Option`."""
    return field(default=default, metadata={"option": Option(default, text, unit, **more)})


def declarations(record: Any) -> dict[str, Option]:
    """Return the declarations of a record's options by their names."""
    return {f.name: replace(f.metadata["option"], name=f.name, kind=str(f.type)) for f in fields(record)}


class Options:
    """Base of frozen records of options, whose values are checked."""

    def __post_init__(self) -> None:
        for name, declaration in declarations(self).items():
            declaration.check(getattr(self, name))


def _with_documentation(record: type[R]) -> type[R]:
    """Return a record of options whose documentation lists them all."""
    entries = "\n".join(declaration.entry for declaration in declarations(record).values())
    record.__doc__ = f"{record.__doc__}\n\n    Attributes\n    ----------\n{entries}\n    "
    return record


def takes(record: Callable[..., Any]) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """Return a decorator of a function whose parameter `options` is a record: its fields become keywords of their own.

    Keywords that are given change the record that is given as `options`, or the default one. Signature and
    documentation of the function show them all.
    """
    known = declarations(record)

    def decorate(function: Callable[..., R]) -> Callable[..., R]:
        @functools.wraps(function)
        def call(*arguments: Any, **keywords: Any) -> R:
            given = {name: keywords.pop(name) for name in known if name in keywords}
            options = keywords.pop("options", None)
            options = record(**given) if options is None else replace(options, **given)
            return function(*arguments, options=options, **keywords)

        signature, keyword = inspect.signature(function), inspect.Parameter.KEYWORD_ONLY
        own = [p.replace(default=None) if p.name == "options" else p for p in signature.parameters.values()]
        more = [
            inspect.Parameter(o.name, keyword, default=o.default, annotation=o.kind) for o in known.values()
        ]
        end = len(own) - (own[-1].kind is inspect.Parameter.VAR_KEYWORD)
        parameters = [*own[:end], *more, *own[end:]]
        call.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
        entries, doc = "\n".join(declaration.entry for declaration in known.values()), function.__doc__ or ""
        after = re.search(r"\n    \*\*|\n\n    (?:Returns|Yields|Raises|Notes)\n", doc)
        place = after.start() if after else len(doc.rstrip())
        head = "" if "    Parameters\n" in doc else "\n\n    Parameters\n    ----------"
        call.__doc__ = f"{doc[:place]}{head}\n{entries}{doc[place:]}"
        return call

    return decorate


@_with_documentation
@dataclass(frozen=True)
class SearchOptions(Options):
    """Work, time and processes of a search."""

    effort: float = option(1.0, "multiplies the work of the search; 0.1 is a quick look", above=0)
    seconds: float | None = option(
        None,
        "limit on the time of learning; left out: none. With one the result depends on the machine",
        above=0,
    )
    workers: int | None = option(
        None, "processes that search, with the same result; left out: one per core, eight at most", least=1
    )
    seed: int = option(0, "decides the starts", least=0)


@_with_documentation
@dataclass(frozen=True)
class EnergyOptions(SearchOptions):
    """Options of learning an energy."""

    units_max: int = option(160, "most units of the energy, mirror images among them", least=0)
    target: float = option(1e-3, "leave-one-out error at which growth stops", least=0)
    networks: int = option(
        12,
        "most networks whose mean is one energy, of 320 units in all; one answers faster, several miss less",
        least=1,
    )
    choose: bool = option(
        True, "choose among the baseline's candidates, such as contact laws; False takes it as it is"
    )
    deepest: float | None = option(
        None,
        "depth that the solves were to reach: beyond it, or beyond what they did reach where that is less than nine "
        "tenths of it, nothing counts as trained. Left out: the ranges alone decide",
        "m",
    )
    form: str = option("auto", 'form of a unit (see `palpate.rbf.unit_forms`); "auto" tries several')
    radial: str = option(
        "auto",
        'radial function of the units; "auto" tries several',
        choices=("auto", "gaussian", "inverse-multiquadric", "matern-5/2"),
    )
    ridge: float | None = option(
        None, "penalty on the squared weights, by the noise of the solves; left out: the baseline's", least=0
    )
    tolerance: float = option(
        1e-5,
        "relative gain per step of the refinement below which it ends; smaller for solves without noise",
        least=0,
    )


@_with_documentation
@dataclass(frozen=True)
class FieldOptions(SearchOptions):
    """Options of learning a field over a surface."""

    name: str = option("displacement", "name of the field")
    unit: str = option("m", "SI unit of the field")
    tolerance: float | None = option(
        None,
        "root mean square over surface and solves that the modes may miss, in the field's unit; left out: half a "
        "percent of the field's own",
        least=0,
    )
    modes_max: int = option(60, "most modes, however much they miss", least=1)
    moving: bool = option(True, "take out a part that travels with the probe first")
    amplitude: str = option(
        "auto",
        'growth of the field with depth; "auto" compares all by what is missed of solves left out',
        choices=("auto", "linear", "hertz", "square", "series"),
    )
    length: float | None = option(
        None, 'crossing length a of the amplitude "series"; left out: a tenth of the radius', "m", above=0
    )
    units_max: int = option(
        36, "most units of the small network, which is searched beside a unit at every solve", least=0
    )


@_with_documentation
@dataclass(frozen=True)
class FitOptions(SearchOptions):
    """Options of fitting a network to arrays."""

    effort: float = option(
        0.02,
        "work of the search: the default gives a first answer in about a second and says what more may bring; 1 tries "
        "more kinds of networks, for half a minute on one core at most, a minute for more than 10,000 samples. The "
        "result depends on it, never on the machine",
        above=0,
    )
    seconds: float | None = option(
        None,
        "limit on time; left out: none. With the default effort as much work is planned as it allows, and what still "
        "takes longer is left out: the result then depends on the machine",
        "s",
        above=0,
    )
    workers: int = option(
        1,
        "processes that refine networks, and threads that add up many samples; the result is the same with any number",
        least=1,
    )
    seed: int = option(0, "decides everything that is drawn", least=0)
    target: float | None = option(
        None,
        "error on held-out samples, relative to the outputs' standard deviation, that is good enough",
        above=0,
        flag="none",
    )
    level: float = option(0.9, "share of unseen samples that the intervals are to hold", above=0, below=1)


@_with_documentation
@dataclass(frozen=True)
class Refinement(Options):
    """Settings of the refinement of what the sequential filter has found."""

    samples: int = option(26, "solves used for refinement; 0: all training solves", least=0)
    units_max: int = option(6, "most units per network", least=0)
    target: float = option(
        5e-7, "leave-one-out error at which growth stops, over the outputs' largest deviation", least=0
    )
    starts: int = option(4, "starts per number of units", least=1)


@_with_documentation
@dataclass(frozen=True)
class StopOptions(Options):
    """When an improvement ends."""

    until: float = option(
        0.02,
        "wanted force error at the 95th percentile of unseen solves, such as 0.02 for 2 %",
        above=0,
        below=1,
    )
    limit: float = option(
        math.inf,
        "time after which no further batch of solves begins; left out: none",
        "s",
        least=0,
        infinite=True,
    )
    most: int = option(400, "solves to learn from after which no further batch begins", least=1)


@_with_documentation
@dataclass(frozen=True)
class ImprovementOptions(StopOptions):
    """Options of an improvement: when it ends, how solves are chosen, and where they are solved."""

    rule: str = option(
        "variance",
        "choice of the next solves; the last three are there to compare with",
        choices=("variance", "disagreement", "farthest", "sobol"),
    )
    seed: int = option(0, "decides the first places and the candidates", least=0)
    batch: int | None = option(
        None, "solves of a batch; left out: a multiple of the workers between 4 and 8", least=1
    )
    workers: int | None = option(None, "processes that solve and search; left out: one per core", least=1)
    case_limit: float = option(CASE_LIMIT, "time after which a single solve has failed", "s", above=0)


@_with_documentation
@dataclass(frozen=True)
class Discrepancy(Options):
    """Standard deviations of what a specimen differs by from the model."""

    constant: float = option(
        0.5,
        "uncertainty σ_c of the stiffness of the whole body, as a natural logarithm (one standard deviation)",
        least=0,
    )
    varying: float = option(
        0.3,
        "uncertainty σ_v of the stiffness from place to place, as a natural logarithm (one standard deviation)",
        least=0,
    )
    length: float = option(
        0.5, "length L over which the stiffness varies, in halves of the inputs' ranges", above=0, flag="none"
    )
    offset: float = option(
        5e-4,
        "uncertainty σ_o of the height of the surface (one standard deviation); 0 where it is known",
        "m",
        least=0,
    )
    units: int = option(
        64, "broad units that are added at most; they make each answer slower", least=0, flag="none"
    )


@_with_documentation
@dataclass(frozen=True)
class Noise(Options):
    """Standard deviations of one measured component of a force."""

    absolute: float = option(
        0.005,
        "noise σ_a of a measured force component (one standard deviation)",
        "N",
        above=0,
        flag="--noise",
    )
    relative: float = option(
        0.01, "noise σ_r of a measured force, as a share of its size (one standard deviation)", least=0
    )
    position: float = option(
        0.0,
        "noise σ_x of each coordinate of the measured position (one standard deviation), by way of the stiffness",
        "m",
        least=0,
        flag="--jitter",
    )


@_with_documentation
@dataclass(frozen=True)
class PartOptions(Options):
    """Choices for a part that somebody has."""

    unit: str | None = option(
        None, "unit of the file's numbers. Default: mm, or m where only that fits; else it is asked"
    )
    material: str | None = option(
        None,
        "tissue or other material by name, such as liver, muscle or 'ecoflex 00-30'. Default: an own one",
        flag="--material --tissue",
    )
    young: float | None = option(None, "Young's modulus. Default: 10 kPa", "Pa", bare=False)
    poisson: float | None = option(None, "Poisson's ratio. Default: 0.45")
    labels: str | None = option(
        None,
        "tissues of a scan by their numbers, such as fat=1,gland=2,skin=3. Default: all numbers but 0",
    )
    materials: str | None = option(
        None,
        "material of each region: a name, Young's modulus, or a range of it to be set while it is touched, such as "
        "'fat=fat,gland=12 kPa,lump=5 kPa..30 kPa'. Default: a tissue of the region's name, else --material",
    )
    up: str | None = option(
        None,
        "direction of a scan's patient that points up: superior, anterior and so on. Default: superior",
    )
    radius: float | None = option(
        None, "radius of the ball. Default: by the part's size", "m", above=0, bare=False
    )
    depth: float | None = option(
        None,
        "largest depth of the ball. Default: three quarters of its radius, at most a quarter of the thickness beneath",
        "m",
        above=0,
        bare=False,
    )
    element: str | None = option(
        None,
        "size of elements under the ball, such as 3 mm; or auto: smaller ones where finer solves show that it pays. "
        "Default: by the part's size",
    )
    tool: str | None = option(
        None,
        "what presses: ball, sphere, capsule, cylinder, punch, cone, box or fingertip, with sizes, such as "
        "'punch, radius 6 mm, edge 2 mm'. Default: a ball",
    )
    held: tuple[str, ...] = option(
        (), "surface of the file that is held. Several times. Default: what it stands on"
    )
    touched: str | None = option(None, "surface of the file that is touched. Default: what faces up")
    wrap: float | None = option(
        None,
        "size by which a closed surface is laid around one that cuts itself or has holes. Default: none",
        "m",
        above=0,
        bare=False,
    )
    name: str | None = option(None, "name of the study and of its files. Default: that of the part")
