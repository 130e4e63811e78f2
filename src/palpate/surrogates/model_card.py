"""The model card of a learnt file: what it was made from, by whom, how good it is, and where it must not be trusted.

The idea of a card is of Mitchell et al. (2019, Model cards for model reporting, FAT* 2019). Everything here comes from
the file itself; what the file does not say is written as "not stated".
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.format import share
from palpate.units import Range

__all__ = ["FORMAT_VERSION", "NOT_STATED", "ModelCard", "card_of"]

FORMAT_VERSION = 1
NOT_STATED = "not stated"
_RELATIVE = ("error", "RMSE", "percentile", "median", "p95")  # figures that are shares


@dataclass(frozen=True)
class ModelCard:
    """The card of a learnt body or network.

    Attributes
    ----------
    name : str
        Name of the body.
    kind : str
        What it is, in words.
    author, licence : str
        Who made it, and under which licence (an SPDX identifier, such as ``CC-BY-4.0``); "not stated" where the file
        does not say.
    answers : mapping
        Inputs with trained ranges and units, and what is answered.
    trained_on : mapping
        Body, solves, design, seed, versions, date, and the hashes of dataset and configuration.
    errors : mapping
        Figures on solves that were not learnt from, and by leaving out.
    limits : tuple of str
        Sentences on where the answers hold and what happens beyond.
    warnings : tuple of str
        What was suspicious in the making.
    hashes : mapping of name to str
        SHA-256 of the file, of the dataset and of the configuration, where they are known.
    """

    name: str
    kind: str
    author: str
    licence: str
    answers: Mapping[str, Any]
    trained_on: Mapping[str, Any]
    errors: Mapping[str, Any]
    limits: tuple[str, ...]
    warnings: tuple[str, ...]
    hashes: Mapping[str, str]

    def with_hash(self, name: str, sha256: str) -> ModelCard:
        """Return the card with a further hash, such as that of the weights that an export writes."""
        return replace(self, hashes={**self.hashes, name: sha256})

    def as_dict(self) -> dict[str, Any]:
        """Return the card as plain data for JSON."""
        return {
            "format": "palpate model card",
            "version": FORMAT_VERSION,
            "name": self.name,
            "kind": self.kind,
            "author": self.author,
            "licence": self.licence,
            "answers": dict(self.answers),
            "trained_on": dict(self.trained_on),
            "errors": dict(self.errors),
            "limits": list(self.limits),
            "warnings": list(self.warnings),
            "hashes": dict(self.hashes),
        }

    def in_words(self) -> dict[str, Any]:
        """Return the card for people: titles and what stands under them, sentences as lists and figures as words."""
        words: dict[str, Any] = {"author": self.author, "licence": self.licence}
        for title, part in (("errors", self.errors), ("trained on", self.trained_on)):
            words[title] = {name: _plain(name, value) for name, value in _flat(part)}
        words |= {"limits": list(self.limits), "warnings": list(self.warnings), "SHA-256": dict(self.hashes)}
        return {title: part for title, part in words.items() if part}

    def to_json(self) -> str:
        """Return the card as JSON."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False)

    def to_markdown(self) -> str:
        """Return the card as Markdown."""
        lines = [f"# Model card: {_escaped(self.name)}", "", _escaped(self.kind), ""]
        lines += [f"- Author: {_escaped(self.author)}", f"- Licence: {_escaped(self.licence)}", ""]
        lines += ["## Inputs", "", "| input | trained from | to | unit |", "|---|--:|--:|---|"]
        lines += [
            f"| {_escaped(r['name'])} | {r['low']:.6g} | {r['high']:.6g} | {_escaped(r['unit']) or '–'} |"
            for r in self.answers["inputs"]
        ]
        lines += ["", "Answers: " + "; ".join(map(_escaped, self.answers["outputs"])) + ".", ""]
        for title, part in (("Trained on", self.trained_on), ("Errors", self.errors)):
            lines += [f"## {title}", ""]
            lines += [f"- {name}: {_words(name, value)}" for name, value in _flat(part)] or [
                f"- {NOT_STATED}"
            ]
            lines += [""]
        for title, sentences in (("Limits", self.limits), ("Warnings", self.warnings)):
            if sentences:
                lines += [f"## {title}", "", *(f"- {_escaped(sentence)}" for sentence in sentences), ""]
        lines += ["## Hashes (SHA-256)", "", *(f"- {name}: `{value}`" for name, value in self.hashes.items())]
        return "\n".join(lines).rstrip() + "\n"

    __str__ = to_markdown


