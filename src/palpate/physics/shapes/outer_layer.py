"""A thin outermost tissue, such as skin, as one layer of flat prisms over the mesh of the tissues beneath.

Elements as small as a skin is thick would be a hundred times as many. The tissues beneath are meshed without it; each
triangle of their surface is then the base of a prism as high as the voxels of the skin above it, split into three
tetrahedra. Heights are scaled so that the layer has the volume of its voxels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.physics.shapes.label_surface import LabelSurface
from palpate.physics.shapes.mesh import tetrahedron_volumes
from palpate.physics.shapes.scan_file import LabelImage

__all__ = ["ThinLayer", "add_layer", "thin_layer", "without_layer"]

INSIDE = 0.97  # share of a layer's voxels that lie within an element of the outside
RAY = 0.2  # of a voxel: distance between places at which the label above a surface is read
REACH = 2.5  # of the layer's usual height: largest height
BARE = 0.3  # of the layer's usual height: where less is above a place, it is bare
SPREAD = 6  # rounds in which heights become the mean of their neighbours': voxels give whole numbers of them
SEEN = 0.5  # sine of the angle between a layer and a cut above which the layer ends at the cut, and does not taper
FLAT = 0.2  # of base times height over three: a prism's smallest tetrahedron
LOWER, ROUNDS = 0.7, 16  # what heights over prisms inside out are multiplied by, and how often
GAINS = 4  # rounds of scaling heights to the volume of the voxels


@dataclass(frozen=True)
class ThinLayer:
    """A tissue that lies outermost and is thinner than an element."""

    name: str
    number: int  # among the names of the image, from 1
    value: int  # of its voxels
    height: float  # mean, m


def thin_layer(image: LabelImage, spacing: float) -> ThinLayer | None:
    """Return the tissue that lies outermost and is too thin for elements of `spacing` in m, if there is such."""
    from scipy.ndimage import distance_transform_edt

    if len(image.names) < 2:
        return None
    used = np.argwhere(image.labels > 0)
    low, last = used.min(axis=0), used.max(axis=0)
    part = image.labels[tuple(slice(max(a - 1, 0), b + 2) for a, b in zip(low, last, strict=True))]
    if (part > 0).all():
        return None
    depth = distance_transform_edt(part > 0, sampling=image.spacing)  # to the middle of a voxel outside
    layers = []
    for number, (name, value) in enumerate(image.names.items(), 1):
        deep = depth[part == value]
        if (deep < spacing).mean() > INSIDE:
            height = 2 * float(deep.mean()) - float(image.spacing.min())
            layers.append(ThinLayer(name, number, value, height))
    return min(layers, key=lambda layer: layer.height, default=None)


def without_layer(image: LabelImage, layer: ThinLayer) -> LabelImage:
    """Return the image of the tissues beneath a layer."""
    beneath = np.where(image.labels == layer.value, 0, image.labels)
    return replace(image, labels=beneath, names={k: v for k, v in image.names.items() if v != layer.value})


def add_layer(
    image: LabelImage,
    layer: ThinLayer,
    surface: LabelSurface,
    mesh: tuple[np.ndarray, np.ndarray, np.ndarray],
    is_bare: np.ndarray,
) -> tuple[LabelSurface, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the surfaces and the mesh (points, tetrahedra, label of each) with a layer over them.

    Labels of both are numbered by the names of the image that has the layer. `is_bare` (t,) tells triangles of the
    surface at the end of the image, where the layer ends.
    """
    points, tetrahedra, region = mesh
    number = layer.number
    rename = np.array([0, *(k for k in range(1, len(image.names) + 1) if k != number)])
    covers = (surface.outside == 0) & ~is_bare
    base = surface.triangles[covers]
    ways = _directions(surface, covers, len(points))
    height = _heights(image, layer, points, ways, base)
    top, height = _lift(points, ways, height, base, image.volumes[layer.name])
    lifted = np.flatnonzero(height > 0)
    index = np.arange(len(points))
    index[lifted] = len(points) + np.arange(len(lifted))
    points = np.concatenate([points, top[lifted]])
    prisms = _split(base, index[base])
    is_covered = (index[base] != base).any(axis=1)
    inside, outside = rename[surface.inside], rename[surface.outside]
    outside[np.flatnonzero(covers)[is_covered]] = number
    upper = index[base[is_covered]]
    surface = LabelSurface(
        points,
        np.concatenate([surface.triangles, upper]),
        np.concatenate([inside, np.full(len(upper), number)]),
        np.concatenate([outside, np.zeros(len(upper), int)]),
    )
    solid = (points, np.concatenate([tetrahedra, prisms]), np.append(rename[region], [number] * len(prisms)))
    return surface, solid


