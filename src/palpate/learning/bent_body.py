"""From a dataset of loads and deflections to a body that a hand holds at one node: filter, refinement, energy.

Of one set of solves come

    fields   loads → displacements: of all nodes, of the nodes asked for, and the sequential filter's own network
    energy   the energy of the held node's place, whose slope is the force on the hand

To the solves one is added that needs no solver: no load, no deflection.

The hand displaces the node along the loads' unit directions D_i, i = 1 … k loads at that node.

*One load.* With nothing else on the body, its energy begins as ½ K w² with w = D·u, and the network says how it goes
on. A range of loads across the body that begins at zero is mirrored about its axis.

*Several loads, or others elsewhere.* No stiffness at rest is the same for all, and the energy is learnt above a
constant (`palpate.surrogates.baselines.constant_baseline`). A slender beam is hundreds of thousands of times stiffer
along its axis than across, so that near the straight state all axial loads share one displacement. A virtual coupling
of stiffness k_c between hand and node makes place → force a function (Colgate, Stanley & Brown 1995): with
h = D·u(P) + P/k_c the map h → P has a Jacobian between 0 and k_c, and P = ∇E(h) of E = W + |P|²/2k_c, W being the
body's energy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset, is_history
from palpate.errors import UsageError
from palpate.format import count
from palpate.learning.growth_frames import GrowthRecorder
from palpate.learning.learn import Learned, learn
from palpate.learning.recognised import Recognised, Request, recogniser
from palpate.learning.structure import refined_network
from palpate.network import Network
from palpate.options import Refinement, SearchOptions
from palpate.rbf.filter.settings import Settings, recommended
from palpate.rbf.forms import Centred
from palpate.surrogates import (
    Baseline,
    ConstantBaseline,
    NodeField,
    PadBaseline,
    RestStiffness,
    Solves,
    Stiffening,
)
from palpate.units import Quantity, Range, bounds

__all__ = ["FEWEST", "BentSolves", "hand_coordinates", "node_outputs", "recognise_bent"]

FEWEST = 4  # solves for an affine map of one input, and one to judge it by
_OBSERVATIONS = 1250  # five passes over the founding study's 251 training loads
_LEVEL = 3.0  # of the largest energy: ln(1 + U/U₀) is then nearly as smooth as U
_UNITS, _EFFORT = (12, 36), (1.0, 0.5)  # of the energy, for one load and for several
# solves of beams carry no noise, and their baseline has no rivals: one network goes down to round-off
_NOISELESS = {"choose": False, "networks": 1, "target": 1e-9, "ridge": 1e-13, "tolerance": 1e-9}


@recogniser
def recognise_bent(data: Dataset, request: Request) -> Recognised | None:
    """Return the body of solves under loads at nodes; None of any other dataset."""
    if "input_node" not in data or is_history(data):
        return None
    request.log(f"displacements of {count(len(data), 'solve')}")
    names = ("heldout", "settings", "refinement", "passes", "coupling", "progress", "watch")
    own, further = request.split(*names)
    bent = BentSolves.of(data, request.search, **own)
    return Recognised(
        bent.baseline,
        bent.solves,
        bent.options | further,
        rows=bent.rows,
        fields=bent.fields,
        meta=bent.meta,
        filter=bent.filter.history,
    )


@dataclass(frozen=True, eq=False)
class BentSolves:
    """A body that loads bend: its fields by load, and the solves of the energy of the hand's place."""

    baseline: Baseline
    solves: Solves
    options: dict[str, Any]  # of learning that energy
    fields: dict[
        str, NodeField
    ]  # displacements of all nodes, of those asked for, and the filter's answer for these
    meta: dict[str, Any]
    filter: Learned  # the sequential filter's network, with its history
    rows: np.ndarray  # (N,), converged solve that each one is; negative for the state without load

    @classmethod
    def of(
        cls,
        train: Dataset,
        search: SearchOptions,
        *,
        heldout: Dataset | None = None,
        settings: Settings | None = None,
        refinement: Refinement | None = None,
        passes: int | None = None,
        coupling: float | None = None,
        progress: Callable[[int, int], None] | None = None,
        watch: GrowthRecorder | None = None,
    ) -> BentSolves:
        """Learn the fields of solves under loads; the options are those of `palpate.learn` for such a body."""
        good = train.ok
        _refuse_unfit(good)
        settings = settings or recommended(len(good.ranges))
        refinement = refinement or _refinement_for(len(good.ranges))
        # few solves need more presentations: the filter sees each one's linearisation once per pass
        passes = passes or max(5, math.ceil(_OBSERVATIONS / len(good)))
        few, good = _with_rest(_spread_rows(good, refinement.samples)), _with_rest(good)
        with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
            outputs, columns = node_outputs(good)
            sequential = learn(
                good.X,
                _columns(good, columns),
                good.ranges,
                outputs,
                settings=settings,
                passes=passes,
                seed=search.seed,
                heldout=None if heldout is None else (heldout.ok.X, _columns(heldout.ok, columns)),
                progress=progress,
                watch=watch,
            )
            fields = _fields(few, outputs, columns, sequential, settings, refinement, search.seed)
            baseline, solves = _energy_of(few, fields["displacement"], coupling)
        units = sequential.network.units
        meta = {
            "filter": {"samples": len(good), "passes": passes, "seed": search.seed, "units": units},
            "settings": asdict(settings),
            "refinement": asdict(refinement) | {"used": len(few)},
        }
        several = len(few.ranges) > 1
        options = _NOISELESS | {"units_max": _UNITS[several], "effort": search.effort * _EFFORT[several]}
        return cls(baseline, solves, options, fields, meta, sequential, _rows_of(few, train.ok))


