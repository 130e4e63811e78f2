"""The mesh of a body as plain arrays, the way from and to NGSolve, its quality, and where its surfaces are.

BodyMesh     points, tetrahedra, and the triangles of the outer surface, with names
MeshQuality  shape of the worst elements
Face         place, size and direction of a named surface
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.checks import own_arrays
from palpate.format import number
from palpate.physics.shapes.naming import members, require_known

__all__ = [
    "UNNAMED",
    "BodyMesh",
    "Face",
    "MeshQuality",
    "body_mesh",
    "faces_of",
    "mesh_quality",
    "outer_faces",
    "tetrahedron_volumes",
    "to_ngsolve",
]

# pairs of faces that share an edge; face i is opposite to vertex i
PAIRS = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
ONE_WAY = 0.1  # length of the mean normal below which a surface faces nowhere in the mean
UNNAMED = "unnamed"
Triple = tuple[float, float, float]
# the faces of a right-handed tetrahedron, each counter-clockwise as seen from outside
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@dataclass(frozen=True, eq=False)
class BodyMesh:
    """A body at rest as straight tetrahedra and the triangles of its outer surface.

    The arrays are read-only.

    Attributes
    ----------
    points : (node, 3) array
        Positions of the vertices in m. Node k is vertex k of the NGSolve mesh.
    tetrahedra : (e, 4) int array
        Nodes, right-handed: (p1 - p0) × (p2 - p0) · (p3 - p0) > 0.
    triangles : (t, 3) int array
        Nodes of the outer surface, counter-clockwise as seen from outside.
    surface_of : (t,) int array
        Index into `surfaces` for each triangle.
    region_of : (e,) int array
        Index into `regions` for each tetrahedron.
    surfaces, regions : tuple of str
        Names; each has at least one triangle or tetrahedron.
    """

    points: np.ndarray
    tetrahedra: np.ndarray
    triangles: np.ndarray
    surface_of: np.ndarray
    region_of: np.ndarray
    surfaces: tuple[str, ...]
    regions: tuple[str, ...]

    def __post_init__(self) -> None:
        own_arrays(self, "points")
        own_arrays(self, "tetrahedra", "triangles", "surface_of", "region_of", dtype=np.int64)

    def __repr__(self) -> str:
        return (
            f"BodyMesh({len(self.points)} nodes, {len(self.tetrahedra)} tetrahedra, "
            f"surfaces {', '.join(self.surfaces)}, regions {', '.join(self.regions)})"
        )

    @property
    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the box around the body in m, each (3,)."""
        return self.points.min(axis=0), self.points.max(axis=0)

    @cached_property
    def volumes(self) -> np.ndarray:
        """Volume of each tetrahedron in m³, shape (e,)."""
        return tetrahedron_volumes(self.points, self.tetrahedra)

    @property
    def volume(self) -> float:
        """Volume of the body in m³, between straight faces."""
        return float(self.volumes.sum())

    @property
    def region_volumes(self) -> dict[str, float]:
        """Volume of each region in m³."""
        sums = np.bincount(self.region_of, self.volumes, minlength=len(self.regions))
        return dict(zip(self.regions, sums.tolist(), strict=True))

    @cached_property
    def area_vectors(self) -> np.ndarray:
        """Outward normal times area of each triangle in m², shape (t, 3)."""
        a, b, c = np.moveaxis(self.points[self.triangles], 1, 0)
        return np.cross(b - a, c - a) / 2

    @property
    def areas(self) -> dict[str, float]:
        """Area of each surface in m²."""
        size = np.linalg.norm(self.area_vectors, axis=1)
        sums = np.bincount(self.surface_of, size, minlength=len(self.surfaces))
        return dict(zip(self.surfaces, sums.tolist(), strict=True))

    @property
    def normals(self) -> np.ndarray:
        """Outward unit normal of each triangle, shape (t, 3)."""
        return np.asarray(self.area_vectors / np.linalg.norm(self.area_vectors, axis=1, keepdims=True))

    @cached_property
    def quality(self) -> MeshQuality:
        """Shape of the worst elements."""
        return mesh_quality(self.points, self.tetrahedra)

    @cached_property
    def parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Number of the part of each tetrahedron (e,) and of each outer triangle (t,): what common faces join."""
        from trimesh.graph import connected_component_labels

        count = len(self.tetrahedra)
        faces = np.sort(np.concatenate([self.tetrahedra[:, FACES].reshape(-1, 3), self.triangles]), axis=1)
        # one number for the three nodes of a face, which sorts faster than rows
        key = (faces[:, 0] * len(self.points) + faces[:, 1]) * len(self.points) + faces[:, 2]
        order = np.argsort(key, kind="stable")
        # tetrahedra, and behind them the triangles as if they were some
        owner = np.concatenate([np.repeat(np.arange(count), 4), count + np.arange(len(self.triangles))])[
            order
        ]
        same = np.flatnonzero(key[order][1:] == key[order][:-1])
        pairs = np.column_stack([owner[same], owner[same + 1]])
        part = connected_component_labels(pairs, node_count=count + len(self.triangles))
        return part[:count], part[count:]

    def on(self, surface: str) -> np.ndarray:
        """Mask of the triangles that belong to a surface or a group of surfaces, bool of shape (t,).

        Raises
        ------
        UsageError
            If there is no such surface.
        """
        require_known("surface", surface, self.surfaces)
        numbers = [self.surfaces.index(name) for name in members(surface, self.surfaces)]
        return np.isin(self.surface_of, numbers)

    @cached_property
    def edges(self) -> np.ndarray:
        """Nodes (m, 2) of the edges of the outer surface, each pair and all pairs in rising order."""
        return np.unique(np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)

    def triangles_of(self, surface: str) -> np.ndarray:
        """Nodes of the triangles of a surface, shape (t, 3); `UsageError` if there is no such surface."""
        return np.asarray(self.triangles[self.on(surface)])

    def ngsolve(self) -> Any:
        """Return the mesh for NGSolve, as `to_ngsolve` gives it."""
        return to_ngsolve(self)


def outer_faces(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, in the order of the tetrahedra.

    The tetrahedra (e, 4) are right-handed; the faces (t, 3) are counter-clockwise as seen from outside.
    """
    faces = tetrahedra[:, FACES].reshape(-1, 3)
    _, inverse, count = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    return np.asarray(faces[count[inverse.ravel()] == 1])


