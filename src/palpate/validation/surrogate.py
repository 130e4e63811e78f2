"""A touch surrogate, or any force as a function of the probe's centre, against unseen solves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count, plain, share
from palpate.learning.energy.columns import columns_of
from palpate.surrogates import TouchedBody, TouchSurrogate
from palpate.surrogates.grasp import GraspSurrogate
from palpate.units import bounds
from palpate.validation.coverage import Coverage, coverage
from palpate.validation.force import ForceErrors, ForceSamples, force_errors
from palpate.validation.judge import SURROGATE_FIXES, checks, surrogate_figures
from palpate.validation.judgement import Judgement
from palpate.validation.limits import Limits
from palpate.validation.loops import LoopWork, function_work
from palpate.validation.mesh_error import ASKED, MeshErrors, mesh_errors
from palpate.validation.parts import Case, Part, parts, worst_cases
from palpate.validation.shown import ShownErrors, shown_errors
from palpate.validation.solves import TouchFunction, TouchSolves
from palpate.validation.stiffness import StiffnessErrors, matrix_errors
from palpate.validation.strokes import Smoothness, smoothness

__all__ = ["SurrogateValidation", "probe_samples", "validate_surrogate"]

SEEN = 1e-9  # in scaled inputs: a solve this near to one that was trained on is no test
RADIUS = 1e-9  # relative: radii that are the same
T = TypeVar("T")


@dataclass(frozen=True)
class SurrogateValidation(Judgement):
    """How a touched body's model did on solves that it has never seen.

    Attributes
    ----------
    name, samples, checks, notes
        See `Judgement`.
    force : ForceErrors
    energy_median, energy_p95 : float or None
        |ΔU|/U of the touches.
    stiffness : StiffnessErrors or None
    smoothness : Smoothness or None
    coverage : Coverage or None
    loops, border_loops : LoopWork or None
        Between places of the test, and across the border of what was trained.
    mesh : MeshErrors or None
    shape : ShownErrors or None
        Of the displacement that is shown.
    parts : tuple of Part
        All solves, the shallow and the deep third, the edge of the ranges, what counts as outside.
    worst : tuple of Case
        The worst five, worst first.
    """

    force: ForceErrors
    energy_median: float | None
    energy_p95: float | None
    stiffness: StiffnessErrors | None
    smoothness: Smoothness | None
    coverage: Coverage | None
    loops: LoopWork | None
    border_loops: LoopWork | None
    mesh: MeshErrors | None
    shape: ShownErrors | None
    parts: tuple[Part, ...]
    worst: tuple[Case, ...]

    def details(self) -> list[str]:
        """Parts of the test, felt differences, references and worst cases."""
        lines = [_part_line(part) for part in self.parts]
        if self.force.p95_jnd is not None and self.force.max_jnd is not None:
            lines.append(
                f"in just noticeable differences: 95th percentile {plain(self.force.p95_jnd)}, largest "
                f"{plain(self.force.max_jnd)}"
            )
        if self.smoothness:
            lines.append(
                f"second differences of the force at 0.1 m/s and 1 kHz: at most {self.smoothness.p95:.2f} times the "
                f"reference's on 95 of 100 of {count(self.smoothness.strokes, 'stroke')}; reference: "
                f"{self.smoothness.reference}"
            )
        if self.mesh:
            lines.append(_mesh_line(self.mesh))
        return lines + [f"worst {i}: {_case_line(case)}" for i, case in enumerate(self.worst, 1)]


def validate_surrogate(
    model: TouchedBody | TouchSurrogate | GraspSurrogate | TouchFunction,
    test: Dataset | TouchSolves,
    *,
    refined: Dataset | TouchSolves | None = None,
    strokes: Sequence[TouchSolves] = (),
    limits: Limits | None = None,
    seed: int = 0,
) -> SurrogateValidation:
    """Judge a touched body's model by solves that it has never seen.

    Parameters
    ----------
    model : TouchedBody, TouchSurrogate, GraspSurrogate or TouchFunction
    test : Dataset or TouchSolves
        Rows that did not converge are left out, and rows that a surrogate was trained on.
    refined : Dataset or TouchSolves, optional
        Some of the places solved with half the element size at the contact, at least 20: the mesh's own error.
    strokes : sequence of TouchSolves, optional
        Solves along strokes, the reference of smoothness.
    limits : Limits, optional
        By default what a person can notice.
    seed : int
        Of the random strokes and loops.

    Returns
    -------
    SurrogateValidation

    Raises
    ------
    UsageError
        If the solves are of another body or probe, or were all trained on, or none has a force.
    """
    body, model = (model, model.touch) if isinstance(model, TouchedBody) else (None, model)
    function = TouchFunction.of(model)
    solves, seen = unseen_solves(model, test)
    samples = probe_samples(function, solves)
    force = force_errors(samples, solves.X, function.inputs, units=function.units)
    notes: list[str] = _over(model, solves)
    stiffness = _told(_stiffness(function, solves), notes)
    smooth = _told(smoothness(function, solves, strokes, seed=seed), notes)
    held = _told(coverage(function, solves, samples), notes)
    loops = _told(function_work(function, solves, seed=seed), notes)
    border = _told(function_work(function, solves, border=True, seed=seed), notes)
    mesh = None
    if refined is not None:
        _refuse_radius(model, refined)
        mesh = mesh_errors(function, solves, TouchSolves.of(refined, function.inputs), samples.light)
    shape = _told(_shape(body, test), notes)
    notes += _notes(force, loops, border, mesh, seen)
    energy = _energy(function, solves)
    figures = surrogate_figures(force, stiffness, loops, border, smooth, held, mesh, shape)
    return SurrogateValidation(
        name=function.name,
        samples=len(solves),
        checks=checks(figures, limits or Limits(), SURROGATE_FIXES),
        notes=tuple(notes),
        force=force,
        energy_median=None if energy is None else float(np.median(energy)),
        energy_p95=None if energy is None else float(np.quantile(energy, 0.95)),
        stiffness=stiffness,
        smoothness=smooth,
        coverage=held,
        loops=loops,
        border_loops=border,
        mesh=mesh,
        shape=shape,
        parts=parts(function, solves, samples, _relative_stiffness(function, solves)),
        worst=worst_cases(function, solves, samples, function.inputs),
    )


def probe_samples(model: TouchFunction, solves: TouchSolves) -> ForceSamples:
    """Ask for the force where each solve has the probe."""
    return ForceSamples(solves.X[:, :3], solves.force, model.force(solves.X), model.within(solves.X))


def unseen_solves(
    model: TouchSurrogate | GraspSurrogate | TouchFunction, test: Dataset | TouchSolves
) -> tuple[TouchSolves, int]:
    """The solves that a model was not trained on, and how many were left out for that.

    A surrogate remembers its training inputs and their images under the body's symmetry, up to 512 of them.
    """
    _refuse_radius(model, test)
    solves = TouchSolves.of(test, model.inputs)
    seen = _seen(model, solves.X)
    if seen.all():
        raise UsageError(
            f"The surrogate was trained on all {len(solves)} solves, or on mirror images of them.",
            fix="Test with solves that training left out.",
        )
    return (solves.take(~seen), int(seen.sum())) if seen.any() else (solves, 0)


def _seen(model: TouchSurrogate | GraspSurrogate | TouchFunction, X: np.ndarray) -> np.ndarray:
    """Which of the inputs (N, n) a model was trained on, as far as it remembers."""
    if isinstance(model, TouchFunction) or model.region is None:
        return np.zeros(len(X), dtype=bool)
    low, high = bounds(model.inputs)
    return np.asarray(model.region.distances(2 * (X - low) / (high - low) - 1) < SEEN)


def _shape(body: TouchedBody | None, test: Dataset | TouchSolves) -> ShownErrors | str:
    if body is None or "displacement" not in body.fields:
        return "Displacement is not judged: the model answers none."
    if not isinstance(test, Dataset):
        return "Displacement is not judged: the solves are given without theirs."
    test = test.ok
    unseen = np.flatnonzero(~_seen(body.touch, test.X))
    return shown_errors(body.fields["displacement"], test.take(unseen))


def _refuse_radius(
    model: TouchSurrogate | GraspSurrogate | TouchFunction, data: Dataset | TouchSolves
) -> None:
    """Solves with another probe than the surrogate's are no test of it."""
    if (
        not isinstance(model, TouchSurrogate)
        or not isinstance(data, Dataset)
        or model.radius_input is not None
    ):
        return
    acting = data.provenance.get("problem", {}).get("interactions", [])
    radii = [a["radius"] for a in acting if isinstance(a, dict) and "radius" in a]
    if any(abs(r - model.radius) > RADIUS * model.radius for r in radii):
        raise UsageError(
            f"The solves' probe has a radius of {1e3 * radii[0]:g} mm, the surrogate's {1e3 * model.radius:g} mm.",
            fix="Test with solves of the probe that the surrogate was learnt with.",
        )


