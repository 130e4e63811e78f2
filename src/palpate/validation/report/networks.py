"""The networks of a touch model: what each one is for, how many units it has."""

from __future__ import annotations

from palpate.format import count
from palpate.surrogates import TouchModel

__all__ = ["ROLES", "network_rows", "units_of"]

ROLES = {
    "nodes": "loads → the displacements asked for",
    "field": "loads → the whole shape, for the eye",
    "force": "where the hand is → the force, for the hand",
    "filter": "the sequential network before refinement, kept to be compared with nodes",
}
"""What each network is for."""


def network_rows(touch: TouchModel) -> list[tuple[str, str, str]]:
    """Name, purpose and number of units of each network, in the order of `ROLES`."""
    return [(k, role, str(touch.networks[k].units)) for k, role in ROLES.items() if k in touch.networks]


def units_of(touch: TouchModel, key: str) -> str:
    """One network by its name with its number of units, for titles and captions."""
    return f"network “{key}”, {count(touch.networks[key].units, 'unit')}"
