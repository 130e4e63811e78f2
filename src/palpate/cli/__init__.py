"""The command line: parse, call the study, print.

Progress goes to stderr, results to stdout. Exit codes: 0 ok, 1 accuracy target missed, 2 usage, 3 solver or
device failure, 130 interrupted.
"""

from palpate.cli.program import main

__all__ = ["main"]