def _told(found: T | str, notes: list[str]) -> T | None:
    """What was found; a reason why there is nothing goes to the notes."""
    if isinstance(found, str):
        notes.append(found)
        return None
    return found


def _stiffness(model: TouchFunction, solves: TouchSolves) -> StiffnessErrors | str:
    if solves.stiffness is None:
        return "Stiffness is not judged: the solves do not know theirs."
    if model.stiffness is None:
        return "Stiffness is not judged: the model does not answer one."
    return matrix_errors(solves.stiffness, model.stiffness(solves.X), solves.X, model.inputs)


def _relative_stiffness(model: TouchFunction, solves: TouchSolves) -> np.ndarray | None:
    if solves.stiffness is None or model.stiffness is None:
        return None
    size = np.linalg.norm(solves.stiffness, axis=(1, 2))
    error = np.linalg.norm(model.stiffness(solves.X) - solves.stiffness, axis=(1, 2))
    return np.asarray(np.divide(error, size, out=np.full(len(size), np.nan), where=size > 0))


def _energy(model: TouchFunction, solves: TouchSolves) -> np.ndarray | None:
    """|ΔU|/U of the touches."""
    if solves.energy is None or model.energy is None:
        return None
    rows = solves.energy > 0
    error = np.abs(model.energy(solves.X[rows]) - solves.energy[rows]) / solves.energy[rows]
    return np.asarray(error) if error.size else None


