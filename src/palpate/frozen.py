"""Arrays of values that nobody changes."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["own_arrays"]


def own_arrays(value: object, *names: str, dtype: Any = np.float64) -> None:
    """Replace these arrays of a frozen dataclass by C-ordered copies of its own, of one type, that can't be written.

    Called in ``__post_init__``; what is None stays so.
    """
    for name in names:
        if getattr(value, name) is None:
            continue
        array = np.array(getattr(value, name), dtype=dtype, order="C")
        array.flags.writeable = False
        object.__setattr__(value, name, array)
