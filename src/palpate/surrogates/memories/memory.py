"""Memory: what a body remembers of how it was touched, on top of its energy.

All memories walk one signed amplitude q of the elastic energy, U = ½ q², and its slope ∇q by the place: the energy's
kernels give both without dividing (`palpate.surrogates.energy_kernels`). A `Memory` is a frozen description that files
hold; `start` makes the state of a body at rest, and `step` moves the hand and renews the force. Whatever its numbers, a
memory gives back no more than was put in:

    work of the hand = change of what is stored + what is lost        lost ≥ 0 in every step
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias

import numpy as np

from palpate.errors import UsageError
from palpate.network.kinds import register_kind
from palpate.surrogates.memories.patches import Patches

if TYPE_CHECKING:
    from palpate.surrogates.memories.friction import Friction

__all__ = ["Amplitude", "Carry", "Memory", "MemoryState", "amplitudes", "register_memory"]

Amplitude: TypeAlias = Literal["none", "positive", "signed"]

STORED, LOST, WORK, STEP = range(4)  # places in the ledger


class MemoryState(ABC):
    """The state of a body that remembers; `step` allocates nothing.

    A state begins at rest, with `force` and a ledger of zeros; each step renews the force and enters its energies with
    `book`, from which the work of the hand follows.

    Attributes
    ----------
    force : (3,)
        On the hand, N; overwritten by each step.
    """

    force: np.ndarray
    _ledger: np.ndarray

    def __init__(self) -> None:
        self.force, self._ledger = np.zeros(3), np.zeros(4)

    def book(self, stored: float, lost: float) -> None:
        """Enter the energies of a step.

        Parameters
        ----------
        stored : float
            What is stored after it, J.
        lost : float
            What was turned into heat during it, J, not negative.
        """
        ledger = self._ledger
        ledger[WORK] += stored - ledger[STORED] + lost
        ledger[STORED], ledger[STEP] = stored, lost
        ledger[LOST] += lost

    @property
    def stored(self) -> float:
        """Energy V that is stored, J: the most that the body can give back."""
        return float(self._ledger[STORED])

    @property
    def lost(self) -> float:
        """Energy turned into heat since the start, J."""
        return float(self._ledger[LOST])

    @property
    def work(self) -> float:
        """Work of the hand since the start, J: `stored` + `lost`."""
        return float(self._ledger[WORK])

    @property
    def lost_in_step(self) -> float:
        """Energy turned into heat in the last step, J; never negative."""
        return float(self._ledger[STEP])

    @property
    def of_body(self) -> MemoryState | None:
        """The state of what the body itself remembers: this one, unless it is of a tool's friction on the body."""
        return self

    @abstractmethod
    def reset(self) -> None:
        """Forget everything: the body is as at the start, and nobody touches it. Here: no force, an empty ledger."""
        self.force[:] = 0.0
        self._ledger[:] = 0.0

    @abstractmethod
    def step(self, position: np.ndarray, amplitude: float, slope: np.ndarray, dt: float) -> bool:
        """Move the hand to a place within dt seconds and renew `force`.

        Parameters
        ----------
        position : (3,) float64
            The place at the end of the step, m.
        amplitude : float
            Signed amplitude q there, √J; 0 without contact.
        slope : (3,) float64
            Slope ∇q there, √J/m.
        dt : float
            Length of the step, s; 0 for an instant.

        Returns
        -------
        bool
            False if a number is not finite, or the amplitude can't be: the force is zero then and nothing has changed.
        """


Carry: TypeAlias = Callable[[MemoryState, MemoryState], None]
"""Hands what the first state remembers on to the second, which nothing was done to."""


class Memory(ABC):
    """The law of a memory, as a value: a frozen dataclass.

    Attributes
    ----------
    name : str
        The name by which files find it.
    walks : set of str
        Signs of the amplitude that it can walk, see `palpate.surrogates.Baseline.amplitude`.
    keeps_indentation : bool
        True where its state has ``now`` (n,), residual amplitudes at ``points`` (n, 3) of the surface, m.
    moves_rest : bool
        True where the body lies elsewhere after a touch: its state has ``release(dt)``, which returns the amplitude to
        which a body moves that nobody holds.
    """

    name: ClassVar[str]
    walks: ClassVar[frozenset[Amplitude]] = frozenset({"positive"})
    keeps_indentation: ClassVar[bool] = False
    moves_rest: ClassVar[bool] = False

    @abstractmethod
    def start(self) -> MemoryState:
        """Return the state of a body that nothing has been done to."""

    @property
    def of_body(self) -> Memory | None:
        """The memory of the body itself: this one, unless it is of a tool's friction on the body."""
        return self

    @property
    def friction(self) -> Friction | None:
        """The friction of a tool on the body; None without."""
        return None

    def carry_from(self, other: Memory) -> Carry:
        """Return how a state of this memory takes over what a state of `other` remembers, as amplitudes in √J.

        So a body that was pressed goes on from where it was while another surrogate of it takes its place. All that
        takes long is done here; the function that is returned runs within a tick of the loop.

        Raises
        ------
        UsageError
            If the two have nothing in common: by default always.
        """
        raise UsageError(
            f"What a memory called {other.name!r} remembers can't be handed on to one called {self.name!r}.",
            fix="Let go of the body, and load the new one from the start.",
        )

    def c_source(self) -> str | None:
        """Return the step in C99 for exporters, which refuse a memory without it by name.

        The text defines ``NAME_step``, and ``NAME_release`` where the memory moves the rest (docs/guide/export.md);
        `c_arguments` are its arrays, `c_size` says how large its state is.
        """
        return None

    def c_arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays that the functions of `c_source` take, in their order."""
        return ()

    def c_size(self) -> int:
        """Return how many numbers the state of `c_source` has, after the four of the ledger."""
        return 0

    def c_states(self) -> tuple[tuple[str, ...], ...] | None:
        """Return the names of its continuous states, in groups, for simulators that integrate by a solver of their own.

        The rate of a state depends on where the hand is and on the states of its own group. None, the default, says
        that what is remembered follows the path of the hand and no differential equation in time.
        """
        return None

    def spread(self, patches: Patches, spacing: float) -> Memory:
        """Return the same memory, kept at places of the surface that are `spacing` (m) apart.

        Raises
        ------
        UsageError
            If it has no places, or they do not fit it.
        """
        del patches, spacing
        raise UsageError(
            f"A memory called {self.name!r} is not kept at places of a surface.",
            fix="Give it without a spacing.",
        )


def register_memory(cls: type[Memory]) -> type[Memory]:
    """Make a memory known by its name to files; also a decorator.

    Parameters
    ----------
    cls : class
        A frozen dataclass derived from `Memory`.

    Raises
    ------
    UsageError
        If it is no such class, has no name, or another one has it.
    """
    register_kind(Memory, cls)
    return cls


def amplitudes(energy: np.ndarray, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return q = √(2U) (N,), √J, and ∇q (N, 3), √J/m, of energies U (N,), J, and their slopes ∇U (N, 3), N.

    Raises
    ------
    UsageError
        If an energy is negative.
    """
    U = np.asarray(energy, dtype=float)
    if (U < 0).any():
        raise UsageError(
            f"Sample {int(np.argmax(U < 0))} has a negative energy.",
            fix="Give energies less those of the body at rest.",
        )
    q = np.sqrt(2.0 * U)
    with np.errstate(divide="ignore", invalid="ignore"):
        return q, np.where(q[:, None] > 0, np.asarray(slope, dtype=float) / q[:, None], 0.0)