def card_of(model: Any, file: str | os.PathLike[str] | None = None) -> ModelCard:
    """Return the card of a learnt body, a network, or what `palpate.fit` made.

    Parameters
    ----------
    model : Surrogate, Network or Fitted
        The learnt value.
    file : path, optional
        Its file, whose SHA-256 goes into the card.
    """
    meta: Mapping[str, Any] = getattr(model, "meta", None) or {}
    network = getattr(model, "network", model)
    energy = getattr(model, "energy", None)
    stated = meta.get("card", {}) if isinstance(meta.get("card"), Mapping) else {}
    origin = meta.get("dataset", {}) if isinstance(meta.get("dataset"), Mapping) else {}
    provenance = origin.get("provenance", {}) if isinstance(origin.get("provenance"), Mapping) else {}
    hashes = {
        "file": None if file is None else hashlib.sha256(Path(file).read_bytes()).hexdigest(),
        "dataset": origin.get("hash") or meta.get("training", {}).get("hash"),
        "configuration": provenance.get("config_hash"),
    }
    inputs: Sequence[Range] = network.inputs if energy is None else model.inputs
    outputs = (
        [f"{q.name} ({q.unit or '1'})" for q in network.outputs]
        if energy is None
        else [
            "energy (J), force (N), stiffness (N/m)",
            *(f"{n} ({f.unit or '1'})" for n, f in model.fields.items()),
        ]
    )
    return ModelCard(
        name=str(meta.get("name") or (Path(file).stem if file else "model")),
        kind=str(model).splitlines()[0],
        author=str(stated.get("author") or NOT_STATED),
        licence=str(stated.get("licence") or NOT_STATED),
        answers={
            "inputs": [{"name": r.name, "low": r.low, "high": r.high, "unit": r.unit} for r in inputs],
            "outputs": outputs,
        },
        trained_on=_training_of(meta, provenance),
        errors=_errors_of(meta),
        limits=tuple(_limits_of(model, meta)),
        warnings=tuple(_warnings_of(meta)),
        hashes={name: str(value) for name, value in hashes.items() if value},
    )


def _training_of(meta: Mapping[str, Any], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the file says of its making."""
    problem = provenance.get("problem", {}) if isinstance(provenance.get("problem"), Mapping) else {}
    training = {
        "body": problem.get("body") or provenance.get("words"),
        "acting on it": problem.get("interactions") or problem.get("loads"),
        "solves": meta.get("solves"),
        "samples": meta.get("samples") or meta.get("training", {}).get("samples"),
        "design": provenance.get("design"),
        "seed": provenance.get("seed"),
        "solved": provenance.get("created"),
        "versions": provenance.get("versions"),
        "machine": provenance.get("machine"),
        "corrected by touches": (meta.get("correction") or {}).get("counts", {}).get("learnt"),
    }
    return {name: value for name, value in training.items() if value not in (None, "", {}, [])}


def _errors_of(meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return figures on unseen solves and by leaving out."""
    errors = {
        "unseen solves": meta.get("validation"),
        "solves left out in turn, relative force error": meta.get("left_out"),
        "corrected body, relative force error": (meta.get("correction") or {}).get("force_error"),
    }
    return {name: value for name, value in errors.items() if value not in (None, {}, [])}


def _limits_of(model: Any, meta: Mapping[str, Any]) -> list[str]:
    """Return sentences on where the answers hold."""
    energy, memory = getattr(model, "energy", None), getattr(model, "memory", None)
    limits = [
        "The answers hold between the trained ends of every input; elsewhere they are continued and marked."
    ]
    if energy is None:
        limits = ["The answers hold between the trained ends of every input; beyond, they are extrapolated."]
    else:
        deepest = float(energy.going.deepest)
        if 0 < deepest < 1e3:
            limits.append(f"The deepest trained press is {1e3 * deepest:.3g} mm; deeper, the body lets go.")
        known = "say" if energy.root is not None else "do not say"
        limits.append(f"The answers {known} how far the force may be off from place to place.")
        remembers = "Elastic: a force depends on the place alone, not on what came before."
        limits.append(remembers if memory is None else f"It remembers: {memory}.")
    runtime = meta.get("runtime", {}) if isinstance(meta.get("runtime"), Mapping) else {}
    if runtime.get("max_force"):
        limits.append(
            f"Forces on a hand are limited to {runtime['max_force']:g} N, at {runtime.get('rate', 1000):g} Hz."
        )
    limits.append(
        "It is as true as the finite-element model that it was learnt from; it is no medical device."
    )
    return limits


def _warnings_of(meta: Mapping[str, Any]) -> list[str]:
    warnings = []
    if (meta.get("correction") or {}).get("warning"):
        warnings.append(str(meta["correction"]["warning"]))
    validation = meta.get("validation")
    if validation is None:
        warnings.append("It was not checked on solves that it has not seen, or the file does not say so.")
    elif isinstance(validation, Mapping) and validation.get("limits kept") is False:
        warnings.append("It misses a limit on unseen solves: see the errors.")
    return warnings


def _flat(part: Mapping[str, Any], path: str = "") -> list[tuple[str, Any]]:
    """Return names and plain values of nested data; lists as compact JSON."""
    rows: list[tuple[str, Any]] = []
    for name, value in part.items():
        where = f"{path}, {name}" if path else str(name)
        if isinstance(value, Mapping):
            rows += _flat(value, where)
        elif value not in (None, "", []):
            rows.append((where, value))
    return rows


def _plain(name: str, value: Any) -> str:
    """Return a value of the card in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return share(value) if any(word in name for word in _RELATIVE) else f"{value:.6g}"
    if isinstance(value, list | tuple):
        return json.dumps(value, ensure_ascii=False)[:400]
    return str(value)


def _words(name: str, value: Any) -> str:
    """Return a value of the card in words, as Markdown takes them."""
    words = _plain(name, value)
    return f"`{words.replace('`', chr(39))}`" if isinstance(value, list | tuple) else _escaped(words)


def _escaped(text: str) -> str:
    """Return text that Markdown and HTML take as it stands."""
    for mark in ("\\", "`", "*", "_", "[", "]", "<", ">", "|", "#"):
        text = text.replace(mark, f"\\{mark}" if mark not in "<>" else {"<": "&lt;", ">": "&gt;"}[mark])
    return text.replace("\n", " ")
