"""Correction by a whole record of measurements at once, and a summary of it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.dataset.measured import Measurements
from palpate.errors import UsageError
from palpate.learning.correction.corrector import Corrector
from palpate.learning.correction.load_cell import LoadCell, cell_from_air, leave_out_faults
from palpate.learning.correction.measures import ForceError, felt_along, force_error
from palpate.learning.correction.probe_positions import probe_positions
from palpate.surrogates import LearntEnergy, Surrogate

__all__ = ["Correction", "correct", "summarise_correction"]

_FOLDS = 5
_FEWEST = 10  # touches that are enough to leave some of them out
_SURPRISE = 5.0  # one in 1.7 million of a Gaussian's numbers is as far
_MOST_INFLATED = 3.0
_STRANGE = 0.3  # of the touches: as many outliers are no outliers
_RATIO = 4.0  # specimens are two or three times as stiff; pounds or kilograms for newtons make 4.4 and 9.8


@dataclass(frozen=True, eq=False)
class Correction:
    """A corrected surrogate, and errors of the measured forces.

    Attributes
    ----------
    surrogate : Surrogate
        Its ``meta["correction"]`` holds counts, height and the warning, so a file keeps them.
    before, after : ForceError
        Of the model and of the corrected surrogate on all measurements that were not outliers of both.
    left_out : ForceError, optional
        Of measurements that the correction did not know: a fifth of them at a time.
    counts : mapping
        Of the verdicts.
    offset : (float, float)
        Height of the specimen's surface over the model's and its standard deviation, m.
    surprise : float
        Largest change, in standard deviations of the discrepancy.
    noise_inflation : float
        How many times larger the noise is than was said.
    ratio : float
        How many times the model's forces the measured ones are, least squares; not-a-number without contact.
    cell : LoadCell
        Offset, drift and faults of the load cell.
    """

    surrogate: Surrogate
    before: ForceError
    after: ForceError
    left_out: ForceError | None
    counts: Mapping[str, int]
    offset: tuple[float, float]
    surprise: float
    noise_inflation: float
    ratio: float
    cell: LoadCell = LoadCell()  # noqa: RUF009 - a frozen value

    @property
    def doubtful(self) -> bool:
        """True where the forces can hardly be this body's: they have another sign, or may have another unit."""
        return bool(_doubt(self.ratio))

    @property
    def warning(self) -> str:
        """Text on what is suspicious; "" if nothing is."""
        if self.doubtful:
            return _doubt(self.ratio)
        if self.cell.faults:
            return " ".join(self.cell.faults)
        out, learnt = self.counts.get("outlier", 0), self.counts.get("learnt", 0)
        if out > _STRANGE * (out + learnt):
            return (
                f"{out} of {out + learnt} touches are outliers: units, frame or probe may be others than the "
                "model's, or the specimen differs by more than the discrepancy allows."
            )
        if self.noise_inflation > _MOST_INFLATED:
            return (
                f"Forces scatter {self.noise_inflation:.1f} times as much as the noise: positions may be off, the body "
                "be viscous or slip, or vary on shorter lengths than the discrepancy; the deviation has been widened."
            )
        if self.surprise > _SURPRISE:
            return (
                f"The specimen differs by {self.surprise:.0f} standard deviations of what was expected: units, frame "
                "or probe may be others than the model's, or the discrepancy is larger."
            )
        return self.cell.warning

    def __str__(self) -> str:
        said = ", ".join(f"{n} {verdict}" for verdict, n in self.counts.items() if n)
        lines = [
            f"measured  {said}",
            f"before    {self.before}",
            f"after     {self.after}",
        ]
        whole = (
            f"not judged: only files of {_FEWEST} measurements or more are"
            if self.left_out is None
            else self.left_out
        )
        lines.append(f"left out  {whole}")
        height, sure = self.offset
        lines.append(f"surface   {1e3 * height:+.3f} ± {1e3 * sure:.3f} mm over the model's")
        return "\n".join([*lines, str(self.cell)] if self.cell.deviation.any() else lines)

    def as_dict(self) -> dict[str, Any]:
        """The figures, by name."""
        return {
            "counts": dict(self.counts),
            "before": self.before.as_dict(),
            "after": self.after.as_dict(),
            "left_out": None if self.left_out is None else self.left_out.as_dict(),
            "surprise": self.surprise,
            "noise_inflation": self.noise_inflation,
            "ratio": self.ratio,
            "offset": {"value": self.offset[0], "deviation": self.offset[1]},
            "load_cell": self.cell.as_dict(),
        }


