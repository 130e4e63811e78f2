"""Kernels are compiled beside other work, in a process of its own: ``python -m palpate.runtime.warm_up KIND…``.

The first touch of a body on a machine waits some seconds for its kernels. A command that solves or learns first lets a
`WarmUp` compile them meanwhile: this process builds a small body of each kind, asks it as the loop and the page do, and
leaves what Numba makes of it on disk, where all later processes find it. It works at a low priority, and ends with its
standard input, so with the command that began it, however that ends.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Self

import numpy as np

from palpate.kernels import FEW, is_ready
from palpate.network import Network, Scaling, TrainedRegion
from palpate.network.network_kernels import second_order_into
from palpate.processes import end_with_input, helper_environment
from palpate.runtime.blending import _mix, compile_blend
from palpate.runtime.timing_test import measure_timing
from palpate.runtime.touchable import Touchable, touchable
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    FieldSurrogate,
    LearntEnergy,
    NodeField,
    PadBaseline,
    RestStiffness,
    Stiffening,
    Surrogate,
    TouchedSurface,
)
from palpate.surrogates.energy_kernels import entry_of
from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.field_kernels import field_into
from palpate.surrogates.fields.local_mode import LocalMode
from palpate.surrogates.fields.node_field import _node_into
from palpate.units import Quantity, Range

__all__ = ["SECONDS", "WarmUp", "main", "rod", "slab"]

SECONDS = {"loop": 3, "held": 8, "pressed": 14}
"""Time in s that the kernels of a kind take to compile, about; for what a person is told."""

_BODY = 6  # s, the kernel of a body's energy
_NICE = 5  # below everything that somebody waits for
_SIDE, _CELL = 8, 0.01  # nodes and spacing (m) of the grid under a small body's surface


class WarmUp:
    """A process beside this one that compiles the kernels of kinds of bodies; none is started where all are ready.

    It is a context manager: the process ends with it at the latest. The kinds are "loop", the real-time loop; "held", a
    body that is held and moved along one direction; "pressed", one that a ball presses. `body` is one whose own kernels
    somebody else compiles meanwhile. `seconds` is about the time in s that all of it takes, 0 where nothing is to be
    done.
    """

    def __init__(self, *kinds: str, body: Touchable | None = None) -> None:
        cold = [kind for kind in kinds if not is_ready(_LAST[kind])]
        self.seconds = sum(SECONDS[kind] for kind in cold)
        if body is not None and not is_ready(entry_of(body.energy.baseline.compiled()).one):
            self.seconds = max(self.seconds, _BODY)
        self._process: subprocess.Popen[bytes] | None = None
        if cold:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "palpate.runtime.warm_up", *cold],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=helper_environment(),
                start_new_session=True,
            )

    @property
    def words(self) -> str:
        """The line for a person who waits; "" where all is ready."""
        if self.seconds == 0 or (self._process is not None and self._process.poll() is not None):
            return ""
        return f"warming up, {self.seconds} s (kernels are compiled once on a machine)"

    @property
    def pid(self) -> int | None:
        """Process id; None where nothing was to be done."""
        return None if self._process is None else self._process.pid

    def wait(self) -> None:
        """Wait until all is compiled."""
        if self._process is not None:
            self._process.wait()

    def close(self) -> None:
        """End the process, if it has not ended."""
        if self._process is not None:
            assert self._process.stdin is not None
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def main(kinds: Sequence[str]) -> None:
    """Compile the kernels of kinds."""
    end_with_input()
    if hasattr(os, "nice"):
        os.nice(_NICE)
    for kind in kinds:
        _COMPILE[kind]()


def _compile_loop() -> None:
    # meanwhile the loop's process compiles the rest of its body's energy, which waits for these parts
    pressed = slab().hand_energy
    _, small, felt, base, place, numbers, *_, grams, arguments, net = pressed.compiled()
    second_order_into.translate(place, felt[0], felt[1:], grams, *net)
    leave: Any = pressed.baseline.compiled().leave
    leave.translate(place, base, small, numbers, arguments)
    measure_timing(0.01)
    compile_blend()


def _compile_body(body: Surrogate) -> None:
    """Ask a body as learning, the loop and the page do, in this order."""
    network = body.hand_energy.network
    network.predict(np.zeros((FEW + 1, len(network.inputs))))
    TrainedRegion.of(np.random.default_rng(0).uniform(-1.0, 1.0, (20, len(network.inputs))))
    touchable(body).evaluator()
    for field in body.surface_fields.values():
        field.surface.at(np.zeros((FEW + 1, 3)))
        field.evaluator()


def rod() -> Surrogate:
    """Return a small body that is held at its end and moved along one direction."""
    inputs, loads = [Range("h", -0.1, 0.1, "m")], [Range("P", 0.0, 1.0, "N")]
    axes, points = np.array([[0.0, -1.0, 0.0]]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    baseline = PadBaseline(
        RestStiffness.even(np.ones((1, 1))), Stiffening(np.ones(1), np.array([[2]])), axes=axes
    )
    columns = np.array([(1, 0), (1, 1)])
    shape = _network(loads, [Quantity("u_x", "m"), Quantity("u_y", "m")])
    field = NodeField("displacement", "m", shape, columns, points, 1, mirror=axes[0])
    return Surrogate(LearntEnergy(_network(inputs, [Quantity("ℓ", "")]), baseline), {"displacement": field})


def slab() -> Surrogate:
    """Return a small body that a ball presses, with the shape of its surface."""
    radius, deepest, width = 0.01, 0.005, _CELL * (_SIDE - 1)
    heights = _CELL * (np.arange(_SIDE) - _SIDE // 2)
    surface = TouchedSurface(
        np.array([0.0, 0.0, heights[0], _CELL]),
        np.tile(heights, (_SIDE, _SIDE, 1)),
        np.zeros((0, 0)),
        radius=radius,
        reach=0.02,
        inner=0.02,
        error=0.0,
    )
    inputs = [Range(f"c_{axis}", 0.3 * width, 0.7 * width, "m") for axis in "xy"]
    inputs.append(Range("c_z", radius - deepest, radius, "m"))
    energy = LearntEnergy(
        _network(inputs, [Quantity("ℓ", "")]),
        ContactBaseline(ContactLaw("pad"), surface, radius),
        continuation=Continuation.of(inputs, deepest=deepest),
        root=np.ones((6, 1)),
    )
    corners = width * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    field = FieldSurrogate(
        "displacement",
        "m",
        _network(inputs, [Quantity("b0", "")]),
        modes=np.ones((1, 3, 3)) / 3.0**0.5,
        rest=np.zeros((3, 3)),
        points=corners,
        triangles=np.array([[0, 1, 2]]),
        mass=np.full(3, 1.0 / 3.0),
        amplitude=DepthAmplitude("series", deepest, 1e-3),
        surface=surface,
        radius=radius,
        local_mode=LocalMode(np.zeros((2, 5, 4)), 0.02, 2e-3, None),
    )
    return Surrogate(energy, {"displacement": field})


def _network(inputs: Sequence[Range], outputs: Sequence[Quantity]) -> Network:
    """Return a network that is zero."""
    n, m = len(inputs), len(outputs)
    low, high = np.array([[r.low for r in inputs], [r.high for r in inputs]])
    return Network.axis_aligned(
        inputs,
        outputs,
        centres=np.zeros((2, n)),
        widths=np.ones((2, n)),
        weights=np.zeros((m, 2)),
        tail=np.zeros((m, 1 + n)),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(m), np.ones(m)),
    )


_LAST: dict[str, Any] = {"loop": _mix, "held": _node_into, "pressed": field_into}
"""The kernel of each kind that is compiled last: where it is ready, all are."""
_COMPILE: dict[str, Callable[[], None]] = {
    "loop": _compile_loop,
    "held": lambda: _compile_body(rod()),
    "pressed": lambda: _compile_body(slab()),
}

if __name__ == "__main__":
    main(sys.argv[1:])
