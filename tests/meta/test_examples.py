"""Every example runs as a file, in a process of its own, and says what it promises."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from programs import run_file

EXAMPLES = Path(__file__).parents[2] / "examples"
pytestmark = pytest.mark.timeout(240)


def cantilever(text: str, folder: Path) -> None:
    assert "Dataset of 64 solves of Cantilever, all converged" in text
    assert "body on 16 unseen solves: every limit kept" in text
    assert (folder / "beam.palpate").stat().st_size > 1000
    assert "http" not in text  # without a terminal nothing is served


def two_loads(text: str, folder: Path) -> None:
    assert "every limit kept" in text
    coupling = float(re.search(r"virtual coupling: (\d+) N/m", text)[1])
    answers = re.findall(
        r"hand at \((.+), (.+)\) m: force on it \((.+), (.+)\) N, tip at \((.+), (.+)\) m", text
    )
    assert len(answers) == 3
    for row in [tuple(map(float, a)) for a in answers[:2]]:
        # what the hand feels is what stretches the coupling, to the printed digits
        for hand, force, tip in zip(row[0:2], row[2:4], row[4:6], strict=True):
            assert force == pytest.approx(-coupling * (hand - tip), abs=0.02 + 0.001 * coupling)
    assert text.count("inside the trained range") == 2
    assert text.count(" m, outside the trained range") == 1


def own_beam(text: str, folder: Path) -> None:
    weight = 9.80665 * 1080.0 * 0.02 * 0.006 * 0.15
    assert (
        f"the clamp carries {1000 * weight:.1f} mN" in text
    )  # at rest the clamp carries the weight, to the digit
    sag = float(re.search(r"own weight: ([\d.]+) mm", text)[1])
    linear = weight * 0.15**3 / (8 * 1.1e6 * 0.02 * 0.006**3 / 12)
    assert 0.5 * linear < sag / 1000 < linear  # a beam that bends far bends less than the linear one
    assert "strip on 8 unseen solves: every limit kept" in text
    assert re.search(r"500 N: (?!converged)", text)


def by_hand(text: str, folder: Path) -> None:
    stars = [len(s) for s in re.findall(r"\*+", text)]
    assert text.count("grew") > 3
    assert text.count("pruned") > 0
    units, rms = re.search(r"(\d+) units, RMS error ([\d.]+)", text).groups()
    assert int(units) == stars[-1] == text.count("centre")
    assert float(rms) < 0.03


def program(text: str, folder: Path) -> None:
    down = float(re.search(r"-20 mm: (\S+) N", text)[1])
    up = float(re.search(r"\+20 mm: (\S+) N", text)[1])
    assert up == -down < 0.0
    # 3EI w/L³ for a small deflection
    stiffness = 3 * 110e9 * 3.14159265 * 0.005**4 / 4
    assert down == pytest.approx(0.02 * stiffness, rel=2e-3)
    # twice as far as trained: the energy goes on, and says that it was not solved there
    beyond = float(re.search(r"-60 mm: (\S+) N on the hand \(beyond the trained range\)", text)[1])
    assert beyond == pytest.approx(0.06 * stiffness, rel=0.05)
    ticks = [int(t) for t in re.findall(r"tick +(\d+)", text)]
    assert ticks == sorted(set(ticks))
    assert len(ticks) == 5
    assert "faults    none" in text or "clock jump" in text  # a busy machine may suspend the loop


def scikit_learn(text: str, folder: Path) -> None:
    validated, searched = (
        float(v) for v in re.findall(r"(?:cross-validated R²:|, R²) ([\d.]+)$", text, re.MULTILINE)[:2]
    )
    assert validated > 0.999
    assert searched >= validated
    samples, scores = zip(*re.findall(r"after +(\d+) samples: .*R² ([\d.]+)", text), strict=True)
    assert [int(s) for s in samples] == [60, 120, 180, 240]
    assert 0.8 < float(scores[0]) < float(scores[-1])
    assert float(re.search(r"five passes: .*R² ([\d.]+)", text)[1]) > 0.98
    assert (folder / "history.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "strip.palpate").stat().st_size > 1000


def drifting(text: str, folder: Path) -> None:
    rows = re.findall(r"stiffness +(\d+) %.*: following ([\d.]+), constant ([\d.]+), frozen ([\d.]+)", text)
    stiffness = [int(row[0]) for row in rows]
    assert (stiffness[0], stiffness[-1]) == (100, 70)
    following, constant, frozen = (float(e) for e in rows[-1][1:])
    assert following < 0.1 * frozen
    assert following < 0.2 * constant
    # while it drifts too, not only afterwards
    assert max(float(row[1]) for row in rows) < 0.2 * frozen
    # a rod that has lost 30 % of its stiffness: the frozen network is wrong by some centimetres
    assert 20.0 < frozen < 100.0
    evaluations, networks = map(
        int, re.search(r"evaluated (\d+) times with (\d+) networks, in order: True", text).groups()
    )
    assert evaluations > 100
    assert networks > 20
    there, here = re.search(r"tip at 2.5 N: (\S+) mm in the reader, (\S+) mm here", text).groups()
    assert there == here


def arrays(text: str, folder: Path) -> None:
    errors = re.search(r"error ([\d.]+) and ([\d.]+), ([\d.]+)% inside", text).groups()
    assert all(0.009 < float(e) < 0.015 for e in errors[:2])  # the noise itself is 0.01
    assert 85.0 <= float(errors[2]) <= 95.0
    assert re.search(r"force 1: .* 0\.7\d+ ± 0\.0\d+, trusted", text)
    assert re.search(r"force 6: .*, not trusted", text)
    assert "the same answers: True" in text
    assert (folder / "oscillator.palpate").stat().st_size > 1000


def copper(text: str, folder: Path) -> None:
    rows = re.findall(r"(\d+) N +([\d.]+) mm +([\d.]+) mm +([\d.]+) J", text)
    load, tip, left, lost = np.array(rows, dtype=float).T
    first = float(re.search(r"first yield at the clamp: ([\d.]+) N", text)[1])
    assert np.all(left[load < first] == 0.0)
    assert np.all(np.diff(left[load > first]) > 0)
    assert np.all(np.diff(lost[load > first]) > 0)
    stiffness = 3 * 110e9 * np.pi * 0.005**4 / 4
    # what springs back is elastic; at 25 N the tip has turned by 0.37 rad, so levers are shorter by up to its cosine
    spring = (tip - left) / (1000 * load / stiffness)
    assert np.all(spring < 1.0)
    assert np.all(spring > np.cos(0.38) ** 2)
    assert spring[0] > 0.998
    assert "the same shape to 0 nm" in text
    assert text.count(f"{tip[-1]:.2f} mm") == 2
    after, before = (float(v) for v in re.findall(r"5 N: ([\d.]+) mm", text)[-2:])
    assert after > before + 10.0
    assert "no step along the load path" in text


def nylon(text: str, folder: Path) -> None:
    rows = np.array(re.findall(r"([\d.]+) s  (\d) N +([\d.]+) mm +([\d.]+) J +([\d.]+) J", text), dtype=float)
    tip, stored, lost = rows[:, 2], rows[:, 3], rows[:, 4]
    assert np.all(np.diff(tip[:4]) > 0)
    assert np.all(np.diff(tip[3:]) < 0)
    assert np.all(np.diff(lost) >= 0)
    # what was put in while 3 N lay on it: at once, then by the way that it sank
    np.testing.assert_allclose(stored[1:4] + lost[1:4], stored[0] + 3e-3 * (tip[1:4] - tip[0]), atol=3e-4)
    once, ever = (float(v) for v in re.findall(r"with the modulus .*: ([\d.]+) mm", text))
    assert once == tip[0]
    assert tip[3] < ever < 1.01 * tip[3]
    ramps = [float(v) for v in re.findall(r"within .* s: ([\d.]+) mm", text)]
    assert once < ramps[0] < ramps[1] < ramps[2] < ever


def tissue(text: str, folder: Path) -> None:
    rows = re.findall(r"(\d) mm +([\d.]+) N +([\d.]+) N/m +([\d.]+) mm", text)
    depth, force, stiffness, pad = np.array(rows, dtype=float).T
    assert list(depth) == [2, 4, 6]
    # a ball that sinks in touches more and more of a body that stiffens: both grow, the pad stays within its stop
    assert np.all(np.diff(force) > 0)
    assert np.all(np.diff(stiffness) > 0)
    assert np.all(pad < np.minimum(depth, 4.0))
    # a force that grows convexly lies below its chord: between the trapezoid of the slopes and nothing
    steps = np.diff(force) / 2e-3
    assert np.all((stiffness[:-1] < steps) & (steps < stiffness[1:]))
    assert float(re.search(r"differences of the energy: ([\d.]+) N", text)[1]) == pytest.approx(
        force[-1], abs=2e-4
    )
    assert "Dataset of 4 solves of layered block 60 × 60 × 33 mm" in text
    assert (folder / "tissue.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "tissue.vtu").stat().st_size > 10000
    assert (folder / "tissue.zarr" / "zarr.json").is_file()


def specimen(text: str, folder: Path) -> None:
    medians = [float(v) for v in re.findall(r"([\d.]+) % median", text)]
    assert len(medians) == 6
    assert medians[0] == pytest.approx(50, abs=5)  # 1.4 times the modulus, and up to e^0.3 times by the layer
    assert medians[-1] < 0.05 * medians[0]
    assert (folder / "specimen.palpate").stat().st_size > 1000


def grasp(text: str, folder: Path) -> None:
    rows = np.array(re.findall(r"lifted (\d) mm: force +(\S+) N, stiffness +(\S+) N/m", text), dtype=float)
    assert "8 solves (64 samples by symmetry)" in text
    lift, force, stiffness = rows[:, 0] * 1e-3, rows[:, 1], rows[:, 2]
    assert force[0] == 0.0
    # the pull back grows as the stiffness says: by the trapezoid of the slopes, to what their printed digits allow
    np.testing.assert_allclose(
        np.diff(-force), np.diff(lift) * (stiffness[1:] + stiffness[:-1]) / 2, rtol=0.01
    )
    assert float(re.search(r"closed path: (\S+) of", text)[1]) < 1e-9
    assert (folder / "held.palpate").stat().st_size > 1000


def bent(text: str, folder: Path) -> None:
    learnt, elastic = (float(v) for v in re.findall(r"error [\d.]+% median, ([\d.]+)% p95", text))
    assert learnt < 1.0 < 10.0 < elastic
    assert 50 < float(re.search(r"stays at (\d+) mm", text)[1]) < 90
    assert (folder / "copper-rod.palpate").stat().st_size > 1000


def in_mujoco(text: str, folder: Path) -> None:
    rests, solved = (float(v) for v in re.findall(r"([\d.]+) mm", text)[-2:])
    assert rests == pytest.approx(solved, rel=0.005)
    varies, exchanged = (float(v) for v in re.search(r"varies by (\S+) J of (\S+) J", text).groups())
    assert varies < 1e-5 * exchanged


def in_newton(text: str, folder: Path) -> None:
    borne, weight = (float(v) for v in re.search(r"borne by (\S+) N of (\S+) N", text).groups())
    assert borne == pytest.approx(weight, rel=0.01)


def scanned_tool(text: str, folder: Path) -> None:
    scan, ellipsoid = (float(v) for v in re.findall(r"([\d.]+) mN", text))
    assert scan == pytest.approx(ellipsoid, rel=0.1)  # the same but for its lumps and its flatter nail


CHECKS: dict[str, Callable[[str, Path], None]] = {
    "01_cantilever.py": cantilever,
    "02_two_loads.py": two_loads,
    "03_your_own_beam.py": own_beam,
    "04_filter_by_hand.py": by_hand,
    "05_program_touches.py": program,
    "06_drifting_stiffness.py": drifting,
    "07_scikit_learn.py": scikit_learn,
    "08_arrays.py": arrays,
    "09_bend_copper_past_yield.py": copper,
    "10_creeping_nylon.py": nylon,
    "11_press_soft_tissue.py": tissue,
    "12_correct_from_a_specimen.py": specimen,
    "13_hold_soft_tissue.py": grasp,
    "14_bent_and_stays_bent.py": bent,
    "15_touch_in_mujoco.py": in_mujoco,
    "16_touch_in_newton.py": in_newton,
    "17_a_tool_from_a_scan.py": scanned_tool,
}
QUICK = {"04_filter_by_hand.py"}
SLOW = pytest.mark.skipif(
    "PALPATE_NEWTON" not in os.environ, reason="Newton compiles its kernels for minutes at the first run"
)
MARKS = {"16_touch_in_newton.py": [pytest.mark.full, SLOW]} | {name: [] for name in QUICK}


def test_every_example_is_checked():
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(CHECKS)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=MARKS.get(n, pytest.mark.full)) for n in sorted(CHECKS)]
)
def test_example(name: str, tmp_path: Path):
    printed = run_file(EXAMPLES / name, tmp_path, 200, PYTHONWARNINGS="")
    CHECKS[name](printed, tmp_path)