def _over(model: object, solves: TouchSolves) -> list[str]:
    """That several depths over one place were solved, where they were: these are less than as many places."""
    if not isinstance(model, TouchSurrogate):
        return []
    own = model.radius_input
    radius = model.radius if own is None else float(solves.X[:, own].mean())
    places = int(columns_of(solves.X, model.surface, radius).max()) + 1
    if places == len(solves):
        return []
    return [
        f"The {count(len(solves), 'solve')} lie over {count(places, 'place')}, at several depths of each."
    ]


def _notes(
    force: ForceErrors, loops: LoopWork | None, border: LoopWork | None, mesh: MeshErrors | None, seen: int
) -> list[str]:
    """What was not judged or must be known, beside the reasons of each figure."""
    found = [
        f"f₀ = {force.light:.3g} N, the smaller of 0.5 N and 5 % of the largest force: errors of fainter ones are "
        "shares of it."
    ]
    if mesh is None:
        found.append("The mesh's own error is not in these figures: no refined solves were given.")
    elif mesh.count < ASKED:
        found.append(f"Refined solves are few: {mesh.count} above f₀, where {ASKED} are asked.")
    if seen:
        found.append(f"{count(seen, 'solve')} left out: trained on, or the mirror image of one that was.")
    if force.outside:
        found.append(
            f"{force.outside} of {force.count + force.light_count} count as outside what was trained, in no training "
            "solve's neighbourhood; more solves bring them nearer."
        )
    found += [
        f"The quadrature around closed paths left {share(one.open)} open: the force jumps somewhere."
        for one in (loops, border)
        if one is not None and one.open > max(0.1 * one.max, 1e-10)
    ]
    return found


def _part_line(part: Part) -> str:
    def text(value: float | None) -> str:
        return "–" if value is None else share(value)

    return (
        f"{part.name}: {count(part.count, 'solve')}, {part.felt} above f₀ with {text(part.median)} median and "
        f"{text(part.p95)} p95; below {text(part.light_p95)} of f₀; stiffness {text(part.stiffness_p95)} p95"
    )


def _mesh_line(mesh: MeshErrors) -> str:
    text = f"refined solves: {mesh.count} above f₀"
    if mesh.mesh_median is None or mesh.mesh_p95 is None:
        return f"{text}, none of them solved on the ordinary mesh too"
    alone = f"{share(mesh.mesh_median)} median, {share(mesh.mesh_p95)} p95 ({count(mesh.paired, 'place')})"
    return f"{text}; the mesh alone is off by {alone}"


def _case_line(case: Case) -> str:
    deep = "" if case.depth is None else f", {plain(1e3 * case.depth, 3)} mm deep"
    truth, answer = (" ".join(f"{v:.4g}" for v in F) for F in (case.truth, case.answer))
    return f"{share(case.relative)} ({plain(case.jnd)} JND) {case.at}{deep}: answered ({answer}) N, solved ({truth}) N"
