"""Sections, materials, loads and the checks on a beam's own numbers."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from palpate.errors import UsageError
from palpate.physics import (
    MATERIALS,
    Cantilever,
    Circle,
    LinearElastic,
    PointLoad,
    Rectangle,
    Section,
    TipLoad,
    named_material,
)

NYLON = named_material("nylon")


@pytest.mark.parametrize(
    ("section", "half_width"),
    [
        (Circle(0.3), lambda y: math.sqrt(0.3**2 - y**2)),
        (Rectangle(0.2, 0.5), lambda _: 0.1),
    ],
)
def test_area_and_second_moment_are_the_integrals(section, half_width):
    h = section.half_height
    area, _ = dblquad(lambda x, y: 1.0, -h, h, lambda y: -half_width(y), half_width)
    moment, _ = dblquad(lambda x, y: y**2, -h, h, lambda y: -half_width(y), half_width)
    assert section.area == pytest.approx(area, rel=1e-7)
    assert section.second_moment == pytest.approx(moment, rel=1e-7)


def test_cowpers_shear_factors_at_zero_poisson_ratio():
    # there they are the classical energy-based 6/7 and 5/6 (Cowper 1966, table 1)
    assert Circle(1).shear_factor(0.0) == pytest.approx(6 / 7)
    assert Rectangle(1, 1).shear_factor(0.0) == pytest.approx(5 / 6)


def test_a_section_of_a_circles_numbers_is_that_circle():
    circle = Circle(0.005)
    given = Section(circle.area, circle.second_moment, circle.shear_factor(0.43))
    assert given.half_height == pytest.approx(circle.half_height)
    one, other = (
        Cantilever(1.0, section, NYLON).problem(TipLoad(0, 5)).solve(3.0).displacement
        for section in (circle, given)
    )
    np.testing.assert_allclose(one, other, rtol=1e-12)


def test_shear_modulus():
    assert LinearElastic(3e9, 0.5).shear_modulus == pytest.approx(1e9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Circle(0.0),
        lambda: Rectangle(1, math.nan),
        lambda: Section(1, 1, 1.5),
        lambda: Section(1, 1, 0.9, -1),
        lambda: LinearElastic(-1, 0.3),
        lambda: LinearElastic(1e9, 0.6),
        lambda: LinearElastic(1e9, 0.3, -1),
        lambda: PointLoad("P", 1.0, 5.0, 0.0),
        lambda: TipLoad(0, 1, direction=(0, 0)),
        lambda: Cantilever(-1, Circle(1), NYLON),
        lambda: Cantilever(1000, Circle(0.005), NYLON),
        lambda: Cantilever(1, Circle(5), NYLON),
        lambda: Cantilever(1, Circle(1), NYLON, order=1),
        lambda: Cantilever(1, Circle(1), NYLON, kinematics="medium"),
        lambda: Cantilever(1, Circle(1), NYLON, nodes=(0.5, 1.5)),
        lambda: Cantilever(1, Circle(1), NYLON).problem(()),
        lambda: Cantilever(1, Circle(1), NYLON).problem(PointLoad("P", 1.5, 0, 1)),
        lambda: Cantilever(1, Circle(1), NYLON).problem(PointLoad("P", 0.0, 0, 1)),
        lambda: Cantilever(1, Circle(1), NYLON).problem((TipLoad(0, 1), TipLoad(0, 2))),
        lambda: Cantilever(1, Circle(1), NYLON).problem(TipLoad(0, 1)).solve((1.0, 2.0)),
    ],
)
def test_impossible_numbers_are_refused_with_reason_and_remedy(make):
    with pytest.raises(UsageError) as caught:
        make()
    assert caught.value.why
    assert caught.value.fix


@pytest.mark.parametrize(
    "make",
    [
        lambda: Cantilever("0.3 m", Circle(1), NYLON),
        lambda: Cantilever(None, Circle(1), NYLON),
        lambda: Cantilever(1, 0.005, NYLON),
        lambda: Cantilever(1, "circle", NYLON),
        lambda: Cantilever(1, Circle(1), 2e9),
        lambda: Cantilever(1, Circle(1), NYLON, nodes=("tip",)),
        lambda: Cantilever(1, Circle(1), NYLON, elements="many"),
        lambda: Cantilever(1, Circle(1), NYLON).problem("5 N"),
        lambda: Cantilever(1, Circle(1), NYLON).problem(5.0),
        lambda: TipLoad("0 N", "5 N"),
        lambda: TipLoad(0, None),
        lambda: TipLoad(0, 5, direction="down"),
        lambda: TipLoad(0, 5, direction=("0", "1")),
        lambda: TipLoad(0, 5, direction=1.0),
        lambda: PointLoad("P", "0.5 m", 0, 1),
        lambda: Circle("5 mm"),
        lambda: LinearElastic("70 GPa", 0.33),
    ],
)
def test_arguments_of_the_wrong_kind_say_what_to_pass(make):
    with pytest.raises(UsageError) as caught:
        make()
    assert caught.value.why
    assert any(word in caught.value.fix for word in ("SI units", "Pass", "for example"))


def test_a_materials_name_is_no_material():
    with pytest.raises(UsageError) as caught:
        Cantilever(1, Circle(1), material="nylon")
    assert "named_material('nylon')" in caught.value.fix


def test_numpys_numbers_are_numbers():
    body = Cantilever(np.float64(1), Circle(np.float32(0.005)), NYLON, nodes=np.linspace(0, 1, 3))
    assert body.problem(TipLoad(np.int64(0), np.float64(5))).solve(1.0).converged


def test_unknown_material_lists_the_known_and_the_nearest():
    with pytest.raises(UsageError, match="coper") as caught:
        named_material("coper")
    assert "'copper'" in caught.value.fix
    assert all(name in caught.value.why for name in MATERIALS)
    assert named_material(" Copper ") is MATERIALS["copper"]


def test_directions_are_normalised():
    assert TipLoad(0, 1, direction=(3, -4)).direction == pytest.approx((0.6, -0.8))
