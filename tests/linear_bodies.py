"""Bodies that answer linearly, made by formula, with datasets and surrogates that fit them exactly.

Errors put into a model are then known in closed form.
"""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import numpy as np

from models import linear_network, planar_field, spring_energy
from palpate.dataset import Dataset, Layout, assemble
from palpate.learning import History
from palpate.network import Network
from palpate.surrogates import LearntEnergy, NodeField, Surrogate
from palpate.units import Quantity, Range

PLACES = np.linspace(0.0, 1.0, 6)
REST = np.stack([PLACES, np.zeros(6)], axis=1)
COMPLIANCE = 0.05  # m/N at the tip


def dataset(
    X: np.ndarray,
    ranges: list[Range],
    directions: list[tuple[float, float]],
    load_nodes: list[int],
    scale: float = 1.0,
) -> Dataset:
    """Every load moves node x by COMPLIANCE · P · x² along its direction."""
    count = len(X)
    displacement = np.zeros((count, 6, 3))
    displacement[:, :, :2] = (
        scale * COMPLIANCE * (PLACES**2)[None, :, None] * (X @ np.array(directions))[:, None]
    )
    layout = Layout(REST, np.ones(6, dtype=bool), load_nodes, directions)
    answers: dict[str, Any] = {
        "displacement": displacement,
        "root_reaction": np.zeros((count, 3)),
        "strain_energy": np.zeros(count),
        "potential_energy": np.zeros(count),
        "converged": np.ones(count, dtype=bool),
        "iterations": np.ones(count, dtype=np.int64),
        "residual": np.zeros(count),
        "message": np.array([""] * count),
        "solve_seconds": np.zeros(count),
    }
    body = {"type": "Cantilever", "length": 1.0, "material": {"name": "rubber"}}
    return assemble(ranges, layout, X, answers, {"problem": {"body": body}, "seed": 0})


def tip_data(X: np.ndarray | None = None, name: str = "P", scale: float = 1.0) -> Dataset:
    """One load, 0 … 5 N, pushing the tip down."""
    X = np.linspace(0.0, 5.0, 41)[:, None] if X is None else X
    return dataset(X, [Range(name, 0.0, 5.0, "N")], [(0.0, -1.0)], [5], scale)


def tip_model(
    *,
    shift: float = 0.0,
    slope: float = 0.0,
    force: float = 1.0,
    scale: float = 1.0,
    name: str = "P",
    low: float = 0.0,
) -> Surrogate:
    """The exact model of `tip_data`, with errors put into it.

    Its nodes are off by shift + slope · ξ with the scaled load ξ in [−1, 1]; its force by the factor `force`.
    """
    loads = [Range(name, low, 5.0, "N")]
    middle, half = (5.0 + low) / 2, (5.0 - low) / 2
    fall = -scale * COMPLIANCE * PLACES**2
    nodes = np.stack([middle * fall[1:] + shift, half * fall[1:] + slope], axis=1)
    whole = np.zeros((12, 2))
    whole[1::2] = np.outer(fall, [middle, half])
    outputs = [Quantity(f"u_y at {x:g} m", "m") for x in PLACES[1:]]
    names = [Quantity(f"u_{c} at {x:g} m", "m") for x in PLACES for c in "xy"]
    asked = linear_network(loads, outputs, nodes)
    travel = scale * COMPLIANCE
    energy = spring_energy(force / travel, [Range(f"h along {name}", low * travel, 5.0 * travel, "m")])
    return _model(energy, linear_network(loads, names, whole), asked, asked)


PLANE = [Range("P_x", -4.0, 4.0, "N"), Range("P_y", -4.0, 4.0, "N")]


def plane_data(X: np.ndarray | None = None) -> Dataset:
    """Two loads at the tip, sampled well inside their ranges so that nothing is held at a limit."""
    X = np.random.default_rng(3).uniform(-2.0, 2.0, (60, 2)) if X is None else X
    return dataset(X, PLANE, [(1.0, 0.0), (0.0, 1.0)], [5, 5])


def plane_model(turn: np.ndarray | None = None) -> Surrogate:
    """The exact model of `plane_data`, its loads multiplied by the positive definite matrix `turn` (2, 2)."""
    reach = 4.0 * COMPLIANCE
    shape = np.kron((PLACES**2)[:, None], reach * np.eye(2))
    names = [Quantity(f"u_{c} at {x:g} m", "m") for x in PLACES for c in "xy"]
    hand = [Range("h_x", -reach, reach, "m"), Range("h_y", -reach, reach, "m")]
    stiffness = (np.eye(2) if turn is None else turn) / COMPLIANCE
    return _model(
        spring_energy(stiffness, hand, np.eye(3)[:2]),
        linear_network(PLANE, names, np.hstack([np.zeros((12, 1)), shape])),
        linear_network(PLANE, names[2:], np.hstack([np.zeros((10, 1)), shape[2:]])),
    )


def _model(energy: LearntEnergy, whole: Network, nodes: Network, own: Network | None = None) -> Surrogate:
    points = np.hstack([REST, np.zeros((6, 1))])
    common = {"touched": np.arange(len(energy.inputs)), "of_interest": np.arange(6)}
    fields = {"displacement": planar_field("displacement", whole, points, **common)}
    for name, network in (("nodes", nodes), ("filter", own)):
        if network is not None:
            components = range(2) if len(network.outputs) == 10 else (1,)
            columns = np.array([(node, c) for node in range(1, 6) for c in components])
            fields[name] = NodeField(name, "m", network, columns, points, 5, **common)
    meta = {"name": "rubber", "refinement": {"used": 26}, "settings": {"window": 50}}
    return Surrogate(energy, fields, meta=meta)


def with_network(model: Surrogate, name: str, network: Network) -> Surrogate:
    """The same body, one of whose fields has another network."""
    changed = dataclasses.replace(model.fields[name], network=network)
    return dataclasses.replace(model, fields={**model.fields, name: changed})


def history(heldout: tuple[float, ...] = (1e-1, 1e-2, 2e-2, 1e-3)) -> History:
    """Four observations: grew, grew, pruned, nothing."""
    return History(
        units=np.array([1, 2, 1, 1]),
        error=np.array([1.0, 0.5, 0.2, 0.1]),
        window_rms=np.array([1.0, 0.8, 0.6, 0.4]),
        innovation=np.array([1.0, 0.8, 0.6, 0.4]),
        grew=np.array([1, 1, 0, 0]),
        pruned=np.array([0, 0, 1, 0]),
        heldout=np.array(heldout),
        passes=2,
    )


def nonsense(network: Network) -> Network:
    """A network whose every answer is not-a-number: none can be made so, but memory and files can rot."""
    rotten = copy.copy(network)
    object.__setattr__(rotten, "tail", np.full_like(network.tail, np.nan))
    return rotten
