"""A memory that palpate does not know, a dashpot in series with a part of the body, passes the checklist."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from surrogate_checks import MEMORY_CHECKS
from test_contract import contact, node, with_memory

from palpate.surrogates.memories import Memory, MemoryState, register_memory


@register_memory
@dataclass(frozen=True, eq=False)
class Dashpot(Memory):
    """A share of the body's stiffness that relaxes in a time (s)."""

    name: ClassVar[str] = "dashpot"
    walks: ClassVar[frozenset[str]] = frozenset({"positive", "signed"})

    share: float
    time: float

    def start(self):
        return DashpotState(self)


class DashpotState(MemoryState):
    """Stores V = ½ (1 − γ) q² + ½ γ e²; the dashpot takes e down while the hand stays, then both follow the hand."""

    def __init__(self, law):
        super().__init__()
        self._share, self._time = law.share, law.time
        self.reset()

    def reset(self):
        self._amplitude = self._stretch = 0.0
        super().reset()

    def step(self, position, amplitude, slope, dt):
        self.force[:] = 0.0
        if not (math.isfinite(amplitude) and math.isfinite(dt)):
            return False
        kept = math.exp(-dt / self._time)
        lost = 0.5 * self._share * self._stretch**2 * (1.0 - kept**2)
        self._stretch = kept * self._stretch + amplitude - self._amplitude
        self._amplitude = amplitude
        own = 1.0 - self._share
        self.book(0.5 * own * amplitude**2 + 0.5 * self._share * self._stretch**2, lost)
        np.multiply(slope, -(own * amplitude + self._share * self._stretch), out=self.force)
        return True


@pytest.mark.parametrize("body", [contact, node], ids=["contact", "node"])
@pytest.mark.parametrize("check", MEMORY_CHECKS, ids=[check.__name__ for check in MEMORY_CHECKS])
def test_it_passes_the_checklist(body, check, tmp_path):
    check(with_memory(body, lambda _: Dashpot(0.4, 0.2)), tmp_path)