def body_mesh(mesh: Any, surfaces: tuple[str, ...] = (), regions: tuple[str, ...] = ()) -> BodyMesh:
    """Plain arrays of a mesh of tetrahedra.

    Parameters
    ----------
    mesh : ngsolve.Mesh or netgen.meshing.Mesh
        Three-dimensional, in m. Curved elements are taken by their vertices.
    surfaces, regions : tuple of str
        Names in the order wanted; others follow in the order of the mesh.

    Returns
    -------
    BodyMesh
        Its nodes are numbered as the mesh's vertices. Boundaries between regions are left out.
    """
    netgen = getattr(mesh, "ngmesh", mesh)
    points = netgen.Coordinates()
    solid, skin = netgen.Elements3D().NumPy(), netgen.Elements2D().NumPy()
    tetrahedra = solid["nodes"][:, :4].astype(np.int64) - 1
    left_handed = tetrahedron_volumes(points, tetrahedra) < 0
    tetrahedra[left_handed] = tetrahedra[left_handed][:, [0, 2, 1, 3]]
    triangles = outer_faces(tetrahedra)
    names = [netgen.FaceDescriptor(i + 1).bcname for i in range(netgen.GetNFaceDescriptors())]
    number = _look_up(
        skin["nodes"][:, :3].astype(np.int64) - 1, skin["index"].astype(np.int64) - 1, triangles
    )
    outer, surface_of = _compact([*names, UNNAMED], number, surfaces)
    # Netgen counts regions by the faces around them, of which one within another has none in `to_ngsolve`
    materials = [netgen.GetMaterial(i + 1) for i in range(int(solid["index"].max(initial=0)))]
    inner, region_of = _compact(materials, solid["index"].astype(np.int64) - 1, regions)
    return BodyMesh(points, tetrahedra, triangles, surface_of, region_of, outer, inner)


