"""A busy port moves on, or is an error where that was asked."""

from __future__ import annotations

import socket

import pytest

from palpate.errors import PortInUseError, UsageError
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer, free_port
from palpate.viewer.web_server import listen


@pytest.fixture
def taken():
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield server.getsockname()[1]


def test_a_busy_port_moves_on(taken: int):
    with listen(taken) as server:
        assert taken < server.getsockname()[1] < taken + 50


def test_strict_says_which_port(taken: int):
    with pytest.raises(PortInUseError, match=rf"Port {taken} is in use") as caught:
        listen(taken, strict=True)
    assert caught.value.exit_code == 2
    assert "--port" in caught.value.fix


def test_a_free_port_is_free_again_afterwards():
    port = free_port(0)
    with listen(port, strict=True) as server:
        assert server.getsockname()[1] == port


@pytest.mark.parametrize("port", [-1, 65536])
def test_no_such_port(port: int):
    with pytest.raises(UsageError, match="no port"):
        listen(port)


@pytest.mark.full
def test_a_viewer_on_a_busy_port(rod: Surrogate, taken: int):
    with Viewer(rod, port=taken) as moved:
        assert moved.port != taken
        assert f":{moved.port}/" in moved.url
    with pytest.raises(PortInUseError), Viewer(rod, port=taken, strict_port=True):
        pass
