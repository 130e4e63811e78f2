"""A body drawn as a line in a page that is one file: what the page knows of it, and how it is compared with palpate.

The network of the nodes goes out as a block of its own. The page asks it by the loads that the answered force says and
by the further inputs, and lets the line swing back to rest as the server does (`palpate.viewer.page_model`). One that
lies elsewhere after a touch stays there: the page follows its memory in steps, as the real-time loop does.
"""

from __future__ import annotations

from typing import Any

from palpate.export.answer_network import AnswerNetwork
from palpate.export.check_answers import compare_answers
from palpate.export.check_points import Difference
from palpate.export.wasm_core import WasmCore
from palpate.runtime.touchable import touchable
from palpate.surrogates import NodeField, Surrogate
from palpate.units import bounds
from palpate.viewer.page_model import DAMPING, FREQUENCY, STILL

__all__ = ["compare_line", "line_facts"]


def line_facts(line: NodeField, surrogate: Surrogate) -> dict[str, Any]:
    """Return what the page must know of a line beside its network, as JSON."""
    low, high = bounds(line.inputs)
    return {
        "stays": touchable(surrogate).stays,
        "directions": surrogate.hand_energy.baseline.directions.tolist(),
        "touched": line.touched.tolist(),
        "further": list(line.further),
        "by_place": line.asked_by == "place and load",
        "low": low.tolist(),
        "high": high.tolist(),
        "mirror": None if line.mirror is None else line.mirror.tolist(),
        "columns": line.columns.tolist(),
        "frequency": FREQUENCY,
        "damping": DAMPING,
        "still": STILL,
    }


def compare_line(surrogate: Surrogate, core: WasmCore) -> Difference:
    """Return how far the nodes' values of a page are from palpate at 1,000 inputs."""
    line = touchable(surrogate).line
    assert line is not None
    count = len(line.network.outputs)
    nodes = AnswerNetwork(line.name, (line.network,), (), (), (count,))
    (difference,) = compare_answers(nodes, lambda X: (core.predict(X, count), None, None)).parts.values()
    return difference
