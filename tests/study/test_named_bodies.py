"""Bodies with a name are carried out, from finite elements to a file; how well is for the demos to tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.study import Study, preset_study
from palpate.study.run import Paths, carry_out
from palpate.surrogates import Surrogate

pytestmark = [pytest.mark.full, pytest.mark.timeout(600)]


def small(name: str) -> Study:
    """As few solves as can be learnt from, not deep and on coarse elements."""
    study = preset_study(name, quick=True)
    assert study.body.element is not None
    assert study.sweep.element is not None
    changes: dict[str, dict[str, object]] = {
        "body": {"element": 1.5 * study.body.element},
        "interaction": {"depth": (3e-4, 0.0015)},
        "sweep": {"samples": 6, "element": 1.7 * study.sweep.element, "workers": 1},
        "test": {"samples": 1, "depths": 2},
        "learning": {"effort": 0.1, "workers": 1},
    }
    return study.model_copy(
        update={part: getattr(study, part).model_copy(update=new) for part, new in changes.items()}
    )


# the block runs as a whole on the command line; dome, phantom and liver pass here too, and cost as much again each
@pytest.mark.parametrize("name", ["layered"])
def test_a_named_body_is_solved_learnt_and_judged(name: str, tmp_path: Path) -> None:
    study = small(name)
    paths = Paths(tmp_path, study.name)
    outcome = carry_out(study, paths, progress=False)
    assert (len(outcome.train), len(outcome.test)) == (6, 1), "every solve converged"
    body = Surrogate.load(paths.model)
    felt = np.linalg.norm(outcome.train.force, axis=1)
    off = np.linalg.norm(body.energy.force(outcome.train.X) - outcome.train.force, axis=1) / felt
    assert np.median(off) < 0.05
    away = outcome.train.X + np.array([0.0, 0.0, 0.2])
    np.testing.assert_array_equal(body.energy.force(away), 0.0)
    # the body is shown on other nodes than those of a part's solves: what moves most is compared
    most = np.abs(body.fields["displacement"].values(outcome.train.X)).max(axis=(1, 2))
    moved = np.abs(outcome.train.displacement).max(axis=(1, 2))
    assert np.median(np.abs(most - moved) / moved) < 0.1
    assert outcome.validation.name == study.name
