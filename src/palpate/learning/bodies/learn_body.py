"""From a sweep of touches to a body that is felt and seen."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from palpate.dataset import Dataset, Layout
from palpate.format import share
from palpate.learning.bodies.images import snapshots_of
from palpate.learning.bodies.touches import Touches
from palpate.learning.energy import LearntSurrogate, learn_surrogate
from palpate.learning.fields import LearntField, learn_snapshots, lumped_mass
from palpate.learning.search import Budget
from palpate.surrogates import TouchedBody

__all__ = ["TouchHistory", "learn_body"]

SHARE = 0.25  # of the energy's time for a field, where time is limited


@dataclass(frozen=True, eq=False)
class TouchHistory:
    """How a touched body was learnt.

    Attributes
    ----------
    energy : LearntSurrogate
        The energy, every network that was tried, and the error of each solve when it is left out.
    shape : LearntField or None
        The same of the displacement; None if only the force was asked for.
    stress : LearntField or None
        The same of the von Mises stress; None if the sweep has none.
    solves : int
        That were learnt from.
    seconds : float
    """

    energy: LearntSurrogate
    shape: LearntField | None
    solves: int
    seconds: float
    stress: LearntField | None = None

    def __str__(self) -> str:
        tried = len(self.energy.trials)
        left = self.energy.surrogate.meta.get("left_out", {})
        words = f"{self.solves} solves, {tried} networks of the energy tried in {self.seconds:.0f} s"
        if left:
            words += (
                f"; a solve left out is missed by {share(left['median'])} of its force (median), "
                f"{share(left['p95'])} (95th percentile)"
            )
        if self.shape is not None:
            modes = self.shape.field.meta["modes"]
            words += f"; shape: {modes} modes, which miss {1e3 * self.shape.truncation:.2g} mm"
        if self.stress is not None:
            field = self.stress.field
            words += (
                f"; von Mises stress: {field.meta['modes']} modes, which miss {self.stress.truncation:.2g} Pa"
            )
        return words

    __repr__ = __str__


def learn_body(
    train: Dataset,
    *,
    name: str = "body",
    layout: Layout | None = None,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
    units_max: int = 160,
    target: float = 1e-3,
    shape: bool = True,
    seed: int = 0,
    say: Callable[[str], None] = lambda _: None,
    **options: Any,
) -> tuple[TouchedBody, TouchHistory]:
    """Learn a body that can be touched anywhere on a surface, and seen.

    Parameters
    ----------
    train : Dataset
        Of ``palpate.sweep(body, probe, …)``; rows that did not converge are left out. The body's symmetry stands in it.
    name : str
    layout : Layout, optional
        Of a mesh that is fine wherever the body shall be touched, where the sweep's is fine in a part only.
    effort : float
        Multiplies the counts of candidates and iterations of the search; 0.1 gives a quick look.
    seconds : float, optional
        Limit on the time of learning; by default none. A limit that ends a search early makes the result depend on
        the machine.
    workers : int, optional
        Processes that search at a time; one for each core by default, at most eight. The result is the same with any
        number.
    units_max : int
        Most units of the energy; mirror images count.
    target : float
        Leave-one-solve-out error of the energy at which no more units are added.
    shape : bool
        Whether to learn the displacement of the surface too, and the stress there if it is in the dataset.
    seed : int
    say : callable
        Told what begins, as one line.
    **options
        Of `palpate.learning.energy.learn_surrogate`.

    Returns
    -------
    TouchedBody, TouchHistory

    Raises
    ------
    UsageError
        If the data is of no body under one probe, lacks energies, has too few solves or none in contact.
    """
    budget, began = Budget.of(effort, seconds), time.monotonic()
    touches = Touches.of(train, layout)
    fields = [("displacement", "m")] if shape else []
    if shape and "von_mises" in touches.data:
        fields.append(("von_mises", "Pa"))
    searched: dict[str, Any] = {"effort": effort, "workers": workers, "seed": seed}

    def limit(share: float) -> float | None:
        """Return a share of the time that is left; nothing where it is not limited."""
        return None if seconds is None else max(share * budget.left, 0.1)

    say(f"energy of {len(touches.data)} solves")
    own = {"seconds": limit(1.0 / (1.0 + SHARE * len(fields))), "units_max": units_max, "target": target}
    energy = _energy(touches, searched | own | options)
    learnt: dict[str, LearntField] = {}
    for i, (quantity, unit) in enumerate(fields):
        say("shape" if quantity == "displacement" else "stress")
        own = {"seconds": limit(1.0 / (len(fields) - i))}
        learnt[quantity] = _field(touches, quantity, unit, searched | own)
    meta = {**energy.surrogate.meta, "name": name, "dataset": _origin(touches.data)}
    touch = replace(energy.surrogate, meta=meta)
    history = TouchHistory(
        energy,
        learnt.get("displacement"),
        len(touches.data),
        time.monotonic() - began,
        learnt.get("von_mises"),
    )
    return TouchedBody(touch, {quantity: one.field for quantity, one in learnt.items()}), history


def _energy(touches: Touches, options: dict[str, Any]) -> LearntSurrogate:
    data = touches.data
    K = data.response_gradient[:, :3, :3] if "response_gradient" in data else None
    known: dict[str, Any] = {
        "surface": touches.surface,
        "radius": touches.radius,
        "radius_input": touches.radius_input,
        "inputs": touches.inputs,
        "symmetry": touches.matrices if len(touches.matrices) > 1 else (),
        "about": touches.about,
        "resolved": touches.resolved,
        "deepest": touches.deepest or None,
    }
    return learn_surrogate(data.X, data.potential_energy, data.response, K, **(known | options))


def _field(touches: Touches, name: str, unit: str, options: dict[str, Any]) -> LearntField:
    return learn_snapshots(
        snapshots_of(touches, name, seed=options["seed"]),
        inputs=touches.inputs,
        points=touches.points,
        triangles=touches.triangles,
        mass=lumped_mass(touches.points, touches.triangles),
        surface=touches.surface,
        radius=touches.radius,
        radius_input=touches.radius_input,
        name=name,
        unit=unit,
        **options,
    )


def _origin(data: Dataset) -> dict[str, Any]:
    return {"hash": data.hash, "provenance": data.provenance}
