"""How a study of a beam that remembers is carried out: each stage takes values and returns values."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.plastic import Fit, HeldPaths, lead_held, lead_twin, learn_held
from palpate.physics import Cantilever, TipLoad
from palpate.physics.beam.beam_presets import preset
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.viscous import Viscoelastic
from palpate.study.held.record import HeldStudy
from palpate.study.paths import Paths
from palpate.surrogates.plastic import HeldBody
from palpate.validation import HeldChapter, HeldLimits, HeldValidation, validate_held

if TYPE_CHECKING:
    from palpate.study.pipeline import Outcome

__all__ = ["HeldStages", "beam_of", "elastic_twin"]

TEST_SEED = 1000  # further on
BEYOND = (
    1.05  # the elastic twin goes farther than the histories learnt from, for those that go farther than these
)


def beam_of(study: HeldStudy) -> Cantilever:
    """The study's body."""
    numbers: dict[str, Any] = {"elements": study.elements, "tolerance": study.tolerance}
    if not study.relaxes:
        numbers["fibres"] = study.fibres
    return replace(preset(study.preset).body, **numbers)


def elastic_twin(body: Cantilever) -> Cantilever:
    """The same body without its memory: below yield, or at once.

    Raises
    ------
    UsageError
        If it has none.
    """
    material = body.material
    if isinstance(material, Plastic):
        return replace(body, material=material.elastic, fibres=None, tolerance=None)
    if isinstance(material, Viscoelastic):
        return replace(body, material=material.base, tolerance=None)
    raise UsageError(f"{material.name} has no memory.", fix="Choose a material that yields or creeps.")


class HeldStages:
    """The stages of a study of a beam that remembers (see `palpate.study.stages`)."""

    def swept(
        self, study: HeldStudy, paths: Paths | None, cluster: Any, progress: Any
    ) -> tuple[HeldPaths, HeldPaths]:
        """Histories to learn from, drawn to the ends of the load, and even ones for testing."""
        problem = beam_of(study).problem(TipLoad(-study.load, study.load))
        common: dict[str, Any] = {"low": -study.load, "high": study.load, "relaxes": study.relaxes}
        common["step"] = study.step
        train = lead_held(problem, count=study.train, seed=study.seed, **common)
        test = lead_held(problem, count=study.test, seed=study.seed + TEST_SEED, outward=0.0, **common)
        if paths is not None:
            train.save(paths.histories)
            test.save(paths.unseen_histories)
        return train, test

    def parted(self, study: HeldStudy, paths: Paths) -> tuple[HeldPaths, HeldPaths]:
        """Histories to learn from, and unseen ones, as they lie in files."""
        return HeldPaths.load(paths.histories), HeldPaths.load(paths.unseen_histories)

    def train_and_test(
        self, study: HeldStudy, data: HeldPaths, random: HeldPaths | None
    ) -> tuple[HeldPaths, HeldPaths]:
        """Both as they are."""
        if random is None:
            raise UsageError(f"The study {study.name!r} keeps nothing for testing.")
        return data, random

    def learnt(
        self, study: HeldStudy, train: HeldPaths, test: HeldPaths | None, progress: Any, say: Any
    ) -> tuple[HeldBody, Fit]:
        """The held body and how well it fits; the elastic twin is solved here."""
        problem = elastic_twin(beam_of(study)).problem(TipLoad(0.0, study.load))
        reach = BEYOND * max(float(np.abs(path.place).max()) for path in train.paths)
        twin = lead_twin(problem, reach=reach, load=study.load)
        return learn_held(train, twin, relaxes=study.relaxes, name=study.name)

    def validated(self, study: HeldStudy, model: HeldBody, test: HeldPaths, history: Any) -> HeldValidation:
        """How it does on unseen histories, by the study's targets."""
        return validate_held(model, test, limits=HeldLimits(**study.target.model_dump()))

    def judged(self, model: HeldBody, validation: HeldValidation) -> HeldBody:
        """The body with its errors on unseen histories written into it, for whoever opens the file later."""
        errors = {
            "unseen histories": validation.histories,
            "force error, median": validation.force_median,
            "force error, 95th percentile": validation.force_p95,
            "limits kept": validation.passed,
        }
        return replace(model, meta={**model.meta, "validation": errors})

    def rivals(self, study: HeldStudy, train: HeldPaths, test: HeldPaths, history: Any) -> dict[str, Any]:
        """None: the elastic model stands in the validation."""
        return {}

    def chapter(self, outcome: Outcome) -> HeldChapter:
        """The report's."""
        return HeldChapter(
            outcome.study.name,
            outcome.touch,
            outcome.test,
            outcome.validation,
            settings=outcome.study.model_dump(mode="json"),
            timings=outcome.timings,
            provenance={"learnt from": str(outcome.train), "fit": str(outcome.history), **outcome.touch.meta},
        )

    def save(self, paths: Paths, model: HeldBody, history: Any) -> None:
        """Write the body."""
        model.save(paths.model)

    def load(self, paths: Paths, train: HeldPaths) -> tuple[HeldBody, None]:
        """Read it back."""
        return HeldBody.load(paths.model), None

    def told(self, model: HeldBody, validation: HeldValidation) -> tuple[str, dict[str, Any]]:
        """The force error as text and as data."""
        figures = {"force_median": validation.force_median, "force_p95": validation.force_p95}
        return "\n".join(f"  {check}" for check in validation.checks), figures
