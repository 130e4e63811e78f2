"""A surrogate of a model in one value: energy that a hand feels, fields, numbers, and the record of its making.

This is what `palpate.learn` makes, what a file holds, and what everything downstream takes. At least one of energy,
fields and quantities is there, and what a surrogate can do is asked of them: `can_be_touched` tells whether a hand
feels it, `energy.baseline` whether that hand presses it or holds it and where, `fields` what can be drawn, and
`quantities` which numbers it answers.
"""

from __future__ import annotations

import html
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.format import count, millimetres
from palpate.network import Network, load_archive
from palpate.network.codec import load_value, save_value
from palpate.page_hook import page_of
from palpate.surrogates.energy import LearntEnergy
from palpate.surrogates.fields import (
    Field,
    FieldSurrogate,
    ModalField,
    NodeField,
    line_of,
    modal_fields,
    surface_fields,
)
from palpate.surrogates.grip_effort import efforts
from palpate.surrogates.learnt_quantities import LearntQuantities
from palpate.surrogates.learnt_torque import ARM, torque_evaluator, torques
from palpate.surrogates.lumps import Lump, LumpContrast
from palpate.surrogates.lumps.lump_units import energy_with_lumps
from palpate.surrogates.memories import Memory
from palpate.surrogates.memories.friction import MINDLIN
from palpate.surrogates.memory_places import memory_places
from palpate.surrogates.model_card import ModelCard, card_of
from palpate.surrogates.moving_rest import Followed, follow
from palpate.surrogates.tool_friction import with_friction
from palpate.surrogates.training_record import training_in_words
from palpate.surrogates.two_tools import two_tool_forces
from palpate.units import Quantity, Range

__all__ = ["KIND", "Surrogate"]

