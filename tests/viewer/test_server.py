"""`serve` and `Viewer` as programs use them: scripts, signals, standard input, models in memory and in files."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import httpx
import numpy as np
import pytest

from palpate.errors import FileFormatError, PortInUseError, UsageError
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer, show
from palpate.viewer.shown_body import ShownBody, ShownStep
from palpate.viewer.web_server import in_notebook

SCRIPT = """
import sys
from palpate.viewer import serve
serve(sys.argv[1], port=0, on_ready=lambda viewer: print(viewer.url, viewer.loop.pid, flush=True))
print("ended in good order", flush=True)
"""


@pytest.fixture
def script(rod: Surrogate, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A program without a main guard, on standard input, in a process group of its own."""
    path = rod.save(tmp_path / "rod.palpate")
    with subprocess.Popen(
        [sys.executable, "-", str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write(SCRIPT)
        process.stdin.close()
        process.stdin = None
        yield process
        process.kill()


@pytest.mark.full
@pytest.mark.skipif(os.name != "posix", reason="signals of a terminal are POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_serve_ends_in_good_order(script: subprocess.Popen[str], number: signal.Signals):
    assert script.stdout is not None
    url, loop = script.stdout.readline().split()
    assert httpx.get(url).status_code == 200
    os.kill(int(loop), 0)  # it runs
    os.killpg(script.pid, number)  # a terminal's Ctrl-C reaches the loop's process as well
    said, complaints = script.communicate(timeout=20)
    assert said == "ended in good order\n"
    assert complaints == ""
    assert script.returncode == 0
    with pytest.raises(ProcessLookupError):
        os.kill(int(loop), 0)
    with pytest.raises(httpx.ConnectError):
        httpx.get(url)


@pytest.mark.full
def test_stopping_twice_and_a_model_in_memory(rod: Surrogate):
    viewer = Viewer(rod, port=0).start()
    assert httpx.get(viewer.url).headers["content-type"].startswith("text/html")
    viewer.stop()
    viewer.stop()
    assert not viewer.loop.alive
    with pytest.raises(httpx.ConnectError):
        httpx.get(viewer.url)


def test_a_corrupt_file_is_said_to_be_one(tmp_path: Path):
    path = tmp_path / "broken.palpate"
    path.write_bytes(b"not a model")
    with pytest.raises(FileFormatError):
        Viewer(path, port=0)


def test_an_unknown_device_is_a_usage_error(rod: Surrogate):
    with pytest.raises(UsageError, match="gloves"):
        Viewer(rod, port=0, device="gloves").start()


@pytest.mark.full
def test_after_a_failed_start_nothing_is_left(rod: Surrogate):
    with Viewer(rod, port=0) as first:
        second = Viewer(rod, port=first.port, strict_port=True)
        with pytest.raises(PortInUseError):
            second.start()
        assert not hasattr(second, "loop")
        assert httpx.get(first.url).status_code == 200


def test_a_notebook_goes_on_while_its_page_is_served(monkeypatch, capsys):
    class Shell:
        kernel = object()

    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=Shell))
    corners = np.vstack([np.zeros(3), np.eye(3)])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    viewer = show(ShownBody("tetrahedron", corners, faces, [ShownStep(0 * corners)]), port=0)
    try:
        assert viewer.url in capsys.readouterr().err
        with socket.create_connection(("127.0.0.1", viewer.port), timeout=5):
            pass
    finally:
        viewer.stop()
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: None))
    assert not in_notebook()
