"""Run the published experiments: ``python -m benchmarks.literature``."""

from __future__ import annotations

import sys

from benchmarks.runner import main

if __name__ == "__main__":
    sys.exit(main(only="literature"))
