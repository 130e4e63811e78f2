"""Figures that a model is judged by, one a file.

Each is a function of a `Subject` that returns a `Figure`; a sentence where it can't be measured; or None where it does
not apply. A further figure is a further file and a further line in `FIGURES`; its limits stand in
`palpate.validation.limits`.
"""

from __future__ import annotations

from collections.abc import Callable

from palpate.validation.figures.answer_errors import answer_errors
from palpate.validation.figures.by_load import network_outputs, shape_by_load, stiffness_by_load, work_by_load
from palpate.validation.figures.contrast_error import contrast_error
from palpate.validation.figures.coverage import coverage
from palpate.validation.figures.displayed_shape import displayed_shape
from palpate.validation.figures.figure import Figure
from palpate.validation.figures.force import energy_of_touches, force_on_hand
from palpate.validation.figures.history_following import history_following
from palpate.validation.figures.loop_work import border_work, closed_path_work
from palpate.validation.figures.mesh_error import mesh_error
from palpate.validation.figures.smoothness import stroke_smoothness
from palpate.validation.figures.stiffness import stiffness_matrix
from palpate.validation.figures.torque import torque_on_tool
from palpate.validation.figures.worst_cases import parts_of_test, worst_of_test
from palpate.validation.subject import Subject

__all__ = ["FIGURES"]

FIGURES: tuple[tuple[str, Callable[[Subject], Figure | str | None]], ...] = (
    ("force", force_on_hand),
    ("energy", energy_of_touches),
    ("torque", torque_on_tool),
    ("parts", parts_of_test),
    ("networks", network_outputs),
    ("stiffness", stiffness_matrix),
    ("stiffness", stiffness_by_load),
    ("smoothness", stroke_smoothness),
    ("coverage", coverage),
    ("contrast", contrast_error),
    ("loops", closed_path_work),
    ("loops", work_by_load),
    ("border_loops", border_work),
    ("shape", displayed_shape),
    ("shape", shape_by_load),
    ("mesh", mesh_error),
    ("worst", worst_of_test),
    ("histories", history_following),
    ("answers", answer_errors),
)
"""All figures by the names that they have in a `Validation`, in the order in which they are told."""
