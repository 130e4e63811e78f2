"""The process that searches: ``python -m palpate.learning.energy.searcher``, started by `palpate.learning.energy.crew`.

It reads a pickled task from standard input, writes the pickled answer to standard output, and ends when that input
closes, so it does not outlive the process that started it. What anything prints goes to standard error.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading

__all__ = ["main"]


def _end_with_input() -> None:
    # the descriptor itself is read: a thread inside `sys.stdin` would stall the interpreter's end
    while os.read(sys.stdin.fileno(), 1024):
        pass
    os._exit(0)


def main() -> None:
    """Carry out the one task that comes."""
    from threadpoolctl import threadpool_limits

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is told by the input's end
    answer = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    task = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_input, daemon=True).start()
    with threadpool_limits(1), answer:
        pickle.dump(task.answer(), answer)


if __name__ == "__main__":
    main()
