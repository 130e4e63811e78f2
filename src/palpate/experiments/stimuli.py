"""The bodies of an experiment: the learnt reference and its comparisons, stiffer or softer or with another input."""

from __future__ import annotations

import hashlib
import math
import os
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.errors import UsageError
from palpate.experiments.exam_lumps import LEAST_COVER, body_with_lumps, place_of
from palpate.experiments.experiment_plan import Plan
from palpate.experiments.sitting import Trial
from palpate.experiments.study_folder import checksum
from palpate.files import writing
from palpate.runtime.touchable import Touchable, load_touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.lumps import Lump

__all__ = ["Felt", "Stimuli", "stiffened"]


@dataclass(frozen=True)
class Felt:
    """A body in the hand: its file, and the inputs that the hand doesn't supply."""

    file: Path
    parameters: tuple[float, ...]


def stiffened(body: Surrogate, ratio: float) -> Surrogate:
    """Return a body whose energy, force and stiffness are those of another one times a ratio, everywhere.

    Parameters
    ----------
    body : Surrogate
        A touched or held body; one that keeps indentations is refused, as its yield force would stay.
    ratio : float
        Above zero.

    Raises
    ------
    UsageError
        If the body can't be touched, keeps indentations, or the ratio is not positive and finite.
    """
    energy = body.hand_energy
    if not (math.isfinite(ratio) and ratio > 0.0):
        raise UsageError(f"A ratio of stiffness is {ratio:g}.", fix="Give a finite number above zero.")
    if body.memory is not None and body.memory.keeps_indentation:
        raise UsageError(
            f"{body.name} can't be made stiffer as a whole.",
            why="It keeps indentations, and the force at which it yields would stay as it is.",
            fix="Vary one of its inputs, or take a body that forgets.",
        )
    network = energy.network  # energy = U₀ exp(ℓ) less a constant: the ratio is added to ℓ as its logarithm
    scaling = replace(network.scaling, output_centre=network.scaling.output_centre + math.log(ratio))
    return replace(body, energy=replace(energy, network=replace(network, scaling=scaling)))


