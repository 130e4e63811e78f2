"""Every message of the page of an examination, beside those of `messages`.

The conversation, over a websocket of its own at ``/exam``, all JSON: the server says `ExamNews` at once and after each
change, the page says `ExamWish`. The body is touched in the conversation at ``/touch``; it is drawn without lumps, and
nothing at either place tells of lumps before a practice shows them or an examination has ended.
"""

from __future__ import annotations

from dataclasses import dataclass

from palpate.viewer.messages import Vec3
from palpate.viewer.wire import Json

__all__ = ["ExamMark", "ExamNews", "ExamWish", "FormerExam"]


@dataclass(frozen=True)
class ExamMark:
    """A place that a person has marked on the skin, m, or one that practice shows."""

    number: int  # 0 of a lump that practice shows
    place: Vec3
    hardness: str  # ``hard``, ``soft`` or nothing yet
    depth: str  # ``deep``, ``shallow`` or nothing yet
    answer: str  # of practice, in words


@dataclass(frozen=True)
class FormerExam:
    """An examination on this machine."""

    name: str
    at: str  # when it began, in words
    words: str  # its score in a line
    ended: bool  # otherwise it can go on


@dataclass(frozen=True)
class ExamNews(Json):
    """The state of the page of an examination, server to page."""

    protocol: int  # `PROTOCOL`: a page of another one reloads itself
    title: str
    words: str  # a paragraph that explains the examination
    stage: str  # ``ready``, ``practice`` or ``examination``
    notice: str  # what has just happened, in sentences; empty where there is nothing to say
    elapsed: float  # s since the examination began, without interruptions
    marks: tuple[ExamMark, ...]
    lumps: tuple[
        ExamMark, ...
    ]  # those that practice shows; none before it is asked, and none in an examination
    former: tuple[FormerExam, ...]  # the latest first
    score: str  # name of the examination that has just ended; its score is at ``/exams/NAME``


@dataclass(frozen=True)
class ExamWish(Json):
    """The wish of a person who examines, page to server."""

    wish: str  # ``practise``, ``show``, ``leave``, ``examine``, ``resume``, ``mark``, ``answer``, ``remove`` or ``end``
    number: int = 0  # of the mark that is answered or removed
    place: Vec3 = (
        0.0,
        0.0,
        0.0,
    )  # m, of a new mark: the probe's centre, or any place above or under the skin
    hardness: str = ""
    depth: str = ""
    name: str = ""  # of the examination that goes on
