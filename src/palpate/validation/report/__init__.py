"""One self-contained page: what was solved, what was learnt, how good it is.

chapter   what the page tells of one body         write    the page itself
summary   the plain words on top                  tables   rows of its tables
style     how figures look                        svg      a figure as part of a page
shapes, errors, growth, forces   the figures
surrogates/   the same of a touched body          held/    of a held body that remembers
"""

from __future__ import annotations

from palpate.validation.report.chapter import Chapter
from palpate.validation.report.held import HeldChapter
from palpate.validation.report.surrogates import SurrogateChapter
from palpate.validation.report.write import write_report

__all__ = ["Chapter", "HeldChapter", "SurrogateChapter", "write_report"]
