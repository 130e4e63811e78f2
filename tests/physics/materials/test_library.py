"""Materials by name: all there, sourced, stable where they were fitted, and true to the test data's own check."""

from __future__ import annotations

import json
import pickle
import re

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.materials import MATERIALS, LinearElastic, NeoHookean, Ogden, named_material
from palpate.physics.materials.homogeneous import uniaxial
from palpate.physics.materials.library import material_words
from palpate.physics.materials.tissues import TISSUES

ELASTIC = [m for m in MATERIALS.values() if not m.states]
SILICONES = ("ecoflex 00-10", "ecoflex 00-30", "ecoflex 00-50")


@pytest.mark.parametrize("name", MATERIALS)
def test_each_is_sourced_plain_data_and_a_value(name):
    material = named_material(name.upper())
    assert material is MATERIALS[name]
    assert material.source
    assert material.density > 0
    assert material.name == name
    copy = pickle.loads(pickle.dumps(material))
    assert copy == material
    assert hash(copy) == hash(material)
    told = material.describe()
    assert json.loads(json.dumps(told)) == told
    assert name in str(material)


@pytest.mark.grid
@pytest.mark.parametrize("material", ELASTIC, ids=lambda m: m.name)
def test_each_is_stable_over_its_strains(material):
    high = 0.05 if isinstance(material, LinearElastic) else 1.0
    assert material.stability(strain=(-0.3, high), volume=(-0.01, 0.01))


@pytest.mark.parametrize("name", SILICONES)
def test_both_fits_of_one_silicone_describe_one_curve(name):
    # fitted to the same tension curve: with the other convention, 2μ/α², Ogden's would lie a sixth lower
    stretch = np.linspace(1.3, 2.0, 8)
    one, other = (uniaxial(named_material(n), stretch).stress for n in (name, f"{name} neo-hookean"))
    assert np.abs(one / other - 1).max() < 0.1
    assert np.abs(np.mean(one / other) - 1) < 0.05


def test_the_tables_constants():
    ecoflex, skin, fat = (named_material(n) for n in ("ecoflex 00-30", "dragon skin 30", "porcine fat"))
    assert isinstance(ecoflex, Ogden)
    assert (ecoflex.mu, ecoflex.alpha) == ((11.99e3,), (2.42,))
    assert (skin.mu, skin.alpha) == ((110e3,), (3.06,))
    assert fat.shear_modulus == pytest.approx(530)
    assert ecoflex.poisson == pytest.approx(0.499)
    assert named_material("porcine fat viscoelastic").shear_modulus == pytest.approx(530)
    assert named_material("Ecoflex 00-50 neo-Hookean", NeoHookean).shear_modulus == pytest.approx(2 * 11.21e3)


def test_a_body_can_ask_for_a_law():
    assert named_material("copper", LinearElastic).young == 110e9
    with pytest.raises(UsageError, match="Ogden") as caught:
        named_material("ecoflex 00-30", LinearElastic)
    assert "copper, nylon" in caught.value.why
    with pytest.raises(UsageError, match="ecoflx"):
        named_material("ecoflx 00-30")


@pytest.mark.parametrize("tissue", TISSUES.values(), ids=lambda tissue: tissue.name)
def test_a_tissue_lies_within_the_deviation_of_its_sources(tissue):
    assert tissue.low < tissue.young < tissue.high
    pairs = re.findall(r"([\d.]+) ± ([\d.]+) kPa", tissue.measured.partition("; with")[0])
    measured = [(1e3 * float(mean), 1e3 * float(deviation)) for mean, deviation in pairs]
    if measured:
        assert tissue.young == pytest.approx(measured[0][0], rel=0.02)
        assert tissue.low == pytest.approx(min(mean - deviation for mean, deviation in measured), rel=0.03)
        assert tissue.high == pytest.approx(max(mean + deviation for mean, deviation in measured), rel=0.03)
    assert named_material(tissue.name).young == tissue.young
    assert all(source in material_words(tissue.name) for source in tissue.sources)
