"""A held body that remembers in the report: force against displacement, beside finite elements.

chapter   what the page tells of one body      loops   the pictures      told   all of it, for the page
"""

from __future__ import annotations

from palpate.validation.report.held.chapter import HeldChapter

__all__ = ["HeldChapter"]
