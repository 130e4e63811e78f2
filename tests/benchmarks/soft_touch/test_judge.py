"""The judge gives methods whose errors are known just these errors."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from benchmarks.soft_touch.case_files import read_vtu
from benchmarks.soft_touch.judge import (
    JudgeError,
    compare,
    delay,
    judge,
    main,
    monotone_cubic,
    plain_figures,
    question,
    read_case,
    read_method,
)
from half_space_case import RADIUS, STIFF, force, loop, write_case, write_rows

from exported_bodies import body
from palpate.export import export_fmu

FOLDER = Path(__file__).parents[3] / "benchmarks" / "soft_touch"


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cases") / "half-space"
    return read_case(write_case(folder).name, folder.parent)


def test_the_exact_force_has_no_error(case):
    figures = judge(force, case)
    assert figures["force_p95"] == 0.0
    assert figures["stiffness_median"] < 0.02  # %, of differences over ± 5 % of the depth: h²/24 of the slope
    assert figures["loop_work"] < 1e-3  # %
    assert abs(figures["lateness"]) < 0.1  # ms: the oracle is a cubic between five depths there
    assert figures["solves"] is None


def test_a_scaled_force_errs_by_its_scale(case):
    figures = judge(lambda places: 1.2 * force(places), case)
    size = np.linalg.norm(case.force, axis=1)
    assert size.max() < 1.0  # N: the just noticeable share is a tenth
    assert figures["jnd_median"] == pytest.approx(2.0)
    assert figures["force_p95"] == pytest.approx(0.2 * np.quantile(size, 0.95, method="higher"))
    assert figures["stiffness_median"] == pytest.approx(20.0, abs=0.02)
    assert figures["direction_median"] == pytest.approx(0.0, abs=1e-6)
    assert figures["loop_work"] < 1e-3
    assert abs(figures["lateness"]) < 0.1


@pytest.mark.parametrize("late", [3, 17])
def test_a_delayed_force_is_late_by_its_delay(case, late):
    class Delayed:
        def start(self, place):
            self.places = deque([place] * late)

        def step(self, place, seconds):
            self.places.append(place)
            return 0.7 * force(self.places.popleft()[None])[0]

        force = staticmethod(force)

    assert judge(Delayed(), case)["lateness"] == pytest.approx(late, abs=0.1)


def test_a_force_with_a_curl_does_its_known_work(case):
    curl = 5.0  # N/m: the force curl × (−y, x, 0) does twice the enclosed area around a plane path

    def swirling(places):
        return force(places) + curl * np.stack([-places[:, 1], places[:, 0], np.zeros(len(places))], axis=1)

    x, y, _ = loop().T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    way = case.way_in(0)
    forces = swirling(way)
    paid = -np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(way, axis=0))
    # going in, the swirl pushes sideways and does no work
    assert paid == pytest.approx((STIFF + 4000.0 * x[0]) * 0.003**2.5 / 2.5, rel=0.02)
    assert judge(swirling, case)["loop_work"] == pytest.approx(100 * 2 * curl * area / paid, rel=1e-3)


def test_a_turned_force_errs_by_its_angle(tmp_path):
    case = read_case(write_case(tmp_path / "even", slope=0.0).name, tmp_path)
    angle = np.radians(12.0)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    figures = judge(lambda places: force(places, 0.0) @ turn.T, case)
    assert figures["direction_median"] == pytest.approx(12.0)


def test_presses_without_an_answer_count_as_wrong(case):
    def shy(places):
        return np.where(places[:, 2:] < RADIUS - 0.0045, np.nan, force(places))

    figures = judge(shy, case)
    assert figures["presses"] == 16
    assert figures["force_median"] == 0.0
    assert figures["force_p95"] == np.inf
    assert figures["lateness"] is None


def test_presses_without_an_oracle_are_not_judged(tmp_path):
    folder = write_case(tmp_path / "begun")
    lines = (folder / "oracle.csv").read_text("utf-8").splitlines()
    (folder / "oracle.csv").write_text("\n".join(lines[:11]), "utf-8")
    case, blind = read_case("begun", tmp_path), read_case("begun", tmp_path, blind=True)
    answers = question(lambda places: 1.3 * force(places), blind, loops=False)
    assert (len(case.presses), len(answers["press"])) == (10, 20)
    assert compare(answers, case)["presses"] == 10
    assert compare(answers, case)["jnd_median"] == pytest.approx(3.0)


def test_stiffness_may_be_asked_of_some_presses(case):
    answers = question(lambda places: 1.2 * force(places), case, loops=False, probed=case.presses[3:7])
    assert (len(answers["press"]), len(answers["deeper"])) == (20, 4)
    assert compare(answers, case)["stiffness_median"] == pytest.approx(20.0, abs=0.02)


def test_a_folder_without_cases_is_named(tmp_path, capsys):
    assert main([str(tmp_path / "method.py"), "--cases", str(tmp_path)]) == 2
    assert "holds no case" in capsys.readouterr().err


def test_a_table_gives_no_stiffness(case, tmp_path):
    table = tmp_path / "forces.csv"
    rows = [(press, *f) for press, f in zip(case.presses, force(case.places), strict=True)]
    write_rows(table, "press fx fy fz", rows[::-1])
    figures = judge(read_method(table, case), case)
    assert figures["force_p95"] == 0.0
    assert figures["stiffness_median"] is figures["loop_work"] is figures["lateness"] is None
    write_rows(table, "press fx fy fz", rows[1:])
    with pytest.raises(JudgeError, match="lacks 1 of 20 presses, among them 0"):
        read_method(table, case)


def test_an_fmu_gives_the_force_of_each_place(case, tmp_path):
    """Places that follow each other anyhow, each with its own force, and strokes without delay."""
    block = body("contact")
    export_fmu(block, tmp_path / "block.fmu", name="block", check=False)
    method = read_method(tmp_path / "block.fmu", case)
    places = np.random.default_rng(4).uniform([-0.004, -0.004, 0.008], [0.004, 0.004, 0.0095], (20, 3))
    modulus = block.energy.inputs[3]  # the FMU starts in its middle
    X = np.column_stack([places, np.full(len(places), (modulus.low + modulus.high) / 2)])
    np.testing.assert_allclose(method.force(places), block.energy.force(X), rtol=1e-9, atol=1e-12)
    answers = question(method, case)
    assert len(answers["at_presses"]) == len(case.presses)
    assert (
        abs(answers["lateness"]) < 1.5
    )  # ms: the block is no half-space; an FMU answers at the end of a step


class _Failing:
    """A simulator whose strokes fail."""

    force = staticmethod(force)

    def start(self, place):
        raise RuntimeError("no body")

    def step(self, place, seconds):
        return np.zeros(2)


def test_a_simulator_that_fails_in_a_stroke_is_named(case):
    with pytest.raises(JudgeError, match="no body"):
        judge(_Failing(), case)
    short = _Failing()
    short.start = lambda place: None
    with pytest.raises(JudgeError, match=r"an array of shape \(2,\)"):
        judge(short, case)


def test_figures_in_json_are_valid_without_an_answer(case):
    figures = judge(lambda places: np.full(places.shape, np.nan), case)
    plain = json.loads(json.dumps(plain_figures(figures), allow_nan=False))
    assert plain["force_median"] == "no answer"
    assert plain["loop_work"] is None


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("nothing.py", None, "There is no file"),
        ("method.txt", "", "is no method"),
        ("method.py", "load = 3", "can't be loaded for the case half-space"),
        ("method.py", "def load(case): return 3", "returned int, which gives no forces"),
        ("method.py", "def load(case): return lambda places: places[0]", "an array of shape (3,)"),
        ("method.py", "import sys\nsys.exit(3)", "SystemExit: 3"),
        ("method.py", "def load(case): return lambda places: 1j * places", "complex numbers"),
        (
            "method.py",
            "def force(places): return places\nforce.solves = 'many'\ndef load(case): return force",
            "solves of the method is 'many', no number",
        ),
        ("method.csv", "press,fx\n0,1\n", "has no column fy"),
        ("method.csv", "press,fx,fy,fz\n0,1,0\n", "a row of another length"),
        ("method.csv", "press,fx,fy,fz\n0,1,0,0\n0,2,0,0\n", "several rows for one press"),
        ("method.csv", "press,fx,fy,fz\nnan,1,0,0\n", "a press that is no number"),
        ("method.csv", "press,fx,fy,fz\n0,a,0,0\n", "no number"),
        ("method.fmu", "no archive", "can't be read as an FMU"),
    ],
)
def test_a_bad_file_is_refused_in_words(case, tmp_path, name, text, words):
    path = tmp_path / name
    if text is not None:
        path.write_text(text, "utf-8")
    if name.endswith(".fmu"):
        pytest.importorskip("fmpy")
    with pytest.raises(JudgeError) as caught:
        judge(read_method(path, case), case)
    assert words in str(caught.value)


def test_meshes_are_read_in_every_coding(case, tmp_path):
    import meshio

    points = np.random.default_rng(0).normal(size=(9000, 3))  # more than one block of zlib
    corners = np.arange(8000).reshape(-1, 4)
    mesh = meshio.Mesh(
        points,
        [("tetra", corners)],
        point_data={"fixed": (points[:, 2] < 0).astype(np.uint8)},
        cell_data={"label": [np.arange(2000) % 3]},
    )
    for name, options in (("zlib", {}), ("plain", {"compression": None}), ("text", {"binary": False})):
        mesh.write(tmp_path / f"{name}.vtu", file_format="vtu", **options)
        arrays = read_vtu(tmp_path / f"{name}.vtu")
        assert arrays["points"] == pytest.approx(points)
        assert (arrays["tetrahedra"] == corners).all()
        assert (arrays["label"] == np.arange(2000) % 3).all()
        assert (arrays["fixed"] == (points[:, 2] < 0)).all()
    assert case.mesh["fixed"].tolist() == [True, True, True, False]
    (tmp_path / "text.vtu").write_text("<VTKFile>", "utf-8")
    with pytest.raises(JudgeError, match="can't be read as a mesh"):
        read_vtu(tmp_path / "text.vtu")


def test_the_monotone_cubic_is_exact_for_lines_and_never_overshoots():
    x = np.array([0.0, 1.0, 1.5, 4.0])
    at = np.linspace(0.0, 4.0, 50)
    assert monotone_cubic(x, 3.0 * x, at) == pytest.approx(3.0 * at)
    assert (np.diff(monotone_cubic(x, np.array([0.0, 0.1, 5.0, 5.1]), at)) >= 0.0).all()


def test_a_delay_between_samples_is_measured():
    t = np.arange(600.0)
    pulse = lambda late: np.exp(-(((t - 300.0 - late) / 60.0) ** 2))  # noqa: E731
    assert delay(pulse(4.4), pulse(0.0)) == pytest.approx(4.4e-3, abs=2e-5)


def test_the_judge_runs_alone_on_the_readme_example(case, tmp_path):
    readme = (FOLDER / "README.md").read_text("utf-8")
    example = readme.split("```python\n")[1].split("```")[0]
    (tmp_path / "mine.py").write_text(example, "utf-8")
    command = [sys.executable, str(FOLDER / "judge.py"), "mine.py", "--cases", str(case.folder.parent)]
    done = subprocess.run(
        [*command, "--json", "figures.json"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "figures.json").read_text("utf-8"))["half-space"]
    stiff = 4 / 3 * 9000.0 / (1 - 0.45**2) * 0.01**0.5
    hertz = np.outer(stiff * case.depths**1.5, [0.0, 0.0, 1.0])
    error = np.linalg.norm(hertz - case.force, axis=1) / np.linalg.norm(case.force, axis=1)
    assert figures["jnd_p95"] == pytest.approx(np.quantile(error, 0.95, method="higher") / 0.1)
    assert "lateness, ms" in done.stdout
