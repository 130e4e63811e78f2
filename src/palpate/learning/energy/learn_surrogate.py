"""From solves of a touched body to its surrogate: one energy, its law, its network and what it is trusted with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_search import search_energy
from palpate.learning.energy.images import images_of
from palpate.learning.energy.laws import chosen_law
from palpate.learning.energy.samples import EnergySamples
from palpate.learning.energy.trust import trust_of
from palpate.learning.energy.written import trained_region, training_meta, written_out
from palpate.learning.search import Budget, Trial
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction
from palpate.surrogates import ContactLaw, Continuation, TouchedSurface, TouchSurrogate
from palpate.units import Range

__all__ = ["LearntSurrogate", "learn_surrogate"]

_LAW_SHARE = 0.15  # of the time
_NEARLY = 0.9  # of the wanted depth: columns of depths are shifted at random and end just before it
Law = ContactLaw | Literal["auto"]


@dataclass(frozen=True, eq=False)
class LearntSurrogate:
    """A surrogate, and how it was found.

    Attributes
    ----------
    surrogate : TouchSurrogate
    trials : tuple of Trial
        All networks that were tried, in order.
    errors : (N,)
        Relative force error of each solve in contact when it is left out.
    loo : float
        Of the mean of networks chosen: what it misses of solves left out, by closed form and refined again without
        them, as a geometric mean.
    """

    surrogate: TouchSurrogate
    trials: tuple[Trial, ...]
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
    radius_input: int | None = None,
    symmetry: Sequence[np.ndarray] = (),
    about: np.ndarray | None = None,
    law: Law = "auto",
    length: float | None = None,
    units_max: int = 160,
    networks: int = 12,
    target: float = 1e-3,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
    resolved: float | None = None,
    deepest: float | None = None,
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
        Of the probe, m; where it is an input, a usual one.
    inputs : n ranges
    radius_input : int, optional
        The input, 3 or later, that is the probe's radius.
    symmetry : (3, 3) matrices
        Isometries of body, supports and touched surface: the whole group, the identity among them.
    about : (3,), optional
        The point that they leave where it is, m; the middle of the ranges by default.
    law : ContactLaw or "auto"
    length : float, optional
        A guess of the law's crossing length, m (see `palpate.surrogates.laws`); a tenth of the radius by default.
    units_max : int
        Most units of one network; images count.
    networks : int
        How many at most make one surrogate, as their mean, and no more than 320 units do; one answers faster,
        several miss less.
    target : float
        Leave-one-solve-out error at which no more units are added.
    effort : float
        Multiplies the counts of candidates and iterations of the search; 0.1 gives a quick look.
    seconds : float, optional
        Limit on time; by default none. A limit that ends the search early makes the result depend on the machine.
    workers : int, optional
        Processes that search at a time; one for each core by default, at most eight. The result is the same with any
        number.
    resolved : float, optional
        Depth (m) at which a contact is as wide as an element; an eighth of the radius by default, for elements of
        half the radius.
    deepest : float, optional
        Depth (m) that the solves were to reach, or that they did reach where they came less far than nine tenths of
        it: beyond it nothing counts as trained, whatever the ranges say. By default they alone decide.
    form : str
        Of a unit (see `palpate.rbf.forms`), or "auto".
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2", "auto"}
    seed : int
        Decides the starts, and with them the result.

    Returns
    -------
    LearntSurrogate

    Raises
    ------
    UsageError
        If samples, surface, symmetry or options do not fit.
    """
    budget, inputs = Budget.of(effort, seconds), tuple(inputs)
    if not (radius > 0 and units_max >= 0 and networks >= 1):
        raise UsageError(
            f"radius={radius}, units_max={units_max} and networks={networks} allow no learning.",
            fix="Give positive numbers.",
        )
    if radial != "auto" and radial not in get_args(RadialFunction):
        raise UsageError(f"There is no radial function {radial!r}.", fix=f"Choose from {RADIAL_FUNCTIONS}.")
    known = {"surface": surface, "radius": radius, "inputs": inputs, "radius_input": radius_input}
    samples = EnergySamples.of(X, energy, force, stiffness, **known)  # type: ignore[arg-type]
    images = images_of(symmetry, about, inputs)
    resolved = radius / 8.0 if resolved is None else resolved
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        trials: tuple[Trial, ...] = ()
        if not isinstance(law, ContactLaw):
            guess = radius / 10.0 if length is None else length
            share = budget.part(_LAW_SHARE)
            law, trials = chosen_law(samples, images, guess, resolved=resolved, budget=share, seed=seed)
        rows = samples.rows(law, resolved=resolved)
        problem = EnergyProblem(samples.scaled, rows, images, finest=samples.finest(radius))
        found, tried = search_energy(
            problem,
            form=form,
            radial=radial,
            units_max=units_max,
            networks=networks,
            target=target,
            budget=budget,
            workers=workers,
            seed=seed,
        )
        trust = trust_of(found, samples)
    meta = training_meta(samples, found, trust.errors)
    network, root = written_out(found, trust.root, samples, meta)
    surrogate = TouchSurrogate(
        *(network, law, surface),
        radius=radius if radius_input is None else math.nan,
        radius_input=radius_input,
        region=trained_region(samples, images, rows["groups"]),
        continuation=Continuation.of(inputs, deepest=_reached(samples.depth, deepest)),
        root=root,
        meta=meta,
    )
    return LearntSurrogate(surrogate, (*trials, *tried), trust.errors, found.error)


def _reached(depths: np.ndarray, wanted: float | None) -> float:
    """To which depth samples at `depths` (N,) teach; they are spread up to the wanted one, and end just before it."""
    if wanted is None:
        return math.inf
    own = float(depths.max())
    return wanted if _NEARLY * wanted <= own <= wanted else own
