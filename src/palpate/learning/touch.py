"""From a dataset to a body that can be touched: filter, refine, and put the networks together."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.learn import Learned, learn
from palpate.learning.learning_history import History
from palpate.learning.structure import refined_network
from palpate.network import Network
from palpate.rbf.filter.settings import Settings, recommended
from palpate.rbf.forms import Centred
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range, bounds

__all__ = ["FEWEST", "Refinement", "hand_coordinates", "learn_touch", "node_outputs"]


FEWEST = 4  # solves for an affine map of one input, and one to judge it by
_OBSERVATIONS = 1250  # five passes over the founding study's 251 training loads


@dataclass(frozen=True)
class Refinement:
    """How the sequential filter's answer is refined.

    Attributes
    ----------
    samples : int
        Solves used, spread over the training data; 0 for all of them.
    units_max : int
        Most units per network.
    target : float
        Leave-one-out error at which no more units are added, relative to the outputs' largest deviation.
    starts : int
        Starts per number of units.
    """

    samples: int = 26
    units_max: int = 6
    target: float = 5e-7
    starts: int = 4


def learn_touch(
    train: Dataset,
    *,
    heldout: Dataset | None = None,
    name: str = "beam",
    settings: Settings | None = None,
    refinement: Refinement | None = None,
    passes: int | None = None,
    seed: int = 0,
    coupling: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[TouchModel, History]:
    """Learn a body that can be touched.

    Parameters
    ----------
    train : Dataset
        Rows that did not converge are left out.
    heldout : Dataset, optional
        Unseen solves; the filter's error on them is recorded while it learns, and never acted upon.
    name : str
    settings : Settings, optional
        Of the sequential filter; `recommended` if left out.
    refinement : Refinement, optional
        By default 26 solves and 6 units for one input, all solves and more units for several.
    passes : int, optional
        Shuffled presentations of the data; by default five, or as many as make 1,250 observations.
    seed : int
        Decides their order.
    coupling : float, optional
        Stiffness k_c of the virtual coupling at the held node, N/m. By default none for one touched load, and
        four times the mean lateral stiffness for several (see `palpate.surrogates.touch`).
    progress : callable, optional
        Called with (done, total) observations of the filter.

    Returns
    -------
    TouchModel, History
        The history is that of the sequential filter on the nodes' displacements.

    Raises
    ------
    UsageError
        If there are too few converged solves to learn from.
    """
    if not isinstance(train, Dataset):
        raise UsageError(
            f"A body is learnt from a Dataset of solves; a {type(train).__name__} came.",
            why="Which node is held, and which loads act on it, stands in the dataset.",
            fix="Pass what `palpate.sweep` returns; for arrays X and Y use `palpate.fit`.",
        )
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        return _learn_touch(train.ok, heldout, name, settings, refinement, passes, seed, coupling, progress)


def _learn_touch(
    train: Dataset,
    heldout: Dataset | None,
    name: str,
    settings: Settings | None,
    refinement: Refinement | None,
    passes: int | None,
    seed: int,
    coupling: float | None,
    progress: Callable[[int, int], None] | None,
) -> tuple[TouchModel, History]:
    if len(train) < 4:
        raise UsageError(
            f"{len(train)} converged solves are too few to learn from.",
            fix="Sweep at least 4, better 26 or more.",
        )
    settings = settings or recommended(len(train.ranges))
    refinement = refinement or _refinement_for(len(train.ranges))
    # few solves need more presentations: the filter sees each one's linearisation once per pass
    passes = passes or max(5, math.ceil(_OBSERVATIONS / len(train)))
    outputs, columns = node_outputs(train)
    sequential = learn(
        train.X,
        _columns(train, columns),
        train.ranges,
        outputs,
        settings=settings,
        passes=passes,
        seed=seed,
        heldout=None if heldout is None else (heldout.ok.X, _columns(heldout.ok, columns)),
        progress=progress,
    )
    few = _spread_rows(train, refinement.samples)
    networks = _networks(few, outputs, columns, sequential, settings, refinement, seed, coupling)
    meta = _meta(train, few, settings, refinement, passes, seed, sequential)
    return _assembled(few, networks, name, meta), sequential.history


def node_outputs(data: Dataset) -> tuple[tuple[Quantity, ...], list[tuple[int, int]]]:
    """The founding study's outputs: displacements of the free nodes of interest, along the loads' axes.

    Returns
    -------
    quantities : m of them
    columns : m pairs (node, component)
    """
    axes = [c for c in range(2) if np.abs(data.load_directions[:, c]).max() > 1e-12]
    free = [int(i) for i in data.nodes_of_interest if np.abs(data.displacement[:, i, :2]).max() > 0]
    columns = [(i, c) for i in free for c in axes]
    return tuple(Quantity(f"u_{'xy'[c]} at {data.rest[i, 0]:g} m", "m") for i, c in columns), columns


def hand_coordinates(
    data: Dataset, touch_node: int, touched: tuple[int, ...], compliance: float
) -> np.ndarray:
    """h (N, k): displacement of the held node along each touched load, plus the coupling's stretch, m."""
    along = data.displacement[:, touch_node, :2] @ data.load_directions[list(touched), :2].T
    return np.asarray(along + compliance * data.X[:, list(touched)])


