"""Lines with which a command that judges a surrogate ends: at most eight, or every figure with --verbose."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.cli.console import Console
from palpate.errors import AccuracyError

if TYPE_CHECKING:
    from palpate.validation import Validation

__all__ = ["raise_misses", "verdict_text"]


def verdict_text(
    validations: Sequence[Validation], console: Console, *, report: Path | None, next_step: str = ""
) -> str:
    """Return the verdicts on one or more surrogates, the report's file and the next command as text.

    Of several surrogates each has one line, and what is to be heeded of them follows once.
    """
    from palpate.validation.verdict import verdict

    if console.verbose:
        lines = "\n\n".join(map(str, validations)).splitlines()
    elif len(validations) == 1:
        lines = verdict(validations[0])
    else:
        each = [verdict(validation) for validation in validations]
        cautions = [line for _, _, *rest in each for line in rest]
        lines = [*(f"{outcome}; {error}" for outcome, error, *_ in each), *dict.fromkeys(cautions)]
    if report is not None:
        lines.append(
            f"report  {report}" + ("" if console.verbose else "   (worst cases too, or --verbose here)")
        )
    return "\n".join([*lines, *([f"next    {next_step}"] if next_step else [])])


def raise_misses(validation: Validation, console: Console, fix: str = "") -> None:
    """Raise an `AccuracyError` where a limit is missed, with the advice of the limits or a `fix` of its own.

    What was missed stands in the verdict; with --verbose the error says it with the worst cases.
    """
    try:
        validation.raise_if_failed()
    except AccuracyError as error:
        raise AccuracyError(
            error.what, why=error.why if console.verbose else "", fix=fix or error.fix
        ) from None
