"""The variables of an FMU, the same for both versions of FMI: inputs, parameters, outputs, states and their rates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from palpate.export.weights_block import identifier
from palpate.surrogates import Surrogate
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.export.answer_network import AnswerNetwork
    from palpate.export.carried_mass import CarriedMass

__all__ = [
    "ANSWER",
    "ANSWER_DEVIATION",
    "Variable",
    "answer_variables",
    "body_variables",
    "defined_units",
    "has_exchange",
    "moving_variables",
]

PARAMETER, STATE, FLAGS, SCALE = 16, 64, 12, 9  # value references, as in core/fmi_instance.c
DAMPING, MASS, LIGHT = 48, 49, 0.05  # the last is the start of MASS, kg: a light tool
PUSH, SPEED, KINETIC, TORQUE, ANSWER, ANSWER_DEVIATION = 50, 53, 56, 57, 1024, 1 << 25
_MOST_STATES = 2000  # solvers keep a square matrix of them, and each is described by two variables
_PLACES = (0, 1, 2)
_UNITS: Mapping[str, str] = {
    "m": 'm="1"',
    "N": 'kg="1" m="1" s="-2"',
    "J": 'kg="1" m="2" s="-2"',
    "N.m": 'kg="1" m="2" s="-2"',
    "W": 'kg="1" m="2" s="-3"',
    "Pa": 'kg="1" m="-1" s="-2"',
    "N/m": 'kg="1" s="-2"',
    "N.s/m": 'kg="1" s="-1"',
    "m/s": 'm="1" s="-1"',
    "m/s2": 'm="1" s="-2"',
    "K": 'K="1"',
    "kg": 'kg="1"',
    "s": 's="1"',
    "1": "",
}
_ROOT, _ROOT_RATE = "J^0.5", "J^0.5/s"  # no whole powers of SI's base units


@dataclass(frozen=True)
class Variable:
    """A scalar variable of FMI; what is discrete is Boolean, all else real."""

    name: str
    words: str  # what it is
    reference: int  # value reference; all are different
    causality: Literal["input", "output", "parameter", "local"]
    variability: Literal["continuous", "discrete", "tunable"]
    unit: str = ""  # as `defined_units` defines it; "" for Booleans
    start: float | None = None
    low: float | None = None
    high: float | None = None
    nominal: float | None = None  # usual size
    rate_of: int | None = None  # value reference of the state that it is the rate of
    depends: tuple[int, ...] | None = _PLACES  # references of inputs and states it depends on; None: all

    @property
    def is_state(self) -> bool:
        """True for a continuous state."""
        return self.causality == "local" and self.rate_of is None

    @property
    def is_unknown(self) -> bool:
        """True for what follows from others: an output or a rate."""
        return self.causality == "output" or self.rate_of is not None


def has_exchange(surrogate: Surrogate) -> bool:
    """Return whether a body goes out for model exchange, too.

    It does without a memory, and with one that follows differential equations of at most 2,000 states.
    """
    if surrogate.memory is None:
        return True
    groups = surrogate.memory.c_states()
    return groups is not None and sum(map(len, groups)) < _MOST_STATES


def body_variables(surrogate: Surrogate) -> list[Variable]:
    """Return the variables in the order in which a description lists them."""
    return [
        *_inputs(surrogate),
        *_parameters(surrogate),
        *_outputs(surrogate),
        *(_states(surrogate) if surrogate.memory is not None and has_exchange(surrogate) else []),
    ]


def answer_variables(answers: AnswerNetwork) -> list[Variable]:
    """Return the variables of what no hand feels: inputs, answers, and whether they are in the trained region."""
    every = tuple(range(PARAMETER, PARAMETER + len(answers.inputs)))
    names = _different([r.name for r in answers.inputs] + [q.name for q in answers.outputs])
    rows = [
        Variable(
            name,
            f"{r.name}, trained from {r.low:g} to {r.high:g}",
            reference,
            "input",
            "continuous",
            r.unit or "1",
            start=(r.low + r.high) / 2,
        )
        for name, reference, r in zip(names, every, answers.inputs, strict=False)
    ]
    # extremes stand behind all outputs of the networks, of which some are not replies
    last = len(answers.networks[0].outputs)
    places = [*range(answers.count), *range(last, last + len(answers.runs))]
    rows += [
        _output(name, q.name, ANSWER + i, q.unit or "1", every)
        for name, i, q in zip(names[len(every) :], places, answers.outputs, strict=True)
    ]
    if answers.rows is not None:
        own = names[len(every) :]
        spread = _different([*names, *(f"{name}_deviation" for name in own)])[len(names) :]
        rows += [
            _output(name, f"standard deviation of {q.name}", ANSWER_DEVIATION + i, q.unit or "1", every)
            for name, i, q in zip(spread, places, answers.outputs, strict=True)
        ]
    return [
        *rows,
        Variable("inside", "inside of the trained region", FLAGS, "output", "discrete", depends=every),
    ]


def _different(names: list[str]) -> list[str]:
    """Return names as identifiers, with a number behind each that is there already."""
    different: list[str] = []
    for name in map(identifier, names):
        count, new = 1, "inside_value" if name == "inside" else name
        while new in different:
            count += 1
            new = f"{name}_{count}"
        different.append(new)
    return different


def moving_variables(surrogate: Surrogate, carried: CarriedMass) -> list[Variable]:
    """Return the variables of a body that carries a mass: pushes in, places and speeds out, states and their rates."""
    ranges, k = surrogate.inputs, len(surrogate.hand_energy.baseline.directions)
    states = range(STATE, STATE + k)
    speeds = range(STATE + k, STATE + 2 * k)
    pushes = tuple(range(PUSH, PUSH + 3))
    parameters = [v for v in _parameters(surrogate) if v.name not in ("mass", "damping")]
    rows = [
        Variable(
            f"push_{axis}", f"force on the mass, {axis}", PUSH + i, "input", "continuous", "N", start=0.0
        )
        for i, axis in enumerate("xyz")
    ]
    rows += [
        _parameter("mass", "mass at the tip", MASS, "kg", carried.mass, 0.0),
        _parameter("damping", "damping of the mass, by its speed", DAMPING, "N.s/m", carried.damping, 0.0),
        *parameters,
    ]
    rows += [
        _output(axis, f"place of the mass, {axis}", i, "m", tuple(states)) for i, axis in enumerate("xyz")
    ]
    rows += [
        _output(f"v{axis}", f"speed of the mass, {axis}", SPEED + i, "m/s", tuple(speeds))
        for i, axis in enumerate("xyz")
    ]
    rows += [replace(v, depends=tuple(states)) for v in _outputs(surrogate)]
    rows.append(_output("kinetic", "kinetic energy of the mass", KINETIC, "J", tuple(speeds)))
    start = [0.0] * k if surrogate.hand_energy.baseline.holds else [*_middles(surrogate)[:2], ranges[2].high]
    for a, (state, speed) in enumerate(zip(states, speeds, strict=True), 1):
        rows.append(
            replace(
                _state(
                    f"way_{a}", f"way along direction {a}", state, "m", ranges[a - 1].high - ranges[a - 1].low
                ),
                start=float(start[a - 1]),
            )
        )
        rows.append(
            replace(_state(f"speed_{a}", f"speed along direction {a}", speed, "m/s", 1.0), nominal=None)
        )
    for a, (state, speed) in enumerate(zip(states, speeds, strict=True), 1):
        rows.append(_rate(f"way_{a}", state + 2 * k, state, "m/s", (speed,)))
        rows.append(_rate(f"speed_{a}", speed + 2 * k, speed, "m/s2", (*pushes, *states, *speeds)))
    return rows


def _inputs(surrogate: Surrogate) -> list[Variable]:
    held = surrogate.hand_energy.baseline.holds
    place = "displacement of what the hand holds" if held else "centre of the probe"
    # where nothing is felt: at rest, or as high as it may be in the middle of the ranges
    start = [0.0] * 3 if held else [*(_middles(surrogate)[:2]), float(surrogate.inputs[2].high)]
    return [
        Variable(axis, f"{place}, {axis}", i, "input", "continuous", "m", start=value)
        for i, (axis, value) in enumerate(zip("xyz", start, strict=True))
    ]


def _parameters(surrogate: Surrogate) -> list[Variable]:
    damping = (
        "damping of the hand within a contact, by its velocity from step to step; of co-simulation alone"
    )
    mass = "mass that the force moves, by which steps are judged to be too long; 0 for no warning"
    return [
        _parameter("force_scale", "factor of forces and energies", SCALE, "1", 1.0),
        _parameter("damping", damping, DAMPING, "N.s/m", 0.0, 0.0),
        _parameter("mass", mass, MASS, "kg", LIGHT, 0.0),
        *(
            _parameter(
                identifier(r.name), r.name, PARAMETER + i, r.unit or "1", (r.low + r.high) / 2, r.low, r.high
            )
            for i, r in enumerate(surrogate.parameters)
        ),
    ]


def _parameter(
    name: str,
    words: str,
    reference: int,
    unit: str,
    start: float,
    low: float | None = None,
    high: float | None = None,
) -> Variable:
    return Variable(name, words, reference, "parameter", "tunable", unit, start=start, low=low, high=high)


def _outputs(surrogate: Surrogate) -> list[Variable]:
    states = surrogate.memory is not None and has_exchange(surrogate)
    felt = None if states else _PLACES
    rows = [
        _output(f"f{axis}", f"force on the hand, {axis}", 3 + i, "N", felt) for i, axis in enumerate("xyz")
    ]
    rows += [
        _output("energy", "elastic energy", 6, "J"),
        _output("depth", "depth of the probe, negative in the air; or way of the hand", 7, "m"),
        _output("deviation", "standard deviation of the force relative to its size", 8, "1"),
    ]
    if surrogate.torque_evaluator is not None:
        rows += [
            _output(f"t{axis}", f"torque on the tool about its place, {axis}", TORQUE + i, "N.m", felt)
            for i, axis in enumerate("xyz")
        ]
    if surrogate.memory is not None:
        rows += [
            _output("stored", "energy that can be had back", 10, "J", felt),
            _output("lost", "energy lost since the start", 11, "J", felt),
        ]
    flags = {
        "inside": "inside of the trained region",
        "contact": "the probe touches the body",
        "too_deep": "the body has let go of the probe: no force",
    }
    return rows + [
        Variable(name, words, FLAGS + i, "output", "discrete")
        for i, (name, words) in enumerate(flags.items())
    ]


def _output(
    name: str, words: str, reference: int, unit: str, depends: tuple[int, ...] | None = _PLACES
) -> Variable:
    return Variable(name, words, reference, "output", "continuous", unit, depends=depends)


def _states(surrogate: Surrogate) -> list[Variable]:
    """Return the continuous states and their rates: what is remembered, and last the energy that was lost."""
    assert surrogate.memory is not None
    groups, usual = surrogate.memory.c_states() or (), _usual_amplitude(surrogate)
    names = [name for group in groups for name in group]
    rates, states, slopes = STATE + len(names) + 1, [], []
    first = STATE
    for group in groups:
        own = (*_PLACES, *range(first, first + len(group)))
        for i, name in enumerate(group, first):
            words = f"remembered amplitude {name.partition('_')[2]}"
            states.append(_state(name, words, i, _ROOT, usual))
            slopes.append(_rate(name, rates + i - STATE, i, _ROOT_RATE, own))
        first += len(group)
    states.append(_state("dissipated", "energy lost since the start, of force_scale 1", first, "J", usual**2))
    slopes.append(_rate("dissipated", rates + first - STATE, first, "W", None))
    return states + slopes


def _state(name: str, words: str, reference: int, unit: str, usual: float) -> Variable:
    return Variable(name, words, reference, "local", "continuous", unit, start=0.0, nominal=usual)


def _rate(name: str, reference: int, state: int, unit: str, depends: tuple[int, ...] | None) -> Variable:
    return Variable(
        f"der_{name}",
        f"rate of {name}",
        reference,
        "local",
        "continuous",
        unit,
        rate_of=state,
        depends=depends,
    )


def _middles(surrogate: Surrogate) -> list[float]:
    return [(r.low + r.high) / 2 for r in surrogate.inputs]


def _usual_amplitude(surrogate: Surrogate) -> float:
    """Return |q| of a deep press, √J: what the binary takes for the usual size of a state (core/fmi_instance.c)."""
    energy, middles = surrogate.hand_energy, np.array(_middles(surrogate))
    low, high = bounds(energy.inputs)
    felt = len(energy.baseline.directions)
    place = (
        np.array([*middles[:2], low[2]])
        if not energy.baseline.holds
        else high[:felt] @ energy.baseline.directions
    )
    evaluate = energy.evaluator()
    evaluate(np.ascontiguousarray(place), middles[felt:])
    size = abs(float(evaluate.amplitude))
    return size if 0.0 < size < math.inf else 1.0


def defined_units(variables: list[Variable]) -> dict[str, str | None]:
    """Return the units by name: SI's base exponents as attributes, None for one that has no whole ones."""
    return {unit: _UNITS.get(unit) for unit in sorted({v.unit for v in variables if v.unit})}
