"""The model card of a learnt file: what it was made from, by whom, how good it is, and where it must not be trusted.

The idea of a card is of Mitchell et al. (2019, Model cards for model reporting, FAT* 2019). Everything here comes from
the file itself; what the file does not say is written as "not stated".
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.format import count, millimetres, share
from palpate.input_words import input_in_words
from palpate.surrogates.card_text import bullets, escape_markdown, html_page, html_record, rows
from palpate.surrogates.motion import motion_sentence
from palpate.surrogates.rigid_ball import pad_part_of
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.surrogates.surrogate import Surrogate

__all__ = ["FORMAT_VERSION", "NOT_STATED", "ModelCard", "card_of", "suspect_sentences"]

FORMAT_VERSION = 1  # version of the card's own layout
NOT_STATED = "not stated"
QUASI_STATIC = (
    "Quasi-static: each answer is a static equilibrium, without mass or inertia. A simulation that couples the body "
    "gives mass and damping to what touches it, and no vibration or impact of the body itself is in the force."
)

_DATA_LIMITS = (
    "The answers hold between the trained ends of every input, where samples lie; beyond, they are extrapolated.",
    "It is as true as the samples that it was learnt from, and repeats their errors; it is no medical device.",
)
_LEVEL = "share of unseen samples that an interval is made to hold"


@dataclass(frozen=True)
class ModelCard:
    """The card of a learnt body or network."""

    name: str  # name of the body
    kind: str  # what it is, in words
    author: str  # who made it; "not stated" where the file does not say
    licence: str  # SPDX identifier, such as CC-BY-4.0; "not stated" where the file does not say
    answers: Mapping[str, Any]  # inputs with trained ranges and units, and what is answered
    trained_on: Mapping[str, Any]  # body, solves, design, seed, versions, date, hashes of data
    errors: Mapping[str, Any]  # figures on solves that were not learnt from, and by leaving out
    limits: tuple[str, ...]  # sentences on where the answers hold and what happens beyond
    warnings: tuple[str, ...]  # what was suspicious in the making
    hashes: Mapping[str, str]  # SHA-256 of file, dataset and configuration, where they are known

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
            words[title] = rows(part)
        words |= {"limits": list(self.limits), "warnings": list(self.warnings), "SHA-256": dict(self.hashes)}
        return {title: part for title, part in words.items() if part}

    def to_json(self) -> str:
        """Return the card as JSON."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False)

    def to_markdown(self) -> str:
        """Return the card as Markdown."""
        return self._page(escape_markdown)

    def to_html(self) -> str:
        """Return the card as one HTML page."""
        return html_page(f"Model card: {self.name}", self._repr_html_())

    def _repr_html_(self) -> str:
        """Return the card as a part of a page, as a notebook shows it."""
        answers = self.answers
        inputs = [
            (_input_label(r), f"{r['low']:.6g} to {r['high']:.6g} {r['unit']}".strip())
            for r in answers["inputs"]
        ]
        parts = {
            "inputs": dict(inputs),
            "answers": answers["outputs"],
            "inside": answers["inside"],
            **self.in_words(),
        }
        return html_record(self.name, self.kind, parts)

    def __str__(self) -> str:
        return self._page(str)

    def _page(self, escape: Callable[[str], str]) -> str:
        """Return the card's headings, bullets and table, each text of the file escaped."""
        lines = [f"# Model card: {escape(self.name)}", "", escape(self.kind), ""]
        lines += [f"- Author: {escape(self.author)}", f"- Licence: {escape(self.licence)}", ""]
        lines += ["## Inputs", "", "| input | trained from | to | unit |", "|---|--:|--:|---|"]
        lines += [
            f"| {escape(_input_label(r))} | {r['low']:.6g} | {r['high']:.6g} | {escape(r['unit']) or '–'} |"
            for r in self.answers["inputs"]
        ]
        lines += ["", "Answers: " + "; ".join(map(escape, self.answers["outputs"])) + ".", ""]
        lines += [f"Inside: {escape(self.answers['inside'])}.", ""]
        for title, part in (("Trained on", self.trained_on), ("Errors", self.errors)):
            lines += [f"## {title}", "", *(bullets(part, escape) or [f"- {NOT_STATED}"]), ""]
        for title, sentences in (("Limits", self.limits), ("Warnings", self.warnings)):
            if sentences:
                lines += [f"## {title}", "", *(f"- {escape(sentence)}" for sentence in sentences), ""]
        lines += ["## Hashes (SHA-256)", "", *(f"- {name}: `{value}`" for name, value in self.hashes.items())]
        return "\n".join(lines).rstrip() + "\n"


