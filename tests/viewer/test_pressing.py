"""A body pressed anywhere through the real server, websocket and loop; the body is `slabs`."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import httpx
import numpy as np
import pytest
from slabs import DEVIATION, HALF, family, touched_slab
from websockets.sync.client import ClientConnection

import pressed
from palpate.runtime.touchable import touchable
from palpate.runtime.workspace import Workspace
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer
from palpate.viewer.messages import Credit, Frame, Hand, Hello, Hold, Modes, Surface
from palpate.viewer.surface_drawing import SurfaceDrawing
from palpate.viewer.surfaces import relief
from websocket_page import get, socket_of

pytestmark = pytest.mark.timeout(120)


@pytest.fixture(scope="module")
def slab() -> Surrogate:
    return touched_slab()


@pytest.fixture(scope="module")
def pressed_viewer(slab: Surrogate) -> Iterator[Viewer]:
    with Viewer(slab, port=0) as running:
        yield running


class PressClient:
    """A program in the page's place."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.hello = Hello.from_json(str(socket.recv(timeout=10)))
        hello = self.hello
        self.space = Workspace(hello.workspace, hello.scale, hello.centre, upright=True)

    def say(self, place=None, parameters=()) -> Frame:
        """Put the probe's centre somewhere (m), or lift it; the picture after that."""
        target = np.zeros(3) if place is None else self.space.to_hand(np.asarray(place))
        held = place is not None
        words = Hand(0.0, 0.05, tuple(target), held, False, np.asarray(parameters, "f4"))
        self.socket.send(words.pack())
        self.socket.send(Credit(1).pack())
        while isinstance(data := self.socket.recv(timeout=10), str):
            pass  # news of the force, or of the device
        return Frame.unpack(data)

    def held(self, place, parameters=()) -> Frame:
        """Frame until the loop is there with its full force, and that stands still."""
        before = None
        for _ in range(400):
            frame = self.say(place, parameters)
            there = np.allclose(frame.position, place, atol=1e-6) and not frame.stalled
            if there and before is not None and np.allclose(frame.force, before.force, rtol=1e-6, atol=1e-9):
                if any(frame.force) or not frame.depth > 0:
                    return frame
                self.say(None, parameters)  # after a fault, as of a busy machine, the hand must have let go
                there = False
            before = frame if there else None
            time.sleep(0.06)  # the force grows for 50 ms
        pytest.fail("the loop never followed the hand")


@contextlib.contextmanager
def client_of(viewer: Viewer) -> Iterator[PressClient]:
    with socket_of(viewer) as socket:
        yield PressClient(socket)


def fetched(viewer: Viewer, path: str) -> bytes:
    return get(viewer, path).raise_for_status().content


@pytest.mark.full
def test_force_depth_and_trust_are_the_surrogates_own(pressed_viewer: Viewer, slab: Surrogate):
    place = np.array([0.008, -0.004, pressed.RADIUS - 0.0045])
    with client_of(pressed_viewer) as client:
        frame = client.held(place)
    x = np.array(frame.position)[None]
    # the position travels in 32 bits: half an ulp of a centimetre at 420 N/m
    np.testing.assert_allclose(frame.force, slab.energy.force(x)[0], rtol=1e-6, atol=1e-6)
    assert frame.depth == pytest.approx(slab.energy.depth(x)[0], abs=2e-9)
    n = np.array(frame.force) / np.linalg.norm(frame.force)
    assert frame.stiffness == pytest.approx(-n @ slab.energy.stiffness(x)[0] @ n, rel=1e-5)
    assert frame.deviation == pytest.approx(DEVIATION, rel=1e-6)
    assert (frame.inside, frame.hold) == (True, Hold.YOURS)


@pytest.mark.full
def test_what_was_not_trained_is_flagged(pressed_viewer: Viewer):
    with client_of(pressed_viewer) as client:
        assert not client.held([0.0, 0.0, pressed.RADIUS - 1.2 * pressed.DEEPEST]).inside
        assert not client.held([0.026, 0.0, pressed.RADIUS - 0.003]).inside
        assert client.held([0.0, 0.0, pressed.RADIUS - 0.003]).inside


def test_coefficients_are_the_fields_and_a_frame_is_small(pressed_viewer: Viewer, slab: Surrogate):
    with client_of(pressed_viewer) as client:
        frame = client.held([0.004, 0.006, pressed.RADIUS - 0.004])
    x = np.array(frame.position)[None]
    at = 0
    for one in slab.fields.values():
        eye = one.evaluator()
        eye(x[0])
        own = frame.coefficients[at : at + len(one.modes)]
        np.testing.assert_allclose(own, one.coefficients(x)[0], rtol=1e-5)
        profile = eye.profile().ravel()
        at += len(one.modes) + profile.size
        np.testing.assert_allclose(frame.coefficients[at - profile.size : at], profile, rtol=1e-5, atol=1e-9)
    assert at == frame.coefficients.size
    np.testing.assert_allclose(frame.contact, [*x[0, :2], 0.0], atol=1e-5)
    np.testing.assert_allclose(frame.normal, [0.0, 0.0, 1.0], atol=1e-5)
    # two modes each, and profiles of 14 splines, 1 and three offsets: of three components, and of one
    assert len(frame.pack()) < 256 + 4 * (14 * 4 * 3 + 14 * 4 * 1)


