"""A pressed body of a relaxing material: held presses of the full model, and the memory that its surrogate gets."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.physics.materials import Viscoelastic
from palpate.physics.materials.viscous import Scaled
from palpate.study import Study
from palpate.study.relaxation_stage import held_press, prony_times
from palpate.study.run import learn_study, sweep_study

TERMS = ((0.3, 0.1), (0.2, 2.0))
CONTENT = {
    "name": "gel",
    "body": {
        "kind": "block",
        "size": (0.04, 0.04, 0.02),
        "element": 0.02,
        "material": {"young": 9e3, "poisson": 0.4, "prony": TERMS},
    },
    "interaction": {"radius": 0.008, "depth": (2e-4, 0.003), "over": ((0.018, 0.018), (0.022, 0.022))},
    "sweep": {"samples": 6, "depths": 2, "element": 0.012, "workers": 1},
    "test": {"samples": 2, "depths": 2},
    "learning": {"effort": 0.02, "workers": 1},
}


@pytest.mark.full
def test_a_held_press_goes_from_the_instantaneous_to_the_relaxed_body():
    """At once the force is the base law's; after long it is that of the law whose distortion has relaxed."""
    block = pp.shapes.Block((0.04, 0.04, 0.02), element=0.02)
    base = pp.materials.NeoHookean(9e3, 0.4)
    probe = pp.SphereProbe(0.008, depth=(0.0, 0.003), over=((0.0195, 0.0195), (0.0205, 0.0205)))

    def problem(material):
        return pp.Body(block, material, fixed="bottom").problem(probe, element=0.01)

    touch = (0.02, 0.02, 0.028)
    gel = problem(Viscoelastic(base, TERMS))
    times, forces, energy = held_press(gel, touch, (0.0, 0.0, -1.0), 0.002, (0.05, 0.5, 5.0, 2000.0))
    centre = (0.02, 0.02, 0.026)
    at_once = problem(base).solve(centre)
    relaxed = problem(Scaled(base, 0.5)).solve(centre)
    assert times[0] == 0
    assert forces[0] == pytest.approx(at_once.response[2], rel=1e-4)
    assert energy == pytest.approx(at_once.potential_energy, rel=1e-4)
    assert forces[-1] == pytest.approx(relaxed.response[2], rel=5e-3)
    assert (np.diff(forces) < 0).all()


def test_times_are_those_of_the_materials():
    assert prony_times(Study.model_validate(CONTENT)) == (0.1, 2.0)
    elastic = {**CONTENT, "body": {**CONTENT["body"], "material": {"young": 9e3}}}
    assert prony_times(Study.model_validate(elastic)) == ()


@pytest.mark.full
def test_the_surrogate_of_a_study_relaxes():
    study = Study.model_validate(CONTENT)
    train, _ = sweep_study(study, progress=False)
    lines: list[str] = []
    body, _ = learn_study(study, train.ok, log=lines.append)
    record = body.meta["relaxation"]
    assert body.memory is not None
    assert "held presses, for the relaxation" in lines
    assert record["unseen_error"] < 0.03
    assert record["material"] == [list(term) for term in TERMS]
    # the ball feels less of the relaxation than the material has: its volume stays stiff
    shares = [share for share, _ in record["terms"]]
    assert 0.3 < sum(shares) < 1.05 * 0.5
    assert [time for _, time in record["terms"]] == pytest.approx([0.1, 2.0], rel=0.15)
    # led into the body and held, it answers as the material does
    place = np.array([[0.02, 0.02, 0.0281], [0.02, 0.02, 0.0258], [0.02, 0.02, 0.0258]])
    force = body.follow(place, np.array([0.0, 1e-6, 60.0])).force
    left = body.memory.relaxation(np.array([0.0, 60.0]), float(body.energy.energy(place[1:2])[0]))
    assert np.linalg.norm(force[2]) / np.linalg.norm(force[1]) == pytest.approx(left[1] / left[0], rel=0.03)
