"""Result of fitting a material to tests: constants with intervals, errors, stability, notes, picture, study table."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import number, with_interval
from palpate.output_files import picture_metadata
from palpate.physics.materials.law_forms import stress_in_test
from palpate.physics.materials.material_stability import Stability
from palpate.physics.materials.specimen_tests import IndentationTest, SpecimenTest, StretchTest

__all__ = ["Constant", "MaterialFit", "Rival"]

NEARLY = 0.499  # Poisson's ratio that a study file takes for incompressible
_MARKS = {"uniaxial": "o", "equibiaxial": "s", "planar": "^"}


@dataclass(frozen=True)
class Constant:
    """A fitted constant."""

    name: str  # in the law
    value: float  # in `unit`
    low: float  # the interval's ends
    high: float
    unit: str = ""  # SI; empty of a pure number, or of a user's constant

    def __str__(self) -> str:
        """Return name, value, interval and unit."""
        return f"{self.name} = {with_interval(self.value, self.low, self.high)} {self.unit}".rstrip()


@dataclass(frozen=True)
class Rival:
    """One of the laws among which a fit chose."""

    name: str  # of the law
    error: float  # root mean square of its residuals over their scale
    score: float  # Akaike's criterion for few rows; less is better
    verdict: str  # on its stability, in words
    is_stable: bool  # over the range asked


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """A material whose constants were fitted to tests.

    Attributes
    ----------
    material : Material
        The material, ready for a `Body`; incompressible if Poisson's ratio was given as 0.5.
    law : str
        Name of its law.
    constants : tuple of Constant
        Its constants with their intervals.
    tests : tuple
        The records.
    errors : mapping of name to float
        Root mean square error of each test, in Pa (in N of an indentation).
    stability : Stability or None
        Verdict over the range of the data and a margin; None of a law that was given with its shape.
    notes : tuple of str
        Sentences on what the tests do not tell.
    rivals : tuple of Rival
        The laws compared, the best first; empty where the law was given.
    confidence : float
        Level of the intervals.
    weight : str
        Scale of the residuals.
    error : float
        Root mean square of the residuals over their scale, a pure number.
    keys : mapping or None
        Constants as keys of a study file's material; None of a law that has none.
    curves : tuple of pairs of arrays
        Of tests with an indenter, the fitted course: depths in m and forces in N.
    """

    material: Any
    law: str
    constants: tuple[Constant, ...]
    tests: tuple[SpecimenTest, ...]
    errors: Mapping[str, float]
    stability: Stability | None
    notes: tuple[str, ...]
    rivals: tuple[Rival, ...]
    confidence: float
    weight: str
    error: float
    keys: Mapping[str, Any] | None
    curves: tuple[tuple[np.ndarray, np.ndarray], ...] = ()

    def __str__(self) -> str:
        """Return the constants, errors, rivals, verdict and notes, one a line."""
        lines = [f"{self.material.law}: " + ", ".join(map(str, self.constants))]
        lines[0] += f" ({self.confidence:.0%} intervals)"
        for test in self.tests:
            unit, peak = ("N" if isinstance(test, IndentationTest) else "Pa"), np.abs(test.values).max()
            error = self.errors[test.name]
            words = (
                f"  {test.name}: error {number(error)} {unit} rms, {error / peak:.2%} of the largest value"
            )
            lines.append(f"{words}, {len(test.values)} rows")
        if self.stability is not None:
            lines.append(f"  {'stable' if self.stability else 'NOT STABLE'} over the data and a margin")
        if self.rivals:
            lines.append("  laws compared (error, score):")
            lines += [
                f"    {r.name:14s} {r.error:8.3%} {r.score:9.1f}  {'stable' if r.is_stable else 'unstable'}"
                for r in self.rivals
            ]
        return "\n".join([*lines, *(f"  note: {note}" for note in self.notes)])

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "law": self.law,
            "constants": {
                c.name: {"value": c.value, "interval": [c.low, c.high], "unit": c.unit}
                for c in self.constants
            },
            "confidence": self.confidence,
            "error": self.error,
            "errors": dict(self.errors),
            "stable": None if self.stability is None else bool(self.stability),
            "rivals": [
                {"law": r.name, "error": r.error, "score": r.score, "stable": r.is_stable}
                for r in self.rivals
            ],
            "notes": list(self.notes),
            "material": self.keys and self.record(),
        }

    def record(self) -> dict[str, Any]:
        """Return the material as a table of a study file, in SI units.

        Raises
        ------
        UsageError
            If the law is one's own: a study file names its module.
        """
        if self.keys is None:
            raise UsageError(
                f"The law {self.law} has no keys in a study file.",
                why="It is a function of your own.",
                fix='Write law = "user", module, function and constants.',
            )
        return {
            "law": self.law.partition("-")[0] if self.law.startswith("ogden") else self.law,
            **self.keys,
            "poisson": min(float(self.material.poisson), NEARLY),
        }

    def toml(self, table: str = "body.material") -> str:
        """Return the material as text for a study file, in SI units, with the fit's figures in comments."""
        lines = [f"# fitted, {self.error:.2%} rms; {self.confidence:.0%} intervals:"]
        lines += [f"#   {constant}" for constant in self.constants]
        if self.material.poisson > NEARLY:
            lines.append(f"# incompressible in the fit; {NEARLY} here, as a solver needs")
        return "\n".join([*lines, f"[{table}]", *(f"{k} = {_text(v)}" for k, v in self.record().items()), ""])

    def plot(self, path: str | os.PathLike[str] | None = None) -> Any:
        """Return a Matplotlib figure of measured and fitted curves, with the residuals below.

        Parameters
        ----------
        path : path, optional
            File in which it is saved too, such as ``fit.png``.
        """
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 6), layout="constrained")
        above, below = figure.subplots(2, 1, height_ratios=(3, 1), sharex=True)
        for i, test in enumerate(self.tests):
            x, y, fine, curve = self._curve(i, test)
            model = np.interp(x, fine, curve)
            mark = _MARKS.get(getattr(test, "mode", ""), "o")
            above.plot(x, y, mark, color=f"C{i}", markersize=4, label=test.name)
            above.plot(fine, curve, "-", color=f"C{i}")
            below.plot(x, 100 * (model - y) / np.abs(y).max(), mark, color=f"C{i}", markersize=3)
        force = isinstance(self.tests[0], IndentationTest)
        measures = sorted({t.measure for t in self.tests if isinstance(t, StretchTest)})
        above.set_ylabel("force (mN)" if force else f"{' and '.join(measures)} stress (kPa)")
        below.set_xlabel("depth (mm)" if force else "stretch λ")
        below.set_ylabel("fit − measured\n(% of largest)")
        below.axhline(0, color="0.5", linewidth=0.8)
        words = [f"{c.name} = {c.value:.4g} {c.unit}".strip() for c in self.constants]
        lines = [", ".join(words[k : k + 3]) for k in range(0, len(words), 3)]
        above.set_title("\n".join([f"{self.material.law}: {lines[0]}", *lines[1:]]), fontsize=9)
        above.legend(frameon=False)
        for axes in (above, below):
            axes.grid(alpha=0.3)
        if path is not None:
            figure.savefig(path, dpi=150, metadata=picture_metadata(path))
        return figure

    def _curve(self, i: int, test: SpecimenTest) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return abscissa and measured values, and a fine curve of the model, in the picture's units."""
        if isinstance(test, IndentationTest):
            fine, curve = self.curves[i]
            return 1e3 * test.depth, 1e3 * test.force, 1e3 * fine, 1e3 * curve
        ends = min(1.0, test.stretch.min()), max(1.0, test.stretch.max())
        fine = np.geomspace(*ends, 200)
        curve = stress_in_test(self.material, test, fine)
        return test.stretch, test.stress / 1e3, fine, curve / 1e3


def _text(value: Any) -> str:
    """Return a value as TOML."""
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_text, value)) + "]"
    text = f"{value:.6g}"
    return text if any(mark in text for mark in ".en") or not math.isfinite(value) else text + ".0"
