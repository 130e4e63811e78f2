"""The figures of one chapter, each with a heading, a caption and words for who cannot see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from palpate.format import count, length, plain, scientific, share
from palpate.learning import History
from palpate.validation.force import force_samples
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.errors import plot_node_errors, plot_outer
from palpate.validation.report.forces import plot_force, plot_force_errors
from palpate.validation.report.growth import plot_history
from palpate.validation.report.networks import units_of
from palpate.validation.report.shapes import colour_of_load, plot_shapes
from palpate.validation.report.style import styled
from palpate.validation.report.svg import Picture, inline_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["picture", "pictures"]


def pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw a chapter's figures; `key` starts the name of each one."""
    made = [_shapes(chapter, key), _errors(chapter, key), _growth(chapter, key), *_force(chapter, key)]
    return [*made, _outer(chapter, key)]


def picture(key: str, title: str, alt: str, caption: str, draw: Callable[[], Figure]) -> Picture:
    """Draw one figure; `alt` is what it shows for who cannot see it."""
    with styled(key):
        return Picture(key, title, alt, caption, inline_svg(draw(), key, alt))


def _shapes(chapter: Chapter, key: str) -> Picture:
    data, field = chapter.test.ok, chapter.validation.field
    _, colour = colour_of_load(data)
    alike = f"Left and right differ by {length(field.mean)} on average and {length(field.max)} at most."
    return picture(
        f"{key}-shapes",
        "Deflected shapes",
        f"Two panels with the deflected shapes of {chapter.name} under {count(len(data), 'load')}: finite elements on "
        f"the left, the network on the right. {alike}",
        f"All {len(data)} unseen loads, coloured by {colour.split(' / ')[0]}; on the right the "
        f"{units_of(chapter.touch, 'field')}. Dots mark the nodes of interest, the "
        f"dashed line the body at rest. {alike}",
        lambda: plot_shapes(chapter.touch, data),
    )


def _errors(chapter: Chapter, key: str) -> Picture:
    v = chapter.validation
    refined, own = v.networks["refined"], v.networks.get("filter")
    limit = next((c.most * refined.full_scale for c in v.checks if c.criterion.key == "rmse"), None)
    text = f"Refinement (network “nodes”) leaves at most {length(refined.max)} ({refined.worst})."
    if own:
        text = (
            f"The filter alone (network “filter”) is off by at most {length(own.max)} ({own.worst}). {text}"
        )
    dips = (
        " Dips are loads at which an error changes sign."
        if len(v.networks["refined"].worst.inputs) == 1
        else ""
    )
    return picture(
        f"{key}-errors",
        "Error at each node against load",
        f"Error at each node of {chapter.name} against load, on a logarithmic axis. {text}",
        text + dips,
        lambda: plot_node_errors(chapter.touch, chapter.test.ok, limit),
    )


def _growth(chapter: Chapter, key: str) -> Picture:
    h = chapter.history
    text = _grown(h) + _compared(chapter.rivals)
    return picture(
        f"{key}-growth",
        "Growth and pruning while learning",
        f"Units of the sequential filter over observations of {chapter.name}, with the error beside them. {text}",
        f"Network “filter”: {text} Dotted lines part the passes over the data.",
        lambda: plot_history(h, chapter.rivals),
    )


def _grown(h: History) -> str:
    left = int(h.units[-1]) if h.units.size else 0
    text = (
        f"{count(int(h.grew.sum()), 'unit')} grown and {int(h.pruned.sum())} pruned over "
        f"{count(h.units.size, 'observation')}; {count(left, 'unit')} left."
    )
    if h.heldout.size:
        text += (
            f" The error on unseen solves ends at {scientific(float(h.heldout[-1]))} of full scale and was never above "
            f"{plain(h.relapse, 3)} times its best so far."
        )
    return text


def _compared(rivals: Mapping[str, History]) -> str:
    told = [
        f"{name} ends at {scientific(float(r.heldout[-1]))} with {count(int(r.units[-1]), 'unit')} and rose to "
        f"{plain(r.relapse, 3)} times its best"
        for name, r in rivals.items()
        if r.heldout.size
    ]
    return f" For comparison: {'; '.join(told)}." if told else ""


def _force(chapter: Chapter, key: str) -> list[Picture]:
    data, force = chapter.test.ok, chapter.validation.force
    samples = force_samples(chapter.touch, data)
    what = "against the hand's displacement"
    if len(data.ranges) > 1:
        what = "of the network against that of finite elements"
    felt = "No touch was strong enough to judge in relative terms."
    if force.p95 is not None and force.max is not None:
        felt = f"95 of 100 forces are within {share(force.p95)}, all within {share(force.max)}; a person notices 7 %."
    first = picture(
        f"{key}-force",
        "Force on the hand",
        f"Force on the hand {what}, for {chapter.name}, up to {plain(force.largest, 3)} N.",
        f"The force {what}: {units_of(chapter.touch, 'force')}, asked through the evaluator that runs at 1 kHz."
        f"{_signs(chapter)}",
        lambda: plot_force(chapter.touch, data, samples),
    )
    second = picture(
        f"{key}-felt",
        "Force error as a hand feels it",
        f"Share of unseen solves of {chapter.name} against force error in just noticeable differences. {felt}",
        f"{felt} Touches up to f₀ = {plain(force.light)} N ({force.light_count} of {len(data)}) are judged "
        "against f₀ instead.",
        lambda: plot_force_errors(samples),
    )
    return [first, second]


def _signs(chapter: Chapter) -> str:
    """What a sign means on the axes of the force against the displacement."""
    if len(chapter.test.ranges) > 1:
        return ""
    text = " Displacement counts along the load, force against it: a body that resists has both of one sign."
    weight = chapter.train.provenance.get("problem", {}).get("body", {}).get("self_weight")
    return f"{text} At no force the body hangs under its own weight." if weight else text


def _outer(chapter: Chapter, key: str) -> Picture:
    v = chapter.validation
    parts = [
        f"{'refined network' if k == 'refined' else k} {plain(e.outer_ratio)} times the rest"
        for k, e in v.networks.items()
        if e.outer_ratio is not None
    ]
    place = "in the outer 5 % at either end of the range"
    if len(chapter.test.ranges) > 1:
        place = "with any load in the outer 5 % of its range"
    lie = f"{v.networks['refined'].outer_count} of {v.samples} unseen solves lie {place}."
    text = f"{lie} RMSE there: {', '.join(parts) or 'not known'}."
    return picture(
        f"{key}-outer",
        "Ends of the range against the rest",
        f"Errors of {chapter.name} at the ends of the range beside the rest. {text}",
        text,
        lambda: plot_outer(v),
    )
