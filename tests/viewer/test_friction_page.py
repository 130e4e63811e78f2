"""The page of a body with friction in a real browser: a tool that is dragged sideways sticks, and then slips."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from chromium_page import vector
from playwright.sync_api import Page
from slabs import touched_slab
from test_pressed_page import middle, stand_still

from palpate.surrogates import Surrogate

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]

MU = 0.3
# px: the first sticks; several slip, because a busy machine takes hold anew in between
ASIDE = (1, 20, 40, 60)


def test_a_dragged_tool_sticks_and_then_slips(visit_pressed: Callable[[Surrogate], Page]):
    body = touched_slab().with_friction(MU)
    page = visit_pressed(body)
    words = page.inner_text("#model-line")
    assert words.endswith("friction of 0.3")
    assert words.count("friction") == 1, "it is not among the trained ranges"
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    stand_still(page, "inside")
    shares = []
    for aside in ASIDE:
        page.mouse.move(x + aside, y)
        shown = stand_still(page, "inside")["data"]
        normal = body.energy.force(vector(shown, "position")[None])[0]
        along = vector(shown, "force") - normal
        assert abs(along @ normal) < 1e-3 * normal @ normal, "friction lies across the normal force"
        shares.append(np.linalg.norm(along) / np.linalg.norm(normal))
    assert shares[0] < 0.9 * MU
    assert max(shares) == pytest.approx(MU, rel=1e-3)