@pytest.mark.full
def test_pushed_too_deep_the_body_returns_to_rest_under_the_hand(pressed_viewer: Viewer, slab: Surrogate):
    x, end = np.zeros(3), slab.energy.baseline.surface.inner
    with client_of(pressed_viewer) as client:
        x[2] = -end + 5e-4
        deep = client.held(x)
        assert deep.coefficients.any()
        assert deep.depth > 0
        x[2] = -end - 5e-4
        for _ in range(100):
            frame = client.say(x)
            if not frame.coefficients.any():
                break
            time.sleep(0.02)
        assert frame.force == (0.0, 0.0, 0.0)
        assert not frame.coefficients.any()
        assert not frame.inside
        assert (frame.depth, frame.deviation) == (0.0, 0.0)
        client.held([0.0, 0.0, 1.2 * pressed.RADIUS])
        assert client.held([0.0, 0.0, pressed.RADIUS - 0.004]).force[2] > 0


@pytest.mark.full
def test_released_the_force_is_zero_and_the_body_returns_to_rest(pressed_viewer: Viewer):
    with client_of(pressed_viewer) as client:
        assert client.held([0.0, 0.0, pressed.RADIUS - 0.004]).force[2] > 0
        for _ in range(100):
            frame = client.say()
            if not frame.grabbed:
                assert frame.force == (0.0, 0.0, 0.0)
            if not frame.coefficients.any():
                break
            time.sleep(0.02)
        assert not frame.coefficients.any()
        assert frame.drawn == 0.0


def test_the_hello_says_what_there_is(pressed_viewer: Viewer, slab: Surrogate):
    with client_of(pressed_viewer) as client:
        hello = client.hello
    assert (hello.name, hello.radius, hello.deepest, hello.radius_parameter) == ("slab", 0.010, 0.006, -1)
    assert [(f.name, f.unit, f.components, f.modes) for f in hello.fields] == [
        ("displacement", "m", 3, 2),
        ("largest stretch", "", 1, 2),
    ]
    assert hello.fields[0].low == 0.0
    assert 0.5 * pressed.DEEPEST < hello.fields[0].high < pressed.DEEPEST
    assert hello.force_max == pytest.approx(touchable(slab).force_max)


def test_the_page_gets_the_skin_and_the_modes_once(pressed_viewer: Viewer, slab: Surrogate):
    assert b"page.js" in fetched(pressed_viewer, "")
    surface = Surface.unpack(fetched(pressed_viewer, "surface"))
    corners = surface.rest.reshape(-1, 3)[surface.triangles.astype(int).reshape(-1, 3)]
    top = (np.abs(corners[:, :, 2]) < 1e-6).all(axis=1)
    np.testing.assert_array_equal(surface.touchable > 0, top)
    modes = Modes.unpack(fetched(pressed_viewer, "fields/0"))
    assert modes.modes.size == 2 * surface.rest.size
    assert modes.rows == slab.fields["displacement"].local_mode.table.shape[1]
    with pytest.raises(httpx.HTTPStatusError, match="404"):
        fetched(pressed_viewer, "fields/2")


def test_a_surrogate_alone_is_drawn_from_its_distance():
    body = touchable(pressed.surrogate())
    points, triangles = relief(body)
    used = points[np.unique(triangles)]
    np.testing.assert_allclose(used[:, 2], 0.0, atol=1e-3 * pressed.RADIUS)
    np.testing.assert_allclose(np.abs(used[:, :2]).max(axis=0), 0.02, rtol=0.01)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all(), "counter-clockwise as seen from outside"
    drawing = SurfaceDrawing(body)
    assert drawing.fields == ()
    assert drawing.surface.touchable.all()
    assert np.abs(drawing.surface.rest).max() < HALF


@pytest.mark.full
def test_a_family_hears_its_slider_and_relaxes(tmp_path):
    with Viewer(family().save(tmp_path / "family.palpate"), port=0) as viewer, client_of(viewer) as client:
        assert [r.name for r in client.hello.parameters] == ["firmness"]
        assert "relaxes by 0.4 in 0.05 s" in client.hello.remembers
        place = [0.0, 0.0, pressed.RADIUS - 0.004]
        client.say(None, [1.25])
        soft = client.held(place, [0.5])
        firm = client.held(place, [2.0])
    assert soft.parameters.tolist() == [0.5]
    assert np.isnan(soft.deviation), "no posterior, no figure"
    # long after the press what doesn't relax is left; from one end of the input to the other U grows e-fold
    full = pressed.surrogate(factor=np.exp(-0.5)).energy.force(np.array([soft.position]))[0, 2]
    assert soft.force[2] == pytest.approx(0.6 * full, rel=1e-3)
    assert firm.force[2] > 2 * soft.force[2]
