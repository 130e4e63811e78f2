"""Comparison of a page of answers with palpate: its parts are unpacked again and asked, at 1,000 places.

The arrays are read as the page's script reads them, and become networks, deviations and regions anew; so numbers that
were lost, rounded or mixed up on their way into the file are found. The script's own arithmetic is compared with
palpate's by tests in a browser.
"""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from palpate.export.check_points import Comparison, Difference, Precision, difference, tolerances
from palpate.network import Network, Scaling, TrainedRegion
from palpate.network.influence import Influence
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates import LearntQuantities, ModalField, Surrogate
from palpate.units import Quantity, Range, bounds

__all__ = ["compare_page"]

_PLACES = 1000
_NUMBERS = 5_000_000  # of a field that are compared at most; of a large one at fewer places
_SINGLE = 1e-5  # relative difference of fields, whose modes go out in single precision
_WIDTHS = {"f4": 4, "f8": 8, "i4": 4}

Read = Callable[[Mapping[str, Any]], np.ndarray]


def compare_page(surrogate: Surrogate, parts: Mapping[str, str]) -> Comparison:
    """Return how far the answers of a page, by its packed parts, are from palpate's: in the ranges and beside them."""
    page = json.loads(gzip.decompress(base64.b64decode(parts["answers"])))
    unpacked = {
        name: gzip.decompress(base64.b64decode(text)) for name, text in parts.items() if name != "answers"
    }

    def read(array: Mapping[str, Any]) -> np.ndarray:
        width, size = _WIDTHS[array["kind"]], math.prod(array["shape"])
        data = unpacked[array["part"]][array["at"] : array["at"] + width * size]
        words = np.frombuffer(data, np.uint8).reshape(width, size).T.tobytes()
        return np.frombuffer(words, f"<{array['kind']}").reshape(array["shape"])

    low, high = bounds(surrogate.inputs)
    span = high - low
    X = np.random.default_rng(0).uniform(low - 0.3 * span, high + 0.3 * span, (_PLACES, len(low)))
    inputs = tuple(Range(r["name"], r["low"], r["high"], r["unit"]) for r in page["inputs"])
    found: dict[str, Difference] = {}
    for own, facts in zip(surrogate.quantities.values(), page["groups"], strict=True):
        name = ", ".join(q.name for q in own.outputs)
        found |= dict(_numbers(name, own, _group(facts, inputs, read), X))
    shown_by_name = {shown.name: shown for shown in surrogate.modal_fields.values()}
    for facts in (*page["curves"], *page["fields"]):
        shown = shown_by_name[facts["name"]]
        coefficients = _group(facts["coefficients"], inputs, read)
        found |= dict(_numbers(f"{shown.name}, coefficients", shown.coefficients, coefficients, X))
        found[shown.name] = _field(shown, facts, coefficients, read, X)
    return Comparison(found)


def _group(facts: Mapping[str, Any], inputs: tuple[Range, ...], read: Read) -> LearntQuantities:
    """Return numbers that were learnt together, as the page has them."""
    outputs = tuple(Quantity(q["name"], q["unit"]) for q in facts["outputs"])

    def network(parts: Mapping[str, Any]) -> Network:
        centre, half, bend = read(parts["inputs"])
        zero, unit = read(parts["outputs"])
        return Network(
            inputs,
            outputs,
            read(parts["factors"]),
            read(parts["shifts"]),
            read(parts["weights"]),
            read(parts["tail"]),
            Scaling(centre, half, zero, unit, bend),
            radial=parts["radial"],
            basis=None if parts["basis"] is None else read(parts["basis"]),
        )

    sure, region, influence = facts["deviation"], facts["region"], facts["influence"]
    names = ("noise", "coefficients", "root", "through", "pattern", "factor")
    return LearntQuantities(
        network(facts["network"]),
        None
        if sure is None
        else Uncertainty(network(sure["network"]), *(read(sure[name]) for name in names)),
        None if region is None else TrainedRegion(read(region["points"]), region["radius"]),
        tuple(network(member) for member in facts["members"]),
        None if influence is None else Influence(read(influence["shares"]), read(influence["missed"])),
        facts["level"],
    )


def _numbers(
    name: str, own: LearntQuantities, again: LearntQuantities, X: np.ndarray
) -> Iterator[tuple[str, Difference]]:
    """Yield the differences of numbers, of their deviations, and of what counts as trained."""
    limit = tolerances(own.network, X, Precision())
    yield name, difference(own.predict(X), again.predict(X), limit)
    if again.uncertainty is not None:
        yield f"{name}, ±", difference(own.deviation(X), again.deviation(X), limit)
        wrong = int((own.trusted(X) != again.trusted(X)).sum())
        yield f"{name}, inside", Difference(float(wrong > 0), 0.0, len(X), wrong)


def _field(
    shown: ModalField, facts: Mapping[str, Any], coefficients: LearntQuantities, read: Read, X: np.ndarray
) -> Difference:
    """Return the difference of a field or curve at the places that the page draws."""
    rows = np.arange(len(shown.places))
    if (mesh := shown.mesh) is not None:
        rows = np.unique(mesh.triangles if mesh.kind == "nodes" else mesh.cell_of)
    some = X[: max(20, _NUMBERS // max(1, rows.size * shown.mean.shape[1]))]
    mean, modes = (read(facts[name]).astype(float) for name in ("mean", "modes"))
    got = mean + np.tensordot(coefficients.predict(some), modes, 1)
    wanted = shown.values(some)[:, rows]
    flat = wanted.reshape(len(some), -1), got.reshape(len(some), -1)
    return difference(*flat, np.full(len(some), _SINGLE))