def correct(
    surrogate: Surrogate, measured: Measurements, *, parameters: Sequence[float] = (), **options: Any
) -> Correction:
    """Correct a surrogate by a record of one specimen.

    Parameters
    ----------
    surrogate : Surrogate
        A body that is pressed by a probe.
    measured : Measurements
        Positions or depths of the probe and its forces, as `read_measurements` reads them.
    parameters : sequence of p numbers
        The specimen's further inputs.
    **options
        Of `Corrector`.

    Raises
    ------
    UsageError
        If nothing of the record teaches anything, or options do not fit.
    """
    options["parameters"] = parameters
    corrector = Corrector(surrogate, **options)
    baseline = surrogate.hand_energy.baseline
    own, surface = baseline.radius_input, baseline.surface
    assert surface is not None
    measured = probe_positions(
        measured, surface, baseline.radius if own is None else float(parameters[own - 3])
    )
    with _doubt_first(corrector, measured):
        measured, cell = _without_faults(corrector, measured)
        _observe(corrector, measured, np.arange(len(measured)))
        if not cell.readings and _sound(corrector, measured):
            rest = corrector.load_cell(float(np.nanmax(np.linalg.norm(measured.force, axis=1))))
            if rest.offset.any():
                corrector = Corrector(surrogate, **options)
                measured = rest.without_offset(measured)
                _observe(corrector, measured, np.arange(len(measured)))
            cell = replace(rest, faults=cell.faults)
        left_out = _left_out(surrogate, measured, options)
    return summarise_correction(corrector, measured, left_out=left_out, cell=cell)


def _sound(corrector: Corrector, measured: Measurements) -> bool:
    """True where residuals may be asked for an offset: most touches were learnt, by forces that can be this body's."""
    X, force, along = _usable(corrector, measured)
    learnt, out = corrector.counts["learnt"], corrector.counts["outlier"]
    return (
        learnt >= _FEWEST
        and out <= _STRANGE * (out + learnt)
        and not _doubt(_ratio(corrector.model.force(X), force, along))
    )


def _without_faults(corrector: Corrector, measured: Measurements) -> tuple[Measurements, LoadCell]:
    """The record without faulty readings and without what its load cell reads in air, and that load cell."""
    X = _inputs(corrector.model, measured, corrector.parameters)
    noise = corrector.noise.absolute
    finite = np.isfinite(X).all(axis=1)
    predicted, depth = np.full((len(X), 3), np.nan), np.full(len(X), np.nan)
    predicted[finite], depth[finite] = corrector.model.force(X[finite]), corrector.model.depth(X[finite])
    usable, faults = leave_out_faults(measured, predicted, noise)
    cell = cell_from_air(usable, depth < -corrector.clearance, noise)
    if cell is None:
        return usable, LoadCell(faults=faults)
    return cell.without_offset(usable), replace(cell, faults=faults)


def summarise_correction(
    corrector: Corrector,
    measured: Measurements,
    left_out: ForceError | None = None,
    cell: LoadCell = LoadCell(),  # noqa: B008 - a frozen value
) -> Correction:
    """Summarise what a corrector learnt from measurements.

    Parameters
    ----------
    corrector : Corrector
        After it has observed them.
    measured : Measurements
        The measurements, by whose forces the errors before and after are taken.
    left_out : ForceError, optional
        Error of measurements that a correction did not know, where one was computed.
    cell : LoadCell
        Of the load cell, whose offset the measurements no longer have.

    Raises
    ------
    UsageError
        If it has learnt nothing.
    """
    with _doubt_first(corrector, measured):
        return _summary(corrector, measured, left_out, cell)