def _input_label(entry: Mapping[str, Any]) -> str:
    """Return an input's words, and its name where that is a symbol."""
    name = str(entry["name"])
    words = input_in_words(name)
    return name if words == name else f"{words} ({name})"


def card_of(surrogate: Surrogate, file: str | os.PathLike[str] | None = None) -> ModelCard:
    """Return the card of a surrogate; the SHA-256 of its file, if that is given, goes into the card."""
    meta = _record(surrogate.meta)
    origin = _record(meta.get("dataset"))
    provenance = _record(origin.get("provenance"))
    hashes = {
        "file": None if file is None else hashlib.sha256(Path(file).read_bytes()).hexdigest(),
        "dataset": origin.get("hash") or _record(meta.get("training")).get("hash"),
        "configuration": provenance.get("config_hash"),
    }
    parts = (_of_body if surrogate.can_be_touched else _of_answers)(surrogate, meta)
    inputs: Sequence[Range] = parts.pop("inputs")
    answers = {
        "inputs": [asdict(r) for r in inputs],
        "outputs": parts.pop("outputs"),
        "inside": parts.pop("inside"),
    }
    stated = _record(meta.get("card"))
    return ModelCard(
        name=str(meta.get("name") or (Path(file).stem if file else "model")),
        author=str(stated.get("author") or NOT_STATED),
        licence=str(stated.get("licence") or NOT_STATED),
        answers=answers,
        trained_on=_drop_empty({**_training_of(meta, provenance), **parts.pop("trained_on")}),
        hashes={name: str(value) for name, value in hashes.items() if value},
        **parts,
    )


