"""A problem that a model of UM-Bridge solves, behind an address: vectors of numbers in, vectors of numbers out.

The inputs of the study fill the model's input vectors in their order. Its outputs are the columns ``output.0``,
``output.1`` and so on; of several output vectors ``output0.0`` …, and ``output`` where there is one number alone.
"""

from __future__ import annotations

import functools
import json
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.dataset.readers.case_results import read_numbers
from palpate.dataset.readers.import_results import MappedCases
from palpate.dataset.readers.mapping import ImportMapping
from palpate.errors import PalpateError, ResourceError, UsageError
from palpate.sweeps.answer_files import SavedCase
from palpate.sweeps.mapped_problem import CaseFailure, MappedProblem
from palpate.units import Range

__all__ = ["UMBridgeProblem"]

_LARGEST = 256_000_000  # bytes of an answer
_LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})  # reached without a proxy
_QUICK = 30.0  # s for questions that need no solve
_PAUSES = (0.5, 2.0, 5.0)  # s before the tries after a lost connection
_AFTER = "Start it again, and sweep under another name: a case that failed is not solved anew."


@dataclass(frozen=True)
class UMBridgeProblem(MappedProblem):
    """A problem that asks a server of UM-Bridge; a case that the server can't answer becomes a row with its reason."""

    ranges: tuple[Range, ...]
    # (factor, offset) from the unit that the model takes to SI, for each input
    units: tuple[tuple[float, float], ...]
    url: str  # address of the server
    model: str  # name of its model
    mapping: ImportMapping  # meaning of the outputs
    config: Mapping[str, Any] = field(default_factory=dict)  # settings that the model takes
    limit: float = 3600.0  # time in s of one solve

    def source(self) -> dict[str, Any]:
        """Return what decides the answers besides the mapping."""
        return {
            "url": self.url,
            "model": self.model,
            "config": dict(self.config),
            "units": [list(unit) for unit in self.units],
        }

    def values(self, x: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return the answers of the server for the inputs `x` (n,)."""
        try:
            cases = self.mapped(x, self._patiently(x))
        except PalpateError as error:
            after = _AFTER * isinstance(error, ResourceError)
            raise CaseFailure(" ".join(filter(None, (error.what, error.why, after)))) from error
        if not bool(cases.finite[0]):
            raise CaseFailure("The model's answer is not a number.")
        return {entry.name: cases.answers[entry.name][0] for entry in cases.fields}

    def check(self) -> None:
        """Refuse a server that is not there, has no such model, or takes other numbers of inputs."""
        info = self._ask("Info", None, _QUICK)
        models = info.get("models", [])
        if self.model not in models:
            raise UsageError(
                f"The server at {self.url} has no model {self.model!r}.",
                why=f"Its models are {', '.join(map(str, models)) or 'none'}.",
                fix="Correct `model` in [solver].",
            )
        sizes = self.sizes
        if sum(sizes[0]) != len(self.ranges):
            raise UsageError(
                f"The model {self.model!r} takes {sum(sizes[0])} numbers, and the study has {len(self.ranges)} inputs.",
                why=f"Its input vectors have the sizes {sizes[0]}.",
                fix="Name one input for each number, in the order of the vectors.",
            )
        _ = self.schema  # the mapping fits the outputs

    def shown_command(self) -> str:
        """Return what is asked, for the person who starts the sweep."""
        return f"POST {self.url}/Evaluate, model {self.model!r}"

    @functools.cached_property
    def sizes(self) -> tuple[list[int], list[int]]:
        """Sizes of the model's input and output vectors."""
        question = {"name": self.model, "config": dict(self.config)}
        inputs = self._ask("InputSizes", question, _QUICK).get("inputSizes")
        outputs = self._ask("OutputSizes", question, _QUICK).get("outputSizes")
        return _sizes(inputs), _sizes(outputs)

    @functools.cached_property
    def first(self) -> SavedCase:
        """A case whose outputs are zero, which says what the others look like: numbers have no place."""
        middle = np.array([(r.low + r.high) / 2 for r in self.ranges])
        cases = self.mapped(middle, [[0.0] * size for size in self.sizes[1]])
        return SavedCase(cases.layout, cases.fields, {})

    def mapped(self, x: np.ndarray, output: Sequence[Sequence[float]]) -> MappedCases:
        """Return the answers that output vectors mean for the inputs `x` (n,)."""
        several = len(output) > 1
        columns = {f"output{i}" if several else "output": np.array(part) for i, part in enumerate(output)}
        return read_numbers(columns, f"{self.model} of {self.url}", self.mapping, x)

    def evaluate(self, x: np.ndarray) -> list[list[float]]:
        """Return the model's output vectors for the inputs `x` (n,) in SI units."""
        values = [(float(v) - offset) / factor for v, (factor, offset) in zip(x, self.units, strict=True)]
        vectors, start = [], 0
        for size in self.sizes[0]:
            vectors.append(values[start : start + size])
            start += size
        question = {"name": self.model, "input": vectors, "config": dict(self.config)}
        output = self._ask("Evaluate", question, self.limit).get("output")
        if not isinstance(output, list) or [np.shape(part) for part in output] != [
            (n,) for n in self.sizes[1]
        ]:
            raise UsageError(f"The model's answer has other sizes than {self.sizes[1]}.")
        try:
            return [[float(value) for value in part] for part in output]
        except (TypeError, ValueError) as error:
            raise UsageError("The model's answer holds what is no number.", why=str(error)) from error

    def _patiently(self, x: np.ndarray) -> list[list[float]]:
        """Return the model's answer at `x` (n,); a server that is started again within seconds costs nothing."""
        for pause in _PAUSES:
            try:
                return self.evaluate(x)
            except ResourceError as error:
                if isinstance(error.__cause__, TimeoutError):  # it has had its time
                    raise
                time.sleep(pause)
        return self.evaluate(x)

    def _ask(self, path: str, question: Mapping[str, Any] | None, limit: float) -> dict[str, Any]:
        """Return the server's answer; what it refuses is a `UsageError`, a lost connection a `ResourceError`."""
        address = f"{self.url.rstrip('/')}/{path}"
        content = None if question is None else json.dumps(question).encode()
        request = urllib.request.Request(address, content, {"content-type": "application/json"})
        try:
            with _opener(self.url).open(request, timeout=limit) as answer:
                text = answer.read(_LARGEST + 1)
        except urllib.error.HTTPError as error:
            with error:
                raise UsageError(f"The server refuses {path}.", why=_reason(error.read(100_000))) from error
        except (OSError, ValueError) as error:
            raise ResourceError(
                f"The UM-Bridge server at {self.url} does not answer {path}.",
                why=f"{type(error).__name__}: {error}",
                fix="Start it, or correct `url` in [solver].",
            ) from error
        try:
            found = json.loads(text) if len(text) <= _LARGEST else None
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict):
            raise UsageError(
                f"The answer to {path} is no JSON object.", fix=f"Is {self.url} a UM-Bridge server?"
            )
        if "error" in found:
            raise UsageError(f"The server refuses {path}.", why=_reason(text))
        return found


def _opener(url: str) -> urllib.request.OpenerDirector:
    near = urllib.parse.urlsplit(url).hostname in _LOOPBACK
    return urllib.request.build_opener(*([urllib.request.ProxyHandler({})] if near else []))


def _reason(text: bytes) -> str:
    """Return the words of an error of the protocol, or the beginning of whatever came."""
    try:
        error = json.loads(text)["error"]
        return f"{error['type']}: {error['message']}"
    except (ValueError, KeyError, TypeError, RecursionError):
        return text[:500].decode(errors="replace")


def _sizes(value: Any) -> list[int]:
    if isinstance(value, list) and all(isinstance(size, int) and size >= 0 for size in value):
        return value
    raise UsageError("The server states no sizes of the model's vectors.", why=f"It says {value!r}.")
