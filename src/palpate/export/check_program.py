"""A compiled export as a program that answers questions on its standard input."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.errors import AccuracyError
from palpate.export.check_points import ANSWERS
from palpate.export.compilers import compile_c
from palpate.export.core_source import core_file

__all__ = ["CheckProgram"]

_LONGEST = 120.0  # s that a checking program may take


@dataclass(frozen=True)
class CheckProgram:
    """A program around exported C files."""

    path: Path
    components: tuple[int, int] = (0, 0)  # nodes and components of the field; (0, 0) without one

    @classmethod
    def compile(
        cls,
        compiler: str,
        sources: Sequence[Path],
        name: str,
        folder: Path,
        *,
        memory: bool = False,
        network: bool = False,
        field: tuple[int, int] = (0, 0),
        torque: bool = False,
        options: Sequence[str] = (),
    ) -> CheckProgram:
        """Compile exported .c sources, with the header beside them, into `folder` with the program that asks them.

        `name` begins the exported names. `memory` says whether a memory is in, `network` whether it is a network alone,
        `field` how many nodes and components the field has, `torque` whether it tells one.
        """
        main = folder / "check_main.c"
        kinds = {"MEMORY": memory, "NETWORK": network, "FIELD": field[0] > 0, "TORQUE": torque}
        head = f'#define CHECK_HEADER "{name}.h"\n#define CHECK_NAME {name}\n'
        head += "".join(f"#define CHECK_{kind} {int(there)}\n" for kind, there in kinds.items())
        main.write_text(head + core_file("check_main.c"), "utf-8")
        where = [*options, f"-I{sources[0].parent}"]
        return cls(compile_c(compiler, [main, *sources], folder / "check.out", options=where), field)

    def _ask(self, kind: int, X: np.ndarray, width: int) -> np.ndarray:
        question = (
            np.array([kind, len(X)], dtype=np.int32).tobytes()
            + np.ascontiguousarray(X, dtype=np.float64).tobytes()
        )
        done = subprocess.run([self.path], input=question, capture_output=True, timeout=_LONGEST, check=False)
        answer = np.frombuffer(done.stdout, dtype=np.float64)
        if done.returncode or answer.size != len(X) * width:
            raise AccuracyError(
                "The exported program did not answer.",
                why=done.stderr.decode(errors="replace")[:2000] or f"It ended with {done.returncode}.",
                fix="Report this: the files must not be used.",
            )
        return answer.reshape(len(X), width)

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p)."""
        return self._ask(0, X, ANSWERS)

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p)."""
        return self._ask(1, X, 5)

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        return self._ask(4, X, 3)

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, components) for each row of X (N, 3 + p)."""
        nodes, components = self.components
        return self._ask(2, X, nodes * components).reshape(len(X), nodes, components)

    def replies(self, X: np.ndarray, outputs: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return outputs (N, m), whether they are in the trained region (N,), and derivatives (N, m, n) at X (N, n)."""
        n = X.shape[1]
        rows = self._ask(3, X, outputs * (n + 1) + 1)
        slopes = rows[:, : outputs * n].reshape(len(X), outputs, n)
        return rows[:, outputs * n : -1], rows[:, -1] != 0, slopes
