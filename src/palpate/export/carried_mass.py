"""A mass at the tip of a learnt body, which an FMU moves: m ẍ = F(x) + push − d ẋ along the felt directions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.export.weights_block import MOTION, Table, WeightsBlock
from palpate.surrogates import Surrogate

__all__ = ["CarriedMass"]


@dataclass(frozen=True)
class CarriedMass:
    """A mass at the tip of a body, and its damping.

    Attributes
    ----------
    mass : float
        Mass, kg; more than 0.
    damping : float
        Force against the speed, N·s/m; by default 0, for none.

    Raises
    ------
    UsageError
        If the mass is not positive, or the damping negative.
    """

    mass: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mass) and self.mass > 0.0):
            raise UsageError(
                f"A mass of {self.mass} kg can't be moved.",
                why="The acceleration is the force over the mass.",
                fix="Give a positive one: --mass 0.1kg",
            )
        if not (math.isfinite(self.damping) and self.damping >= 0.0):
            raise UsageError(
                f"A damping of {self.damping} N·s/m would make energy.",
                why="It takes from the mass what its speed gives.",
                fix="Give 0 or more: --damping 0.5",
            )

    @property
    def sentence(self) -> str:
        """The limit that a model card states."""
        return (
            f"This FMU moves one mass of {self.mass:g} kg at the tip, with a damping of {self.damping:g} N·s/m: the "
            "user's choice, not the body's. The body itself is quasi-static: it has no mass, no damping and no "
            "vibrations of its own."
        )

    def require_body(self, surrogate: Surrogate) -> None:
        """Refuse a body that could not carry it.

        Raises
        ------
        UsageError
            If the body has a memory.
        """
        if surrogate.memory is not None:
            raise UsageError(
                f"A body with the memory {surrogate.memory.name!r} carries no mass.",
                why="What it remembers would have to be integrated together with the mass.",
                fix="Leave the mass out, and connect the FMU to a mass in the simulator.",
            )

    def added_to(self, block: WeightsBlock) -> WeightsBlock:
        """Return the block of a body that carries it."""
        tables = {**block.tables, MOTION: Table.of(np.array([self.mass, self.damping]))}
        return WeightsBlock(tables, block.baseline, block.memory, block.sources, block.field)