def _refuse_unfit(good: Dataset) -> None:
    """Refuse too few converged solves, and solves in space."""
    if len(good) < FEWEST:
        raise UsageError(
            f"{count(len(good), 'converged solve')}: too few to learn from.",
            fix=f"Sweep at least {FEWEST}, better 26 or more.",
        )
    if good.rest.shape[1] != 2:
        raise UsageError(
            "A body that loads bend is learnt in a plane; these solves have three coordinates.",
            why="The hand pulls a node in the plane of the body.",
            fix="Import or sweep it with two coordinates, such as coordinates = ['x', 'y'] in an import's mapping.",
        )


def node_outputs(data: Dataset) -> tuple[tuple[Quantity, ...], list[tuple[int, int]]]:
    """Return the founding study's outputs: displacements of the free nodes of interest, along the loads' axes.

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
    """Return h (N, k): the held node's displacement along each touched load, plus the coupling's stretch, m.

    Parameters
    ----------
    data : Dataset
        N solves of the body.
    touch_node : int
        The held node.
    touched : k ints
        Numbers of the loads that the hand supplies.
    compliance : float
        Of the coupling between hand and body, m/N.
    """
    along = data.displacement[:, touch_node, :2] @ data.load_directions[list(touched), :2].T
    return np.asarray(along + compliance * data.X[:, list(touched)])


def _columns(data: Dataset, columns: list[tuple[int, int]]) -> np.ndarray:
    return np.stack([data.displacement[:, i, c] for i, c in columns], axis=1)


def _refinement_for(inputs: int) -> Refinement:
    return Refinement() if inputs == 1 else Refinement(samples=400, units_max=36, target=2e-5, starts=2)


def _spread_rows(data: Dataset, count: int) -> Dataset:
    """Return at most `count` rows: for one input denser towards the ends, for several the first ones of a design.

    Chebyshev's spacing (1 − cos πt)/2 by rank: evenly spaced samples leave the ends with the largest error.
    """
    if not count or len(data) <= count:
        return data
    if data.X.shape[1] > 1:
        return data.take(np.arange(count))
    order = np.argsort(data.X[:, 0], kind="stable")
    share = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count))) / 2.0
    return data.take(order[np.unique(np.round(share * (len(data) - 1)).astype(int))])


def _rows_of(some: Dataset, data: Dataset) -> np.ndarray:
    """Return which row of a dataset has the inputs of each of some solves; negative where none has."""
    same = (some.X[:, None] == data.X[None]).all(axis=2)
    return np.where(same.any(axis=1), same.argmax(axis=1), -1)


def _with_rest(data: Dataset) -> Dataset:
    """Return the rows and one more that needs no solve: without load nothing deflects, and no energy is stored.

    Random loads hardly ever come near it, and several loads are learnt as small as that only if a row says so. A body
    with weight is bent without load; where zero is outside of a load's range nobody will ask there.
    """
    zero = all(r.low <= 0.0 <= r.high for r in data.ranges)
    if _has_weight(data) or not zero or not np.abs(data.X).any(axis=1).all():
        return data
    row = data.take([0]).data
    still = {
        name: row[name] * 0.0
        for name in row.data_vars
        if "sample" in row[name].dims and np.issubdtype(row[name].dtype, np.floating)
    }
    return Dataset.concat([data, Dataset(row.assign(still))])


def _touched(data: Dataset) -> tuple[int, tuple[int, ...]]:
    """Return the loaded node farthest along the beam, and the loads that act there."""
    node = int(data.load_nodes[np.argmax(data.rest[data.load_nodes, 0])])
    return node, tuple(int(i) for i in np.flatnonzero(data.load_nodes == node))


def _fields(
    data: Dataset,
    outputs: tuple[Quantity, ...],
    columns: list[tuple[int, int]],
    sequential: Learned,
    settings: Settings,
    refinement: Refinement,
    seed: int,
) -> dict[str, NodeField]:
    """Return the fields by load: of the nodes asked for, of all nodes, and what the filter alone says."""
    options: dict[str, Any] = {
        "target": refinement.target,
        "units_max": refinement.units_max,
        "starts": refinement.starts,
        "seed": seed,
    }
    filter_units = _filter_units(sequential, settings)
    nodes, refined, _ = refined_network(
        data.X, _columns(data, columns), data.ranges, outputs, filter_units=filter_units, **options
    )
    names = [Quantity(f"u_{c} at {x:g} m", "m") for x in data.rest[:, 0] for c in "xy"]
    planar = data.displacement[:, :, :2].reshape(len(data), -1)
    whole = refined_network(data.X, planar, data.ranges, names, filter_units=refined.theta, **options)[0]
    everywhere = [(node, component) for node in range(len(data.rest)) for component in range(2)]
    held, touched = _touched(data)
    body = data.provenance.get("problem", {}).get("body", {})
    common: dict[str, Any] = {
        "unit": "m",
        "points": np.pad(data.rest, ((0, 0), (0, 1))),
        "held": held,
        "touched": np.array(touched),
        "mirror": _directions(data, touched)[0] if _mirrors(data, touched) else None,
        "radius": float(body.get("half_height", 0.005)),
        "of_interest": np.asarray(data.nodes_of_interest),
    }
    return {
        "displacement": NodeField("displacement", network=whole, columns=np.array(everywhere), **common),
        "nodes": NodeField("nodes", network=nodes, columns=np.array(columns), **common),
        "filter": NodeField("filter", network=sequential.network, columns=np.array(columns), **common),
    }


def _directions(data: Dataset, touched: tuple[int, ...]) -> np.ndarray:
    """Return the unit directions (k, 3) of the touched loads."""
    return np.pad(data.load_directions[list(touched), :2], ((0, 0), (0, 1)))


def _has_weight(data: Dataset) -> bool:
    return bool(data.provenance.get("problem", {}).get("body", {}).get("self_weight", False))


def _is_even(data: Dataset) -> bool:
    """Return whether a body is its own mirror image across its axis: straight and without weight, unless it says no."""
    return not _has_weight(data) and bool(
        data.provenance.get("problem", {}).get("body", {}).get("mirrored", True)
    )


def _mirrors(data: Dataset, touched: tuple[int, ...]) -> bool:
    """Return whether the other side is a mirror image: one load across the body, from zero up, of an even body."""
    across = len(data.ranges) == 1 and abs(_directions(data, touched)[0, 0]) < 1e-12
    return bool(across and data.ranges[0].low == 0.0 and _is_even(data))


def _energy_of(data: Dataset, field: NodeField, coupling: float | None) -> tuple[Baseline, Solves]:
    """Return the baseline and the solves of the energy of the hand's place."""
    touched = tuple(field.touched.tolist())
    others = [i for i in range(len(data.ranges)) if i not in touched]
    D, P = _directions(data, touched), data.X[:, list(touched)]
    compliance = _compliance(field.network, field.held, touched, data, coupling)
    h = hand_coordinates(data, field.held, touched, compliance)
    w = h - compliance * P
    energy = data.potential_energy + (P * w).sum(axis=1) + 0.5 * compliance * (P**2).sum(axis=1)
    ranges = _hand_ranges(data, field, h, compliance)
    mirror = np.stack([np.eye(3), np.diag([1.0, -1.0, 1.0])])  # of a straight body in the x–y plane
    if not others and len(touched) == 1 and not _has_weight(data):
        moved = np.abs(h[:, 0]) > 0.0
        symmetry = mirror if field.mirror is not None else np.zeros((0, 3, 3))
        if field.mirror is not None:
            top = max(abs(ranges[0].low), abs(ranges[0].high))
            ranges = [Range(ranges[0].name, -top, top, "m")]
        rows, least = np.flatnonzero(moved), int(np.argmin(np.where(moved, np.abs(h[:, 0]), np.inf)))
        _refuse_still(rows, data)
        stiffness = np.array([[P[least, 0] / h[least, 0]]])
        baseline = PadBaseline(RestStiffness.even(stiffness), Stiffening.none(1), axes=D)
        return baseline, Solves(h[rows], energy[rows], -P[rows], None, tuple(ranges), symmetry=symmetry)
    _refuse_still(np.flatnonzero(np.abs(h).any(axis=1)), data)
    energy -= energy.min()
    level = _LEVEL * max(float(energy.max()), np.finfo(float).tiny)
    # −∂U/∂p of a load elsewhere is its own displacement
    there = np.einsum(
        "nic,ic->ni", data.displacement[:, data.load_nodes[others], :2], data.load_directions[others, :2]
    )
    symmetric = not others and _is_even(data) and bool((np.abs(D) > 1 - 1e-12).any(axis=1).all())
    even = all(r.low == -r.high for r, d in zip(data.ranges, D, strict=False) if abs(d[1]) > 0.5)
    return ConstantBaseline(level, D, compliance), Solves(
        np.hstack([h, data.X[:, others]]),
        energy,
        np.hstack([-P, there]),
        None,
        (*ranges, *(data.ranges[i] for i in others)),
        symmetry=mirror if symmetric and even else np.zeros((0, 3, 3)),
    )


