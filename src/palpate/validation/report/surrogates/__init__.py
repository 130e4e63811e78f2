"""A touched body in the report: what to draw and to say of its surrogate.

chapter   what the page tells of one body      view      a touched surface seen from outside
curves    force against depth                  maps      errors on the surface; where to trust the answer
story     the plain words on top               told      all of it, for the page
"""

from __future__ import annotations

from palpate.validation.report.surrogates.chapter import SurrogateChapter

__all__ = ["SurrogateChapter"]
