"""Contact points and depths of a sphere probe: whether they have room, and in which order they are solved.

Moving a sphere sideways at depth is dear, since the contact then changes everywhere; pressing on at one place is
cheap, since the last states extrapolate well. So a design is made of depth series: straight lines along the outward
normal at contact points on the touched surface, with depths from shallow to deep on each.
"""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.interactions.surface_patch import Patch

__all__ = ["contact_points", "depth_series", "depths_per_series", "group_into_chains", "require_fit"]

LONGEST = 16  # depths in a series: finer ones cost as much as they save
SAME = 1e-3  # share of the radius within which two contact points are one
STEEP = 0.95  # share of a step that must lead into the surface
STRAIGHT = 1 - 1e-9  # cosine from which on two steps are on one line
NEAR = 8  # most scattered points in a chain
UPRIGHT = 1e-6  # by how much a plane's normal may fall short of an axis


def depths_per_series(samples: int, inputs: int = 3) -> int:
    """Return the number of depths in a series of a design of so many samples: about ¾ √samples.

    So the distance of the series, on the surface's scale, is about that of the depths. Of more inputs than a place each
    gets the same number of values.
    """
    count = 0.75 * np.sqrt(samples) if inputs == 3 else samples ** (1 / inputs)
    return int(np.clip(round(count), 1, LONGEST))


def depth_series(depth: tuple[float, float], count: int, shift: float) -> np.ndarray:
    """Return depths (count,) of one series in m, evenly spaced, all shifted by a share of their distance."""
    low, high = depth
    return low + (high - low) * (np.arange(count) + shift) / count


def contact_points(patch: Patch, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest point of the surface (N, 3) in m of each centre, and its signed distance (N,) in m."""
    nearest = [patch.nearest(centre) for centre in centres]
    return np.array([point for point, _, _ in nearest]), np.array([distance for _, _, distance in nearest])


def group_into_chains(
    centres: np.ndarray, contacts: np.ndarray, distance: np.ndarray, radius: float
) -> list[np.ndarray]:
    """Group positions into chains, each from shallow to deep: int arrays of rows, every row in one of them.

    Positions that follow each other on a straight line into the surface make a chain, and so do those of one contact
    point. Those that stand alone are split into groups of neighbours, by halving them across their widest side. The
    chains depend on the positions alone.

    `centres` and their `contacts` (N, 3) are in m, `distance` (N,) is the signed one from the surface in m.
    """
    runs = _runs(centres, distance)
    whole = [rows for rows in runs if rows.size > 1]
    others = np.array([rows[0] for rows in runs if rows.size == 1], dtype=int)
    series = _series(others, np.round(contacts / (SAME * radius)).astype(np.int64))
    whole += [rows for rows in series if rows.size > 1]
    single = np.array([rows[0] for rows in series if rows.size == 1], dtype=int)
    return [rows[np.argsort(-distance[rows], kind="stable")] for rows in [*whole, *_halve(contacts, single)]]


def _runs(centres: np.ndarray, distance: np.ndarray) -> list[np.ndarray]:
    """Split rows (N,) where the next position is not straight ahead into the surface.

    On a curved surface the positions of a series have contact points that differ by the facets' slopes, but they stay
    on one line.
    """
    steps = np.diff(centres, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    inward = (lengths > 0) & (distance[:-1] - distance[1:] > STEEP * lengths)
    units = steps / np.where(lengths > 0, lengths, 1.0)[:, None]
    breaks: list[int] = []
    for row in range(1, len(centres)):
        directed = row > 1 and (not breaks or breaks[-1] != row - 1)  # a line has two rows at least
        turned = directed and units[row - 1] @ units[row - 2] < STRAIGHT
        if not inward[row - 1] or turned:
            breaks.append(row)
    return np.split(np.arange(len(centres)), breaks)


def _series(rows: np.ndarray, keys: np.ndarray) -> list[np.ndarray]:
    """Split rows by equal keys (N, 3), in the order in which each key first occurs."""
    series: dict[tuple[int, ...], list[int]] = {}
    for row in rows.tolist():
        series.setdefault(tuple(keys[row].tolist()), []).append(row)
    return [np.array(rows) for rows in series.values()]


def _halve(contacts: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
    pending, done = [rows], []
    while pending:
        part = pending.pop()
        if part.size > NEAR:
            axis = int(np.argmax(np.ptp(contacts[part], axis=0)))
            ranked = part[np.argsort(contacts[part, axis], kind="stable")]
            pending += [ranked[part.size // 2 :], ranked[: part.size // 2]]
        elif part.size:
            done.append(part)
    return done


def require_fit(
    patch: Patch,
    points: np.ndarray,
    over: tuple[tuple[float, ...], tuple[float, ...]] | None,
    deepest: float,
    slack: float,
) -> None:
    """Refuse contact points that reach beyond an upright plane surface, or a depth that is all of the body's thickness.

    `points` (node, 3) are the nodes of the body at rest, `over` two corners of the box of the contact points, which may
    reach beyond the surface by `slack`, and `deepest` is the largest depth, all in m.
    """
    axis = int(np.argmax(np.abs(patch.facing)))
    if not patch.is_plane or abs(patch.facing[axis]) < 1 - UPRIGHT:
        return
    low, high = patch.box
    across = [i for i in range(3) if i != axis]
    thickness = float(np.ptp(points[:, axis]))
    if deepest >= thickness:
        raise UsageError(
            f"The probe would press {millimetres(deepest)} deep.",
            why=f"The body is {millimetres(thickness)} thick there.",
            fix="Give a smaller depth; a third of the thickness is deep for soft tissue.",
        )
    for i in across:
        if over is None or i >= len(over[0]):
            continue
        beyond = max(float(low[i] - over[0][i]), float(over[1][i] - high[i]))
        if beyond > slack:
            raise UsageError(
                f"The probe's contact points reach {millimetres(beyond)} beyond the surface along {'xyz'[i]}.",
                why=f"It is asked for from {millimetres(over[0][i])} to {millimetres(over[1][i])}, the surface is from "
                f"{millimetres(float(low[i]))} to {millimetres(float(high[i]))}.",
                fix="Give `over` within the surface, in m; its edges may be among it.",
            )
