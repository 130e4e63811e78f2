"""A surrogate that no hand feels: numbers, fields and curves of the inputs, asked, saved and refused by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import palpate as pp
from answering import RANGES, answering, quantities
from models import spring_beam
from palpate.errors import UsageError
from palpate.network import load_archive, save_archive
from palpate.runtime.touchable import touchable
from palpate.surrogates import AxisPlaces, MeshPlaces, ModalField

X = np.random.default_rng(0).uniform([r.low for r in RANGES], [r.high for r in RANGES], (7, 2))
SCALED = (X - [3e5, 25.0]) / [2e5, 15.0]


def test_numbers_and_fields_are_what_their_formula_says():
    rod = answering()
    numbers = 1.0 + SCALED @ [2.0, 3.0]
    np.testing.assert_allclose(rod.predict(X)[:, 0], numbers, rtol=1e-12)
    shown = rod.fields["temperature"]
    s = np.linspace(0.0, 1.0, 36)
    modes = np.sqrt(2.0) * np.stack([np.sin(np.pi * s), np.sin(2.0 * np.pi * s)])
    wanted = 20.0 + s + np.stack([numbers, numbers + 1.0], axis=1) @ modes
    np.testing.assert_allclose(shown.values(X)[..., 0], wanted, rtol=1e-12)
    assert [q.name for q in rod.outputs] == ["largest"]
    assert not rod.can_be_touched
    assert rod.parameters == rod.inputs == RANGES
    assert "answers largest and the curve rise and the field temperature" in str(rod)


def test_the_evaluator_of_the_loop_answers_as_the_field():
    shown = answering().fields["temperature"]
    exact, quick = shown.evaluator(precision="double"), shown.evaluator()
    for x, values in zip(X, shown.values(X), strict=True):
        np.testing.assert_allclose(exact(x), values, rtol=1e-13)
        np.testing.assert_allclose(quick(x), values, rtol=1e-5)


def test_the_deviation_adds_modes_and_scatter():
    shown = replace(answering().fields["temperature"], widening=2.0)
    assert np.isnan(shown.deviation(X)).all()  # its coefficients state none
    fitted = pp.fit(np.linspace(0, 1, 30), np.sin(np.linspace(0, 3, 30)), effort=0.01).surrogate()
    part = next(iter(fitted.quantities.values()))
    ones = np.ones((3, 1))
    one = ModalField("f", "", AxisPlaces("t", "s", np.arange(3.0)), part, ones, ones[None], 0.1 * ones, 2.0)
    at = np.array([[0.35]])
    np.testing.assert_allclose(one.deviation(at)[0, :, 0], 2.0 * np.hypot(part.deviation(at)[0, 0], 0.1))
    low, high = one.interval(at, 0.9)
    np.testing.assert_allclose((high - low) / 2.0, 1.6448536 * one.deviation(at), rtol=1e-6)


@pytest.mark.parametrize("fields", [False, True])
def test_what_is_saved_is_what_is_loaded_bit_for_bit(fields, tmp_path):
    rod = answering(fields=fields)
    again = pp.load(rod.save(tmp_path / "rod.palpate"))
    assert np.array_equal(again.predict(X), rod.predict(X))
    assert str(again) == str(rod)
    for name, shown in rod.fields.items():
        assert np.array_equal(again.fields[name].values(X), shown.values(X))
        assert np.array_equal(again.fields[name].places.coordinates, shown.places.coordinates)


def test_a_file_from_before_quantities_opens(tmp_path):
    beam = spring_beam()
    file = beam.save(tmp_path / "beam.palpate")
    archive = load_archive(file)
    meta = {key: value for key, value in archive.meta.items() if key != "quantities"}
    save_archive(file, replace(archive, meta=meta))
    again = pp.load(file)
    at = np.array([[-0.01], [-0.02]])
    assert np.array_equal(again.energy.force(at), beam.energy.force(at))
    assert again.quantities == {}


def test_what_can_not_be_one_surrogate_is_refused():
    with pytest.raises(UsageError, match="of nothing"):
        pp.Surrogate()
    other = pp.fit(np.linspace(0, 1, 30), np.linspace(0, 3, 30) ** 2, effort=0.01).surrogate()
    with pytest.raises(UsageError, match="different inputs"):
        pp.Surrogate(quantities={**other.quantities, "largest": quantities()})
    with pytest.raises(UsageError, match="can't be touched"):
        touchable(answering())
    with pytest.raises(UsageError, match="can't be touched"):
        answering().with_memory(spring_beam().memory).follow(X)
    with pytest.raises(UsageError, match="more than one network"):
        _ = answering().plain_network
    with pytest.raises(UsageError, match="no mesh"):
        MeshPlaces(np.zeros((3, 3)), np.array([[0, 1, 3]]))
    with pytest.raises(UsageError, match="does not ascend"):
        AxisPlaces("t", "s", np.array([0.0, 2.0, 1.0]))


def test_a_fit_is_a_surrogate_with_quantities(tmp_path):
    t = np.linspace(0.0, 1.0, 40)
    model = pp.fit(t, np.stack([np.sin(3 * t), t**2], axis=1), effort=0.01)
    again = pp.load(model.surrogate("wave").save(tmp_path / "wave.palpate"))
    at = np.linspace(-0.5, 1.5, 9)[:, None]
    assert isinstance(again, pp.Surrogate)
    assert again.name == "wave"
    assert np.array_equal(again.predict(at), model.predict(at))
    assert np.array_equal(again.deviation(at), model.deviation(at))
    assert np.array_equal(again.trusted(at), model.trusted(at))
    part = next(iter(again.quantities.values()))
    for ours, theirs in zip(part.interval(at, 0.8), model.interval(at, 0.8), strict=True):
        assert np.array_equal(ours, theirs)
