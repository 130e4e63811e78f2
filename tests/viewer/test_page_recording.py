"""The button that records a touch: what it writes is felt again to the last bit."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from palpate.devices.trace_file import read_trace
from palpate.runtime.replay import Replay
from palpate.viewer import Viewer
from palpate.viewer.messages import Recording, RecordWish
from websocket_page import client_of

pytestmark = pytest.mark.timeout(60)


@pytest.fixture
def recording_viewer(rod, tmp_path):
    with Viewer(rod, port=0, recordings=tmp_path) as running:
        yield running


def told(client, wanted):
    """The server's next word on the recording that is as wanted."""
    while True:
        message = client.socket.recv(timeout=20)
        if isinstance(message, str) and '"kind": "Recording"' in message:
            news = Recording.from_json(message)
            if news.active == wanted or news.problem:
                return news


@pytest.mark.full
def test_a_page_records_a_touch_from_its_midst(recording_viewer, rod, tmp_path):
    with client_of(recording_viewer) as client:
        client.hand(0.0, -0.02)
        time.sleep(0.1)
        client.socket.send(RecordWish(wanted=True).pack())
        news = told(client, wanted=True)
        assert news.file.endswith(".trace")
        for y in np.linspace(-0.02, 0.03, 60):
            client.hand(0.0, float(y))
            time.sleep(0.01)
        client.socket.send(RecordWish(wanted=False).pack())
        news = told(client, wanted=False)
        assert not news.problem
    trace = read_trace(tmp_path / news.file)
    assert news.size == trace.size
    assert news.lost == trace.lost == 0
    assert len(trace) > 200
    assert np.abs(trace.ticks["force"]).max() > 0.01
    replayed = Replay(trace, recording_viewer.model).run()
    assert replayed.identical, str(replayed)
    with Viewer(rod, port=0, replay=trace.path) as shown, client_of(shown) as client:
        forces = []
        until = time.monotonic() + 20.0
        while len(forces) < 5:
            assert time.monotonic() < until, "the touch is shown"
            frame = client.next_frame()
            if frame.grabbed and any(frame.force):
                forces.append(np.array(frame.force))
    apart = [np.abs(trace.ticks["force"] - force).max(axis=1).min() for force in forces]
    np.testing.assert_allclose(apart, 0.0, atol=1e-5)  # pages get 32 bits


@pytest.mark.full
def test_a_folder_that_is_gone_is_told_to_the_page(recording_viewer, tmp_path):
    tmp_path.rmdir()
    with client_of(recording_viewer) as client:
        client.socket.send(RecordWish(wanted=True).pack())
        assert "could not be begun" in told(client, wanted=True).problem
        client.grant(1)
        client.frame()
    tmp_path.mkdir()


@pytest.mark.full
def test_the_button_says_what_is_written(recording_viewer, visit: Callable[..., Page], tmp_path):
    page = visit(recording_viewer)
    page.click("#record")
    expect(page.locator("#record")).to_have_text("stop recording")
    page.click("#record")
    expect(page.locator("#record")).to_have_text("record")
    expect(page.locator("#recording")).to_contain_text("MB")
    assert len(list(tmp_path.glob("*.trace"))) == 1
