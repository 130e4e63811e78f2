"""The plain words on top, of a touched body."""

from __future__ import annotations

from palpate.format import count, interval, plain, share
from palpate.validation.report.summary import Fact, Story, felt
from palpate.validation.report.surrogates.chapter import SurrogateChapter

__all__ = ["surrogate_story"]


def surrogate_story(chapter: SurrogateChapter) -> Story:
    """Tell a chapter's results to a person."""
    v = chapter.validation
    verdict = "Every limit kept" if v.passed else f"{len(v.failures)} of {len(v.checks)} limits missed"
    return Story(
        verdict,
        v.passed,
        _facts(chapter),
        _solved(chapter),
        f"An energy network under a {chapter.surrogate.made_of}.",
        _good(chapter),
    )


def _facts(chapter: SurrogateChapter) -> tuple[Fact, ...]:
    v = chapter.validation
    depth = float(chapter.surrogate.depth(chapter.test.X).max())
    facts = [
        Fact(f"{plain(1e3 * depth, 3)} mm", "deepest touch in the test"),
        Fact(f"{plain(v.force.largest, 3)} N", "largest force on the probe in the test"),
    ]
    if "solves" in chapter.surrogate.meta:
        facts.append(Fact(count(int(chapter.surrogate.meta["solves"]), "solve"), "to learn from"))
    if v.force.median is not None and v.force.p95 is not None and v.force.p95_jnd is not None:
        facts.append(Fact(share(v.force.median), "force error at the median"))
        facts.append(
            Fact(share(v.force.p95), f"force error at most, for 95 of 100 touches: {felt(v.force.p95_jnd)}")
        )
    return tuple(facts)


def _solved(chapter: SurrogateChapter) -> str:
    v = chapter.validation
    return (
        f"{count(v.samples, 'touch', 'touches')} by finite elements that the surrogate never saw, within "
        f"{', '.join(interval(r) for r in chapter.surrogate.inputs)}; {v.force.light_count} of them are light, up to "
        f"f₀ = {plain(v.force.light)} N."
    )


def _good(chapter: SurrogateChapter) -> str:
    v = chapter.validation
    if v.force.median is None or v.force.p95 is None or v.force.p95_jnd is None:
        return "No touch in the test was strong enough to judge its force in relative terms."
    text = (
        f"The force is off by {share(v.force.median)} at the median and by at most {share(v.force.p95)} for 95 of 100 "
        f"touches: {felt(v.force.p95_jnd)}."
    )
    if v.stiffness is not None:
        text += f" The stiffness is off by at most {share(v.stiffness.p95)} for 95 of 100."
    if v.force.direction_p95 is not None:
        text += f" The direction is within {plain(v.force.direction_p95)}° for 95 of 100; a person notices 25° to 35°."
    if v.coverage is not None:
        text += f" Of {v.coverage.count} errors {share(v.coverage.share)} lie within the 90 % interval."
    works = [w.max for w in (v.loops, v.border_loops) if w is not None]
    if works:
        text += f" Closed paths return at most {share(max(works))} of the energy given on the way."
    return text
