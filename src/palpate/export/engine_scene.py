"""A learnt body for a scene of a game engine: its tool, a press to show, the mesh that is drawn."""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.surrogates.baselines import require_one_tool

__all__ = ["press_ends", "probe_radius", "require_touch", "shown_mesh", "tool_words"]


def require_touch(surrogate: Surrogate) -> None:
    """Refuse a model that no hand feels."""
    if not surrogate.can_be_touched:
        raise UsageError(
            f"The model {surrogate.name!r} can't be touched.",
            why="A scene asks a body for the force on a tool.",
            fix="Take it out with `palpate export fmu`, `lib`, `c` or `onnx`.",
        )


def shown_mesh(surrogate: Surrogate) -> FieldSurrogate | None:
    """Return the displacement of a surface that an engine can draw, if the body has one."""
    field = surrogate.surface_fields.get("displacement")
    return field if field is not None and field.rest.shape[1] == 3 else None


def probe_radius(surrogate: Surrogate) -> float:
    """Return the radius of the ball, m: the middle one of several, 0 of a body that is held or under another tool."""
    baseline = surrogate.hand_energy.baseline
    if baseline.holds or hasattr(baseline, "posed_tool"):
        return 0.0
    if baseline.radius_input is None:
        return float(baseline.radius)
    own = surrogate.inputs[baseline.radius_input]
    return (own.low + own.high) / 2


def tool_words(surrogate: Surrogate) -> str:
    """Return a sentence that says what the tool is."""
    require_one_tool(surrogate.hand_energy.baseline, "act in a game engine")
    radius = probe_radius(surrogate)
    if surrogate.hand_energy.baseline.holds:
        return "The body is held where the tool starts."
    if (tool := getattr(surrogate.hand_energy.baseline, "posed_tool", None)) is not None:
        return f"It is a {tool}, its place being its foremost point."
    return f"It is a ball of {1e3 * radius:g} mm radius."


def press_ends(surrogate: Surrogate) -> tuple[np.ndarray, np.ndarray]:
    """Return two places (3,), m, between which a sample leads its tool: free, and in the trained body."""
    energy = surrogate.hand_energy
    k, D = len(energy.baseline.directions), energy.baseline.directions
    middle = np.array([(r.low + r.high) / 2 for r in surrogate.inputs])
    X = energy.trained_rows()
    X[:, k:] = middle[k:]
    if energy.baseline.holds:
        size = np.linalg.norm(X[:, :k] * energy.inside(X)[:, None], axis=1)
        return np.zeros(3), 0.7 * X[np.argmax(size), :k] @ D
    depth, inside = energy.depth(X), energy.inside(X)
    if inside.any():
        depth = np.where(inside, depth, -np.inf)
    row = np.argsort(depth)[-max(1, int(np.isfinite(depth).sum()) // 20)]
    evaluate = energy.evaluator()
    evaluate(X[row, :3], middle[3:])
    clear = probe_radius(surrogate) or float(depth[row])
    return X[row, :3] + (depth[row] + clear) * evaluate.outward, X[row, :3].copy()
