"""From solves of a touched body to its surrogate: one energy, its law, its network and what it is trusted with."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.learning.energy.images import images_of
from palpate.learning.energy.laws import chosen_law
from palpate.learning.energy.samples import EnergySamples
from palpate.learning.energy.search import EnergyTrial, Problem, Search
from palpate.learning.energy.trust import trust_of
from palpate.learning.freezing import training_record
from palpate.learning.refinement.refine import Refined
from palpate.learning.units.symmetric import Images, SymmetricRegressors
from palpate.network import Network, Scaling, TrainedRegion
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction
from palpate.surrogates import ContactLaw, TouchedSurface, TouchSurrogate
from palpate.units import Quantity, Range, bounds

__all__ = ["LearntSurrogate", "learn_surrogate"]

_LAW_SHARE, _FORM_SHARE = 0.15, 0.35  # of the time
_FORMS = ("rotated", "axis-aligned", "rank-2")  # the last for more inputs than the position
_RADIALS: tuple[RadialFunction, ...] = ("inverse-multiquadric", "matern-5/2", "gaussian")
_FIRST = 6  # units by which forms are compared
_SPREAD = (0.6, 1.4)  # sizes of further networks over that of the best
_COPIES = 512  # points of a region are kept at most; more images would only be thinned again
Law = ContactLaw | Literal["auto"]


@dataclass(frozen=True, eq=False)
class LearntSurrogate:
    """A surrogate, and how it was found.

    Attributes
    ----------
    surrogate : TouchSurrogate
    trials : tuple of EnergyTrial
        All networks that were tried, in order.
    errors : (N,)
        Relative force error of each solve in contact when it is left out.
    loo : float
        Leave-one-solve-out error of the network chosen, as in its trial.
    """

    surrogate: TouchSurrogate
    trials: tuple[EnergyTrial, ...]
    errors: np.ndarray
    loo: float


def learn_surrogate(
    X: np.ndarray,
    energy: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray | None,
    *,
    surface: TouchedSurface,
    radius: float,
    inputs: Sequence[Range],
    symmetry: Sequence[np.ndarray] = (),
    about: np.ndarray | None = None,
    law: Law = "auto",
    length: float | None = None,
    units_max: int = 96,
    target: float = 1e-3,
    seconds: float = 60.0,
    resolved: float | None = None,
    form: str = "auto",
    radial: RadialFunction | Literal["auto"] = "auto",
    seed: int = 0,
) -> LearntSurrogate:
    """Learn the energy of a touched body from solves.

    Parameters
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    energy : (N,)
        U(c), J; zero without contact.
    force : (N, 3) or (N, n)
        On the probe, N; then −∂U/∂p by further inputs p, not-a-number where it is not known.
    stiffness : (N, 3, 3), optional
        ∂F/∂c, N/m; not-a-number where unknown.
    surface : TouchedSurface
        At rest.
    radius : float
        Of the probe, m.
    inputs : n ranges
    symmetry : (3, 3) matrices
        Isometries of body, supports and touched surface: the whole group, the identity among them.
    about : (3,), optional
        The point that they leave where it is, m; the middle of the ranges by default.
    law : ContactLaw or "auto"
    length : float, optional
        A guess of the law's crossing length, m (see `palpate.surrogates.laws`); a tenth of the radius by default.
    units_max : int
        Most units; images count.
    target : float
        Leave-one-solve-out error at which no more units are added.
    seconds : float
        For the search; a refinement under way is ended.
    resolved : float, optional
        Depth (m) at which a contact is as wide as an element; an eighth of the radius by default, for elements of
        half the radius.
    form : str
        Of a unit (see `palpate.learning.units.forms`), or "auto".
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2", "auto"}
    seed : int
        Decides the starts. With a limit on time the result also depends on the machine's speed.

    Returns
    -------
    LearntSurrogate

    Raises
    ------
    UsageError
        If samples, surface, symmetry or options do not fit.
    """
    begun, inputs = time.monotonic(), tuple(inputs)
    if not (math.isfinite(seconds) and seconds > 0 and radius > 0 and units_max >= 0):
        raise UsageError(
            f"seconds={seconds}, radius={radius} and units_max={units_max} allow no learning.",
            fix="Give positive numbers.",
        )
    if radial != "auto" and radial not in get_args(RadialFunction):
        raise UsageError(f"There is no radial function {radial!r}.", fix=f"Choose from {RADIAL_FUNCTIONS}.")
    known = {"surface": surface, "radius": radius, "inputs": inputs}
    samples = EnergySamples.of(X, energy, force, stiffness, **known)  # type: ignore[arg-type]
    images = images_of(symmetry, about, inputs)
    resolved = radius / 8.0 if resolved is None else resolved
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        trials: tuple[EnergyTrial, ...] = ()
        if not isinstance(law, ContactLaw):
            guess = radius / 10.0 if length is None else length
            share = _LAW_SHARE * seconds
            law, trials = chosen_law(samples, images, guess, resolved=resolved, seconds=share, seed=seed)
        problem = Problem(samples.scaled, samples.rows(law, resolved=resolved), images, str(law))
        search = _searched(problem, begun + seconds, form, radial, units_max, target, seed)
        best = search.best
        assert best is not None  # the tail at least was tried
        trust = trust_of(best, problem, samples)
    trials = (*trials, *search.trials)
    meta = _meta(samples, images, best, search.error, trust.errors)
    network, root = _written_out(best, trust.root, samples, meta)
    surrogate = TouchSurrogate(
        network, law, surface, radius, region=_region(samples, images), root=root, meta=meta
    )
    return LearntSurrogate(surrogate, trials, trust.errors, search.error)


def _searched(
    problem: Problem,
    deadline: float,
    form: str,
    radial: RadialFunction | Literal["auto"],
    units_max: int,
    target: float,
    seed: int,
) -> Search:
    """Every kind of unit at one size, then growth of the best two, and what time is left for starts of any size."""
    search = Search(problem, deadline, seed)
    copies = 1 if problem.images is None else len(problem.images.turns)
    most, n = units_max // copies, problem.X.shape[1]
    found: list[tuple[Refined, float]] = []
    until = time.monotonic() + _FORM_SHARE * search.left
    for kind in _kinds(form, radial, n):
        of = problem.regressors(*kind)
        h = min(_FIRST, most, problem.room(of))
        if not found or time.monotonic() < until:
            found.append(search.tried(search.random(of, h), of, "kind", 80))
    found.sort(key=lambda one: one[1])
    for i, (one, _) in enumerate(found[:2]):
        rest = search.deadline
        search.deadline = time.monotonic() + max(search.left, 0.0) / (len(found[:2]) - i)
        search.grow(one, most, target)
        search.deadline = rest
    rng = np.random.default_rng([seed, len(found)])
    while search.left > 0 and search.error > target and search.best is not None and len(search.best.theta):
        of = found[int(rng.integers(min(3, len(found))))][0].regressors
        h = round(len(search.best.theta) * rng.uniform(*_SPREAD))
        search.tried(search.random(of, min(max(h, 1), most, problem.room(of))), of, "random")
    return search


def _kinds(
    form: str, radial: RadialFunction | Literal["auto"], inputs: int
) -> list[tuple[str, RadialFunction]]:
    """Forms and radial functions to try: the first of each list with all of the other."""
    forms = [f for f in _FORMS if f != "rank-2" or inputs > 3] if form == "auto" else [form]
    radials = list(_RADIALS) if radial == "auto" else [radial]
    return [(forms[0], r) for r in radials] + [(f, r) for f in forms[1:] for r in radials[:2]]


def _written_out(
    best: Refined, root: np.ndarray, samples: EnergySamples, meta: dict[str, Any]
) -> tuple[Network, np.ndarray]:
    """The network with every unit's images as units of their own, and the root of its weights' covariance."""
    of, n = best.regressors, len(samples.inputs)
    if isinstance(of, SymmetricRegressors):
        factors, shifts, coefficients = of.expanded(best.theta, best.coefficients)
        root = of.expanded(best.theta, root)[2]
    else:
        factors, shifts = of.form.factors(best.theta)
        coefficients = best.coefficients
    low, high = bounds(samples.inputs)
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(1), np.ones(1))
    network = Network(
        samples.inputs,
        (Quantity("ln U/U0", ""),),
        factors,
        shifts,
        coefficients[1 + n :].T,
        coefficients[: 1 + n].T,
        scaling,
        meta={k: v for k, v in meta.items() if k == "training"},
        radial=of.radial,
    )
    return network, root


def _region(samples: EnergySamples, images: Images | None) -> TrainedRegion:
    points = samples.scaled if images is None else images.of(samples.scaled).reshape(-1, len(samples.inputs))
    return TrainedRegion.of(points, most=_COPIES)


def _meta(
    samples: EnergySamples, images: Images | None, best: Refined, loo: float, errors: np.ndarray
) -> dict[str, Any]:
    copies = 1 if images is None else len(images.turns)
    return {
        **training_record(samples.X, samples.energy[:, None], samples.inputs),
        "solves": len(samples),
        "samples": copies * len(samples),
        "form": best.regressors.form.name,
        "radial": best.regressors.radial,
        "loo": loo if math.isfinite(loo) else None,
        "left_out": {"median": float(np.median(errors)), "p95": float(np.quantile(errors, 0.95))},
    }