class Stimuli:
    """The bodies of a plan, read once and checked; files of levels are made when they are first felt.

    They lie in a folder of the experiment, under names that hold their checksum or level, so that recordings of touches
    can be replayed with the very bodies that were felt.
    """

    def __init__(self, plan: Plan, beside: Path, folder: Path) -> None:
        self.plan, self.folder = plan, folder
        files = {"reference": plan.reference} | {c.name: c.file for c in plan.comparison}
        self.files = {name: self._kept(_existing(beside / file)) for name, file in files.items()}
        self.bodies: dict[str, Touchable] = {name: load_touchable(file) for name, file in self.files.items()}
        self._surrogates: dict[str, Surrogate] = {}
        self._check()

    def _kept(self, file: Path) -> Path:
        """Return the copy of a body's file in the experiment's folder."""
        copy = self.folder / f"{file.stem}-{checksum(file)[:12]}.palpate"
        if not copy.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            with writing(copy) as part:
                shutil.copyfile(file, part)
        return copy

    def _check(self) -> None:
        """Refuse bodies that a hand would tell apart by their place, and levels outside of what was trained."""
        own = self.bodies["reference"]
        what = self.plan.vary.what
        for name, body in self.bodies.items():
            if body.holds != own.holds:
                raise UsageError(
                    f"The body {name} is {'held' if body.holds else 'pressed'}, the reference is not.",
                    fix="Compare bodies that are touched in the same way.",
                )
        if self.plan.question == "rating" or what == "force":
            return
        if what == "lump":
            for name in (c.name for c in self.plan.comparison):
                for level in self.plan.levels[[0, -1]]:  # a lump that leaves the body is refused here
                    self._lumped(name, self.plan.value(float(level)))
            return
        for name in (c.name for c in self.plan.comparison):
            place = _index(self.bodies[name], what, name)
            known = self.bodies[name].parameters[place]
            base = 1.0 if self.plan.question == "detection" else self._middle(name)[place]
            ends = [base * self.plan.value(float(x)) for x in self.plan.levels[[0, -1]]]
            if self.plan.question == "detection" and self.plan.vary.absent is not None:
                ends.append(self.plan.vary.absent)
            if min(ends) < known.low - 1e-12 or max(ends) > known.high + 1e-12:
                raise UsageError(
                    f"The levels of {what} go from {min(ends):.4g} to {max(ends):.4g} {known.unit}.",
                    why=f"{name} was trained from {known.low:.4g} to {known.high:.4g} {known.unit}.",
                    fix="Bring vary.low, vary.high and vary.absent inside, or learn a wider range.",
                )

    def _middle(self, name: str) -> list[float]:
        return [(r.low + r.high) / 2.0 for r in self.bodies[name].parameters]

    def felt(self, trial: Trial, interval: int) -> Felt:
        """Return the body of an interval of a trial, counted from 1."""
        name = trial.bodies[interval - 1]
        parameters, vary = self._middle(name), self.plan.vary
        varied = name != "reference" and self.plan.question != "rating"
        if vary.what == "force":
            return Felt(self._scaled(name, trial.value) if varied else self.files[name], tuple(parameters))
        if varied and vary.what == "lump":
            return Felt(self._lumped(name, trial.value), tuple(parameters))
        if varied:
            place = _index(self.bodies[name], vary.what, name)
            base = 1.0 if self.plan.question == "detection" else parameters[place]
            parameters[place] = base * trial.value
        elif vary.what != "lump" and vary.absent is not None and self.plan.question == "detection":
            parameters[_index(self.bodies[name], vary.what, name)] = vary.absent
        return Felt(self.files[name], tuple(parameters))

    def _scaled(self, name: str, ratio: float) -> Path:
        source = self.files[name]
        file = self.folder / f"{source.stem}-times-{ratio:.9f}.palpate"
        if not file.exists():
            stiffened(self._surrogate(name), ratio).save(file)
        return file

    def _lumped(self, name: str, radius: float) -> Path:
        """Return the file of a body with the plan's lump of a radius (m) in it."""
        source, vary, body = self.files[name], self.plan.vary, self.bodies[name]
        assert vary.place is not None
        lump = Lump(vary.place, radius, vary.stiffer)
        # a plan may move its lump until the first sitting: a file of another place must not be felt
        where = hashlib.sha256(repr(lump).encode()).hexdigest()[:8]
        file = self.folder / f"{source.stem}-lump-{radius:.9f}-{where}.palpate"
        if not file.exists():
            if (cover := place_of(body, lump).cover) < LEAST_COVER:
                raise UsageError(
                    f"A lump of {1e3 * radius:.3g} mm leaves the skin at vary.place.",
                    why=f"{1e3 * max(cover, 0.0):.2g} mm of tissue cover it, and {1e3 * LEAST_COVER:g} mm are needed.",
                    fix="Put it deeper, or make vary.high smaller.",
                )
            body_with_lumps(self._surrogate(name), body, [lump]).save(file)
        return file

    def _surrogate(self, name: str) -> Surrogate:
        if name not in self._surrogates:
            from palpate.learning.loading import load_surrogate

            self._surrogates[name] = load_surrogate(self.files[name])
        return self._surrogates[name]

    @property
    def checksums(self) -> dict[str, str]:
        """SHA-256 of each body's file, by name."""
        return {name: checksum(file) for name, file in self.files.items()}


def _existing(file: Path) -> Path:
    if not file.is_file():
        raise UsageError(
            f"{file} is not there.",
            why="The plan names it as a body.",
            fix="Learn it, or correct the plan: files lie beside it or have a whole path.",
        )
    return Path(os.path.normpath(file))


def _index(body: Touchable, what: str, name: str) -> int:
    """Return the place of an input among those that the hand doesn't supply."""
    names: Iterable[str] = [r.name for r in body.parameters]
    if what not in names:
        raise UsageError(
            f"{name} has no input {what!r} to be varied.",
            why=f"Beside the hand's place it has {', '.join(names) or 'none'}.",
            fix='Name one of these in vary.what, or "force".',
        )
    return list(names).index(what)
