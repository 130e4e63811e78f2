"""Options of the command line that are numbers: read by palpate's own grammar, and refused in its own sentences.

Typer by itself reads "1_0" as 10, takes nan and inf, and doesn't know a decimal comma.
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer

from palpate.errors import UsageError
from palpate.number_text import whole_number
from palpate.options import Options, declarations

__all__ = ["count_option", "declared_option", "number_option", "with_options"]

_KEYWORD = inspect.Parameter.KEYWORD_ONLY
_ENDS = {
    "least": ("≥", operator.ge),
    "above": (">", operator.gt),
    "most": ("≤", operator.le),
    "below": ("<", operator.lt),
}


def number_option(name: str, unit: str = "", *, help: str, bare: bool = True, **ends: float | None) -> Any:
    """Return the declaration of an option that is a number, such as "--seconds".

    A number that stands alone is in the SI unit, "" for a pure number, unless `bare` is false; `ends` are those that
    `checks.fits` takes.
    """

    def read(text: str) -> float:
        from palpate.units import parse_quantity  # imports NumPy, which the help needs not

        return parse_quantity(text, unit, name, bare=bare)

    return _option(name, read, "NUMBER", unit, ends, help)


def count_option(name: str, *, help: str, **ends: float | None) -> Any:
    """Return the declaration of an option that is a whole number; `ends` are those that `checks.fits` takes."""

    def read(text: str) -> int:
        try:
            return whole_number(text)
        except UsageError as error:
            raise UsageError(f"{name}: {error.what}", why=error.why, fix=error.fix) from error

    return _option(name, read, "COUNT", "", ends, help)


def _option(
    name: str,
    read: Callable[[str], float],
    kind: str,
    unit: str,
    ends: Mapping[str, float | None],
    help: str,
) -> Any:
    rules = [(*_ENDS[end], bound) for end, bound in ends.items() if bound is not None]
    limits = [f"{sign} {bound:g}" for sign, _, bound in rules]

    def parse(text: Any) -> Any:
        value = read(text) if isinstance(text, str) else text  # older Typers hand over the default, too
        if value is None or all(is_within(value, bound) for _, is_within, bound in rules):
            return value
        raise UsageError(
            f"{name}: {text} is out of range.", fix=f"Give {' and '.join(limits)} {unit}".rstrip() + "."
        )

    return typer.Option(
        name, parser=parse, metavar=f"{kind} ({', '.join(limits)})" if limits else kind, help=help
    )


def declared_option(record: type[Options], field: str, help: str = "") -> Any:
    """Return the declaration of a command's option by that in a record of options; a `help` says it otherwise."""
    declaration = declarations(record)[field]
    names, text = (declaration.flag or f"--{field}".replace("_", "-")).split(), help or declaration.sentence
    if declaration.kind.startswith("float"):
        return number_option(names[0], declaration.unit, help=text, bare=declaration.bare, **declaration.ends)
    is_count = declaration.kind.startswith("int")
    return (
        count_option(names[0], help=text, **declaration.ends) if is_count else typer.Option(*names, help=text)
    )


def _parameters(source: Any) -> list[inspect.Parameter]:
    """Return the options of a command that a record of options makes, or a function whose parameters are options."""
    if not (isinstance(source, type) and issubclass(source, Options)):
        return list(inspect.signature(source, eval_str=True).parameters.values())
    kinds: dict[str, Any] = {"float": float, "int": int, "str": str, "tuple": list[str]}
    parameters = []
    for name, declaration in declarations(source).items():
        if declaration.flag != "none":
            default = None if declaration.default == () else declaration.default
            kind = next(known for word, known in kinds.items() if declaration.kind.startswith(word))
            kind = kind | None if default is None else kind
            wanted = Annotated[kind, declared_option(source, name)]  # type: ignore[valid-type]
            parameters.append(inspect.Parameter(name, _KEYWORD, default=default, annotation=wanted))
    return parameters


def with_options(**groups: Any) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator of commands: in place of a parameter the command has the options that make its value.

    For each parameter that stands for several options a group names a record of options, or a function of them.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        options = {name: _parameters(source) for name, source in groups.items()}
        own = inspect.signature(command, eval_str=True).parameters.values()
        parameters = [p for argument in own for p in options.get(argument.name, [argument])]
        parameters = [p.replace(kind=_KEYWORD) for p in parameters]

        @functools.wraps(command)
        def run(**arguments: Any) -> None:
            for name, source in groups.items():
                values = {p.name: arguments.pop(p.name) for p in options[name]}
                given = {key: value for key, value in values.items() if value is not None}
                arguments[name] = source(
                    **{
                        key: tuple(value) if isinstance(value, list) else value
                        for key, value in given.items()
                    }
                )
            command(**arguments)

        run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return run

    return decorate
