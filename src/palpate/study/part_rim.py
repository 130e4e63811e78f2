"""The rim of what is painted on a part: what the ball meets as well when it presses near the border of the paint.

A ball of radius R that is pressed to a depth d is in contact as far as √(2 R d − d²) from the place that it presses. So
the surface around the paint, that far, belongs to the contact; what is held does not.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.file_kinds import part_kind
from palpate.physics.shapes.body_file import FEATURE_ANGLE
from palpate.physics.shapes.mesh import BodyMesh
from palpate.study.part_records import PartRecord
from palpate.study.probe_kind import ProbeRecord
from palpate.study.study import Study

__all__ = ["RIM", "contact_radius", "with_rim"]

RIM = "rim"
# Share of the border of the paint that goes on smoothly into the rim. Where it ends at sharp edges, as the top of a
# block does, the body gives way within a few mm of them, and places keep away from the border as before.
SMOOTH = 0.5


def contact_radius(radius: float, depth: float) -> float:
    """Return the radius √(2 R d − d²) in m of the largest contact of a ball of radius R at a depth d, at most R."""
    deep = min(depth, radius)
    return math.sqrt(deep * (2 * radius - deep))


def with_rim(study: Study) -> Study:
    """Return the study of a part with a rim around what is touched, or without one where the part leaves no room.

    A CAD file has no triangles to choose a rim from, and where the touched surface mostly ends at sharp edges the
    places keep a margin.
    """
    body, acting = study.body, study.interaction
    assert isinstance(body, PartRecord)
    if not isinstance(acting, ProbeRecord):
        return study  # a tool keeps a margin
    bare = _without_rim(study)
    if part_kind(body.file) == "cad":
        return bare
    assert isinstance(bare.body, PartRecord)
    skin = bare.body.shape().skin
    reach = contact_radius(acting.radius, acting.depth[1]) + _half_triangle(skin, acting.touches)
    content = bare.model_dump()
    content["body"]["surfaces"] += ({"name": RIM, "around": acting.touches, "reach": float(f"{reach:.3g}")},)
    content["interaction"] |= {"rim": RIM, "over": None}
    try:
        rimmed = Study.model_validate(content)
    except (UsageError, ValueError):  # nothing lies around it but what is held
        return bare
    assert isinstance(rimmed.body, PartRecord)
    return rimmed if _smooth_share(rimmed.body.shape().skin, acting.touches) >= SMOOTH else bare


def _without_rim(study: Study) -> Study:
    """Return the study without the rim of earlier choices."""
    content: dict[str, Any] = study.model_dump()
    if content["interaction"].get("rim") is None:
        return study
    content["body"]["surfaces"] = tuple(s for s in content["body"]["surfaces"] if s["name"] != RIM)
    content["interaction"]["rim"] = None
    return Study.model_validate(content)


def _half_triangle(skin: BodyMesh, surface: str) -> float:
    """Return half the usual edge in m of the triangles of a surface: the rim is measured from middle to middle."""
    corners = skin.points[skin.triangles_of(surface)]
    return 0.5 * float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def _smooth_share(skin: BodyMesh, touched: str) -> float:
    """Return the share, by length, of the border of a surface that goes on smoothly into the rim."""
    triangles, mine, rim = skin.triangles, skin.on(touched), skin.on(RIM)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    first = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    a, b = owner[first], owner[first + 1]
    length = np.linalg.norm(skin.points[edges[first, 0]] - skin.points[edges[first, 1]], axis=1)
    border = mine[a] != mine[b]
    smooth = np.einsum("ni,ni->n", skin.normals[a], skin.normals[b]) > math.cos(math.radians(FEATURE_ANGLE))
    into = smooth & (rim[a] | rim[b])
    return float(length[border & into].sum() / max(length[border].sum(), 1e-300))
