"""Entry of the real-time process, ``python -m palpate.runtime``; see `palpate.runtime.child`."""

from __future__ import annotations

import sys

# Numba imports SciPy wherever it finds it, for linear algebra that this process doesn't do: it is told that
# there is none, which saves tens of megabytes and a good part of the start
sys.modules["scipy"] = None  # type: ignore[assignment]

from palpate.runtime.child import main  # noqa: E402 after the line that it depends on

if __name__ == "__main__":
    sys.exit(main())
