"""How a study of a pressed body is carried out: each stage takes values and returns values."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning import TouchHistory, learn_body
from palpate.study.paths import Paths
from palpate.study.rows import check_hash, refuse_other
from palpate.study.touching.build import limits_of, points_of, problem_of
from palpate.study.touching.records import TouchStudy
from palpate.surrogates import TouchedBody
from palpate.sweeps import sweep
from palpate.validation import SurrogateChapter, SurrogateValidation, validate
from palpate.validation.surrogate import unseen_solves

if TYPE_CHECKING:
    from palpate.study.pipeline import Outcome

__all__ = ["TouchStages"]


class TouchStages:
    """The stages of a study of a pressed body (see `palpate.study.stages`)."""

    def swept(
        self, study: TouchStudy, paths: Paths | None, cluster: Any, progress: Any
    ) -> tuple[Dataset, Dataset]:
        """Columns to learn from, and columns for testing."""
        problem = problem_of(study)
        common: dict[str, Any] = {
            "cluster": cluster if cluster is not None else study.sweep.scheduler,
            "workers": study.sweep.workers,
            "progress": progress,
        }
        found = []
        for test, path in ((False, paths.data if paths else None), (True, paths.random if paths else None)):
            points, seed = points_of(study, problem, test=test), (study.test if test else study.sweep).seed
            found.append(sweep(problem, points=points, seed=seed, path=path, **common))
        return found[0], found[1]

    def parted(self, study: TouchStudy, paths: Paths) -> tuple[Dataset, Dataset]:
        """Training and unseen rows of what lies in files."""
        # compared as the file has it: tuples are lists there
        wanted = json.loads(json.dumps(problem_of(study).describe()))
        found = []
        for path in (paths.data, paths.random):
            data = Dataset.open(path)
            if data.provenance["problem"] != wanted:
                raise refuse_other(path)
            found.append(data.ok)
        return found[0], found[1]

    def train_and_test(
        self, study: TouchStudy, data: Dataset, random: Dataset | None
    ) -> tuple[Dataset, Dataset]:
        """What converged of either."""
        if random is None:
            raise UsageError(f"The study {study.name!r} keeps nothing for testing.")
        return data.ok, random.ok

    def learnt(
        self, study: TouchStudy, train: Dataset, test: Dataset | None, progress: Any, say: Any
    ) -> tuple[TouchedBody, TouchHistory]:
        """The touched body, and how it was found; it remembers the study's runtime settings."""
        options = study.learning.model_dump()
        layout = problem_of(study, whole=True).layout  # shown on a mesh that is fine wherever it is touched
        body, history = learn_body(train, name=study.name, layout=layout, say=say, **options)
        return _told_more(body, {"runtime": study.runtime.model_dump()}), history

    def validated(
        self, study: TouchStudy, model: TouchedBody, test: Dataset, history: TouchHistory | None
    ) -> SurrogateValidation:
        """How it does on unseen touches, by the study's targets."""
        return validate(model, test, limits=limits_of(study))

    def judged(self, model: TouchedBody, validation: SurrogateValidation) -> TouchedBody:
        """The body with its errors on unseen touches written into it, for whoever opens the file later."""
        force = validation.force
        errors = {
            "unseen solves": validation.samples,
            "force error, median": force.median,
            "force error, 95th percentile": force.p95,
            "limits kept": validation.passed,
        }
        return _told_more(model, {"validation": errors})

    def rivals(
        self, study: TouchStudy, train: Dataset, test: Dataset, history: TouchHistory
    ) -> dict[str, Any]:
        """None: the benchmarks compare."""
        return {}

    def chapter(self, outcome: Outcome) -> SurrogateChapter:
        """The report's."""
        touch = outcome.touch.touch
        solves, _ = unseen_solves(touch, outcome.test)
        return SurrogateChapter(
            outcome.study.name,
            touch,
            solves,
            outcome.validation,
            settings=outcome.study.model_dump(mode="json"),
            timings=outcome.timings,
            provenance=_plain(outcome.train),
        )

    def save(self, paths: Paths, model: TouchedBody, history: TouchHistory | None) -> None:
        """Write the body; what is worth knowing of its history stands in it."""
        model.save(paths.model)

    def load(self, paths: Paths, train: Dataset) -> tuple[TouchedBody, None]:
        """Read it back, if it is of just these training rows."""
        model = TouchedBody.load(paths.model)
        check_hash(model.touch.meta, train, paths.model)
        return model, None

    def told(self, model: TouchedBody, validation: SurrogateValidation) -> tuple[str, dict[str, Any]]:
        """What `palpate learn` prints of it, as text and as data."""
        force = validation.force
        units = {"touch": model.touch.network.units} | {n: f.network.units for n, f in model.fields.items()}
        lines = [str(check) for check in validation.checks if check.criterion.key.startswith("force")]
        return "\n".join(f"  {line}" for line in lines), {
            "units": units,
            "force_median": force.median,
            "force_p95": force.p95,
        }


def _told_more(body: TouchedBody, more: dict[str, Any]) -> TouchedBody:
    return replace(body, touch=replace(body.touch, meta={**body.touch.meta, **more}))


def _plain(data: Dataset) -> dict[str, Any]:
    """Provenance for a table: the isometries as their number."""
    told = dict(data.provenance)
    told["symmetry"] = f"{len((told.get('symmetry') or {}).get('isometries', [1]))} images"
    return told
