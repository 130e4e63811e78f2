"""A spring per edge of the tetrahedra, with a stiffness from Young's modulus and the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["LLOYD", "SpringNetwork", "spring_network"]

# Lloyd, Székely & Harders (2007) fit the stiffness matrix of a regular tetrahedron of edge l with springs at
# ν = 1/4, the one Poisson's ratio that central forces have, and find k = 2√2/25 E l. With the volume V = l³/(6√2)
# that is 24/25 E V/l², a form which also serves tetrahedra that are not regular.
LLOYD = 24 / 25

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


@dataclass(frozen=True, eq=False)
class SpringNetwork:
    """Points, springs between them, and tetrahedra that resist a change of volume.

    Attributes
    ----------
    points : (node, 3) array
        Positions at rest, m.
    edges : (s, 2) int array
        Ends of each spring.
    lengths : (s,) array
        Lengths at rest, m.
    stiffness : (s,) array
        N/m.
    tetrahedra : (e, 4) int array
        Nodes, right-handed.
    volumes : (e,) array
        Volumes at rest, m³.
    bulk : (e,) array
        Modulus of the energy ½ κ V₀ (V/V₀ − 1)² of each tetrahedron, Pa.
    """

    points: np.ndarray
    edges: np.ndarray
    lengths: np.ndarray
    stiffness: np.ndarray
    tetrahedra: np.ndarray
    volumes: np.ndarray
    bulk: np.ndarray


def spring_network(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    young: np.ndarray | float,
    poisson: np.ndarray | float = 0.25,
    *,
    volume: bool = True,
) -> SpringNetwork:
    """Springs, and volumes, that answer nearly like an isotropic elastic body.

    The stiffness of a spring of length l is the sum of 24/25 E' V/l² over the tetrahedra around it (Lloyd, Székely
    & Harders 2007, written with the volume V). Alone the springs behave like ν = 1/4 and take E' = E. With `volume`
    they carry the shear modulus μ, E' = 5/2 μ, and an energy of the volume alone carries what the bulk modulus
    exceeds 5/3 μ (Golec, Palierne, Zara, Nicolle & Damiand 2020).

    Parameters
    ----------
    points : (node, 3) array
        m.
    tetrahedra : (e, 4) int array
        Right-handed.
    young : float or (e,) array
        Young's modulus, Pa.
    poisson : float or (e,) array
        Below 1/4 the volume's energy is left out: it would have to be negative.
    volume : bool
        Whether the tetrahedra resist a change of volume.

    Returns
    -------
    SpringNetwork
    """
    corners = points[tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    young, poisson = np.broadcast_to(young, volumes.shape), np.broadcast_to(poisson, volumes.shape)
    shear, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
    carried = 2.5 * shear if volume else young
    edges, lengths, stiffness = _assembled(points, tetrahedra, LLOYD * carried * volumes)
    rest = np.maximum(bulk - 5 / 3 * shear, 0.0) if volume else np.zeros_like(volumes)
    return SpringNetwork(
        np.ascontiguousarray(points, dtype=float),
        edges,
        lengths,
        stiffness,
        np.ascontiguousarray(tetrahedra, dtype=np.int64),
        volumes,
        rest,
    )


def _assembled(
    points: np.ndarray, tetrahedra: np.ndarray, moments: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges, their lengths, and the sum of `moments`/l² over the tetrahedra around each."""
    ends = np.sort(tetrahedra[:, _EDGES].reshape(-1, 2), axis=1).astype(np.int64)
    edges, spring = np.unique(ends, axis=0, return_inverse=True)
    lengths = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    sums = np.bincount(spring.ravel(), np.repeat(moments, 6), minlength=len(edges))
    return edges, lengths, sums / lengths**2