def _summary(
    corrector: Corrector, measured: Measurements, left_out: ForceError | None, cell: LoadCell
) -> Correction:
    after = corrector.surrogate
    counts = {verdict: n for verdict, n in corrector.counts.items() if n}
    if not counts.get("learnt"):
        said = ", ".join(f"{n} {verdict}" for verdict, n in counts.items()) or "none came"
        raise UsageError(
            f"No measurement taught anything: {said}.",
            why="Touches teach where the probe is in contact, in the trained ranges and no deeper than trained.",
            fix="Check the frame, the units, the forces' sign, the probe's radius and the surface's height.",
        )
    X, force, along = _usable(corrector, measured)
    surprise = float(np.abs(corrector.posterior.mean).max())
    before = force_error(corrector.model, X, force, along)
    done = Correction(
        after,
        before,
        force_error(after.hand_energy, X, force, along),
        left_out,
        counts,
        corrector.offset,
        surprise,
        corrector.noise_inflation,
        _ratio(corrector.model.force(X), force, along),
        cell,
    )
    return replace(done, surrogate=_warned(after, done.warning)) if done.warning else done


def _usable(corrector: Corrector, measured: Measurements) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs (N, n), forces and directions (N, 3) of measurements that are finite."""
    X = _inputs(corrector.model, measured, corrector.parameters)
    usable = np.isfinite(X).all(axis=1) & np.isfinite(measured.force).all(axis=1)
    return X[usable], measured.force[usable], measured.along[usable]


@contextlib.contextmanager
def _doubt_first(corrector: Corrector, measured: Measurements) -> Iterator[None]:
    """Where nothing can be learnt, and sign or unit of the forces look wrong, say that first."""
    try:
        yield
    except UsageError as error:
        X, force, along = _usable(corrector, measured)
        doubt = _doubt(_ratio(corrector.model.force(X), force, along))
        if not doubt:
            raise
        raise UsageError(
            doubt, why=f"Nothing could be learnt from them: {error.what}", fix="Mend the measurements."
        ) from error


def _doubt(ratio: float) -> str:
    """Say what is wrong with forces that are so many times the model's; "" where they may be a specimen's."""
    if ratio < 0:
        return (
            "Measured forces point against the model's: they are to be those on the probe, which a body pushes "
            "out. Change their sign."
        )
    if ratio > _RATIO or ratio < 1 / _RATIO:
        return (
            f"Measured forces are {ratio:.2g} times the model's: more than specimens mostly differ by, and as "
            "much as between units (pounds 4.4, kilograms 9.8, millinewtons 1000 times newtons)."
        )
    return ""


def _warned(surrogate: Surrogate, warning: str) -> Surrogate:
    """Return the body, whose record repeats a warning."""
    record = {**surrogate.meta["correction"], "warning": warning}
    return replace(surrogate, meta={**surrogate.meta, "correction": record})


def _ratio(predicted: np.ndarray, measured: np.ndarray, along: np.ndarray) -> float:
    """Factor that makes forces (N, 3) of the model the measured ones, least squares; `along` as in `observe`."""
    compared = felt_along(predicted, along)
    size = float((compared**2).sum())
    return float((compared * measured).sum()) / size if size > 0 else np.nan


def _left_out(surrogate: Surrogate, measured: Measurements, options: Mapping[str, Any]) -> ForceError | None:
    """Errors of every fifth measurement by a correction from the others."""
    if len(measured) < _FEWEST:
        return None
    turn, force = np.arange(len(measured)) % _FOLDS, measured.force
    X = _inputs(surrogate, measured, np.array(options["parameters"], dtype=float))
    predicted = np.empty_like(force)
    depth = np.empty(len(force))
    for fold in range(_FOLDS):
        corrector = Corrector(surrogate, **options)
        _observe(corrector, measured, np.flatnonzero(turn != fold))
        energy, out = corrector.surrogate.hand_energy, turn == fold
        predicted[out], depth[out] = energy.force(X[out]), energy.depth(X[out])
    return force_error((predicted, depth), X, force, measured.along)


def _observe(corrector: Corrector, measured: Measurements, which: np.ndarray) -> None:
    for i in which:
        corrector.observe(measured.position[i], measured.force[i], along=measured.along[i])


def _inputs(body: Surrogate | LearntEnergy, measured: Measurements, parameters: np.ndarray) -> np.ndarray:
    further = np.broadcast_to(parameters, (len(measured), len(body.parameters)))
    return np.hstack([measured.position, further])
