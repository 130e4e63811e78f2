"""Wrappers of exported libraries: every function that they name is in the library, and they refuse another one."""

from __future__ import annotations

import ctypes
import math
import re
import runpy
import subprocess
import sys

import numpy as np
import pytest

from exported_bodies import body
from palpate.export import export_lib
from palpate.surrogates.moving_rest import MovingRest
from system_programs import require_program


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    require_program("gcc")
    folder = tmp_path_factory.mktemp("organ")
    return export_lib(body("relaxation"), folder, compiler="gcc", check=False)


@pytest.mark.full
def test_every_function_of_every_wrapper_is_in_the_library(exported):
    library = ctypes.CDLL(str(exported.library))
    for file in exported.wrappers:
        names = set(re.findall(r"\borgan_[a-z_]+(?=\()", file.read_text("utf-8")))
        assert names or file.suffix in (".py", ".m")
        for name in names:
            assert getattr(library, name) is not None, (file, name)


def test_the_python_wrapper_needs_no_other_package(exported):
    code = f"import sys; sys.path.append({str(exported.library.parent)!r}); import organ; b = organ.Body()"
    code += "; print(b.force([0.0, 0.0, 0.005])[0], b.limits(), b.remembers)"
    command = [sys.executable, "-I", "-S", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "True" in done.stdout


@pytest.mark.full
def test_a_rod_that_is_let_go_lies_where_palpate_finds_it(tmp_path):
    require_program("gcc")
    rod, none = body("iwan"), np.zeros(0)
    done = export_lib(rod, tmp_path, compiler="gcc", check=False)
    out = runpy.run_path(str(tmp_path / "rod.py"))["Body"](str(done.library))
    evaluate, state = rod.energy.evaluator(), rod.memory.start()
    resting = MovingRest(evaluate, state, rod.energy.baseline.directions[0])
    stroke = 0.03 * np.sin(np.linspace(0.0, 4.0, 50))[:, None] * rod.energy.baseline.directions
    largest = 0.0
    for seconds in (0.0, 0.4):
        for place in stroke:
            evaluate(place, none)
            state.step(place, evaluate.amplitude, evaluate.slope, 0.01)
            largest = max(largest, np.abs(out.step(0.01, place)[0]).max())
        resting.lies[:] = stroke[-1]
        assert resting.release(seconds, none)
        place, flags = out.release(seconds, stroke[-1])
        size = np.linalg.norm(resting.lies)
        assert size > 1e-4
        assert not flags & 4
        np.testing.assert_allclose(place, resting.lies, rtol=0, atol=1e-9 * size)
        np.testing.assert_allclose(out.ledger[:2], [state.stored, state.lost], rtol=1e-9)
        np.testing.assert_allclose(out.step(0.0, place)[0], 0.0, atol=1e-9 * largest)
    assert out.release(math.nan, place)[1] & 4
    np.testing.assert_allclose(out.ledger[1], state.lost, rtol=1e-9)


def test_the_wrapper_refuses_other_weights(exported, tmp_path):
    wrapper = (exported.library.parent / "organ.py").read_text("utf-8")
    (tmp_path / "organ.py").write_text(wrapper.replace(exported.sources.hash, "0" * 64), "utf-8")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import organ; organ.Body({str(exported.library)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "holds other weights" in done.stderr
