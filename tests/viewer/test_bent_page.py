"""A rod that stays bent, on the page: pulled past yield, let go, taken hold of again."""

from __future__ import annotations

import time

import numpy as np
import pytest
from chromium_page import drag, number, settled, tip, vector

from bent import REACH, D, body
from palpate.viewer import Viewer
from palpate.viewer.messages import Frame
from websocket_page import Client, client_of

pytestmark = pytest.mark.timeout(120)

ROD = body(nodes=21)
SHAPE = ROD.fields["displacement"]


def still(client: Client, y: float, *, grabbed: bool) -> Frame:
    """The last of the frames that stay alike for 0.1 s of the loop's while the hand is at y (m), or there is none."""
    first = None
    while True:
        client.hand(0.0, y, grabbed=grabbed)
        frame = client.next_frame()
        heard = frame.grabbed == grabbed and not frame.stalled
        if not heard or first is None or (frame.force, frame.contact) != (first.force, first.contact):
            first = frame if heard else None
        elif frame.time >= first.time + 0.1:
            return frame
        time.sleep(0.01)


@pytest.mark.full
def test_the_picture_is_that_of_the_place_and_the_force():
    with Viewer(ROD, port=0, max_force=100.0) as viewer, client_of(viewer) as client:
        assert client.hello.line.travel[0][1] == pytest.approx(-REACH)
        still(client, 0.0, grabbed=True)
        held = still(client, -0.3, grabbed=True)
        assert held.contact[1] == pytest.approx(-0.3, abs=1e-6)
        assert held.force[1] > 5.0
        np.testing.assert_allclose(
            np.reshape(held.displacement, (-1, 3)),
            SHAPE.values(np.array([0.3, held.force[1]]))[0],
            atol=1e-6,
        )
        free = still(client, 0.0, grabbed=False)
        assert free.force == (0.0, 0.0, 0.0)
        assert -0.25 < free.contact[1] < -0.05
        np.testing.assert_allclose(
            np.reshape(free.displacement, (-1, 3)),
            SHAPE.values(np.array([-free.contact[1], 0.0]))[0],
            atol=1e-6,
        )
        # the hand comes from elsewhere
        again = still(client, 0.1, grabbed=True)
        np.testing.assert_allclose(again.contact, free.contact, atol=1e-6)
        np.testing.assert_allclose(again.force, 0.0, atol=1e-4)


@pytest.mark.full
def test_the_page_shows_it_bent(visit, keep):
    with Viewer(ROD, port=0, max_force=100.0) as viewer:
        page = visit(viewer)
        y = tip(page)[1]
        drag(page, 0, 80, steps=40)
        shown = settled(page, "inside")
        keep(page, "bending")
        deepest = vector(shown["data"], "contact") @ D
        assert number(shown["text"]["force-norm"]) > 1.0
        page.mouse.up()
        free = settled(page, "free")
        keep(page, "stays-bent")
        assert number(free["text"]["force-norm"]) == 0.0
        lies = vector(free["data"], "contact") @ D
        assert 0.2 * deepest < lies < deepest
        assert tip(page)[1] > y + 20
        # taken by its tip where that lies now: no force until it moves
        drag(page, 0, 0, steps=1)
        again = settled(page, "inside")
        assert vector(again["data"], "contact") @ D == pytest.approx(lies, abs=1e-5)
        assert number(again["text"]["force-norm"]) < 0.01
        page.mouse.up()
        page.context.close()
