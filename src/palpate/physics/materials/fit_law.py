"""Constants of a material from tests on specimens: `fit`.

The constants minimise Σ ((model − measured)/scale)² over all rows of all tests. Stresses of an incompressible law are
linear in its moduli, so that exponents alone need a search, and moduli are their (non-negative) linear least squares:
variable projection (Golub & Pereyra 1973) with SciPy's `least_squares`, a trust region with bounds (Branch, Coleman &
Li 1999), and `nnls`. Of a compressible law the sides' stretch depends on the ratio of the moduli, so that this is a
first guess, from which `least_squares` (a dogleg in a box, Voglis & Lagaris 2004) searches all constants at once.
Intervals are those of the linearised model, s² (JᵀJ)⁻¹ with Student's t; of moduli whose sign is known, in their
logarithm. A law is stable if Drucker's criterion holds in every mode as far as I₁ − 3 goes in the data, and `margin`
farther. Laws are compared by Akaike's criterion for few rows (Hurvich & Tsai 1989), N ln(RSS/N) + 2k +
2k(k + 1)/(N − k − 1) with k constants and a scatter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from palpate import checks
from palpate.errors import PalpateError, UsageError
from palpate.physics.materials.law_forms import CANDIDATES, LawForm, form_of, stress_in_test
from palpate.physics.materials.material_fit import Constant, MaterialFit, Rival
from palpate.physics.materials.material_stability import Stability, stability
from palpate.physics.materials.specimen_tests import (
    IndentationTest,
    SpecimenTest,
    StretchTest,
    first_invariant,
)

__all__ = ["fit", "ranges_of_strain"]

Weight = Literal["peak", "stress", "relative"]
_WEIGHTS = ("peak", "stress", "relative")
LEAST_STRESS = 0.02  # share of a test's largest stress below which a relative error no longer counts
DIFFERENCE = 1e-5  # share of a coordinate by which the Jacobian moves it
REFUSED = 1e6  # residual of constants that no material has
LAST_EVALUATIONS = 60  # of the last search of a compressible law, which begins near its end
NEAR_VOLUME = (-0.02, 0.02)  # range of J − 1 over which a nearly incompressible law must be stable
MODES = ("uniaxial", "equibiaxial", "planar", "simple shear")


def fit(
    law: Any = None,
    tests: SpecimenTest | Sequence[SpecimenTest] = (),
    *,
    poisson: float = 0.5,
    weight: Weight = "peak",
    margin: float = 0.1,
    stable: bool = True,
    confidence: float = 0.95,
) -> MaterialFit:
    """Fit a material's constants to tests, and choose the law where none is given.

    Parameters
    ----------
    law : str, class, material or sequence of str, optional
        A name such as ``"ogden-3"`` (`palpate.physics.materials.law_forms.FORMS` has all), a class such as `Yeoh`, or
        a `UserMaterial` whose constants are first guesses. By default, or of several names, the best law among those
        that stay stable. For indentation a material, whose modulus alone is scaled; by default neo-Hookean.
    tests : StretchTest or IndentationTest, or a sequence of one kind
        The records.
    poisson : float
        Poisson's ratio, which is given and not fitted: stresses of free specimens hardly depend on it. 0.5 is
        incompressible, as elastomers and wet tissue are nearly. Indentation needs less than 0.5.
    weight : str
        Scale of the residuals. ``"peak"``: the largest stress of each test, so that each counts alike; ``"stress"``:
        one scale for all; ``"relative"``: each row's own stress.
    margin : float
        How much farther than the data the law must be stable: I₁ − 3 up to (1 + margin) times its largest.
    stable : bool
        True holds moduli positive where the free fit of a law is unstable in that range; False returns the free fit.
    confidence : float
        Level of the intervals.

    Returns
    -------
    MaterialFit
        The material, its constants with intervals, errors, verdict on stability and notes.

    Raises
    ------
    UsageError
        For a law that is not known, no tests, or tests that don't go together, or tell too little.
    """
    records: list[Any] = [tests] if isinstance(tests, StretchTest | IndentationTest) else list(tests)
    checks.one_of("The weight of a fit", weight, _WEIGHTS)
    checks.fits("The margin of stability", margin, "", least=0)
    if not 0 < confidence < 1:
        raise UsageError(f"The confidence is {confidence:g}.", fix="Pass a level such as 0.95.")
    if not records or not all(isinstance(t, StretchTest | IndentationTest) for t in records):
        raise UsageError(
            "There are no tests to fit." if not records else "A test is no StretchTest or IndentationTest.",
            why="Constants come from records of specimens.",
            fix='Pass StretchTest("uniaxial", stretch, stress, "nominal"), or a list of such.',
        )
    if any(isinstance(t, IndentationTest) for t in records):
        # it solves solids, which are made of materials
        from palpate.physics.solid.fit_indentation import fit_indentation

        return fit_indentation(law, records, poisson, confidence)
    if not -1 < poisson <= 0.5:
        raise UsageError(
            f"Poisson's ratio is {poisson!r}.",
            why="It lies above -1 and is at most 0.5.",
            fix="Pass 0.5 for elastomers and wet tissue, or the ratio that was measured.",
        )
    names = CANDIDATES if law is None else law if isinstance(law, list | tuple) else (law,)
    problem = _Problem(tuple(records), poisson, weight, margin)
    solutions, failures = [], []
    for name in names:
        try:
            solutions.append(problem.best(form_of(name), stable=stable))
        except UsageError as error:
            failures.append(error)
    if not solutions:
        raise failures[0]
    steady = [solved for solved in solutions if solved.verdict]
    chosen = min(steady or solutions, key=lambda solved: solved.score)
    return problem.result(chosen, solutions, confidence, asked=len(names) == 1)


@dataclass(frozen=True, eq=False)
class _Solved:
    """Coordinates of one law that fit best, and what belongs to them."""

    form: LawForm
    x: np.ndarray
    jacobian: np.ndarray
    bounded: np.ndarray
    rss: float
    material: Any
    verdict: Stability
    score: float
    note: str = ""


@dataclass(frozen=True, eq=False)
class _Problem:
    """Tests, and how their residuals are weighted."""

    tests: tuple[StretchTest, ...]
    poisson: float
    weight: str
    margin: float

    @property
    def rows(self) -> int:
        return sum(len(t.stress) for t in self.tests)

    def scales(self) -> list[Any]:
        """Return the scale of each test's residuals in Pa."""
        peaks = [float(np.abs(t.stress).max()) for t in self.tests]
        if not min(peaks) > 0:
            raise UsageError(
                "A test has no stress.", why="All its stresses are 0.", fix="Check the column of the stress."
            )
        if self.weight == "stress":
            return [max(peaks)] * len(peaks)
        if self.weight == "peak":
            return list(peaks)
        return [
            np.maximum(np.abs(t.stress), LEAST_STRESS * p) for t, p in zip(self.tests, peaks, strict=True)
        ]

    def model(self, form: LawForm, x: np.ndarray) -> np.ndarray:
        """Return the scaled stresses (N,) of all tests."""
        material = form.build(x, self.poisson)
        pairs = zip(self.tests, self.scales(), strict=True)
        return np.concatenate([stress_in_test(material, t) / scale for t, scale in pairs])

    def best(self, form: LawForm, *, stable: bool) -> _Solved:
        """Return the best constants of a law; those that are always stable, where the free ones are not."""
        if self.rows <= len(form.constants):
            raise UsageError(
                f"{self.rows} rows can't tell {len(form.constants)} constants of the law {form.name}.",
                why="There are no more rows than constants.",
                fix="Give more rows, or a law with fewer constants.",
            )
        free = self._solve(form, stable=not form.signed)
        if free is not None and (free.verdict or not stable or not form.signed):
            return free
        held = self._solve(form, stable=True) if form.signed else None
        if held is None:
            raise UsageError(
                f"No constants of the law {form.name} fit these tests.",
                why="No positive stiffness makes the stresses grow with the stretches as they do.",
                fix="Check the signs (tension is positive), the measure of stress, and stretch against strain.",
            )
        if free is None:
            return held
        shares = [f"{100 * math.sqrt(s.rss / self.rows):.2g} %" for s in (free, held)]
        note = f"Free constants of {form.name} err by {shares[0]} instead of {shares[1]} and are unstable: "
        return replace(held, note=note + f"{free.verdict}")

    def _solve(self, form: LawForm, *, stable: bool) -> _Solved | None:
        measured = np.concatenate([t.stress / s for t, s in zip(self.tests, self.scales(), strict=True)])
        if form.origin is not None:
            end = self._search(form, form.origin, measured)
            return None if end is None else self._solved(form, end, measured)
        # stresses of a compressible law are not linear in the moduli: the incompressible one is a first guess
        is_compressible = self.poisson < 0.5
        first = replace(self, poisson=0.5)
        best: tuple[float, np.ndarray, tuple[float, ...]] | None = None
        for start in form.starts:
            exponents = first._exponents(form, start, measured, stable=stable)
            x, residual = first._moduli(form, exponents, measured, stable=stable)
            if not _is_material(form, x, self.poisson):
                continue
            residual = self._residuals(form, x, measured) if is_compressible else residual
            cost = float(residual @ residual)
            if np.abs(residual).max() < REFUSED and (best is None or cost < best[0]):
                best = cost, x, start
        if best is None:
            return None
        _, x, start = best
        x = self._refine(form, x, start, measured, stable=stable) if is_compressible else x
        return self._solved(form, x, measured)

    def _search(self, form: LawForm, origin: np.ndarray, measured: np.ndarray) -> np.ndarray | None:
        """Return the constants (n,) of a user's law, from its first guesses."""
        from scipy.optimize import least_squares

        def residuals(x: np.ndarray) -> np.ndarray:
            return self._residuals(form, x, measured)

        scale = np.where(origin == 0, 1.0, np.abs(origin))
        end = least_squares(residuals, origin, jac="3-point", x_scale=scale, xtol=1e-10, ftol=1e-12)
        return None if np.abs(end.fun).max() >= REFUSED else np.asarray(end.x)

    def _residuals(self, form: LawForm, x: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Return model − measured (N,), which is large of constants that no material has."""
        try:
            values = self.model(form, x) - measured
        except PalpateError:
            return np.full(len(measured), REFUSED)
        return np.where(np.isfinite(values), values, REFUSED)

    def _refine(
        self, form: LawForm, x: np.ndarray, start: tuple[float, ...], measured: np.ndarray, *, stable: bool
    ) -> np.ndarray:
        """Return the best coordinates (n,) of a compressible law near a first guess; a modulus can end at 0."""
        from scipy.optimize import least_squares

        size = np.append(np.full(form.moduli, np.abs(x[: form.moduli]).max()), np.abs(x[form.moduli :]))
        low, high = form.exponent_bounds(start)

        def residuals(z: np.ndarray) -> np.ndarray:
            return self._residuals(form, z * size, measured)

        end = least_squares(
            residuals,
            x / size,
            jac="3-point",
            bounds=(
                np.append(np.full(form.moduli, 0.0 if stable else -np.inf), low / size[form.moduli :]),
                np.append(np.full(form.moduli, np.inf), high / size[form.moduli :]),
            ),
            method="dogbox",  # which leaves a modulus at 0 exactly
            xtol=1e-10,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=LAST_EVALUATIONS,
        )
        return np.asarray(end.x * size)

    def _exponents(
        self, form: LawForm, start: tuple[float, ...], measured: np.ndarray, *, stable: bool
    ) -> np.ndarray:
        """Return the best exponents near a start, each with the moduli that suit it."""
        from scipy.optimize import least_squares

        if not start:
            return np.empty(0)

        def residuals(exponents: np.ndarray) -> np.ndarray:
            return self._moduli(form, exponents, measured, stable=stable)[1]

        end = least_squares(
            residuals,
            start,
            bounds=form.exponent_bounds(start),
            x_scale=np.abs(start),
            xtol=1e-9,
            ftol=1e-12,
        )
        return np.asarray(end.x)

    def _moduli(
        self, form: LawForm, exponents: np.ndarray | tuple[()], measured: np.ndarray, *, stable: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the coordinates (n,) whose moduli are the least squares at these exponents, and residuals (N,).

        Both are exact of an incompressible law, and of one with a single modulus.
        """
        from scipy.optimize import nnls

        unit = float(max(np.abs(t.stress).max() for t in self.tests))
        origin = np.append(np.eye(form.moduli)[0] * unit, exponents)
        first = self.model(form, origin)
        columns = [first]
        for i in range(1, form.moduli):
            moved = origin.copy()
            moved[i] += unit
            columns.append(self.model(form, moved) - first)
        A = np.stack(columns, axis=1)
        if not np.isfinite(A).all():  # no sides' stretch was found at these exponents
            return origin, np.full(len(measured), REFUSED)
        moduli = nnls(A, measured)[0] if stable else np.linalg.lstsq(A, measured, rcond=None)[0]
        return np.append(moduli * unit, exponents), A @ moduli - measured

    def _solved(self, form: LawForm, x: np.ndarray, measured: np.ndarray) -> _Solved:
        material = form.build(x, self.poisson)
        verdict = stability(material, ranges_of_strain(self.tests, self.margin), NEAR_VOLUME)
        residual = self.model(form, x) - measured
        size = np.append(np.full(form.moduli, np.abs(x[: form.moduli]).max()), np.abs(x[form.moduli :]))
        ended = np.zeros(len(x), dtype=bool)
        if form.origin is None:
            ended[: form.moduli] = x[: form.moduli] == 0  # where the non-negative squares leave it
        jacobian = np.zeros((self.rows, len(x)))
        for i in np.flatnonzero(~ended):
            step = DIFFERENCE * (abs(x[i]) or size[i] or 1.0) * np.eye(len(x))[i]
            jacobian[:, i] = (self.model(form, x + step) - self.model(form, x - step)) / (2 * step[i])
        n, k = self.rows, len(x) + 1
        rss = float(residual @ residual)
        correction = 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else math.inf
        score = n * math.log(max(rss, 1e-24) / n) + 2 * k + correction
        return _Solved(form, x, jacobian, ended, rss, material, verdict, score)

    def result(
        self, chosen: _Solved, solutions: Sequence[_Solved], confidence: float, *, asked: bool
    ) -> MaterialFit:
        """Return the fit with everything that is said of it."""
        values = chosen.form.values(chosen.x)
        spread = _spread(chosen, self.rows, confidence)
        pairs = zip(chosen.form.constants, values, spread, strict=True)
        constants = tuple(_constant(name, unit, v, d, chosen.form) for (name, unit), v, d in pairs)
        errors = {
            t.name: float(np.sqrt(np.mean((stress_in_test(chosen.material, t) - t.stress) ** 2)))
            for t in self.tests
        }
        rivals = tuple(
            Rival(s.form.name, math.sqrt(s.rss / self.rows), s.score, str(s.verdict), bool(s.verdict))
            for s in sorted(solutions, key=lambda s: s.score)
        )
        return MaterialFit(
            chosen.material,
            chosen.form.name,
            constants,
            self.tests,
            errors,
            chosen.verdict,
            tuple(_notes(chosen, constants, self, asked)),
            () if asked else rivals,
            confidence,
            self.weight,
            math.sqrt(chosen.rss / self.rows),
            _keys(chosen, values) if chosen.form.name in CANDIDATES else None,
        )


def _is_material(form: LawForm, x: np.ndarray, poisson: float) -> bool:
    """Return whether a material has these coordinates."""
    try:
        form.build(x, poisson)
    except PalpateError:
        return False
    return True


def _keys(solved: _Solved, values: np.ndarray) -> dict[str, Any]:
    if solved.form.keys is None:
        return {"young": float(solved.material.young)}
    return solved.form.keys(values)


def _constant(name: str, unit: str, value: float, spread: float, form: LawForm) -> Constant:
    """Return a constant with its interval; of moduli whose sign is known, an interval of the logarithm."""
    if unit == "Pa" and not form.signed and value:
        ratio = math.exp(min(spread / abs(value), 50.0))
        low, high = sorted((float(value / ratio), float(value * ratio)))
        return Constant(name, float(value), low, high, unit)
    return Constant(name, float(value), float(value - spread), float(value + spread), unit)


def _spread(solved: _Solved, rows: int, confidence: float) -> np.ndarray:
    """Return half the width (n,) of each constant's interval; infinite of one that the rows do not tell."""
    from scipy.special import stdtrit

    free = ~solved.bounded
    x, count = solved.x, int(free.sum())
    scatter = solved.rss / max(rows - count, 1)
    J = solved.jacobian[:, free]
    size = np.linalg.norm(J, axis=0)
    size[size == 0] = 1.0
    inverse = np.linalg.pinv(J / size, rcond=1e-10)
    covariance = np.zeros((len(x), len(x)))
    covariance[np.ix_(free, free)] = scatter * (inverse @ inverse.T) / np.outer(size, size)
    # the constants' slopes by the coordinates, by differences
    step = 1e-6 * np.maximum(np.abs(x), 1e-9 * np.abs(x).max())
    slopes = np.stack(
        [(solved.form.values(x + d) - solved.form.values(x - d)) / (2 * d.max()) for d in np.diag(step)],
        axis=1,
    )
    variance = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    quantile = float(stdtrit(max(rows - count, 1), 0.5 + confidence / 2))
    return np.asarray(quantile * np.sqrt(np.maximum(variance, 0.0)))


def _notes(solved: _Solved, constants: Sequence[Constant], problem: _Problem, asked: bool) -> list[str]:
    """Return sentences on what these tests do not tell."""
    notes = [solved.note] if solved.note else []
    if not solved.verdict:
        lead = "The law" if asked else "No law that was tried is stable over the range; the best"
        notes.append(f"{lead} is unstable: {solved.verdict}")
    for constant, bounded in zip(constants, solved.bounded, strict=True):
        if bounded:
            notes.append(f"{constant.name} is at the end of what keeps the law stable; it has no interval.")
        elif constant.value and abs(constant.high - constant.low) > 2 * abs(constant.value):
            notes.append(
                f"{constant.name} is hardly told by these tests: its interval is wider than twice its value."
            )
    modes = {t.mode for t in problem.tests}
    if modes == {"uniaxial"} and len(constants) > 1:
        notes.append(
            "Uniaxial tests alone tell little of other modes, and constants can trade with each other: give an "
            "equibiaxial or a planar test too."
        )
    if max(t.stretch.max() for t in problem.tests) < 1.2 and len(constants) > 1:
        notes.append("Stretches below 1.2 tell a modulus and hardly how it changes with strain.")
    ratio = f"{problem.poisson:g}" + (" (incompressible)" if problem.poisson == 0.5 else "")
    notes.append(
        f"Poisson's ratio {ratio} is given, not fitted: specimens with free sides bear nearly the same stress "
        "whatever it is. A volumetric or a confined test tells it."
    )
    notes.append("Intervals show the scatter about the curve, not that between specimens.")
    return notes


def ranges_of_strain(tests: Sequence[StretchTest], margin: float) -> dict[str, tuple[float, float]]:
    """Return λ − 1 (γ of simple shear) in each mode as far as I₁ − 3 goes in the tests, and `margin` farther."""
    from scipy.optimize import brentq

    limit = 3 + (1 + margin) * max(max(t.largest_invariant for t in tests) - 3, 1e-6)
    ranges = {}
    for mode in MODES:
        invariant = first_invariant(mode)
        rest = 0.0 if mode == "simple shear" else 1.0

        def beyond(s: float, invariant: Any = invariant) -> float:
            return float(invariant(s)) - limit

        high = brentq(beyond, rest, 10 * math.sqrt(limit)) - rest
        low = -high if mode == "simple shear" else brentq(beyond, 1e-3 / limit, rest) - rest
        ranges[mode] = (max(low, -0.99), high)
    return ranges
