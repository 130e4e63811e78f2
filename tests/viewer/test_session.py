"""Credits, one hand, heartbeats and the end of the loop, through the real server and loop."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import time
from collections.abc import Callable

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed

from palpate.devices.hand_kind import HandKind
from palpate.runtime.stability import FeltStiffness
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer, session
from palpate.viewer.messages import Frame, Hold, Loop, Notice, StopWish
from palpate.viewer.session import MOST_CREDITS
from websocket_page import Client, client_of

pytestmark = pytest.mark.timeout(60)


def hold(client: Client, y: float, *, seconds: float = 0.5) -> Frame:
    """Hold the tip at y (m) for a while, as a page does; the last frame."""
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        client.hand(0.0, y)
        client.grant(1)
        frame = client.frame()
        time.sleep(0.01)
    return frame


def held(client: Client, y: float) -> Frame:
    """Hold until the loop has arrived and ramped up; on a busy machine that may take several tries.

    After a fault the hand must have let go before there is a force.
    """
    for _ in range(20):
        frame = hold(client, y)
        felt = frame.hold == Hold.YOURS and not frame.stalled and any(frame.force)
        if felt and abs(frame.position[1] - y) < 1e-6:
            return frame
        client.hand(0.0, 0.0, grabbed=False)
        time.sleep(0.05)
    pytest.fail("the loop never followed the hand")


@pytest.mark.full
def test_without_credit_no_frame(viewer: Viewer):
    with client_of(viewer) as client:
        with pytest.raises(TimeoutError):
            client.frame(timeout=0.4)
        client.grant(1)
        client.frame()
        with pytest.raises(TimeoutError):
            client.frame(timeout=0.4)


@pytest.mark.full
def test_a_slow_client_gets_the_newest_frame(viewer: Viewer):
    with client_of(viewer) as client:
        client.grant(1)
        first = client.frame()
        time.sleep(0.5)
        newest = viewer.loop.read().tick
        client.grant(1)
        second = client.frame()
        assert second.tick >= newest > first.tick


@pytest.mark.full
def test_credits_do_not_pile_up(viewer: Viewer):
    with client_of(viewer) as client:
        client.grant(60000)
        client.grant(60000)  # may come after the first frames went out
        frames = 0
        with contextlib.suppress(TimeoutError):
            while frames <= 2 * MOST_CREDITS:
                client.frame(timeout=0.5)
                frames += 1
        assert MOST_CREDITS <= frames <= 2 * MOST_CREDITS


@pytest.mark.full
def test_force_and_shape_are_the_models_own(viewer: Viewer, rod: Surrogate):
    y = -0.4 * touchable(rod).reach
    with client_of(viewer) as client:
        frame = held(client, y)
    evaluator, position = touchable(rod).evaluator(), np.array(frame.position)
    evaluator.place(position, holding=True, believed=True)
    evaluator(position, np.zeros(0))
    # positions travel in 32 bits: half an ulp of y at the largest stiffness
    slack = abs(y) * 2**-24 * touchable(rod).stiffness_max
    assert np.allclose(frame.force, evaluator.force, rtol=2**-23, atol=slack)
    assert np.allclose(frame.contact, evaluator.contact, rtol=2**-23, atol=1e-7)
    shape = rod.fields["displacement"].values(evaluator.loads)[0].astype("f4")
    assert np.allclose(frame.displacement, shape.ravel(), rtol=0, atol=1e-6)
    assert frame.inside


@pytest.mark.full
def test_two_clients_one_hand(viewer: Viewer, rod: Surrogate):
    with client_of(viewer) as first, client_of(viewer) as second:
        held(first, -0.1)
        second.hand(0.0, -0.5)
        second.grant(1)
        seen = second.frame()
        assert seen.hold == Hold.ANOTHER
        assert hold(first, -0.1, seconds=0.2).position[1] == pytest.approx(-0.1, abs=1e-6)
        first.hand(grabbed=False)
        assert held(second, -0.2).hold == Hold.YOURS


@pytest.mark.full
def test_a_client_that_vanishes_lets_go(viewer: Viewer):
    with client_of(viewer) as first:
        held(first, -0.2)
    with client_of(viewer) as second:
        for _ in range(50):
            second.grant(1)
            frame = second.frame()
            if frame.hold == Hold.FREE and not frame.grabbed:
                break
            time.sleep(0.02)
        assert (frame.hold, frame.grabbed, frame.force) == (Hold.FREE, False, (0.0, 0.0, 0.0))


@pytest.mark.full
def test_without_heartbeats_the_force_is_zero(viewer: Viewer):
    with client_of(viewer) as client:
        assert math.hypot(*held(client, -0.3).force) > 0.5
        time.sleep(0.4)  # three silent periods of 100 ms, and some
        client.grant(1)
        frame = client.frame()
        assert frame.stalled
        assert frame.force == (0.0, 0.0, 0.0)


@pytest.mark.full
def test_a_hidden_page_lets_go(viewer: Viewer):
    with client_of(viewer) as client:
        held(client, -0.3)
        client.hand(0.0, -0.3, hidden=True)
        time.sleep(0.1)
        client.grant(1)
        frame = client.frame()
        assert not frame.grabbed
        assert frame.force == (0.0, 0.0, 0.0)


@pytest.mark.full
def test_a_stop_ends_the_force_and_is_told_to_every_page(viewer: Viewer, rod: Surrogate):
    y = -0.3 * touchable(rod).reach
    with client_of(viewer) as client, client_of(viewer) as other:
        held(client, y)
        other.socket.send(StopWish(stop=True).pack())
        assert until(client, lambda frame: not any(frame.force), y)
        told = next(news for news in reversed(client.told) if news["kind"] == "Reason")
        assert told["stopped"]
        assert "until you resume" in told["now"]
        other.socket.send(StopWish(stop=False).pack())
        held(client, y)
        told = next(news for news in reversed(client.told) if news["kind"] == "Reason")
        assert told == {"kind": "Reason", "now": "", "stopped": False} | {
            k: told[k] for k in ("dropped", "ago")
        }


@pytest.mark.full
def test_the_reason_of_a_drop_is_told_with_its_age(viewer: Viewer, rod: Surrogate):
    y = -0.3 * touchable(rod).reach
    with client_of(viewer) as client:
        held(client, y)
        time.sleep(0.4)  # no word: a stall
        client.next_frame()
        told = next(news for news in reversed(client.told) if news["kind"] == "Reason")
        assert HandKind.PAGE.silence in told["now"]
        assert told["dropped"] == HandKind.PAGE.silence
        assert 0.0 <= told["ago"] < 0.4
        client.hand(0.0, 0.0, grabbed=False)
        held(client, y)
        told = next(news for news in reversed(client.told) if news["kind"] == "Reason")
        assert told["now"] == ""


def until(client: Client, sought: Callable[[Frame], bool], y: float) -> bool:
    """Hold the tip at y (m) until a frame is as sought; False where none comes."""
    return any(sought(hold(client, y, seconds=0.05)) for _ in range(100))


@pytest.mark.parametrize("override", [False, True])
def test_a_body_too_stiff_for_the_device_is_told_with_its_figures(override: bool):
    told = session.softening(FeltStiffness(900.0, 0.5, 1000.0, 0.001, override))
    assert (told.body, told.limit) == pytest.approx((900.0, 0.5 / 0.0015))
    assert told.felt == pytest.approx(900.0 if override else told.limit)
    assert told.override is override
    assert ("as asked" if override else "softened to 333 N/m") in told.words
    assert session.softening(FeltStiffness(300.0, 0.5, 1000.0, 0.001, override)) == session.NOT_SOFTENED
    assert session.softening(FeltStiffness(900.0, None, 1000.0)) == session.NOT_SOFTENED


@pytest.mark.full
def test_bytes_that_are_no_message_end_the_conversation(viewer: Viewer):
    for rubbish in (b"\xff\x00", b"\x02", b""):
        with client_of(viewer) as client:
            client.socket.send(rubbish)
            with pytest.raises(ConnectionClosed) as caught:
                client.frame()
            assert caught.value.rcvd is not None
            assert caught.value.rcvd.code == 1003


@pytest.mark.full
def test_a_target_that_is_no_number_gives_zero_force_and_a_fault(rod: Surrogate):
    with Viewer(rod, port=0) as viewer, client_of(viewer) as client:
        before = held(client, -0.3).faults
        frame = hold(client, math.nan, seconds=0.3)
        assert frame.force == (0.0, 0.0, 0.0)
        assert frame.faults > before
        assert "finite" in client.hello.faults[frame.last_fault]
        assert np.isfinite(frame.displacement).all()
        assert math.hypot(*held(client, -0.3).force) > 0.5  # and is forgiven afterwards


@pytest.mark.full
def test_the_end_of_the_loop_is_told_and_the_force_is_zero(rod: Surrogate, caplog: pytest.LogCaptureFixture):
    with Viewer(rod, port=0) as viewer, client_of(viewer) as client:
        held(client, -0.3)
        os.kill(viewer.loop.pid, signal.SIGKILL)
        told = Notice.from_json(str(client.socket.recv(timeout=5)))
        assert "ended" in told.what
        client.grant(1)
        frame = client.frame()
        assert (frame.loop, frame.force) == (Loop.ENDED, (0.0, 0.0, 0.0))
        with client_of(viewer) as later:
            assert "ended" in Notice.from_json(str(later.socket.recv(timeout=5))).what
    assert "real-time process has ended" in caplog.text


@pytest.mark.full
def test_a_standing_loop_is_noticed(rod: Surrogate):
    with Viewer(rod, port=0) as viewer, client_of(viewer) as client:
        held(client, -0.3)
        os.kill(viewer.loop.pid, signal.SIGSTOP)
        time.sleep(0.5)
        client.grant(1)
        frame = client.frame()
        os.kill(viewer.loop.pid, signal.SIGCONT)
        assert (frame.loop, frame.force) == (Loop.FROZEN, (0.0, 0.0, 0.0))


@pytest.mark.full
def test_a_loop_that_stands_in_the_midst_of_a_tick_is_frozen_too(
    rod: Surrogate, monkeypatch: pytest.MonkeyPatch
):
    with Viewer(rod, port=0) as viewer, client_of(viewer) as client:
        held(client, -0.3)
        os.kill(viewer.loop.pid, signal.SIGSTOP)
        with monkeypatch.context() as midst:
            midst.setattr(viewer.loop.shared.state, "fetch", lambda: False)  # as where a write never ends
            client.grant(1)
            frame = client.frame()
        os.kill(viewer.loop.pid, signal.SIGCONT)
        assert (frame.loop, frame.force) == (Loop.FROZEN, (0.0, 0.0, 0.0))
        assert held(client, -0.3).loop == Loop.RUNNING
