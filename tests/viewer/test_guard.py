"""Strangers are kept out: Host, Origin, content security policy, other machines."""

from __future__ import annotations

import httpx
import pytest
from starlette.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from palpate.errors import UsageError
from palpate.viewer import Viewer
from palpate.viewer.web_server import listen, refusal


def headers(**values: str) -> Headers:
    return Headers(raw=[(k.encode(), v.encode()) for k, v in values.items()])


@pytest.mark.parametrize(
    "host", ["127.0.0.1", "127.0.0.1:8080", "localhost:9", "LOCALHOST:8080", "[::1]:8080", "[::1]"]
)
def test_this_machines_names_are_let_in(host: str):
    assert refusal("http", headers(host=host)) == ""
    assert refusal("websocket", headers(host=host, origin=f"http://{host}")) == ""


@pytest.mark.parametrize(
    "host",
    ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:8080", "192.168.0.7", "", "[::2]"],
)
def test_other_names_are_refused(host: str):
    assert "not this machine" in refusal("http", headers(host=host))
    assert "not this machine" in refusal("websocket", headers(host=host, origin=f"http://{host}"))


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://localhost:3000",
        "https://localhost:8080",
        "null",
        "http://localhost:8080.evil",
    ],
)
def test_a_websocket_from_another_page_is_refused(origin: str):
    assert "own page" in refusal("websocket", headers(host="localhost:8080", origin=origin))


def test_a_websocket_without_origin_and_a_second_host_are_refused():
    assert refusal("websocket", headers(host="localhost:8080"))
    two = Headers(raw=[(b"host", b"localhost"), (b"host", b"evil.example")])
    assert refusal("http", two)


def test_the_running_server_answers_403(viewer: Viewer):
    ws = viewer.url.replace("http", "ws", 1) + "touch"
    with pytest.raises(InvalidStatus) as caught, connect(ws, origin="http://evil.example"):
        pass
    assert caught.value.response.status_code == 403
    answer = httpx.get(viewer.url, headers={"host": "evil.example"})
    assert answer.status_code == 403
    assert "evil.example" in answer.text


def test_every_answer_forbids_everything_foreign(viewer: Viewer):
    for path in ("", "assets/page.js", "assets/page.css", "missing"):
        answer = httpx.get(viewer.url + path)
        policy = answer.headers["content-security-policy"]
        assert policy.startswith("default-src 'none'")
        assert "http" not in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    "path", ["../server.py", "..%2fserver.py", "%2e%2e/server.py", "assets/%2e%2e/%2e%2e/guard.py"]
)
def test_only_the_page_is_served(viewer: Viewer, path: str):
    assert httpx.get(viewer.url + path).status_code == 404


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.7", "example.com"])
def test_other_machines_can_not_be_served(host: str):
    with pytest.raises(UsageError, match="ssh -L"):
        listen(0, host)
