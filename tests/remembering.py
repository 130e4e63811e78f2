"""A memory led by energies and their slopes, as closed forms give them."""

from __future__ import annotations

import numpy as np

from palpate.surrogates.memories import MemoryState


def press(memory: MemoryState, place: np.ndarray, energy: float, slope: np.ndarray, dt: float = 0.0) -> bool:
    """Move a memory to a place where the elastic energy (J) and its slope (N) are these, within dt seconds."""
    q = np.sqrt(2.0 * energy) if energy >= 0 else -1.0
    return memory.step(place, float(q), slope / q if q > 0 else 0.0 * slope, dt)