def _of_body(body: Surrogate, meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the card of a learnt body says that no network's does."""
    correction = _record(meta.get("correction"))
    errors: dict[str, Any] = {
        "unseen solves": meta.get("validation"),
        "solves left out in turn, relative force error": meta.get("left_out"),
        "corrected body, relative force error": correction.get("force_error"),
        "lumps, contrast error of presses left out": {}
        if body.lumps is None
        else body.lumps.meta.get("contrast_error"),
    }
    warnings = [str(correction["warning"])] if correction.get("warning") else []
    validation = meta.get("validation")
    if validation is None:
        warnings.append("It was not checked on solves that it has not seen, or the file does not say so.")
    elif _record(validation).get("limits kept") is False:
        warnings.append("It misses a limit on unseen solves: see the errors.")
    if caution := _record(validation).get("caution"):
        warnings.append(str(caution))
        errors["unseen solves"] = {k: v for k, v in _record(validation).items() if k != "caution"}
    warnings += suspect_sentences(meta.get("suspects", ()))
    return {
        "kind": f"A learnt body: {body.purpose}.",
        "inputs": body.inputs,
        "outputs": [
            "energy (J), force (N), stiffness (N/m)",
            *(["torque (N m) about the tool's place"] if body.torque_evaluator is not None else []),
            *(f"{n} ({f.unit or '1'})" for n, f in body.fields.items()),
        ],
        "inside": str(body.energy),
        "trained_on": {
            "corrected by touches": _record(correction.get("counts")).get("learnt"),
            **_record(meta.get("painted")),
            "rows of the dataset left out on request": ", ".join(map(str, meta.get("excluded", ()))),
        },
        "errors": _drop_empty(errors),
        "limits": tuple(_limits_of(body, meta)),
        "warnings": tuple(warnings),
    }


def suspect_sentences(suspects: Sequence[Any]) -> list[str]:
    """Return sentences on solves that contradict their neighbours, records or mappings of them."""
    entries = [one if isinstance(one, Mapping) else vars(one) for one in suspects]
    sentences = [
        f"Solve {one['solve']} contradicts its neighbours: its energy is {one['energy']:.2g} times what they say, its "
        f"force is off by {share(one['force'])}."
        for one in entries
    ]
    if sentences:
        options = " ".join(f"--leave-out {one['solve']}" for one in entries)
        sentences.append(f"Solve again, or learn without: palpate learn {options}.")
    return sentences


def _of_answers(surrogate: Surrogate, meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the card of a surrogate that no hand feels says of its numbers and fields."""
    choice, validation = _record(meta.get("choice")), meta.get("validation")
    errors = {
        "unseen solves": validation,
        "solves left out in turn": meta.get("left_out"),
        "error on samples held out, relative to the outputs' spread": choice.get("heldout"),
        _LEVEL: choice.get("level"),
    }
    warnings = [str(note) for note in choice.get("notes", ())]
    if not _drop_empty({name: value for name, value in errors.items() if name != _LEVEL}):
        warnings.append("It was not checked on samples that it has not seen, or the file does not say so.")
    elif _record(validation).get("limits kept") is False:
        warnings.append("It misses a limit on unseen solves: see the errors.")
    parts = [*surrogate.quantities.values(), *surrogate.fields.values()]
    n, m = len(surrogate.inputs), len(surrogate.outputs)
    network = surrogate.plain_network if not surrogate.fields and len(surrogate.quantities) == 1 else None
    plain = "" if network is None else f", {choice.get('form') or network.form}, {network.radial}"
    return {
        "kind": f"A network learnt from data: {count(n, 'input')}, {count(m, 'output')}."
        if network is not None
        else f"A surrogate learnt from solves: it {surrogate.purpose}.",
        "inputs": surrogate.inputs,
        "outputs": [
            *(f"{q.name} ({q.unit or '1'})" for q in surrogate.outputs),
            *(f"{n} ({f.unit or '1'})" for n, f in surrogate.fields.items()),
        ],
        "inside": "; ".join(map(str, parts)) if network is None else f"{count(network.units, 'unit')}{plain}",
        "trained_on": {"columns of inputs": choice.get("columns")},
        "errors": _drop_empty(errors),
        "limits": _DATA_LIMITS,
        "warnings": tuple(warnings),
    }


def _training_of(meta: Mapping[str, Any], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the file says of its making."""
    problem = _record(provenance.get("problem"))
    return {
        "body": problem.get("body") or provenance.get("words"),
        "acting on it": problem.get("interactions") or problem.get("loads"),
        "solves": meta.get("solves"),
        "samples": meta.get("samples") or _record(meta.get("training")).get("samples"),
        "design": provenance.get("design"),
        "seed": provenance.get("seed"),
        "solved": provenance.get("created"),
        "versions": provenance.get("versions"),
        "machine": provenance.get("machine"),
    }


def _motion_of(body: Any, meta: Mapping[str, Any]) -> list[str]:
    """Return how quickly a body may be pressed, where its solves say its natural frequency."""
    motion = _record(_record(_record(meta.get("dataset")).get("provenance")).get("motion"))
    return [motion_sentence(motion, body.energy.going.deepest)] if motion.get("frequency") else []


def _limits_of(body: Any, meta: Mapping[str, Any]) -> list[str]:
    """Return sentences on where the answers of a body hold."""
    limits = [
        "The answers hold between the trained ends of every input; elsewhere they are continued and marked.",
        *_depths_of(body.energy),
    ]
    if painted := _record(meta.get("painted")):
        trained, whole = (1e4 * float(painted[name]) for name in ("trained_area", "painted_area"))
        limits.append(
            f"Of {whole:.3g} cm² of the surface that were to be touched, {trained:.3g} cm² are trained over the whole "
            "depth, in the mean."
        )
    if (part := pad_part_of(body.energy, meta)) is not None:
        limits.append(str(part))
    if body.lumps is not None:
        room = body.lumps.room
        ends = " to ".join(millimetres(*corner) for corner in (room.lower, room.upper))
        limits.append(
            f"Lumps have soft edges, diameters of {2e3 * room.radius.low:.3g} to {2e3 * room.radius.high:.3g} mm, "
            f"{room.ratio.low:.3g} to {room.ratio.high:.3g} times the modulus, centres within {ends}, and do not meet."
        )
    known = "say" if body.energy.root is not None else "do not say"
    limits.append(f"The answers {known} how far the force may be off from place to place.")
    remembers = "Elastic: a force depends on the place alone, not on what came before."
    limits += [QUASI_STATIC, *_motion_of(body, meta)]
    limits.append(remembers if body.memory is None else f"It remembers: {body.memory}.")
    runtime = _record(meta.get("runtime"))
    if runtime.get("max_force"):
        limits.append(
            f"Forces on a hand are limited to {runtime['max_force']:g} N, at {runtime.get('rate', 1000):g} Hz."
        )
    limits.append(
        "It is as true as the finite-element model that it was learnt from; it is no medical device."
    )
    return limits


def _depths_of(energy: Any) -> list[str]:
    """Return to which depth of the ball the answers are trained, and from which the body gives no force any more."""
    deepest, inner, radius = energy.going.deepest, energy.baseline.inner, energy.baseline.radius
    sentences = []
    if math.isfinite(deepest):
        sentences.append(
            f"The deepest trained press is {millimetres(deepest)}; deeper, the force is continued and not vouched for."
        )
    if math.isfinite(inner):
        # the loop and every export compare the depth of the ball with `inner` and its radius
        at = (
            f"with the ball's centre {millimetres(inner)} inside the surface"
            if math.isnan(radius)
            else f"at a depth of {millimetres(inner + radius)}"
        )
        sentences.append(f"The body lets go, without force, {at} at the latest.")
    return sentences


def _record(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _drop_empty(part: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in part.items() if value not in (None, "", {}, [])}
