"""How a study of a beam under loads is carried out: each stage takes values and returns values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from palpate.dataset import Dataset
from palpate.learning import History, Settings, founding, learn_touch, node_outputs
from palpate.learning import learn as learn_samples
from palpate.study.build import body_of, loads_of, settings_of
from palpate.study.models import Study
from palpate.study.paths import Paths
from palpate.study.rows import check_data, check_hash, train_and_test
from palpate.surrogates import TouchModel
from palpate.sweeps import sweep
from palpate.validation import Chapter, Limits, Validation, validate

if TYPE_CHECKING:
    from palpate.study.pipeline import Outcome

__all__ = ["BeamStages"]


class BeamStages:
    """The stages of a study of a beam (see `palpate.study.stages`)."""

    def swept(
        self, study: Study, paths: Paths | None, cluster: Any, progress: Any
    ) -> tuple[Dataset, Dataset | None]:
        """The sweep, and the random test loads."""
        return _swept(study, paths, cluster, progress)

    def parted(self, study: Study, paths: Paths) -> tuple[Dataset, Dataset]:
        """Training and unseen rows of what lies in files."""
        data = check_data(study, Dataset.open(paths.data), paths.data)
        random = check_data(study, Dataset.open(paths.random), paths.random) if study.test.random else None
        return train_and_test(study, data, random)

    def train_and_test(self, study: Study, data: Dataset, random: Dataset | None) -> tuple[Dataset, Dataset]:
        """Training and unseen rows of a sweep."""
        return train_and_test(study, data, random)

    def learnt(
        self, study: Study, train: Dataset, test: Dataset | None, progress: Any, say: Any
    ) -> tuple[TouchModel, History]:
        """The touch model, and what its filter did."""
        return _learnt(study, train, test, progress)

    def validated(
        self, study: Study, model: TouchModel, test: Dataset, history: History | None
    ) -> Validation:
        """How it does on unseen loads, by the study's targets."""
        return _validated(study, model, test, history)

    def judged(self, model: TouchModel, validation: Validation) -> TouchModel:
        """The model with its errors written into it."""
        return _judged(model, validation)

    def rivals(self, study: Study, train: Dataset, test: Dataset, history: History) -> dict[str, History]:
        """Founding form and ours with thresholds as they are and ten times tighter, for studies of one input."""
        return _rivals(study, train, test, history.passes)

    def chapter(self, outcome: Outcome) -> Chapter:
        """The report's."""
        return Chapter(
            name=outcome.study.name,
            touch=outcome.touch,
            train=outcome.train,
            test=outcome.test,
            validation=outcome.validation,
            history=outcome.history,
            rivals=outcome.rivals,
            settings=outcome.study.model_dump(mode="json"),
            timings=outcome.timings,
        )

    def save(self, paths: Paths, model: TouchModel, history: History) -> None:
        """Write model and history."""
        model.save(paths.model)
        history.save(paths.history)

    def load(self, paths: Paths, train: Dataset) -> tuple[TouchModel, History]:
        """Read them back, if they are of just these training rows."""
        model = TouchModel.load(paths.model)
        check_hash(model.meta, train, paths.model)
        return model, History.load(paths.history)

    def told(self, model: TouchModel, validation: Validation) -> tuple[str, dict[str, Any]]:
        """What `palpate learn` prints of it, as text and as data."""
        units = {name: network.units for name, network in model.networks.items()}
        errors = {name: e.relative for name, e in validation.networks.items()}
        lines = [f"  {name}: RMSE {e:.1e} of full scale on unseen solves" for name, e in errors.items()]
        return "\n".join(lines), {"units": units, "rmse": errors}


def _swept(study: Study, paths: Paths | None, cluster: Any, progress: Any) -> tuple[Dataset, Dataset | None]:
    common: dict[str, Any] = {
        "cluster": cluster if cluster is not None else study.sweep.scheduler,
        "workers": study.sweep.workers,
        "progress": progress,
    }
    body, loads = body_of(study), loads_of(study)
    data = sweep(
        body,
        loads,
        samples=study.sweep.samples,
        seed=study.sweep.seed,
        design=study.sweep.design,
        path=paths.data if paths else None,
        **common,
    )
    if not study.test.random:
        return data, None
    extra = sweep(
        body,
        loads,
        samples=study.test.random,
        seed=study.test.seed,
        design="random",
        path=paths.random if paths else None,
        **common,
    )
    return data, extra


def _learnt(
    study: Study,
    train: Dataset,
    test: Dataset | None,
    progress: Callable[[int, int], None] | None,
) -> tuple[TouchModel, History]:
    touch, history = learn_touch(
        train,
        heldout=test,
        name=study.name,
        settings=settings_of(study),
        refinement=study.learning.refinement(),
        passes=study.filter.passes,
        seed=study.filter.seed,
        coupling=study.learning.coupling,
        progress=progress,
    )
    return replace(touch, meta={**touch.meta, "runtime": study.runtime.model_dump()}), history


def _validated(study: Study, touch: TouchModel, test: Dataset, history: History | None) -> Validation:
    t = study.target
    limits = Limits(
        rmse=t.rmse,
        filter_rmse=t.filter_rmse or None,
        filter_outer_ratio=t.filter_outer_ratio or None,
        filter_relapse=t.filter_relapse or None,
        force_median=t.force_median,
        force_p95=t.force_p95,
    )
    return validate(touch, test, history=history, limits=limits)


def _judged(touch: TouchModel, validation: Validation) -> TouchModel:
    refined = validation.networks["refined"]
    errors = {
        "unseen solves": validation.samples,
        "displacement RMSE / full scale": refined.relative,
        "force error, median": validation.force.median,
        "force error, 95th percentile": validation.force.p95,
        "limits kept": validation.passed,
    }
    return replace(touch, meta={**touch.meta, "validation": errors})


def _rivals(study: Study, train: Dataset, test: Dataset, passes: int) -> dict[str, History]:
    if len(train.ranges) != 1:
        return {}
    forms = {
        "founding form": founding(),
        "founding form, thresholds ÷ 10": _tightened(founding()),
        "our form, thresholds ÷ 10": _tightened(settings_of(study)),
    }
    outputs, columns = node_outputs(train)
    answers = [d.displacement[:, [i for i, _ in columns], [c for _, c in columns]] for d in (train, test)]
    return {
        name: learn_samples(
            train.X,
            answers[0],
            train.ranges,
            outputs,
            settings=settings,
            passes=passes,
            seed=study.filter.seed,
            heldout=(test.X, answers[1]),
        ).history
        for name, settings in forms.items()
    }


def _tightened(settings: Settings) -> Settings:
    """Growth thresholds divided by ten: what a user does who wants more accuracy."""
    return replace(
        settings,
        error_min=settings.error_min / 10,
        error_rms_min=settings.error_rms_min / 10,
        distance_min=settings.distance_min / 10,
    )
