"""`palpate show` as a terminal runs it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from blocks import dents

from palpate.physics.vtu import write_pvd
from palpate.viewer.messages import Shown


@pytest.mark.full
@pytest.mark.skipif(os.name != "posix", reason="signals of a terminal are POSIX")
def test_a_series_is_served_until_interrupted(tmp_path: Path):
    solutions = dents(2)
    mesh = solutions[0].mesh
    mesh.tetrahedra, mesh.regions, mesh.region_of = mesh.triangles[:0, [0, 1, 2, 2]], (), mesh.surface_of[:0]
    path = write_pvd(solutions, tmp_path / "press.pvd", values=[0.0, 0.01])
    command = [sys.executable, "-m", "palpate", "show", str(path), "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        assert process.stderr is not None
        url, *words = process.stderr.readline().split()
        assert words[:2] == ["shows", "press."]
        with httpx.Client() as page:
            page.get(url)
            shown = Shown.from_json(page.get(url.partition("?")[0] + "shown").text)
        os.killpg(process.pid, signal.SIGINT)
        assert process.stderr.read() == "\nInterrupted. The solved bodies are as they were.\n"
        assert process.wait(20) == 130
    assert [step.label for step in shown.steps] == ["t = 0", "t = 0.01"]
    assert {field.name for field in shown.fields} == {"displacement", "von Mises stress", "largest strain"}


@pytest.mark.full
def test_a_file_that_is_none_is_a_usage_error(tmp_path: Path):
    done = subprocess.run(
        [sys.executable, "-m", "palpate", "show", str(tmp_path / "no.vtu")],
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert "can't be shown" in done.stderr
