"""From solves of a held body to its surrogate: stiffness at rest, network and what it is trusted with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.format import share
from palpate.learning.energy.energy_problem import EnergyProblem
from palpate.learning.energy.energy_search import search_energy
from palpate.learning.energy.trust import trust_of
from palpate.learning.energy.written import trained_region, training_meta, written_out
from palpate.learning.grasp.images import hold_images
from palpate.learning.grasp.rest import found_law
from palpate.learning.grasp.samples import GraspSamples
from palpate.learning.search import Budget, Trial
from palpate.network.radial import RADIAL_FUNCTIONS, RadialFunction
from palpate.surrogates.grasp import GraspSurrogate
from palpate.units import Range

__all__ = ["LearntGrasp", "learn_grasp"]

FEWEST = 4  # solves: stiffness at rest and its stiffening have to be found from them, and judged by them
_RIDGE = 1e-4  # on the units' squared weights: few solves do not decide on large ones in five dimensions

Degree = Literal["auto", 0, 1, 2]


@dataclass(frozen=True, eq=False)
class LearntGrasp:
    """A surrogate, and how it was found.

    Attributes
    ----------
    surrogate : GraspSurrogate
    trials : tuple of Trial
        All networks that were tried, in order.
    errors : (N,)
        Relative force error of each solve with a displaced pad when it is left out.
    loo : float
        Of the mean of networks chosen: what it misses of solves left out, by closed form and refined again without
        them, as a geometric mean.
    law_errors : dict
        What S and P alone miss of solves left out, by the degrees of both.
    """

    surrogate: GraspSurrogate
    trials: tuple[Trial, ...]
    errors: np.ndarray
    loo: float
    law_errors: dict[tuple[int, int], float]

    def __str__(self) -> str:
        median, p95 = (share(float(np.quantile(self.errors, q))) for q in (0.5, 0.95))
        return (
            f"{self.surrogate.meta['solves']} solves, {len(self.trials)} networks of the energy tried; a solve left "
            f"out is missed by {median} of its force (median), {p95} (95th percentile)"
        )

    __repr__ = __str__


def learn_grasp(
    X: np.ndarray,
    energy: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray | None,
    *,
    inputs: Sequence[Range],
    axes: Sequence[int] = (0, 1),
    symmetry: Sequence[np.ndarray] = (),
    about: np.ndarray | None = None,
    degree: Degree = "auto",
    stiffening: Literal["auto", 0, 1, 2, 3, 4, 5] = "auto",
    units_max: int = 192,
    networks: int = 4,
    target: float = 1e-3,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
    form: str = "auto",
    radial: RadialFunction | Literal["auto"] = "auto",
    seed: int = 0,
) -> LearntGrasp:
    """Learn the energy of a held body from solves.

    Parameters
    ----------
    X : (N, n)
        Displacement of the pad (m), then its place (m), then further inputs.
    energy : (N,)
        U, J; zero at rest.
    force : (N, 3) or (N, n)
        −∂U/∂d on the hand, N; or that and −∂U/∂y by the other inputs, which every solve knows too.
    stiffness : (N, 3, 3) or (N, n, n), optional
        Derivative of the force; not-a-number where unknown. Pads at rest are of use through it.
    inputs : n ranges
    axes : sequence of int
        Along which axes the place's coordinates are: two on a face, (0, 1, 2) on a curved surface, () for none.
    symmetry : (3, 3) matrices
        Isometries of body, supports and surface: the whole group, the identity among them.
    about : (3,), optional
        The point that they leave where it is, m; the middle of the place's ranges by default.
    degree : {"auto", 0, 1, 2}
        Of the stiffness at rest as a polynomial of place and further inputs.
    stiffening : {"auto", 0 … 5}
        Degree of the polynomial P of all inputs.
    units_max : int
        Most units of one network; images count.
    networks : int
        How many at most make one surrogate, as their mean; one answers faster, four miss less.
    target : float
        Leave-one-solve-out error at which no more units are added.
    effort : float
        Multiplies the counts of candidates and iterations of the search; 0.1 gives a quick look.
    seconds : float, optional
        Limit on time; by default none. A limit that ends the search early makes the result depend on the machine.
    workers : int, optional
        Processes that search at a time; one for each core by default, at most eight. The result is the same with any
        number.
    form : str
        Of a unit (see `palpate.rbf.forms`), or "auto".
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2", "auto"}
    seed : int
        Decides the starts, and with them the result.

    Returns
    -------
    LearntGrasp

    Raises
    ------
    UsageError
        If samples, symmetry or options do not fit, or there are fewer than four samples.
    """
    budget, inputs = Budget.of(effort, seconds), tuple(inputs)
    _require(units_max, networks, radial, axes, len(inputs))
    if len(X) < FEWEST:
        raise UsageError(
            f"{len(X)} converged solves are too few to learn a held body from.",
            fix=f"Sweep at least {FEWEST}, better 20 or more.",
        )
    samples = GraspSamples.of(X, energy, force, stiffness, inputs=inputs)
    images = hold_images(symmetry, about, inputs, axes)
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        found = found_law(
            samples,
            images,
            symmetry,
            None if degree == "auto" else degree,
            None if stiffening == "auto" else stiffening,
        )
        rows = samples.rows(found.rest, found.stiffening)
        problem = EnergyProblem(samples.scaled, rows, images, _RIDGE)
        mean, trials = search_energy(
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
        trust = trust_of(mean, samples)
    meta = training_meta(samples, mean, trust.errors)
    network, root = written_out(mean, trust.root, samples, meta)
    surrogate = GraspSurrogate(
        network, found.rest, found.stiffening, region=trained_region(samples, images), root=root, meta=meta
    )
    return LearntGrasp(surrogate, trials, trust.errors, mean.error, found.errors)


def _require(units_max: int, networks: int, radial: str, axes: Sequence[int], inputs: int) -> None:
    if not (units_max >= 0 and networks >= 1):
        raise UsageError(
            f"units_max={units_max} and networks={networks} allow no learning.",
            fix="Give positive numbers.",
        )
    if radial != "auto" and radial not in get_args(RadialFunction):
        raise UsageError(f"There is no radial function {radial!r}.", fix=f"Choose from {RADIAL_FUNCTIONS}.")
    if len(set(axes)) != len(axes) or not set(axes) <= {0, 1, 2} or 3 + len(axes) > inputs:
        raise UsageError(
            f"A place along the axes {tuple(axes)} does not fit {inputs} inputs.",
            why="Three components of the displacement come first, then one coordinate of the place for each axis.",
            fix="Name the axes of the place's coordinates, for example (0, 1) on top of a block.",
        )
