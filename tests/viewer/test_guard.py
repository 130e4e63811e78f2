"""Strangers are kept out: Host, Origin, token, content security policy, other machines."""

from __future__ import annotations

import inspect
import urllib.request
import webbrowser
from pathlib import Path

import httpx
import pytest
from starlette.datastructures import Headers
from websockets.exceptions import InvalidStatus

from palpate.errors import UsageError
from palpate.viewer import Viewer, serve
from palpate.viewer.guard import Token, refusal
from palpate.viewer.web_server import listen
from websocket_page import get, socket_of


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


@pytest.mark.full
def test_the_running_server_answers_403(viewer: Viewer):
    with pytest.raises(InvalidStatus) as caught, socket_of(viewer, origin="http://evil.example"):
        pass
    assert caught.value.response.status_code == 403
    answer = get(viewer, host="evil.example")
    assert answer.status_code == 403
    assert "evil.example" in answer.text


def test_every_answer_forbids_everything_foreign(viewer: Viewer):
    for path in ("", "assets/page.js", "assets/page.css", "missing"):
        answer = get(viewer, path)
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
    assert get(viewer, path).status_code == 404


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.0.7", "example.com"])
def test_other_machines_can_not_be_served(host: str):
    with pytest.raises(UsageError, match="ssh -L"):
        listen(0, host)


@pytest.mark.full
def test_nothing_is_served_without_the_token(viewer: Viewer):
    other, almost = Token().secret, next(iter(viewer.cookies.values()))[:-1]
    name = next(iter(viewer.cookies))
    for path in (
        "",
        "index.html",
        "assets/page.js",
        "surface",
        "fields/0",
        "missing",
        "?token=",
        f"?token={other}",
    ):
        answer = httpx.get(viewer.address + path)
        assert answer.status_code == 401
        assert "address that palpate printed" in answer.text
        assert answer.headers["connection"] == "close"
        assert "set-cookie" not in answer.headers
        assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    for value in ("", other, almost, "é"):
        assert httpx.get(viewer.address, headers={"cookie": f"{name}={value}".encode()}).status_code == 401
    for cookies in ("", f"{name}={other}", f"other={viewer.cookies[name]}"):
        with (
            pytest.raises(InvalidStatus) as caught,
            socket_of(viewer, additional_headers={"Cookie": cookies}),
        ):
            pass
        assert caught.value.response.status_code == 403


def test_the_address_that_is_printed_turns_into_a_cookie_and_a_page(viewer: Viewer):
    with httpx.Client() as browser:
        welcome = browser.get(viewer.url)
        cookie = welcome.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        assert "domain" not in cookie
        assert welcome.headers["refresh"] == "0; url=/"  # the page's address without the token
        assert dict(browser.cookies) == viewer.cookies
        assert '<script type="module"' in browser.get(viewer.address).text
    elsewhere = httpx.get(viewer.url.replace("/?", "//evil.example/%2e?"), headers={"accept": "*/*"})
    assert elsewhere.headers["refresh"] == "0; url=/evil.example/%2e"


def test_each_start_has_a_secret_of_its_own():
    tokens = [Token() for _ in range(50)]
    assert len({token.secret for token in tokens}) == 50
    assert min(len(token.secret) for token in tokens) >= 24
    assert "secrets.compare_digest" in inspect.getsource(Token.equals)  # takes as long wherever they differ
    assert tokens[0].equals(tokens[0].secret)
    assert not any(
        tokens[0].equals(text) for text in ("", tokens[0].secret[:-1], tokens[0].secret + "x", "é")
    )


@pytest.mark.full
def test_a_page_without_a_token_is_an_explicit_wish_and_warned_of(rod, monkeypatch, capsys):
    def look(viewer: Viewer) -> None:
        assert viewer.url == viewer.address
        assert httpx.get(viewer.address).status_code == 200
        assert httpx.get(viewer.address, headers={"host": "evil.example"}).status_code == 403

    monkeypatch.setattr(Viewer, "wait", look)
    serve(rod, port=0, token=False)
    assert "Warning: this page asks for no token" in capsys.readouterr().err


@pytest.mark.full
def test_the_browsers_command_line_holds_no_token(rod, monkeypatch, capsys):
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)

    def look(viewer: Viewer) -> None:
        (secret,) = viewer.cookies.values()
        assert secret in capsys.readouterr().err  # the terminal has it
        assert secret not in opened[0]
        path = Path(urllib.request.url2pathname(opened[0].removeprefix("file://")))
        assert path.stat().st_mode & 0o077 == 0 or path.parent.stat().st_mode & 0o077 == 0
        assert f"0; url={viewer.url}" in path.read_text("utf-8")

    monkeypatch.setattr(Viewer, "wait", look)
    serve(rod, port=0, open_browser=True)
    assert not Path(urllib.request.url2pathname(opened[0].removeprefix("file://"))).exists()
