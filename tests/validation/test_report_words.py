"""What a chapter says of its body, its networks and its figures, in words and on the axes."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from typing import Any

import numpy as np
import pytest

from linear_bodies import (
    COMPLIANCE,
    dataset,
    history,
    plane_data,
    plane_model,
    tip_data,
    tip_model,
    with_network,
)
from palpate.dataset import Dataset
from palpate.learning import Settings
from palpate.surrogates import Surrogate
from palpate.units import Range
from palpate.validation import Chapter, Limits, validate
from palpate.validation.limits import CRITERIA
from palpate.validation.report.body_words import body_words, strain_words
from palpate.validation.report.load_pictures import heading, plot_force
from palpate.validation.report.network_pictures import network_rows
from palpate.validation.report.summary import story
from palpate.validation.report.write import pictures
from palpate.validation.subject import Subject

CIRCLE = {"type": "Circle", "radius": 0.005}


def provenance(**body: Any) -> dict[str, Any]:
    return {"problem": {"body": {"type": "Cantilever", "length": 0.15, **body}}}


def told(touch: Surrogate, data: Dataset, **limits: Any) -> Chapter:
    validation = validate(touch, data, limits=Limits(**limits))
    return Chapter("beam", touch, data, validation, train=data, history=history())


def with_units(touch: Surrogate, **units: int) -> Surrogate:
    """The same answers from networks of other sizes."""
    for key, number in units.items():
        net = touch.energy.network if key == "energy" else touch.fields[key].network
        n = len(net.inputs)
        sized = dataclasses.replace(
            net,
            factors=np.ones((number, n, n)),
            shifts=np.zeros((number, n)),
            weights=np.zeros((len(net.outputs), number)),
        )
        if key == "energy":
            touch = touch.with_energy(dataclasses.replace(touch.energy, network=sized))
        else:
            touch = with_network(touch, key, sized)
    return touch


def test_a_body_is_named_by_all_that_decides_its_answer() -> None:
    copper = {"name": "copper", "young": 110e9}
    assert body_words(provenance(material=copper, section=CIRCLE, self_weight=False)) == (
        "A cantilever of copper (E = 110 GPa), 150 mm long, of circular section with a radius of 5 mm, "
        "without self-weight,"
    )
    own = {"name": "linear elastic", "young": 1.1e6}
    strip = {"type": "Rectangle", "width": 0.02, "height": 0.006}
    assert body_words(provenance(material=own, section=strip, self_weight=True)) == (
        "A cantilever of a material of E = 1.1 MPa, 150 mm long, of rectangular section, 20 mm wide and 6 mm high, "
        "bending under its own weight,"
    )
    record = {"name": "own material", "young": 70e9}  # what a study file writes without a name
    assert body_words(provenance(material=record)).startswith("A cantilever of a material of E = 70 GPa, ")
    free = {"type": "Section", "area": 1e-4, "second_moment": 2e-9, "shear": 0.8}
    assert "of a section with A = 1.00 × 10⁻⁴ m² and I = 2.00 × 10⁻⁹ m⁴" in body_words(
        provenance(section=free)
    )
    assert body_words({}) == "A body"


def test_a_large_strain_is_warned_of() -> None:
    data = tip_data()
    assert strain_words(data) == ""
    strains = {}
    for largest in (0.04, 0.08):
        values = np.linspace(0.0, largest, len(data))
        xr = data.data.assign(largest_strain=("sample", values))
        strains[largest] = strain_words(data, dataclasses.replace(data, data=xr))
    assert strains[0.04] == "The largest fibre strain is 4 %."
    assert strains[0.08].startswith("The largest fibre strain is 8 %. Warning: that is above 5 %")


@pytest.mark.full
def test_networks_are_told_apart_by_name_and_units() -> None:
    touch = with_units(tip_model(), nodes=2, displacement=3, energy=5, filter=4)
    assert [(name, units) for name, _, units in network_rows(touch)] == [
        ("nodes", "2"),
        ("displacement", "3"),
        ("energy", "5"),
        ("filter", "4"),
    ]
    captions = " ".join(p.caption for p in pictures(told(touch, tip_data()), "c"))
    assert "network “displacement”, 3 units" in captions
    assert "network “energy”, 5 units" in captions
    assert [row[0] for row in network_rows(plane_model())] == ["nodes", "displacement", "energy"]


def test_a_refinement_that_harms_is_told() -> None:
    good, bad = tip_model(), tip_model(shift=1e-3)
    touch = with_network(bad, "filter", good.fields["filter"].network)
    chapter = told(touch, tip_data(), rmse=1e-4)
    assert "The refined network is worse than the sequential filter: RMSE 1 mm" in story(chapter).learnt
    assert any("worse than the sequential filter" in note for note in chapter.validation.notes)
    # 1 mm of 0.25 m full scale
    assert "misses its target: 4.0 × 10⁻³ of full scale measured, 1.0 × 10⁻⁴ asked." in story(chapter).learnt
    fine = story(told(good, tip_data()))
    assert "worse" not in fine.learnt
    assert "misses" not in fine.learnt


def test_a_two_sided_force_keeps_its_sign() -> None:
    """A spring of 1/COMPLIANCE through the origin: a straight line, not a V."""
    loads = [Range("P", -5.0, 5.0, "N")]
    data = dataset(np.linspace(-5.0, 5.0, 41)[:, None], loads, [(0.0, -1.0)], [5])
    touch = tip_model(low=-5.0)
    figure = plot_force(touch, data, Subject.of(touch, data).samples)
    for line in figure.axes[0].lines:
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        assert y.min() == pytest.approx(-5.0)
        assert y == pytest.approx(1e-3 * x / COMPLIANCE, abs=1e-9)
    assert figure.axes[0].get_xlabel() == "displacement along P (down) / mm"
    assert figure.axes[0].get_ylabel() == "force on the hand against P (up) / N"


@pytest.mark.parametrize(
    ("direction", "words"),
    [
        ((0.0, -1.0, 0.0), "down"),
        ((0.0, 1.0, 0.0), "up"),
        ((1.0, 0.0, 0.0), "away from the clamp"),
        ((0.6, -0.8, 0.0), "direction 0.6, −0.8"),
    ],
)
def test_directions_have_names(direction: tuple[float, float, float], words: str) -> None:
    assert heading(np.array(direction)) == words


def test_positions_that_count_as_outside_are_explained() -> None:
    data, model = tip_data(), tip_model()
    short = dataclasses.replace(model.energy.network, inputs=(Range("h along P", 0.0, 0.2, "m"),))
    narrow = model.with_energy(dataclasses.replace(model.energy, network=short))
    note = next(n for n in validate(narrow, data).notes if "outside" in n)
    assert re.match(r"8 of 41 hand positions count as outside .* although their loads are inside", note)
    far = next(n for n in validate(plane_model(), plane_data(np.full((4, 2), 4.5))).notes if "outside" in n)
    assert far == "4 of 4 hand positions count as outside the trained range."


TOUCHED = {  # judged of an energy or a memory only, or of answers that no hand feels
    "answer_p95",
    "answer_coverage",
    "contrast_p95",
    "history_force_median",
    "history_force_p95",
    "history_energy",
    "mesh_force",
    "border_loop_work",
    "smoothness",
    "interval_coverage",
    "refined_force_median",
    "refined_force_p95",
}


def test_remedies_name_keys_of_a_study_file() -> None:
    from palpate.study import Study

    of_beams = (c for c in CRITERIA if c.key not in TOUCHED)
    for criterion in of_beams:
        named = re.findall(r"`(?:settings = \{ )?(\w+)", criterion.fix)
        assert named, criterion.key
        sections = re.findall(r"\[(\w+)\]", criterion.fix)
        study = Study()
        known = set(Settings.__dataclass_fields__)
        for section in sections:
            known |= set(type(getattr(study, section)).model_fields)
        assert set(named) <= known, criterion.fix
    tomllib.loads("[filter]\nsettings = { error_min = 1e-3 }")