def _columns(data: Dataset, columns: list[tuple[int, int]]) -> np.ndarray:
    return np.stack([data.displacement[:, i, c] for i, c in columns], axis=1)


def _refinement_for(inputs: int) -> Refinement:
    return Refinement() if inputs == 1 else Refinement(samples=400, units_max=36, target=2e-5, starts=2)


def _spread_rows(data: Dataset, count: int) -> Dataset:
    """At most `count` rows: for one input denser towards the ends, for several the first ones of a design.

    Chebyshev's spacing (1 − cos πt)/2 by rank: evenly spaced samples leave the ends with the largest error.
    """
    if not count or len(data) <= count:
        return data
    if data.X.shape[1] > 1:
        return data.take(np.arange(count))
    order = np.argsort(data.X[:, 0], kind="stable")
    share = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count))) / 2.0
    return data.take(order[np.unique(np.round(share * (len(data) - 1)).astype(int))])


def _touched(data: Dataset) -> tuple[int, tuple[int, ...]]:
    """The loaded node farthest along the beam, and the loads that act there."""
    node = int(data.load_nodes[np.argmax(data.rest[data.load_nodes, 0])])
    return node, tuple(int(i) for i in np.flatnonzero(data.load_nodes == node))


def _networks(
    data: Dataset,
    outputs: tuple[Quantity, ...],
    columns: list[tuple[int, int]],
    sequential: Learned,
    settings: Settings,
    refinement: Refinement,
    seed: int,
    coupling: float | None,
) -> dict[str, Any]:
    options: dict[str, Any] = {
        "target": refinement.target,
        "units_max": refinement.units_max,
        "starts": refinement.starts,
        "seed": seed,
    }
    known = _known(sequential, settings)
    nodes, refined, _ = refined_network(
        data.X, _columns(data, columns), data.ranges, outputs, known=known, **options
    )
    names = [Quantity(f"u_{c} at {x:g} m", "m") for x in data.rest[:, 0] for c in "xy"]
    planar = data.displacement[:, :, :2].reshape(len(data), -1)
    field = refined_network(data.X, planar, data.ranges, names, known=refined.theta, **options)[0]
    node, touched = _touched(data)
    compliance = _compliance(field, node, touched, data, coupling)
    X, ranges = _hand(data, field, node, touched, compliance)
    pulls = [Quantity(data.ranges[i].name, "N") for i in touched]
    force = refined_network(X, data.X[:, list(touched)], ranges, pulls, **options)[0]
    return {
        "networks": {"nodes": nodes, "field": field, "force": force, "filter": sequential.network},
        "node": node,
        "touched": touched,
        "compliance": compliance,
    }


def _known(sequential: Learned, settings: Settings) -> np.ndarray | None:
    """The filter's units as axis-aligned ones, where they have centres."""
    state = sequential.state
    if settings.form not in {"isotropic", "axis-aligned", "rotated"}:
        return None
    return Centred("axis-aligned", state.inputs).of(state.centres(settings), state.widths(settings))