def _refuse_still(rows: np.ndarray, data: Dataset) -> None:
    if len(rows) < 2:
        raise UsageError(
            f"{len(rows)} of {len(data)} solves move the node that the hand holds.",
            why="Without motion there is no stiffness to feel.",
            fix="Sweep loads that bend the body.",
        )


def _filter_units(sequential: Learned, settings: Settings) -> np.ndarray | None:
    """Return the filter's units as axis-aligned ones, where they have centres."""
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
    """Return ∂(D·u)/∂P (k, k) at the held node, symmetrised, m/N."""
    J = field.jacobian(x)[2 * node : 2 * node + 2][:, list(touched)]
    C = data.load_directions[list(touched), :2] @ J
    return np.asarray((C + C.T) / 2)


def _hand_ranges(data: Dataset, field: NodeField, h: np.ndarray, compliance: float) -> list[Range]:
    """Return the ranges of the hand's coordinates: those of the declared loads, which a design may not have sampled."""
    touched = list(field.touched)
    D = _directions(data, tuple(touched))
    corners = _lattice(data.ranges)
    reach = field.values(corners)[:, field.held] @ D.T + compliance * corners[:, touched]
    low, high = np.minimum(reach.min(0), h.min(0)), np.maximum(reach.max(0), h.max(0))
    return [
        Range(f"h along {data.ranges[i].name}", float(a), float(b), "m")
        for i, a, b in zip(touched, low, high, strict=True)
    ]


def _lattice(ranges: tuple[Range, ...], points: int = 9) -> np.ndarray:
    """Return a full grid of the declared ranges, (points^n, n); coarser for many inputs."""
    low, high = bounds(ranges)
    count = max(2, min(points, int(4096 ** (1.0 / len(ranges)))))
    axes = [np.linspace(a, b, count) for a, b in zip(low, high, strict=True)]
    return np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
