"""`palpate ask`: print the content of a learnt file, or its answers at given places."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.cli.answer_at_place import Answer, Deflection, outside, surrogate_answers
from palpate.cli.console import Console
from palpate.errors import UsageError
from palpate.format import count
from palpate.learning.loading import load, surrogate_of
from palpate.number_text import number_list
from palpate.runtime.touchable import touchable
from palpate.surrogates import LearntEnergy, Surrogate
from palpate.surrogates.fields.node_field import NodeField
from palpate.surrogates.training_record import correction_warning
from palpate.tools import Gripper
from palpate.units import Range, parse_quantity

__all__ = ["answers_at", "ask", "deflections", "inputs_of"]

_STEPS = 16  # steps along a way, in a radius
_NOUNS = {
    "Surrogate": "A learnt body",
    "Fitted": "A network of data, with intervals",
    "Network": "A network of data",
    "Dataset": "Load histories",
}


def ask(model: Path, at: Sequence[str], console: Console) -> None:
    """Print the content of a file, or with places its answers there."""
    contents = load(model)
    what, inputs = type(contents).__name__, inputs_of(contents)
    if not at:
        ranges = [asdict(r) for r in inputs]
        content = {"model": str(model), "kind": what, "inputs": ranges, "text": str(contents)}
        warning = _warning(contents)
        felt = getattr(contents, "can_be_touched", True)
        noun = _NOUNS.get(what, what) if felt else "A surrogate of numbers and fields"
        line = _line_under_loads(contents)
        asked = inputs if line is None else line.inputs  # a beam is asked by its loads
        file, example = shlex.quote(str(model)), ",".join(f"{(r.low + r.high) / 2:.4g}" for r in asked)
        names = ", ".join(f"{r.name} in {r.unit}" if r.unit else r.name for r in asked)
        ways = [
            f"ask it   palpate ask {file} --at {example}   # {names}",
            f"record   palpate card {file}   # where it comes from, how good it is",
        ] * bool(asked)
        text = "\n".join([f"{noun} in {model}\n{contents}", *warning, *ways])
        console.result(text, content | _as_field(warning))
        return
    line = _line_under_loads(contents)
    if line is not None:
        inputs = line.inputs
        answers: Sequence[Any] = deflections(line, _places(at, inputs))
        words = [one.words(inputs) for one in answers]
    else:
        surrogate = surrogate_of(contents, model.stem)
        answer = answers_at if surrogate.can_be_touched else surrogate_answers
        answers = answer(surrogate, _places(at, inputs))
        words = [one.words(inputs) for one in answers]
        words += _reservations(surrogate) if surrogate.can_be_touched else []
    content = {"model": str(model), "answers": [one.as_dict(inputs) for one in answers]}
    console.result("\n".join(words), content | _as_field(_warning(contents)))


def _line_under_loads(contents: Any) -> NodeField | None:
    """Return the displacement of a beam that answers to its loads alone; None of anything else."""
    shown = getattr(contents, "line", None)
    return shown if shown is not None and shown.asked_by == "load" and contents.memory is None else None


def deflections(line: NodeField, X: np.ndarray) -> list[Deflection]:
    """Return the displacement of the nodes of interest under loads X (N, n) in N."""
    chosen = line.of_interest if len(line.of_interest) else np.arange(len(line.points))
    return [Deflection(x, line.points[chosen], u[chosen]) for x, u in zip(X, line.values(X), strict=True)]


def inputs_of(asked: Any) -> tuple[Range, ...]:
    """Return the ranges of the n inputs; none of histories."""
    return tuple(getattr(getattr(asked, "network", asked), "inputs", ()))


def answers_at(body: Surrogate, X: np.ndarray) -> list[Answer]:
    """Return the answers of a body that is pressed or gripped, at inputs X (N, n)."""
    energy: LearntEnergy = body.hand_energy
    if (tool := getattr(energy.baseline, "posed_tool", None)) is not None:
        tool.require_trained(X)
    known = energy.deviation(X) if energy.root is not None else np.full(len(X), math.nan)
    forces = energy.force(X)
    # a deviation is of what is like the training, and says nothing beyond it; that nothing is touched is exact
    known[outside(X, energy.inputs).any(axis=1) & forces.any(axis=1)] = math.nan
    columns = energy.energy(X), forces, energy.stiffness(X), known, energy.inside(X)
    answers = [
        Answer(x, float(U), F, K, float(d), bool(i)) for x, U, F, K, d, i in zip(X, *columns, strict=True)
    ]
    if body.torque_evaluator is not None:
        answers = [replace(one, torque=t) for one, t in zip(answers, body.torque(X), strict=True)]
    if isinstance(tool, Gripper):
        efforts = body.effort(X).tolist()
        answers = [replace(one, effort=effort) for one, effort in zip(answers, efforts, strict=True)]
    if energy.baseline.surface is None:
        return answers
    let_go, end = _let_go(body, X), energy.baseline.inner
    return [one.ended(end) if gone else one for one, gone in zip(answers, let_go, strict=True)]


def _let_go(surrogate: Surrogate, X: np.ndarray) -> list[bool]:
    """Return whether the loop would let go of a probe (N,) at inputs X (N, n), so that no force is known there.

    One that feels nothing is led out along the body's normal: from beneath the touched surface it meets that from
    behind, and the body lets go of it; from the air it meets nothing, or a front.
    """
    body = touchable(surrogate)
    assert body.surface is not None
    loop, (low, high) = body.evaluator(few=True), body.surface.box
    far = float(np.linalg.norm(high - low))
    ways = np.linspace(0.0, far, max(2, int(_STEPS * far / body.surface.radius)))
    gone = []
    for x in X:
        loop(body.away, x[3:])  # every probe begins in the air
        for way in ways:
            loop(x[:3] + way * body.normal, x[3:])
            if loop.depth > 0.0 or loop.let_go:
                break
        gone.append(loop.let_go)
    return gone


def _reservations(body: Surrogate) -> list[str]:
    instant = "This is the elastic answer, that of an instant: the body remembers, which `palpate run` shows."
    return [instant] * (body.memory is not None) + _warning(body)


def _warning(asked: Any) -> list[str]:
    warning = correction_warning(asked.meta) if isinstance(asked, Surrogate) else ""
    return [f"Its correction was warned of: {warning}"] if warning else []


def _as_field(warning: list[str]) -> dict[str, str]:
    return {"warning": warning[0]} if warning else {}


def _places(texts: Sequence[str], inputs: Sequence[Range]) -> np.ndarray:
    return np.array([_place(text, inputs) for text in texts])


def _place(text: str, inputs: Sequence[Range]) -> list[float]:
    """Return numbers with commas or blanks between them, as many as there are inputs; units may stand with them."""
    words = number_list(text)
    problem = f"The text says {count(len(words), 'number')}."
    if len(words) == len(inputs):
        try:
            return [
                parse_quantity(word, r.unit, r.name, bare=True) for word, r in zip(words, inputs, strict=True)
            ]
        except UsageError as error:
            problem = " ".join(str(error).split("\n"))
    names = ", ".join(f"{r.name} ({r.unit})" if r.unit else r.name for r in inputs)
    example = ",".join(f"{(r.low + r.high) / 2:.4g}" for r in inputs)
    raise UsageError(
        f"{text!r} is no place of this model.",
        why=f"It has {count(len(inputs), 'input')}: {names}. {problem}",
        fix=f"Give {count(len(inputs), 'number')}, for example --at {example}; commas stand between several.",
    )