_NAMED = 6  # numbers that are named in a line
KIND = "surrogate"  # what the file's header calls it
# kinds of files of version 0.1.0
_FORMER = ("touch", "held-body", "touched-body", "touch-surrogate", "grasp-surrogate", "field-surrogate")


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A surrogate of a model as a value: `save` and `load` give it back bit for bit.

    Attributes
    ----------
    energy : LearntEnergy, optional
        Energy, force and stiffness, and whether they may be trusted; None where no hand feels it.
    fields : mapping of name to Field
        What is drawn of it, of the same inputs: on a touched surface, at nodes that loads move, or of any physics at
        places of a mesh or of an axis; may be empty.
    memory : Memory, optional
        What it remembers of how it was touched, in the loop and on the page.
    meta : mapping
        JSON-able record: its name, what it was learnt from and how well, what it was corrected with. `__str__` tells of
        ``solves``, ``samples`` and ``force_error`` (a mapping with ``median`` and ``p95``, relative) where they are
        there.
    quantities : mapping of name to LearntQuantities
        Numbers of the inputs, each group learnt together; may be empty.
    lumps : LumpContrast, optional
        What hidden lumps would add to the energy, for `with_lumps`.

    Raises
    ------
    UsageError
        If there is none of energy, fields and quantities; if a part is of another surface or other inputs; or the
        memory can't walk the energy's amplitude.
    """

    energy: LearntEnergy | None = None
    fields: Mapping[str, Field] = field(default_factory=dict)
    memory: Memory | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)
    quantities: Mapping[str, LearntQuantities] = field(default_factory=dict)
    lumps: LumpContrast | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "fields", dict(self.fields))
        object.__setattr__(self, "quantities", dict(self.quantities))
        self._require_one_model()
        for name, shown in self.fields.items():
            if self.energy is not None and (fault := shown.fault_beside(self.energy)):
                raise UsageError(
                    f"The field {name!r} is not of the body that is touched.",
                    why=f"Beside this energy, {fault}.",
                    fix="Learn energy and fields from the same solves, with the same TouchedSurface.",
                )
        if self.memory is None:
            return
        sign = self.hand_energy.baseline.amplitude
        if sign not in self.memory.walks:
            raise UsageError(
                f"The memory {self.memory.name!r} does not fit the baseline {self.hand_energy.baseline.name!r}.",
                why=f"It walks an amplitude that is {' or '.join(sorted(self.memory.walks))}; here that is {sign}.",
                fix="Leave the memory out, or give one that walks such an amplitude.",
            )

    def _require_one_model(self) -> None:
        """Refuse a surrogate of nothing, and parts without an energy whose inputs differ."""
        names = [[(r.name, r.unit) for r in part.inputs] for part in self._parts()]
        if not names:
            raise UsageError(
                "A surrogate of nothing can't be made.",
                why="It has no energy, no fields and no quantities.",
                fix="Give at least one of them; `palpate.learn` and `palpate.fit` make them.",
            )
        alike = all(shown.asked_as_body for shown in self.fields.values())
        if alike and any(other != names[0] for other in names[1:]):
            raise UsageError(
                "The parts of this surrogate have different inputs.",
                why=" / ".join(", ".join(name for name, _ in part) for part in names),
                fix="Learn energy, fields and quantities from the same solves.",
            )

    def _parts(self) -> Iterator[LearntEnergy | Field | LearntQuantities]:
        """Yield everything that answers inputs, the energy first."""
        yield from () if self.energy is None else (self.energy,)
        yield from self.quantities.values()
        yield from self.fields.values()

    @classmethod
    def of(cls, learnt: Surrogate | Network, name: str = "network") -> Surrogate:
        """Return a surrogate as it is, and a network alone as a surrogate of that name, whose quantities it answers."""
        if not isinstance(learnt, Network):
            return learnt
        meta = {"name": name, **learnt.meta}
        return cls(meta=meta, quantities={"outputs": LearntQuantities(learnt)})

    def __str__(self) -> str:
        head = f"Surrogate {self.name!r}: {self.purpose}{training_in_words(self.meta)}{self._remembers}"
        energy = "" if self.energy is None else f"; {self.energy}"
        ranges = f"  {', '.join(str(r) for r in self.inputs)}{energy}"
        parts = [*self.quantities.values(), *self.fields.values()]
        return "\n".join([head, ranges, *(f"  {part}" for part in parts)])

    __repr__ = __str__

    @property
    def purpose(self) -> str:
        """The use of the body in plain words: what a hand does with it, how far it was trained, and what is drawn."""
        if self.energy is None:
            return self._answers_in_words
        known, baseline = self.energy.going.deepest, self.energy.baseline
        if not baseline.holds:
            words = f"pressed by {baseline.probe_words}"
            words += f", trained to a depth of {millimetres(known)}" if math.isfinite(known) else ""
        else:
            words = f"held and moved along {count(len(baseline.directions), 'direction')}"
        shown = ", ".join(name for name in self.fields)
        return words + (f"; shows its {shown}" if shown else "")

    @property
    def _answers_in_words(self) -> str:
        """The numbers and fields that a surrogate without touch answers."""
        numbers = [q.name for q in self.outputs]
        more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
        curves = [name for name, shown in self.fields.items() if shown.is_curve]
        fields = [name for name in self.fields if name not in curves]
        words = [", ".join(numbers[:_NAMED]) + more] if numbers else []
        for noun, names in (("curve", curves), ("field", fields)):
            words += [f"the {noun}{'s' * (len(names) > 1)} {', '.join(names)}"] if names else []
        return f"answers {' and '.join(words)}"

    @property
    def can_be_touched(self) -> bool:
        """True where a hand feels it: it has an energy."""
        return self.energy is not None

    @property
    def hand_energy(self) -> LearntEnergy:
        """The energy that a hand feels.

        Raises
        ------
        UsageError
            If there is none.
        """
        if self.energy is None:
            raise UsageError(
                f"{self.name!r} can't be touched.",
                why=f"It {self._answers_in_words}, and has no energy whose slope would be a force.",
                fix="Ask it for its numbers and fields: `palpate ask FILE --at …`, or surrogate.predict(X).",
            )
        return self.energy

    @property
    def torque_evaluator(self) -> Callable[..., None] | None:
        """A new evaluator of the torque on the tool, one place at a time; None of a body that tells none.

        Called with a place (3,), further inputs (p,) and the force (3,) there, it renews its ``torque`` (3,), N m.
        """
        return None if self.energy is None else torque_evaluator(self.energy, self.quantities.get(ARM))

    def torque(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) on the tool about its place at inputs X (N, n), N m, in the body's axes.

        Raises
        ------
        UsageError
            If the body tells none: a ball feels no torque about its centre.
        """
        return torques(self.hand_energy, self.torque_evaluator, X, self.name)

    def effort(self, X: np.ndarray) -> np.ndarray:
        """Return the effort G = −∂U/∂w (N,) in N with which the body pushes two jaws apart, at inputs X (N, 4).

        Raises
        ------
        UsageError
            For a body that was not learnt from pinches.
        """
        return efforts(self.hand_energy, X)

    def two_tool_forces(self, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the forces (N, 3) in N on two separate tools at inputs (N, n) each.

        Raises
        ------
        UsageError
            For two that are nearer than 3.5 contact radii: each would feel what the other does to the body.
        """
        return two_tool_forces(self.hand_energy, first, second)

    @property
    def _remembers(self) -> str:
        return "" if self.memory is None else f"; {self.memory}"

    @property
    def name(self) -> str:
        """The body's name; "body" where its record has none."""
        return str(self.meta.get("name", "")) or "body"

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all inputs: of a touched body the felt coordinates (m), then the further ones."""
        return next(self._parts()).inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs that the hand does not supply: all of them, where no hand feels it."""
        return self.inputs if self.energy is None else self.energy.parameters

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        """Names and units of the m numbers of all quantities, in their order."""
        return tuple(q for part in self.quantities.values() for q in part.outputs)

    @property
    def surface_fields(self) -> dict[str, FieldSurrogate]:
        """The fields on the touched surface, by name."""
        return surface_fields(self.fields)

    @property
    def modal_fields(self) -> dict[str, ModalField]:
        """The fields and curves of any physics, by name."""
        return modal_fields(self.fields)

    @property
    def line(self) -> NodeField | None:
        """The displacement of a body that is drawn as a line of nodes; None of any other."""
        return line_of(self.fields)

    @property
    def plain_network(self) -> Network:
        """The network, where the surrogate is one group of quantities and nothing else.

        Raises
        ------
        UsageError
            If it is more than that.
        """
        if self.energy is None and not self.fields and len(self.quantities) == 1:
            return next(iter(self.quantities.values())).network
        raise UsageError(
            f"{self.name!r} is more than one network.",
            why=f"It {self.purpose}.",
            fix="Take one part of it: surrogate.quantities[name].network, or surrogate.fields[name].",
        )

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return the numbers (N, m) of all quantities at inputs X (N, n), SI units, as `outputs` names them.

        Raises
        ------
        UsageError
            If X has another number of columns; so do all that take X.
        """
        return self._numbers([part.predict(X) for part in self.quantities.values()], X)

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the standard deviation (N, m) of these numbers at X (N, n); not-a-number where it is unknown."""
        return self._numbers([part.deviation(X) for part in self.quantities.values()], X)

    def trusted(self, X: np.ndarray) -> np.ndarray:
        """Return which of X (N, n) are like what was learnt from, by every part of the surrogate, (N,) bool."""
        answers = [part.trusted(X) for part in self.quantities.values()]
        answers += [shown.trusted(X) for shown in self.fields.values() if shown.asked_as_body]
        answers += [] if self.energy is None else [self.energy.inside(X)]
        return np.asarray(np.all(answers, axis=0)) if answers else np.ones(len(X), dtype=bool)

    @staticmethod
    def _numbers(columns: list[np.ndarray], X: np.ndarray) -> np.ndarray:
        return np.concatenate(columns, axis=1) if columns else np.zeros((len(X), 0))

    def to_html(self) -> str:
        """Return the body as one HTML page that is touched from disk, without a server or a network.

        Raises
        ------
        UsageError
            If a part of the body has no C source.
        """
        return page_of(self)

    def _repr_html_(self) -> str | None:
        """Show the body in a notebook, in a frame of its own, or its card; None where it can't be a page."""
        if not self.can_be_touched:
            return self.card()._repr_html_()
        try:
            source = html.escape(self.to_html(), quote=True)
        except UsageError:
            return None
        return (
            f'<iframe srcdoc="{source}" title="{html.escape(self.name, quote=True)}" '
            'sandbox="allow-scripts allow-downloads" style="width: 100%; height: 640px; border: 0"></iframe>'
        )

    def with_energy(self, energy: LearntEnergy, meta: Mapping[str, Any] | None = None) -> Surrogate:
        """Return the same fields with another energy, such as one that measured forces have corrected.

        Where its surface lies higher or lower, the drawn body sinks from there.

        Parameters
        ----------
        energy : LearntEnergy
            Of the same inputs.
        meta : mapping, optional
            The new record; the old one by default.
        """
        surface, shown = energy.baseline.surface, dict(self.fields)
        if surface is not None:
            shown = {name: part.with_surface(surface) for name, part in shown.items()}
        return replace(self, energy=energy, fields=shown, meta=self.meta if meta is None else meta)

    def with_memory(self, memory: Memory | None, *, spacing: float | None = None) -> Surrogate:
        """Return the same body with a memory, in the loop and on the page.

        Parameters
        ----------
        memory : Memory, optional
            A relaxation, of `palpate.learning.relaxation.identify` for example, or an indentation, of
            `palpate.learning.plastic.learn_indentation`; None for a body that forgets.
        spacing : float, optional
            How far apart the places of the surface are that remember, m, a quarter of the probe's radius for example;
            without it the memory is kept where it says.

        Raises
        ------
        UsageError
            If the body has no drawn surface to keep a memory on, or the spacing does not fit the memory.
        """
        if memory is not None and spacing is not None:
            shown = next(iter(self.surface_fields.values()), None)
            memory = memory.spread(memory_places(self.hand_energy, shown, spacing), spacing)
        return replace(self, memory=memory)

    def with_lumps(self, lumps: Sequence[Lump]) -> Surrogate:
        """Return the body with hidden lumps: what a hand feels of it changes, what is drawn and remembered does not.

        Their energies add, which holds while they are apart. The new body is evaluated, saved and exported as any
        other; its file tells whoever opens it where they are. They lie in ``self.lumps.room``.

        Raises
        ------
        UsageError
            If the body was not learnt with lumps, or one leaves its room or the skin, or two meet.
        """
        if self.lumps is None:
            raise UsageError(
                f"{self.name!r} knows nothing of lumps.",
                why="It was learnt from presses in which none were looked up.",
                fix="Sweep a `palpate.LumpProblem` and learn that.",
            )
        hidden = [[*lump.place, lump.radius, lump.ratio] for lump in lumps]
        energy = energy_with_lumps(self.hand_energy, self.lumps, lumps)
        return replace(self, energy=energy, lumps=None, meta={**self.meta, "lumps": hidden})

    def with_friction(
        self, kinetic: float, static: float | None = None, *, ratio: float = MINDLIN
    ) -> Surrogate:
        """Return the same body under a tool that sticks and slides, in the loop, on the page and in exports.

        The coefficients are pure numbers, such as 0.3; that of a tool at rest is by default that of one that slides.
        `ratio`, in (0, 1], is tangential over normal stiffness: by default Mindlin's for ν = ½.

        Raises
        ------
        UsageError
            For a negative coefficient, a kinetic one above the static one, or a body that is held.
        """
        return replace(
            self, memory=with_friction(self.hand_energy, self.memory, kinetic, static, ratio=ratio)
        )

    def follow(self, X: np.ndarray, times: np.ndarray | None = None) -> Followed:
        """Return what the body answers along a history that begins before anything was done to it.

        Parameters
        ----------
        X : (N, n)
            The body's inputs, the felt coordinates (m) first; between two rows it is led evenly.
        times : (N,), optional
            When it is at each row, s, ascending from 0; a body that relaxes needs them.

        Raises
        ------
        UsageError
            If the rows have another number of inputs, or the times don't fit.
        """
        return follow(self.hand_energy, self.memory, X, times)

    def card(self, file: str | os.PathLike[str] | None = None) -> ModelCard:
        """Return the model card: what it was made from, by whom, its errors, limits and hashes.

        Parameters
        ----------
        file : path, optional
            Its file, whose hash goes into the card.
        """
        return card_of(self, file)

    def signed(self, author: str = "", licence: str = "") -> Surrogate:
        """Return the same body whose card names an author and a licence, such as ``CC-BY-4.0``; "" changes nothing."""
        stated = {k: v for k, v in (("author", author), ("licence", licence)) if v}
        return replace(self, meta={**self.meta, "card": {**self.meta.get("card", {}), **stated}})

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write all of it to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        return save_value(path, self, kind=KIND)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Surrogate:
        """Read it back, bit for bit.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign, from a later version or from 0.1.0, or its parts do not fit.
        """
        if load_archive(path).kind in _FORMER:
            raise FileFormatError(
                f"{path} was written by palpate 0.1.0, which had a file of its own for each kind of body.",
                why="A learnt body is one kind of file now.",
                fix="Learn it again from its solves: `palpate learn STUDY.toml`, or pp.learn(data)[0].save(file).",
            )
        return load_value(path, cls, kind=KIND, noun="a learnt body")
