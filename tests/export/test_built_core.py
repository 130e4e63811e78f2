"""The core that is built for pages: of these sources, and refusing what is no sound block of weights."""

from __future__ import annotations

import os
import struct

import numpy as np
import pytest

from exported_bodies import body, without_units
from palpate.errors import UsageError
from palpate.export.build_core import TARGETS, build, built_core
from palpate.export.c_export import block_of
from palpate.export.wasm_core import WasmCore
from palpate.export.weights_block import fnv


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.file)
def test_a_built_core_is_small_and_what_its_sources_give(target, tmp_path):
    built = built_core(target.file)  # refuses one of other sources
    assert len(built) <= 200_000
    if not os.environ.get("PALPATE_CI"):  # which installs it
        pytest.importorskip("ziglang", reason="zig builds the core again")
    build(target, tmp_path / target.file)
    assert (tmp_path / target.file).read_bytes() == built


def test_a_body_whose_network_has_no_units_states_its_deviation():
    model, X = without_units()
    core = WasmCore(block_of(model, field=None, with_field=False, deviation=True).to_bytes())
    np.testing.assert_allclose(core.answers(X)[:, 19], model.energy.deviation(X), rtol=1e-5)


@pytest.mark.full
def test_weights_that_are_not_sound_are_refused():
    block = block_of(body("contact"), field=None, with_field=False, deviation=True).to_bytes()
    WasmCore(block)

    def fault(changed: bytes) -> str:
        with pytest.raises(UsageError, match="refuses this block") as caught:
            WasmCore(changed)
        return caught.value.what

    def resealed(changed: bytes) -> bytes:
        return changed[:24] + struct.pack("<Q", fnv(changed[64:])) + changed[32:]

    assert "fault 1" in fault(b"palpate\0" + block[8:])
    assert "fault 1" in fault(block[:8] + struct.pack("<I", 2) + block[12:])
    assert "fault 2" in fault(block[:-8])
    rng = np.random.default_rng(0)
    for at in rng.integers(64, len(block), 40).tolist():
        assert "fault 2" in fault(block[:at] + bytes([block[at] ^ 1]) + block[at + 1 :])
    # sealed again, but an array reaches beyond the block, or has a kind that nothing has
    row = 64 + 40 * 3
    assert "fault 3" in fault(resealed(block[: row + 24] + struct.pack("<Q", len(block)) + block[row + 32 :]))
    assert "fault 3" in fault(resealed(block[: row + 4] + struct.pack("<i", 1 << 30) + block[row + 8 :]))
    assert "fault 3" in fault(resealed(block[:row] + struct.pack("<i", 9) + block[row + 4 :]))
    head = (
        64 + struct.unpack("<Q", block[64 + 24 : 64 + 32])[0] - 64
    )  # where the whole numbers of the head are
    foreign = block[: head + 8] + struct.pack("<i", 0) + block[head + 12 :]
    assert "fault 4" in fault(resealed(foreign))
