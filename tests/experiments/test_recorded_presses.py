"""The full model in an experiment: its presses are solved, learnt and judged, and compared blind with a surrogate."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import sync_playwright
from scripted_participant import Sitting, shortened
from test_sitting import run_through

import palpate as pp
from palpate.errors import UsageError
from palpate.experiments import analyse
from palpate.experiments.ready_plans import ready_plan
from palpate.experiments.recorded_presses import body_of_presses, line_errors, solve_presses
from palpate.experiments.study_folder import StudyFolder, read_table
from palpate.runtime.touchable import touchable
from viewer.chromium_page import ARGUMENTS

TRIALS, LIVE, PEOPLE = 40, 6, 12


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


def force_ratio(bodies: dict) -> float:
    """The logarithm of the surrogate's force over the full model's, half as deep as the reference was trained."""
    places = {name: touchable(body) for name, body in bodies.items()}
    whole = places["full"]
    x = (whole.home - 0.5 * whole.deepest * whole.normal)[None]
    few, full = (float(np.linalg.norm(places[name].energy.force(x))) for name in ("few", "full"))
    return float(np.log(few / full))


@pytest.mark.full
@pytest.mark.timeout(900)
def test_a_scripted_participant_compares_the_full_model_with_a_surrogate(bodies, chromium):
    """The page shows each pair as stiff as it is; people with such a hand, simulated, feel both alike."""
    folder, learnt, _ = bodies
    for name, body in learnt.items():
        body.save(folder / f"{name}.palpate")
    plan = folder / "realism.toml"
    text = ready_plan("full-model", "realism", ["full.palpate", "few.palpate"])
    text = shortened(text, TRIALS, catch=0).replace("interval_seconds = 0.3", "interval_seconds = 0.8")
    plan.write_text(text, "utf-8")
    seen = []

    def stiffer(felt: dict[int, float]) -> int:
        seen.append(np.log(felt[2] / felt[1]))
        return 1 + int(seen[-1] > 0.0)

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        sitting = Sitting(browser, plan)
        sitting.act(LIVE, press=True, seconds=600.0, answer=stiffer)
        sitting.end(kill=True)
        browser.close()
    study = StudyFolder.beside(plan)
    shift = force_ratio(learnt)
    ((_, table),) = study.tables()
    rows = read_table(table)
    assert {row["intervals"] for row in rows} == {"reference,body1", "body1,reference"}
    shown = [(float(r["level"]) + shift) * (1 if r["intervals"].endswith("body1") else -1) for r in rows]
    assert seen == pytest.approx(shown, abs=0.05)  # the bar's steps, and depths that differ a little

    for k in range(1, PEOPLE + 1):  # the first goes on where the kill was
        run_through(study, f"{k:02d}", seed=k, shift=shift)
    assert table.read_text("utf-8").count("\n") == 1 + 1 + TRIALS
    result = analyse(study)
    (group,) = result.groups
    assert group.same is not None
    assert group.same.people == PEOPLE
    assert "the same as the reference within 0.5 JND: shown" in str(result)
