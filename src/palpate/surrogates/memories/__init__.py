"""Memories: what a body remembers of how it was touched, one file for each kind.

memory          the contract: a signed amplitude and its slope in, a force out
relaxation      forces that fall while they are held, on patches of the surface
indentation     depths that stay where it was pressed
iwan_elements   a held body that stays bent, or creeps
friction        a tool that sticks and slides on the body
patches         places of the touched surface
"""

from palpate.surrogates.memories.friction import Friction, FrictionState
from palpate.surrogates.memories.indentation import Indentation, IndentationState
from palpate.surrogates.memories.iwan_elements import IwanElements, IwanState
from palpate.surrogates.memories.memory import (
    Amplitude,
    Carry,
    Memory,
    MemoryState,
    amplitudes,
    register_memory,
)
from palpate.surrogates.memories.patches import Patches
from palpate.surrogates.memories.relaxation import Course, Relaxation, RelaxationState, course

__all__ = [
    "Amplitude",
    "Carry",
    "Course",
    "Friction",
    "FrictionState",
    "Indentation",
    "IndentationState",
    "IwanElements",
    "IwanState",
    "Memory",
    "MemoryState",
    "Patches",
    "Relaxation",
    "RelaxationState",
    "amplitudes",
    "course",
    "register_memory",
]
