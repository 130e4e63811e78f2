"""Voxels of a labelmap as hexahedra under a rigid ball in CalculiX: a quarter of a body that is symmetric in x and y.

Each voxel is an element with incompatible modes (C3D8I) of its tissue, so that the surface has the terraces of the
scan. Units are mm, mN and kPa, see `calculix`; the ball is that of `calculix_ball`.
"""

from __future__ import annotations

import calculix
import calculix_ball
import numpy as np

CORNERS = np.array(calculix_ball.CORNERS) // 2
# sides of an element as CalculiX numbers them, with the step to the voxel behind each
SIDES = {1: (0, 0, -1), 2: (0, 0, 1), 3: (0, -1, 0), 4: (1, 0, 0), 5: (0, 1, 0), 6: (-1, 0, 0)}


def deck(
    labels: np.ndarray,
    voxel: float,
    laws: dict[int, str],
    pad: float,
    *,
    top: float,
    held: float,
    touched: float,
    ball: float,
    depths: list[float],
) -> str:
    """Input for CalculiX: labels (n, n, n) of a body about the origin, in voxels of a size in m.

    `laws` has the law of each label, `pad` is the stiffness of the ball's skin in N/m³. The surface is fixed below the
    height `held` and touched above `touched`. The ball goes down to `depths` below the height `top`.
    """
    size, half, radius = voxel / calculix.MILLI, labels.shape[0] // 2, ball / calculix.MILLI
    part = labels[half:, half:]
    places = np.argwhere(part)
    rows = places[:, None] + CORNERS
    nodes, index = np.unique(rows.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 8) + 1
    points = size * (nodes - [0, 0, labels.shape[2] / 2]) - [0, 0, top / calculix.MILLI]
    lines = ["*NODE, NSET=ALL", *_number_rows(points)]
    for label, law in laws.items():
        lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET=R{label}")
        mine = np.flatnonzero(part[tuple(places.T)] == label)
        lines += [", ".join(map(str, [n + 1, *index[n]])) for n in mine.tolist()]
        lines += [f"*MATERIAL, NAME=LAW{label}", law, f"*SOLID SECTION, ELSET=R{label}, MATERIAL=LAW{label}"]
    lines += ["*ELSET, ELSET=BODY", *(f"R{label}," for label in laws)]
    around = np.pad(part, 1)
    around[0], around[:, 0] = 1, 1  # what lies beyond the planes of symmetry is no surface
    heights = size * (places[:, 2] + 0.5 - labels.shape[2] / 2) * calculix.MILLI
    touching, fixed = [], []
    for side, step in SIDES.items():
        bare = np.flatnonzero(around[tuple((places + 1 + step).T)] == 0)
        touching += [f"{n + 1}, S{side}" for n in bare[heights[bare] > touched].tolist()]
        low = bare[heights[bare] < held]
        fixed += index[low][:, (CORNERS @ step == max(step))].ravel().tolist()
    sets = {"FIXED": np.unique(fixed), "XSIDE": 1 + np.flatnonzero(nodes[:, 0] == 0)}
    sets["YSIDE"] = 1 + np.flatnonzero(nodes[:, 1] == 0)
    for name, own in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{n}," for n in own.tolist())]
    lines += ["*SURFACE, NAME=TOP", *touching, *calculix_ball.cap(radius)]
    # the body's laws stand above
    lines += calculix_ball.contact("", pad * calculix.MILLI / calculix.KILO)[3:]
    lines += ["*BOUNDARY", "FIXED, 1, 3", "XSIDE, 1, 1", "YSIDE, 2, 2", "TOOLNODES, 1, 2"]
    return "\n".join([*lines, *calculix_ball.steps(depths)]) + "\n"


def _number_rows(points: np.ndarray) -> list[str]:
    return [f"{n}, {x:.10g}, {y:.10g}, {z:.10g}" for n, (x, y, z) in enumerate(points.tolist(), 1)]
