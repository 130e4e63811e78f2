"""Solve and learn what tests begin with, and pack each into one file beside this one.

    python tests/data/make_solves.py            all
    python tests/data/make_solves.py family     one of them

A minute on one core. `tests/dataset/test_shipped_solves.py` makes a part of each again and compares.
"""

from __future__ import annotations

import sys
import tempfile
import zipfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import palpate as pp
from palpate.physics.solid import SolidProblem
from palpate.physics.solid.body_symmetry import fundamental_part

FOLDER = Path(__file__).parent


def block() -> tuple[SolidProblem, int, int]:
    """A block of tissue pressed on its middle, 16 solves."""
    body = pp.Body(pp.shapes.Block((0.06, 0.06, 0.03)), pp.materials.NeoHookean(9e3, 0.45))
    ball = pp.SphereProbe(0.010, touches="top", depth=(0.0, 0.006), over=((0.02, 0.02), (0.04, 0.04)))
    return body.problem(ball, element=0.008), 16, 0


def family() -> tuple[SolidProblem, int, int]:
    """Blocks of several moduli pressed by balls of several radii, 24 solves of a quarter of the top."""
    shape = pp.shapes.Block((0.06, 0.06, 0.03), element=0.02)
    body = pp.Body(shape, pp.materials.NeoHookean(9e3, 0.45), fixed="bottom")
    ball = pp.SphereProbe(0.010, depth=(5e-4, 0.004), over=((0.01, 0.01), (0.05, 0.05)))
    varied = (pp.Varied("young", 5e3, 15e3), pp.Varied("probe.radius", 0.009, 0.011))
    return pp.BodyFamily(body, varied).problem(fundamental_part(body, ball), element=0.012), 24, 2


SOLVED: dict[str, Callable[[], tuple[SolidProblem, int, int]]] = {"block": block, "family": family}
"""Problem, number of samples and seed of each dataset."""


def main(*names: str) -> None:
    for name in names or (*SOLVED, "small"):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            if name == "small":
                sys.path.insert(0, str(FOLDER.parent))
                import_module("small_study").carry_out(folder)
            else:
                problem, samples, seed = SOLVED[name]()
                data = pp.sweep(problem, samples=samples, seed=seed, workers=1, progress=False)
                folder = data.save(folder / "solves.zarr")
            pack(folder, FOLDER / f"{name}.zip")


def pack(folder: Path, target: Path) -> None:
    """Write all files of a folder into one, the same bytes for the same files."""
    with zipfile.ZipFile(target, "w") as packed:
        for file in sorted(p for p in folder.rglob("*") if p.is_file()):
            entry = zipfile.ZipInfo(file.relative_to(folder).as_posix())
            packed.writestr(entry, file.read_bytes(), zipfile.ZIP_DEFLATED, compresslevel=9)


if __name__ == "__main__":
    main(*sys.argv[1:])
