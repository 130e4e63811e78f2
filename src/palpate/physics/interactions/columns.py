"""In which order a sphere's positions are solved: column by column, from shallow to deep.

Moving a sphere sideways at depth is dear, since the contact then changes everywhere; pressing on at one place is
cheap, since the last states extrapolate well. So a design is made of columns: straight lines along the outward
normal at places ("footprints") on the touched surface, with depths from shallow to deep on each.
"""

from __future__ import annotations

import numpy as np

from palpate.physics.interactions.patch import Patch

__all__ = ["footprints_of", "group", "per_column", "stratified"]

LONGEST = 16  # depths in a column: finer ones cost as much as they save
SAME = 1e-3  # share of the radius within which two footprints are one
STEEP = 0.95  # share of a step that must lead into the surface
STRAIGHT = 1 - 1e-9  # cosine from which on two steps are on one line
NEAR = 8  # scattered points in a chain


def per_column(samples: int) -> int:
    """How many depths a column has in a design of so many samples: about ¾ √samples.

    So the columns' distance, on the surface's scale, is about the depths'.
    """
    return int(np.clip(round(0.75 * np.sqrt(samples)), 1, LONGEST))


def stratified(depth: tuple[float, float], count: int, shift: float) -> np.ndarray:
    """Depths (count,) of one column in m, evenly spaced, all shifted by a share of their distance."""
    low, high = depth
    return low + (high - low) * (np.arange(count) + shift) / count


def footprints_of(patch: Patch, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nearest point of the surface (N, 3) in m of each centre, and its signed distance (N,) in m."""
    found = [patch.nearest(centre) for centre in centres]
    return np.array([foot for foot, _, _ in found]), np.array([distance for _, _, distance in found])


def group(centres: np.ndarray, feet: np.ndarray, distance: np.ndarray, radius: float) -> list[np.ndarray]:
    """Parts positions into chains, each from shallow to deep.

    Positions that follow each other on a straight line into the surface make a chain, and so do those of one
    footprint. Those that stand alone are parted into groups of neighbours, by halving them across their widest
    side.

    Parameters
    ----------
    centres, feet : (N, 3) array
        Positions and their footprints in m.
    distance : (N,) array
        Signed distances of the centres from the surface in m.
    radius : float
        Of the sphere in m.

    Returns
    -------
    list of int arrays
        Row indices; every row occurs once. They depend on the positions alone.
    """
    runs = _runs(centres, distance)
    whole = [rows for rows in runs if rows.size > 1]
    others = np.array([rows[0] for rows in runs if rows.size == 1], dtype=int)
    columns = _columns(others, np.round(feet / (SAME * radius)).astype(np.int64))
    whole += [rows for rows in columns if rows.size > 1]
    single = np.array([rows[0] for rows in columns if rows.size == 1], dtype=int)
    return [rows[np.argsort(-distance[rows], kind="stable")] for rows in [*whole, *_halved(feet, single)]]


def _runs(centres: np.ndarray, distance: np.ndarray) -> list[np.ndarray]:
    """Rows (N,) parted where the next position is not straight ahead into the surface.

    On a curved surface the positions of a column have footprints that differ by the facets' slopes, but they stay
    on one line.
    """
    steps = np.diff(centres, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    inward = (lengths > 0) & (distance[:-1] - distance[1:] > STEEP * lengths)
    units = steps / np.where(lengths > 0, lengths, 1.0)[:, None]
    parted: list[int] = []
    for row in range(1, len(centres)):
        directed = row > 1 and (not parted or parted[-1] != row - 1)  # a line has two rows at least
        turned = directed and units[row - 1] @ units[row - 2] < STRAIGHT
        if not inward[row - 1] or turned:
            parted.append(row)
    return np.split(np.arange(len(centres)), parted)


def _columns(rows: np.ndarray, keys: np.ndarray) -> list[np.ndarray]:
    """Those rows parted by equal keys (N, 3), in the order in which each key first occurs."""
    found: dict[tuple[int, ...], list[int]] = {}
    for row in rows.tolist():
        found.setdefault(tuple(keys[row].tolist()), []).append(row)
    return [np.array(rows) for rows in found.values()]


def _halved(feet: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
    pending, done = [rows], []
    while pending:
        part = pending.pop()
        if part.size > NEAR:
            axis = int(np.argmax(np.ptp(feet[part], axis=0)))
            ranked = part[np.argsort(feet[part, axis], kind="stable")]
            pending += [ranked[part.size // 2 :], ranked[: part.size // 2]]
        elif part.size:
            done.append(part)
    return done
