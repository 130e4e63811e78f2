"""Energies of a body that loads bend, where the other solver gives none or only the energy in the body.

With loads P on nodes that move by w along them, the potential energy is Π(P) = W − P·w. It falls by dΠ = −w·dP, so a
series of solves of one load gives it by itself: Π(P) = −∫₀ᴾ w dP.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from palpate.dataset.schema import Field, Layout
from palpate.format import share
from palpate.units import Range

__all__ = ["with_energies"]

FEWEST = 4  # solves for a cubic spline
_CONTRADICTION = 1e-3  # share of the largest energy; integrals over ten loads are ten times as good


def with_energies(
    fields: Sequence[Field],
    answers: Mapping[str, np.ndarray],
    inputs: np.ndarray,
    ranges: Sequence[Range],
    layout: Layout,
    weight: bool,
) -> tuple[list[Field], dict[str, np.ndarray], list[str]]:
    """Add the potential and the strain energy where they follow from the other answers, with sentences about them.

    `fields` and `answers` are what the import has of each case, `inputs` (case, n) the loads in N, and the layout tells
    their nodes and directions. `weight` is True where gravity acts too: the body moves without a load then, and no
    energy follows.
    """
    notes: list[str] = []
    fields, answers = list(fields), dict(answers)
    if not len(layout.load_nodes) or "displacement" not in answers or "potential_energy" in answers:
        return fields, answers, notes
    moves = np.einsum(
        "nic,ic->ni", answers["displacement"][:, list(layout.load_nodes)], np.array(layout.load_directions)
    )
    if "strain_energy" in answers:
        answers["potential_energy"] = answers["strain_energy"] - (inputs * moves).sum(axis=1)
        notes.append("potential_energy: the strain energy less the work of the loads.")
        if len(ranges) == 1 and not weight:
            notes += _disagreement(answers["potential_energy"], inputs[:, 0], moves[:, 0])
    elif len(ranges) == 1 and not weight:
        potential, note = _integrate_deflection(inputs[:, 0], moves[:, 0])
        if potential is None:
            return fields, answers, [f"No energies: {note}."]
        answers["potential_energy"] = potential
        answers["strain_energy"] = potential + inputs[:, 0] * moves[:, 0]
        fields.append(Field("strain_energy", unit="J", meaning="energy stored in the body, by integration"))
        notes.append(f"strain_energy and potential_energy: {note}.")
    else:
        return (
            fields,
            answers,
            [
                "No energies: export the strain energy too, as the output strain_energy; palpate.learn needs it."
            ],
        )
    fields.append(
        Field("potential_energy", unit="J", meaning="strain energy less the potential of the loads")
    )
    return fields, answers, notes


def _disagreement(energy: np.ndarray, load: np.ndarray, move: np.ndarray) -> list[str]:
    """Return a warning where an energy and the deflection of the loaded node contradict each other."""
    integral, _ = _integrate_deflection(load, move)
    if integral is None:
        return []
    error = np.nanmax(np.abs(integral - energy)) / max(np.nanmax(np.abs(energy)), 1e-300)
    if not error > _CONTRADICTION:
        return []
    return [
        f"Warning: the energy differs by {share(float(error))} from the work of the load at its node. The load is "
        "spread over other nodes that move otherwise, or its size is not what the mapping says."
    ]


def _integrate_deflection(load: np.ndarray, move: np.ndarray) -> tuple[np.ndarray | None, str]:
    """Return −∫ w dP from no load for each case, None where it does not follow, and a sentence."""
    good = np.isfinite(load) & np.isfinite(move)
    P, first = np.unique(load[good], return_index=True)
    w = move[good][first]
    if len(P) + (0.0 not in P) < FEWEST:
        return None, f"{len(P)} different loads are too few to integrate the deflection over them"
    size = np.abs(w).max()
    repeated = np.abs(move[good] - w[np.searchsorted(P, load[good])]).max()
    if repeated > 1e-4 * size:
        return None, "equal loads have different deflections, so the body remembers how it got there"
    if 0.0 in P and abs(w[np.searchsorted(P, 0.0)]) > 1e-3 * size:
        return None, "the body is deflected without a load"
    if 0.0 not in P:
        at = int(np.searchsorted(P, 0.0))
        P, w = np.insert(P, at, 0.0), np.insert(w, at, 0.0)

    def potential(rows: slice) -> np.ndarray:
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(P[rows], w[rows]).antiderivative()
        return np.asarray(spline(0.0) - spline(load))

    energy = potential(slice(None))
    note = f"integrals of the deflection over {len(P)} loads"
    if len(P) >= 2 * FEWEST:
        # half of the solves err sixteen times as much: a cubic spline is of fourth order
        error = (
            np.nanmax(np.abs(potential(slice(None, None, 2)) - energy))
            / 15
            / max(np.nanmax(np.abs(energy)), 1e-300)
        )
        note += f", within about {share(error)} of the largest"
    return energy, note
