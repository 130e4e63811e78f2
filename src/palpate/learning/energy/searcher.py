"""The process that searches: ``python -m palpate.learning.energy.searcher``, started by `palpate.learning.energy.crew`.

It reads a pickled task from standard input, writes the pickled answer to standard output, and ends when that input
closes, so it does not outlive the process that started it. What anything prints goes to standard error.
"""

from __future__ import annotations

import os
import pickle
import sys

from palpate.processes import end_with_input

__all__ = ["main"]


def main() -> None:
    """Carry out the one task that comes."""
    from threadpoolctl import threadpool_limits

    answer = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    task = pickle.load(sys.stdin.buffer)
    end_with_input()
    with threadpool_limits(1), answer:
        pickle.dump(task.answer(), answer)


if __name__ == "__main__":
    main()
