"""The relaxation of a pressed body whose material has Prony terms: held presses of the full model, and what they tell.

Solves of a sweep are presses at once, so what is learnt from them is the instantaneous answer. A ball pressed into the
middle of the touched surface and held, at two depths, shows how the force fades: shares and times as the ball feels
them, with the pad's part (`palpate.learning.relaxation`). The surrogate gets them as its memory, kept at places of its
surface. A third press at a depth between, which nothing was fitted to, gives the error that is reported.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import SolverError
from palpate.format import share
from palpate.learning.relaxation import Record, identify, identify_behind_pad
from palpate.learning.relaxation.probe_motions import step_hold
from palpate.physics import SphereProbe
from palpate.physics.apart import is_foreign
from palpate.physics.materials.viscous import Viscoelastic
from palpate.processes import CASE_LIMIT
from palpate.supervised import ChildEnded, run_in_child
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import Relaxation

__all__ = ["held_press", "prony_times", "with_relaxation"]

DEPTHS = (0.3, 0.9)  # depths of the held presses that are learnt from, over the study's largest
UNSEEN = 0.6  # depth of the press that judges, over the study's largest
EARLY, LATE = 1 / 10, 4.0  # first look over the shortest time, last over the longest
LOOKS = 14  # times at which a held press is looked at
SPACING = 0.25  # distance of the places that remember, over the ball's radius
MORE = 1.05  # factor of the material's share: a ball can't feel more relaxation than the material has
MOST = 3  # terms that held presses tell apart, at most


def prony_times(study: Any) -> tuple[float, ...]:
    """Return the relaxation times in s, ascending, of a study's solid materials; none where nothing relaxes.

    Only bodies that a ball presses have such a memory.
    """
    if study.interaction.kind != "probe":
        return ()
    materials = study.body.build().materials.values()
    times = {time for m in materials if isinstance(m, Viscoelastic) for time in m.prony.times}
    return tuple(sorted(times))


def with_relaxation(
    study: Any, surrogate: Surrogate, log: Callable[[str], None] = lambda _: None
) -> Surrogate:
    """Return a surrogate of a relaxing material with its memory; any other one as it is.

    `surrogate` is the instantaneous answer. SolverError if a held press can't be solved, UsageError if the presses
    don't tell the relaxation.
    """
    times = prony_times(study)
    if not times:
        return surrogate
    log("held presses, for the relaxation")
    problem, touch, inward = _press_of(study, surrogate)
    deepest = float(study.interaction.depth[1])
    looks = tuple(np.geomspace(EARLY * times[0], LATE * times[-1], LOOKS).tolist())
    records = [_held(problem, touch, inward, part * deepest, looks) for part in (*DEPTHS, UNSEEN)]
    learnt, unseen = records[: len(DEPTHS)], records[-1]
    most = min(MOST, len(times))
    found = identify_behind_pad(learnt, most=most)
    if sum(found.relaxation.shares) > MORE * _largest_share(study):
        # these presses do not tell the part of the pad
        found = identify(learnt[-1], most=most)
    error = _error_on(unseen, found.relaxation)
    log(f"{found}; missed by {share(error)} at a depth that it was not fitted to")
    shape = surrogate.fields.get("displacement")
    spacing = None if shape is None else SPACING * problem.interactions[0].radius
    record = {
        "terms": [list(term) for term in found.relaxation.terms],
        "pad": found.relaxation.pad,
        "material": [list(term) for term in _material_terms(study)],
        "depths": [part * deepest for part in DEPTHS],
        "unseen_depth": UNSEEN * deepest,
        "unseen_error": error,
    }
    body = surrogate.with_memory(found.relaxation, spacing=spacing)
    return replace(body, meta={**body.meta, "relaxation": record})


def _material_terms(study: Any) -> list[tuple[float, float]]:
    materials = study.body.build().materials.values()
    return [term for m in materials if isinstance(m, Viscoelastic) for term in m.prony.terms]


def _largest_share(study: Any) -> float:
    """Return the largest share of its stiffness that one of the materials loses."""
    materials = study.body.build().materials.values()
    return max(sum(m.prony.shares) for m in materials if isinstance(m, Viscoelastic))


def _press_of(study: Any, surrogate: Surrogate) -> tuple[Any, tuple[float, ...], tuple[float, ...]]:
    """Return the problem with a fine mesh in the middle alone, the centre at first contact, and the way in."""
    from palpate.runtime.touchable import touchable

    hand = touchable(surrogate)
    centre, normal = np.asarray(hand.home, dtype=float), np.asarray(hand.normal, dtype=float)
    whole = study.problem(whole=True)
    probe = whole.interactions[0]
    assert isinstance(probe, SphereProbe)
    touched = centre - probe.radius * normal
    half = 0.05 * probe.radius
    corners = (touched - half).tolist(), (touched + half).tolist()
    lower, upper = (tuple(float(f"{v:.9g}") for v in corner) for corner in corners)
    problem = replace(whole, interactions=(replace(probe, over=(lower, upper)),))
    return problem, tuple(centre.tolist()), tuple((-normal).tolist())


@functools.lru_cache(maxsize=8)
def _held(
    problem: Any, touch: tuple[float, ...], inward: tuple[float, ...], depth: float, looks: tuple[float, ...]
) -> Record:
    """Return the record of one held press; rounds of a study ask for the same ones again."""
    if not is_foreign(problem.body.geometry):
        times, forces, energy = held_press(problem, touch, inward, depth, looks)
    else:
        try:
            limit = CASE_LIMIT
            times, forces, energy = run_in_child(
                held_press, problem, touch, inward, depth, looks, limit=limit
            )
        except ChildEnded as error:
            raise SolverError(
                f"A child process ended while a press was held: {error.reason}.",
                why=error.details.partition("\n")[0],
                fix="Use larger elements, or leave `prony` out for the instantaneous answer.",
            ) from error
    return Record(np.asarray(times), np.asarray(forces), energy=energy)


def held_press(
    problem: Any, touch: Sequence[float], inward: Sequence[float], depth: float, looks: Sequence[float]
) -> tuple[list[float], list[float], float]:
    """Return times after a sudden press in s, forces along the way out in N, and the energy at once in J.

    `touch` (3,) is the centre of the ball at first contact in m, `inward` (3,) the unit vector of the press,
    `depth` the depth that is held in m, `looks` the times after the press at which the force is solved, in s.
    """
    drive = step_hold(touch, depth, np.asarray(looks), inward=inward)
    solver = problem.open()
    at_once = solver.solve(drive.positions[0])  # its energy is exact; that of a step in time is an estimate
    found = solver.march(drive.times, drive.positions) if at_once.converged else [at_once]
    if not found[-1].converged:
        raise SolverError(
            f"A press of {1e3 * depth:.3g} mm could not be held.",
            why=f"{found[-1].message}.",
            fix="Make the study's largest depth smaller, or leave `prony` out for the instantaneous answer.",
        )
    forces = [float(-np.dot(solution.response, inward)) for solution in found]
    return (drive.times - drive.times[0]).tolist(), forces, float(at_once.potential_energy)


def _error_on(record: Record, relaxation: Relaxation) -> float:
    """Return the largest error of the share that is left, at a press that was not fitted."""
    left = relaxation.relaxation(record.times, record.energy)
    return float(np.abs(left - record.forces / record.forces[0]).max())