def _directions(surface: LabelSurface, covers: np.ndarray, count: int) -> np.ndarray:
    """Return the way (n, 3) that each corner is lifted per height of the layer, zero where none is.

    At the rim of a cut it stays in the plane of the cut; where a layer ends without one, it tapers.
    """
    ways, others = np.zeros((count, 3)), np.zeros((count, 3))
    for rows, total in ((covers, ways), ((surface.outside == 0) & ~covers, others)):
        for corner in surface.triangles[rows].T:
            np.add.at(total, corner, surface.area_vectors[rows])
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-30)
    length = np.linalg.norm(others, axis=1, keepdims=True)
    others = np.where(length > 0, others / np.maximum(length, 1e-30), 0.0)
    ways -= np.einsum("ni,ni->n", ways, others)[:, None] * others
    sine = np.linalg.norm(ways, axis=1, keepdims=True)
    return np.where(sine > SEEN, ways / np.maximum(sine, SEEN) ** 2, 0.0)


def _heights(
    image: LabelImage, layer: ThinLayer, points: np.ndarray, ways: np.ndarray, base: np.ndarray
) -> np.ndarray:
    """Return the height (n,) in m of the layer's voxels above each corner, smooth over its neighbours."""
    from scipy.sparse import coo_matrix, diags_array

    step = RAY * float(image.spacing.min())
    along = np.arange(-float(image.spacing.max()), REACH * layer.height, step)
    height = np.zeros(len(points))
    back = np.linalg.inv(image.axes)
    corners = np.unique(base)
    corners = corners[np.linalg.norm(ways[corners], axis=1) > 0]
    places = points[corners, None] + along[:, None] * ways[corners, None]
    voxel = np.rint((places - image.origin) @ back.T / image.spacing).astype(int)
    voxel = np.clip(voxel, 0, np.array(image.labels.shape) - 1)
    height[corners] = step * (image.labels[tuple(np.moveaxis(voxel, -1, 0))] == layer.value).sum(axis=1)
    pairs = np.concatenate([base[:, [k, (k + turn) % 3]] for k in range(3) for turn in (0, 1, 2)])
    pairs = pairs[np.isin(pairs, corners).all(axis=1)]
    near = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(points),) * 2).tocsr()
    mean = diags_array(1 / np.maximum(np.asarray(near.sum(axis=1)).ravel(), 1)) @ near
    for _ in range(SPREAD):
        height = np.asarray(mean @ height)
    return np.where(height > BARE * layer.height, height, 0.0)


def _lift(
    points: np.ndarray, ways: np.ndarray, height: np.ndarray, base: np.ndarray, wanted: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners above the surface and their heights, which hold `wanted` m³ and turn no prism inside out."""
    a, b, c = np.moveaxis(points[base], 1, 0)
    area = np.tile(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, 3)
    count = len(points)
    prisms = _split(base, base + count)
    for k in range(GAINS + ROUNDS):
        top = points + height[:, None] * ways
        volume = tetrahedron_volumes(np.concatenate([points, top]), prisms)
        if k < GAINS:
            height = height * np.clip(wanted / max(float(volume.sum()), 1e-30), 0.5, 2.0)
            continue
        above = height[prisms[:, 3] - count]  # each tetrahedron has one corner more of the top than the last
        flat = (above > 0) & (volume < FLAT * area * above / 3)
        if not flat.any():
            break
        lower = np.unique(prisms[flat] % count)
        height[lower] *= LOWER if k < GAINS + ROUNDS - 2 else 0.0
    return top, height


def _split(base: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Return right-handed tetrahedra (e, 4) of the prisms between triangles, without those of no height.

    The diagonal of a side runs from its lower corner of smaller number, so that neighbours share it.
    """
    order = np.argsort(base, axis=1)
    a, b, c = np.take_along_axis(base, order, axis=1).T
    above_a, above_b, above_c = np.take_along_axis(top, order, axis=1).T
    is_odd = ((order[:, 1] - order[:, 0]) % 3) == 2
    solid = np.concatenate(
        [
            np.column_stack([a, b, c, above_c]),
            np.column_stack([a, b, above_c, above_b]),
            np.column_stack([a, above_b, above_c, above_a]),
        ]
    )
    turned = np.tile(is_odd, 3)
    solid[turned] = solid[turned][:, [1, 0, 2, 3]]
    lifted = np.concatenate([above_c != c, above_b != b, above_a != a])
    return np.asarray(solid[lifted])
