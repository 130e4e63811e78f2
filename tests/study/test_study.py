"""A study as a record: text and back, units at the door, rows for training and testing."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning import Refinement, hand_coordinates, learn_dataset
from palpate.physics import Circle, Rectangle, Section
from palpate.study import Study, preset_names, preset_study, read_study, to_toml
from palpate.study.run import split_rows
from palpate.study.toml import key_line
from palpate.sweeps import sweep


def study(**parts) -> Study:
    return Study.model_validate(parts)


def test_quantities_may_carry_units():
    s = study(body={"length": "25 cm", "section": {"radius": "5 mm"}, "material": {"young": "110 GPa"}})
    assert s.body.length == pytest.approx(0.25)
    assert s.body.section.radius == pytest.approx(0.005)
    assert s.body.material.young == pytest.approx(1.1e11)


@pytest.mark.parametrize(
    ("text", "number", "line"),
    [
        ('[body]\nkind = "part"\n[body.material]\nyoung = "9 kPa" # soft\n', 4, 'young = "9 kPa"'),
        ('[body]\nmaterial = { young = "9 kPa" }\n', 2, 'material = { young = "9 kPa" }'),
        ("[body]\nmaterial.young = 9e3\n", 2, "material.young = 9e3"),
        ("[body.material]\npoisson = 0.4\n[[body.surfaces]]\nyoung = 1\n", 1, "[body.material]"),
        ("young = 1\n[interaction]\nyoung = 1\n", 0, ""),
    ],
)
def test_the_line_that_says_a_key_is_named(text, number, line):
    assert key_line(text, "body", "material", "young") == (number, line)


def test_a_study_is_frozen():
    with pytest.raises(ValidationError, match="frozen"):
        study().name = "other"


@pytest.mark.parametrize("name", [name for name in preset_names() if name.startswith("beam")])
def test_every_preset_builds_its_body(name):
    s = preset_study(name)
    assert len(s.problem().ranges) == len(s.interaction.loads)
    if s.filter:
        assert s.filter.build(1).units_max > 0


@pytest.mark.parametrize(
    ("section", "kind"),
    [
        ({"radius": 0.01}, Circle),
        ({"width": 0.01, "height": "2 mm"}, Rectangle),
        ({"area": 1e-4, "second_moment": "1e-9 m^4", "shear_factor": 0.9}, Section),
    ],
)
def test_sections(section, kind):
    assert isinstance(study(body={"section": section}).body.build().section, kind)


def test_single_settings_change_a_named_form():
    s = study(filter={"form": "founding", "settings": {"noise": 0.5}}).filter.build(1)
    assert (s.noise, s.widths) == (0.5, "plain")


def test_toml_keeps_every_number(tmp_path):
    s = study(body={"length": 1 / 3}, filter={"settings": {"noise": 1e-7, "tail": "none"}})
    path = tmp_path / "s.toml"
    path.write_text(to_toml(s), encoding="utf-8")
    assert read_study(path) == s


@pytest.fixture(scope="module")
def solved():
    """64 Sobol points of two loads, and 9 grid points of one, solved in one worker."""
    s = study(body={"elements": 6}, sweep={"design": "grid", "samples": 9, "workers": 1})
    two = preset_study("beam-plane")
    grid = sweep(s.problem(), samples=9, design="grid", workers=1, progress=False)
    sobol = sweep(two.problem(), samples=64, design="sobol", workers=1, progress=False)
    return s, grid, two, sobol


@pytest.mark.full
def test_a_grid_is_split_row_by_row_and_keeps_its_ends_for_training(solved):
    s, grid, _, _ = solved
    train, test = split_rows(s, grid, None)
    np.testing.assert_allclose(train.X[:, 0], grid.X[::2, 0])
    np.testing.assert_allclose(test.X[:, 0], grid.X[1::2, 0])


@pytest.mark.full
def test_a_sobol_design_is_split_at_random_so_that_no_corner_is_left_out(solved):
    _, _, two, sobol = solved
    train, test = split_rows(two, sobol, None)
    assert len(train) + len(test) == len(sobol) == 64
    assert len(test) == 16
    corners = {(x > 0, y > 0) for x, y in train.X}
    assert len(corners) == 4
    every_fourth = sobol.X[3::4]
    assert len({(x > 0, y > 0) for x, y in every_fourth}) < 4  # what this guards against


@pytest.mark.full
def test_random_loads_test_and_never_train(solved):
    s, grid, _, _ = solved
    train, test = split_rows(s, grid, grid.take([0, 1]))
    assert len(test) == 4 + 2
    assert len(train) == 5


@pytest.mark.full
def test_something_must_be_kept_for_testing(solved):
    s, grid, _, _ = solved
    with pytest.raises(UsageError, match="nothing for testing"):
        split_rows(
            s.model_copy(update={"test": s.test.model_copy(update={"every": 0, "random": 0})}), grid, None
        )


@pytest.mark.full
def test_datasets_of_different_bodies_are_not_put_together(solved):
    _, grid, _, sobol = solved
    with pytest.raises(UsageError, match="same body"):
        Dataset.concat([grid, sobol])
    both = Dataset.concat([grid, grid])
    np.testing.assert_array_equal(both.X, np.vstack([grid.X, grid.X]))
    assert both.ranges == grid.ranges
    assert both.rest.shape == grid.rest.shape


@pytest.mark.full
def test_networks_may_do_without_units(solved):
    _, grid, _, _ = solved
    touch, _ = learn_dataset(grid, effort=0.1, refinement=Refinement(units_max=0))
    fields = {name: field.network.units for name, field in touch.fields.items() if name != "filter"}
    assert fields == {"nodes": 0, "displacement": 0}


@pytest.mark.full
def test_too_few_solves_are_refused(solved):
    _, grid, _, _ = solved
    with pytest.raises(UsageError, match="too few"):
        learn_dataset(grid.take([0, 1, 2]))


@pytest.mark.full
def test_a_coupling_that_holds_nothing_is_refused(solved):
    _, _, _, sobol = solved
    with pytest.raises(UsageError, match="holds nothing"):
        learn_dataset(sobol, passes=1, refinement=Refinement(samples=0, units_max=1, starts=1), coupling=0.0)


@pytest.mark.full
def test_two_loads_get_a_coupling_and_the_answer_leads_back_to_the_hand(solved):
    _, _, _, sobol = solved
    few = Refinement(samples=0, units_max=8, target=1e-3, starts=1)
    touch, _ = learn_dataset(sobol, passes=1, refinement=few, effort=0.2)
    compliance, field = touch.energy.baseline.compliance, touch.fields["displacement"]
    assert compliance > 0
    hand, directions = (
        hand_coordinates(sobol, field.held, (0, 1), compliance),
        touch.energy.baseline.directions,
    )
    force = touch.energy.force(hand)
    np.testing.assert_allclose(force, -sobol.X @ directions, atol=0.2)
    loads = -force @ directions.T
    contact = field.values(loads)[:, field.held]
    np.testing.assert_allclose(contact + compliance * loads @ directions, hand @ directions, atol=0.05)


@pytest.mark.full
def test_random_loads_leave_no_dead_zone_at_the_first_touch(solved):
    """No solve is near rest, but without load nothing deflects: a hundredth of the loads moves the beam."""
    _, _, two, sobol = solved
    few = Refinement(samples=0, units_max=8, target=1e-3, starts=1)
    away = sobol.take(np.flatnonzero(np.abs(sobol.X / [1.5, 5.0]).max(axis=1) > 0.3))
    touch, _ = learn_dataset(away, passes=2, refinement=few, effort=0.1)
    field, solver = touch.fields["displacement"], two.problem().open()
    for load in ([0.0, 0.05], [0.015, -0.05]):
        u = solver.solve(np.array(load)).displacement[field.held, :2]
        got = field.values(np.array([load]))[0, field.held, :2]
        np.testing.assert_allclose(got, u, atol=0.15 * np.abs(u).max())
        hand = u @ touch.energy.baseline.directions[:, :2].T + touch.energy.baseline.compliance * np.array(
            load
        )
        felt = touch.energy.force(hand[None])[0] @ touch.energy.baseline.directions.T
        np.testing.assert_allclose(-felt, load, atol=0.005)  # of 1.5 and 5 N
    assert touch.meta["refinement"]["used"] == len(away) + 1
    assert np.abs(field.values(np.zeros((1, 2)))).max() < 0.003  # m, of 0.9
