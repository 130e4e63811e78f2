"""Report: one self-contained page with what was solved, what was learnt, and how good it is.

chapter        content on one body                write           the page
summary        plain words on top                 tables          rows of the tables
style          look of the pictures               body_words      a body in words
load_pictures, network_pictures, place_pictures, touch_pictures, history_pictures, hand_pictures, trace_pictures
               the pictures, each of what the figures can show
"""

from palpate.validation.report.chapter import Chapter
from palpate.validation.report.write import write_report

__all__ = ["Chapter", "write_report"]