def _compliance(
    field: Network, node: int, touched: tuple[int, ...], data: Dataset, coupling: float | None
) -> float:
    if coupling is not None:
        if not coupling > 0:
            raise UsageError(f"A coupling of {coupling} N/m holds nothing.", fix="Give a positive stiffness.")
        return 1.0 / coupling
    if len(touched) == 1:
        return 0.0
    own = np.array(
        [_tip_compliance(field, x, node, touched, data) for x in data.X[:: max(1, len(data) // 50)]]
    )
    return float(np.mean([np.linalg.eigvalsh(c)[-1] for c in own])) / 4.0


def _tip_compliance(
    field: Network, x: np.ndarray, node: int, touched: tuple[int, ...], data: Dataset
) -> np.ndarray:
    """∂(D·u)/∂P (k, k) at the held node, symmetrised, m/N."""
    J = field.jacobian(x)[2 * node : 2 * node + 2][:, list(touched)]
    C = data.load_directions[list(touched), :2] @ J
    return np.asarray((C + C.T) / 2)


def _hand(
    data: Dataset, field: Network, node: int, touched: tuple[int, ...], compliance: float
) -> tuple[np.ndarray, list[Range]]:
    """Inputs (N, n) of the force network, touched coordinates first, and their ranges.

    The ranges are what the whole of the declared load ranges reaches, which a design may not have sampled.
    """
    h = hand_coordinates(data, node, touched, compliance)
    others = [i for i in range(len(data.ranges)) if i not in touched]
    corners = _lattice(data.ranges)
    tips = field.predict(corners)[:, 2 * node : 2 * node + 2]
    reach = tips @ data.load_directions[list(touched), :2].T + compliance * corners[:, list(touched)]
    low, high = np.minimum(reach.min(0), h.min(0)), np.maximum(reach.max(0), h.max(0))
    ranges = [
        Range(f"h along {data.ranges[i].name}", float(a), float(b), "m")
        for i, a, b in zip(touched, low, high, strict=True)
    ]
    return np.hstack([h, data.X[:, others]]), ranges + [data.ranges[i] for i in others]


def _lattice(ranges: tuple[Range, ...], points: int = 9) -> np.ndarray:
    """A full grid of the declared ranges, (points^n, n); coarser for many inputs."""
    low, high = bounds(ranges)
    count = max(2, min(points, int(4096 ** (1.0 / len(ranges)))))
    axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    return np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)


def _assembled(data: Dataset, parts: dict[str, Any], name: str, meta: dict[str, Any]) -> TouchModel:
    node, touched, compliance = parts["node"], parts["touched"], parts["compliance"]
    force = parts["networks"]["force"]
    X, _ = _hand(data, parts["networks"]["field"], node, touched, compliance)
    k = len(touched)
    stiffness = [np.linalg.eigvalsh((J[:, :k] + J[:, :k].T) / 2)[-1] for J in (force.jacobian(x) for x in X)]
    body = data.provenance.get("problem", {}).get("body", {})
    directions = np.zeros((k, 3))
    directions[:, :2] = data.load_directions[list(touched), :2]
    rest = np.zeros((len(data.rest), 3))
    rest[:, :2] = data.rest
    return TouchModel(
        name=name,
        networks=parts["networks"],
        rest=rest,
        nodes_of_interest=np.asarray(data.nodes_of_interest, dtype=np.int64),
        touch_node=node,
        touched=touched,
        directions=directions,
        compliance=compliance,
        mirrors=_mirrors(data, directions, body),
        reach=float(np.linalg.norm(data.displacement[:, node, :2], axis=1).max()),
        stiffness_max=float(max(stiffness)),
        radius=float(body.get("half_height", 0.005)),
        meta=meta,
    )


def _mirrors(data: Dataset, directions: np.ndarray, body: dict[str, Any]) -> bool:
    """One load across the beam, from zero up, and no weight: the other side is the mirror image."""
    across = len(data.ranges) == 1 and abs(directions[0, 0]) < 1e-12
    return bool(across and data.ranges[0].low == 0.0 and not body.get("self_weight", False))


def _meta(
    train: Dataset,
    few: Dataset,
    settings: Settings,
    refinement: Refinement,
    passes: int,
    seed: int,
    sequential: Learned,
) -> dict[str, Any]:
    return {
        "filter": {"samples": len(train), "passes": passes, "seed": seed, "units": sequential.network.units},
        "settings": asdict(settings),
        "refinement": asdict(refinement) | {"used": len(few)},
        "dataset": {"hash": train.hash, "provenance": train.provenance},
    }