def _look_up(triangles: np.ndarray, value: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Value of each wanted triangle (w, 3), whatever the order of its corners; -1 for those not among `triangles`."""
    table = {tuple(key): int(v) for key, v in zip(np.sort(triangles, axis=1).tolist(), value, strict=True)}
    return np.array([table.get(tuple(key), -1) for key in np.sort(wanted, axis=1).tolist()], dtype=np.int64)


def _compact(
    names: list[str], index: np.ndarray, first: tuple[str, ...]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names that occur, each once, those wanted `first` before the others; and the index into them."""
    every = [names[i] for i in index]
    present = set(every)
    used = tuple(dict.fromkeys(name for name in (*first, *names) if name in present))
    position = {name: i for i, name in enumerate(used)}
    return used, np.array([position[name] for name in every], dtype=np.int64)


def to_ngsolve(mesh: BodyMesh) -> Any:
    """Return the mesh for NGSolve: straight elements, names of surfaces and regions set.

    Vertices keep their numbers. Elements are sorted by region.

    Returns
    -------
    ngsolve.Mesh
    """
    import ngsolve
    from netgen.meshing import FaceDescriptor, Mesh

    ngsolve.SetNumThreads(1)
    netgen = Mesh(dim=3)
    netgen.AddPoints(np.ascontiguousarray(mesh.points))
    for i, name in enumerate(mesh.regions):
        # Netgen numbers a tetrahedron the other way round
        nodes = mesh.tetrahedra[mesh.region_of == i][:, [0, 2, 1, 3]]
        netgen.AddElements(dim=3, index=i + 1, data=np.ascontiguousarray(nodes, dtype=np.int32), base=0)
        netgen.SetMaterial(i + 1, name)
    behind = _region_behind(mesh)
    for s, name in enumerate(mesh.surfaces):
        for r in np.unique(behind[mesh.surface_of == s]).tolist():
            # a name belongs to a number of its own: Netgen gives it to the first face of a shared one only
            number = netgen.GetNFaceDescriptors() + 1
            index = netgen.Add(FaceDescriptor(surfnr=s + 1, domin=r + 1, domout=0, bc=number))
            netgen.SetBCName(number - 1, name)
            nodes = mesh.triangles[(mesh.surface_of == s) & (behind == r)]
            netgen.AddElements(dim=2, index=index, data=np.ascontiguousarray(nodes, dtype=np.int32), base=0)
    return ngsolve.Mesh(netgen)


def _region_behind(mesh: BodyMesh) -> np.ndarray:
    """Index of the region that each outer triangle bounds, shape (t,)."""
    faces = mesh.tetrahedra[:, FACES].reshape(-1, 3)
    return _look_up(faces, np.repeat(mesh.region_of, 4), mesh.triangles)


def tetrahedron_volumes(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Volumes in m³, shape (e,); negative for left-handed tetrahedra."""
    origin, a, b, c = np.moveaxis(points[tetrahedra], 1, 0)
    return np.asarray(np.einsum("ei,ei->e", np.cross(a - origin, b - origin), c - origin) / 6)


@dataclass(frozen=True)
class MeshQuality:
    """The worst elements of a mesh.

    Attributes
    ----------
    least_scaled_jacobian : float
        Volume of the box that three edges of one corner span, over the product of their lengths, times √2; the
        least over the corners and elements. 1 for regular tetrahedra, 0 for flat ones, negative for inverted
        ones (Knupp 2001, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23, 193-218).
    mean_scaled_jacobian : float
        The mean over the elements of the least over each one's corners.
    least_angle, largest_angle : float
        Angles between two faces in rad; 1.231 in a regular tetrahedron.
    shortest_edge, longest_edge : float
        Lengths of the mesh's extreme edges, m.
    """

    least_scaled_jacobian: float
    mean_scaled_jacobian: float
    least_angle: float
    largest_angle: float
    shortest_edge: float
    longest_edge: float


def mesh_quality(points: np.ndarray, tetrahedra: np.ndarray) -> MeshQuality:
    """The figures of `MeshQuality` for points (node, 3) and right-handed tetrahedra (e, 4)."""
    corners = points[tetrahedra]
    edges = corners[:, None, :, :] - corners[:, :, None, :]
    lengths = np.linalg.norm(edges, axis=-1)
    at_corner = lengths + np.eye(4)  # an edge from a corner to itself does not shrink the product
    box = 6 * tetrahedron_volumes(points, tetrahedra)
    scaled = np.sqrt(2) * box / at_corner.prod(axis=2).max(axis=1)
    angles = _dihedral_angles(corners)
    between = lengths[:, ~np.eye(4, dtype=bool)]
    return MeshQuality(
        least_scaled_jacobian=float(scaled.min()),
        mean_scaled_jacobian=float(scaled.mean()),
        least_angle=float(angles.min()),
        largest_angle=float(angles.max()),
        shortest_edge=float(between.min()),
        longest_edge=float(between.max()),
    )


def _dihedral_angles(corners: np.ndarray) -> np.ndarray:
    """Angles in rad between the faces of right-handed tetrahedra (e, 4, 3), shape (e, 6)."""
    a, b, c, d = np.moveaxis(corners, 1, 0)
    normals = np.stack(
        [np.cross(c - b, d - b), np.cross(d - a, c - a), np.cross(b - a, d - a), np.cross(c - a, b - a)],
        axis=1,
    )
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    cosine = np.einsum("epi,epi->ep", normals[:, PAIRS[:, 0]], normals[:, PAIRS[:, 1]])
    return np.asarray(np.pi - np.arccos(np.clip(cosine, -1, 1)))


@dataclass(frozen=True)
class Face:
    """Place, size and direction of a surface with a name.

    Attributes
    ----------
    name : str
        Name of the surface, as `BodyMesh.surfaces` has it.
    area : float
        Area in m².
    centre : (3,) tuple
        Centre of the area, m.
    normal : (3,) tuple
        Mean outward normal: of length one where the surface is plane, zero where it faces all ways.
    lower, upper : (3,) tuple
        Corners of the box around it, in m.
    """

    name: str
    area: float
    centre: Triple
    normal: Triple
    lower: Triple
    upper: Triple

    def __str__(self) -> str:
        facing = "all ways" if np.linalg.norm(self.normal) < ONE_WAY else _text(self.normal, 1.0, 2)
        box = f"{_text(self.lower)} … {_text(self.upper)} mm"
        area = f"{number(1e6 * self.area)} mm²"
        return f"{self.name}: {area} around {_text(self.centre)} mm, facing {facing}, in {box}"


def faces_of(mesh: BodyMesh) -> tuple[Face, ...]:
    """Return the faces of a mesh, one for each of its surfaces."""
    return tuple(_face(mesh, name, mesh.surface_of == i) for i, name in enumerate(mesh.surfaces))


def _face(mesh: BodyMesh, name: str, chosen: np.ndarray) -> Face:
    corners, vectors = mesh.points[mesh.triangles[chosen]], mesh.area_vectors[chosen]
    areas = np.linalg.norm(vectors, axis=1)
    area = float(areas.sum())
    return Face(
        name,
        area,
        _triple(areas @ corners.mean(axis=1) / area),
        _triple(vectors.sum(axis=0) / area),
        _triple(corners.min(axis=(0, 1))),
        _triple(corners.max(axis=(0, 1))),
    )


def _triple(values: np.ndarray) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _text(values: Triple, scale: float = 1e3, digits: int = 4) -> str:
    # what is nothing beside the largest is rounding dust
    dust = 1e-9 * max(map(abs, values))
    return f"({', '.join(number(0.0 if abs(v) < dust else scale * v, digits) for v in values)})"
