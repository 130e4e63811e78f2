"""The full model in an experiment: its presses are solved, learnt and judged, and compared blind with a surrogate."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import sync_playwright
from scripted_participant import Sitting, shortened

import palpate as pp
from palpate.errors import UsageError
from palpate.experiments import analyse
from palpate.experiments.ready_plans import ready_plan
from palpate.experiments.recorded_presses import body_of_presses, line_errors, solve_presses
from palpate.experiments.study_folder import StudyFolder, read_table
from palpate.runtime.touchable import touchable
from viewer.chromium_page import ARGUMENTS

TRIALS, NOISE = 22, 0.07


def problem():
    body = pp.Body(
        pp.shapes.Block(size=(0.03, 0.03, 0.015), element=0.0075),
        pp.materials.NeoHookean(young=12e3, poisson=0.45),
    )
    ball = pp.SphereProbe(
        radius=0.006, touches="top", depth=(0.0003, 0.002), over=((0.012, 0.012), (0.018, 0.018))
    )
    return body.problem(ball, element=0.006)


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    folder = tmp_path_factory.mktemp("full")
    few, _ = pp.learn(pp.sweep(problem(), samples=6, workers=1), name="few", shape=False, effort=0.05)
    presses, unseen = solve_presses(problem(), touchable(few), folder / "presses.zarr")
    reference = body_of_presses(presses, unseen, "full", lambda _: None)
    return folder, {"full": reference, "few": few}, unseen


@pytest.mark.full
@pytest.mark.timeout(600)
def test_the_reference_is_the_full_model_along_the_line(bodies):
    """Presses that nothing was learnt from are solved anew: forces are those of finite elements, within the bound."""
    _, learnt, unseen = bodies
    solver = problem().open()
    x = unseen.X[-1]
    assert solver.solve(x).response[:3] == pytest.approx(unseen.force[-1], rel=1e-6)
    force = touchable(learnt["full"]).energy.force(x[None])[0]
    assert np.linalg.norm(force - unseen.force[-1]) <= 0.02 * np.linalg.norm(unseen.force[-1])
    errors = line_errors(learnt, unseen)
    assert errors["full"][0] < errors["few"][0]


def test_a_body_that_is_held_has_no_line():
    from models import spring_beam

    with pytest.raises(UsageError, match="along a line"):
        solve_presses(None, touchable(spring_beam()), None)


@pytest.mark.full
@pytest.mark.timeout(900)
def test_a_scripted_participant_compares_the_full_model_with_a_surrogate(bodies, chromium):
    """Two people, who compare the stiffness that the page shows with the noise of a hand, feel both alike."""
    folder, learnt, _ = bodies
    for name, body in learnt.items():
        body.save(folder / f"{name}.palpate")
    plan = folder / "realism.toml"
    text = ready_plan("full-model", "realism", ["full.palpate", "few.palpate"])
    text = shortened(text, TRIALS, catch=0).replace("interval_seconds = 0.3", "interval_seconds = 0.8")
    plan.write_text(text, "utf-8")
    rng = np.random.default_rng(5)

    def stiffer(felt: dict[int, float]) -> int:
        noise = np.exp(NOISE * rng.standard_normal(2))
        return 1 + int(felt.get(2, 0.0) * noise[1] > felt.get(1, 0.0) * noise[0])

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        for label, killed in (("sub-01", False), ("sub-02", True)):
            if killed:  # in the middle of a touch
                first = Sitting(browser, plan, label=label)
                first.act(3, press=True, answer=stiffer)
                first.end(kill=True)
            sitting = Sitting(browser, plan, label=label)
            sitting.act(TRIALS + 1, press=True, seconds=400.0, answer=stiffer)
            assert sitting.end() == 0
        browser.close()
    study = StudyFolder.beside(plan)
    for _, table in study.tables():
        bodies_felt = {body for row in read_table(table) for body in row["intervals"].split(",")}
        assert bodies_felt == {"reference", "body1"}
    result = analyse(study)
    (group,) = result.groups
    assert group.same is not None
    assert group.same.people == 2
    assert "the same as the reference within 0.5 JND" in str(result)
    for person in result.people:
        low, _, high = person.location
        assert low < 0.0 < high  # both feel alike: within 2 % of force, where a hand's noise is 7 %
