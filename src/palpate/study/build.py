"""From the record of a study to the objects it means."""

from __future__ import annotations

from dataclasses import replace

from palpate.learning import PRESETS, Settings, recommended
from palpate.physics import Cantilever, Circle, LinearElastic, PointLoad, Rectangle, Section, named_material
from palpate.study.models import Study

__all__ = ["body_of", "loads_of", "settings_of"]


def body_of(study: Study) -> Cantilever:
    """The study's body."""
    b = study.body
    material = (
        named_material(b.material)
        if isinstance(b.material, str)
        else LinearElastic(b.material.young, b.material.poisson, b.material.density, b.material.name)
    )
    return Cantilever(
        length=b.length,
        section=_section(study),
        material=material,
        elements=b.elements,
        order=b.order,
        kinematics=b.kinematics,
        self_weight=b.self_weight,
        nodes=b.nodes,
    )


def _section(study: Study) -> Circle | Rectangle | Section:
    s = study.body.section
    if s.radius is not None:
        return Circle(s.radius)
    if s.width is not None and s.height is not None:
        return Rectangle(s.width, s.height)
    # the record's own check leaves only this kind
    assert s.area is not None
    assert s.second_moment is not None
    assert s.shear_factor is not None
    return Section(s.area, s.second_moment, s.shear_factor)


def loads_of(study: Study) -> tuple[PointLoad, ...]:
    """The study's loads."""
    return tuple(PointLoad(p.name, p.at, p.low, p.high, p.direction) for p in study.loads)


def settings_of(study: Study) -> Settings:
    """The filter's settings: a named form with single settings changed."""
    form = PRESETS[study.filter.form]() if study.filter.form else recommended(len(study.loads))
    return replace(form, **study.filter.settings)  # type: ignore[arg-type]
