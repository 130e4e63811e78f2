"""Whether a probe's footprint and depth have room on the body: what lies beyond is cut or fails, so it is refused."""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.patch import Patch
from palpate.physics.words import millimetres

__all__ = ["require_fit"]

UPRIGHT = 1e-6  # by how much a plane's normal may fall short of an axis


def require_fit(
    patch: Patch,
    points: np.ndarray,
    over: tuple[tuple[float, ...], tuple[float, ...]] | None,
    deepest: float,
    slack: float,
) -> None:
    """Refuse a footprint that reaches beyond an upright plane surface, or a depth that is all of the body's thickness.

    Parameters
    ----------
    patch : Patch
        The touched surface.
    points : (node, 3) array
        Of the body at rest, m.
    over : two corners, optional
    deepest, slack : float
        In m; a footprint may reach that far beyond.

    Raises
    ------
    UsageError
        With how far it reaches, and what there is.
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
                f"The probe's footprint reaches {millimetres(beyond)} beyond the surface along {'xyz'[i]}.",
                why=f"It is asked for from {millimetres(over[0][i])} to {millimetres(over[1][i])}, the surface is from "
                f"{millimetres(float(low[i]))} to {millimetres(float(high[i]))}.",
                fix="Give `over` within the surface, in m; its edges may be among it.",
            )
