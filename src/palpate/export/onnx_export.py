"""Export to ONNX: energy, force, stiffness and trust of a learnt body in one graph, compared with palpate.

A body that remembers has a state; it is refused by the name of its memory unless its elastic part alone is asked for.
Its outputs ``amplitude`` and ``slope`` are what a memory walks, for those who write one of their own.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.export.answer_network import answers_of
from palpate.export.check_answers import MOST_SLOPES, Replies, compare_answers
from palpate.export.check_points import (
    ANSWERS,
    Comparison,
    ExportedFile,
    Precision,
    compare_body,
)
from palpate.export.onnx_body import add_body, add_torque
from palpate.export.onnx_graph import Graph, require_onnx
from palpate.export.onnx_network import add_network
from palpate.export.weights_block import WeightsBlock
from palpate.files import write_file
from palpate.network import Network
from palpate.output_files import require_outputs
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import card_of

__all__ = ["OnnxAsker", "export_onnx"]

CONTACT, TRUSTED, NOT_A_NUMBER, TOO_DEEP = 1, 2, 4, 8
COLUMNS = {"energy": slice(0, 1), "depth": slice(1, 2), "force": slice(2, 5), "stiffness": slice(5, 14)}
COLUMNS |= {"amplitude": slice(15, 16), "slope": slice(16, 19), "deviation": slice(19, 20)}


def export_onnx(
    thing: Surrogate | Network,
    path: str | os.PathLike[str],
    *,
    single: bool = False,
    elastic: bool = False,
    check: bool = True,
    tolerance: float = 1e-2,
    overwrite: bool = False,
) -> ExportedFile:
    """Write a surrogate or a network as NAME.onnx, and compare it with palpate in ONNX Runtime if that is installed.

    `single` gives numbers of 32 bits, the only ones that the browser's runtimes take; `elastic` leaves a memory out.
    `tolerance` is the largest difference in single precision, relative to the largest value; beyond it nothing is
    written. `overwrite` replaces files whatever they are; by default those alone that an earlier export wrote.
    """
    require_outputs([path], endings=(".onnx",), overwrite=overwrite)
    require_onnx()
    surrogate = Surrogate.of(thing)
    if surrogate.memory is not None:
        if not elastic:
            raise UsageError(
                f"The memory {surrogate.memory.name!r} has no ONNX form.",
                why="A graph has no state of its own, and this memory's is not written as inputs and outputs.",
                fix="Export it with `palpate export c` or `lib`, or with --elastic its answer without memory.",
            )
        surrogate = replace(surrogate, memory=None)
    graph = Graph(np.float32 if single else np.float64)
    if (answers := answers_of(surrogate)) is not None:
        block = WeightsBlock.of_answers(answers)
        add_network(graph, *answers.networks)
    else:
        block = WeightsBlock.of(replace(surrogate, fields={}))
        add_body(graph, surrogate.hand_energy)
        add_torque(graph, surrogate)
    model = graph.model(surrogate.name, _metadata(surrogate, block))
    comparison = _compare(surrogate, model, Precision(single, tolerance)) if check else None
    if comparison is not None:
        fix = "Export it in double precision." if single else "Report this with the model file."
        comparison.require(
            f"The ONNX model of {surrogate.name} does", why="", fix=f"Nothing was written. {fix}"
        )
    return ExportedFile(write_file(Path(path), model.SerializeToString()), block.hash, comparison)


def _metadata(surrogate: Surrogate, block: WeightsBlock) -> dict[str, str]:
    """Return names, units, limits and the hash, as the model's properties."""
    inputs = [asdict(r) for r in surrogate.inputs]
    card = card_of(surrogate).with_hash(block.label, block.hash)
    plain = {
        "inputs": json.dumps(inputs),
        "sha256": block.hash,
        "producer": "palpate",
        "card": card.to_json(),
    }
    if (answers := answers_of(surrogate)) is not None:
        return plain | {"outputs": json.dumps([asdict(q) for q in answers.outputs]), "name": answers.name}
    units = {
        "energy": "J",
        "force": "N",
        "stiffness": "N/m",
        "depth": "m",
        "amplitude": "J^0.5",
        "slope": "J^0.5/m",
        **({} if surrogate.torque_evaluator is None else {"torque": "N m"}),
    }
    about = "force is that on the hand; inside tells whether it may be trusted, deviation is relative to the force"
    return plain | {"outputs": json.dumps(units), "about": about, "name": surrogate.name}


def _compare(surrogate: Surrogate, model: Any, precision: Precision) -> Comparison | None:
    try:
        import onnxruntime  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(model.SerializeToString(), options)
    if (answers := answers_of(surrogate)) is not None:
        kind = np.float32 if precision.single else np.float64
        wanted = ["y", "jacobian"] if len(answers.outputs) <= MOST_SLOPES else ["y"]

        def ask(X: np.ndarray) -> Replies:
            replies = [np.asarray(a, np.float64) for a in session.run(wanted, {"x": X.astype(kind)})]
            return replies[0], None, replies[1] if len(replies) > 1 else None

        return compare_answers(answers, ask, precision)
    bare = replace(surrogate, fields={})
    return compare_body(
        bare, OnnxAsker(session, bare), precision, deviation=surrogate.hand_energy.root is not None
    )


class OnnxAsker:
    """An ONNX Runtime session of an exported body, asked as every export is."""

    def __init__(self, session: Any, surrogate: Surrogate) -> None:
        self._session, self._energy = session, surrogate.hand_energy
        self._kind = np.float32 if session.get_inputs()[0].type == "tensor(float)" else np.float64

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return an answer's 19 numbers, the deviation and the flags for each row of X (N, 3 + p)."""
        baseline, names = self._energy.baseline, [o.name for o in self._session.get_outputs()]
        D = baseline.directions
        # a place that is infinite along one axis has no coordinates along the others
        X = np.where(np.isfinite(X).all(axis=1)[:, None], X, np.nan)
        U = X if len(D) == 3 else np.hstack([X[:, :3] @ D.T, X[:, 3:]])
        got = dict(zip(names, self._session.run(None, {"x": U.astype(self._kind)}), strict=True))
        out = np.full((len(X), ANSWERS), np.nan)
        for name, columns in COLUMNS.items():
            if name in got:
                out[:, columns] = np.reshape(got[name], (len(X), -1))
        out[:, 14] = out[:, 0] + baseline.offset
        finite = np.isfinite(out[:, 0])
        depth = out[:, 1]
        touching = np.full(len(X), True) if baseline.holds else depth > 0
        radius: Any = 0.0 if not np.isfinite(baseline.radius) else baseline.radius
        if baseline.radius_input is not None:
            radius = U[:, baseline.radius_input]
        flags = (
            CONTACT * touching + TRUSTED * got["inside"][:, 0] + TOO_DEEP * (depth > baseline.inner + radius)
        )
        out[:, 20] = np.where(finite, flags, NOT_A_NUMBER)
        return out

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        return np.asarray(self._session.run(["torque"], {"x": X.astype(self._kind)})[0], np.float64)

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Refuse: a graph has no memory."""
        raise NotImplementedError

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Refuse: a graph has no field."""
        raise NotImplementedError
