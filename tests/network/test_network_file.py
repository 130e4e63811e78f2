"""The network file: bit for bit there and back, and every kind of damage named."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from palpate.errors import FileFormatError, PalpateError, UsageError
from palpate.network import Archive, load_archive, save_archive

from .test_network import random_network


@pytest.fixture
def archive():
    return Archive(
        {"a": random_network(1, 5, 6), "b": random_network(3, 2, 4)},
        {"rest": np.arange(6.0)},
        {"note": "é"},
        "touch",
    )


@pytest.fixture
def path(archive, tmp_path):
    return save_archive(tmp_path / "m.palpate", archive)


def test_loaded_network_predicts_bit_identically(archive, path):
    again = load_archive(path, kind="touch")
    X = np.random.default_rng(0).normal(size=(9, 3))
    np.testing.assert_array_equal(again.networks["b"].predict(X), archive.networks["b"].predict(X))
    assert again.networks["a"].inputs == archive.networks["a"].inputs
    assert again.networks["a"].outputs == archive.networks["a"].outputs
    np.testing.assert_array_equal(again.arrays["rest"], np.arange(6.0))
    assert again.meta == {"note": "é"}


def test_no_part_of_the_file_is_left_when_it_can_not_be_written(archive, tmp_path):
    with pytest.raises(UsageError, match="Could not write"):
        save_archive(tmp_path / "no" / "m.palpate", archive)
    assert not list(tmp_path.iterdir())


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileFormatError, match="does not exist"):
        load_archive(tmp_path / "no.palpate")
    with pytest.raises(FileFormatError, match="is a folder"):
        load_archive(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.99])
def test_truncated(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(FileFormatError, match=r"m\.palpate"):
        load_archive(path)


def test_foreign_safetensors(tmp_path):
    save_file({"x": np.zeros(3)}, tmp_path / "x.safetensors", {"other": "tool"})
    with pytest.raises(FileFormatError, match="not one of palpate's"):
        load_archive(tmp_path / "x.safetensors")


def rewritten(path, **changes):
    """The same arrays under a changed header."""
    with safe_open(path, framework="numpy") as file:
        header, tensors = file.metadata(), {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    save_file(tensors, path, header | changes)


def test_future_version(path):
    rewritten(path, version="2")
    with pytest.raises(FileFormatError, match="Upgrade palpate"):
        load_archive(path)


def test_another_kind(path):
    with pytest.raises(FileFormatError, match="'touch'; 'field' is needed"):
        load_archive(path, kind="field")


def test_changed_description_is_found_by_the_checksum(path):
    rewritten(path, content=json.dumps({"networks": {}, "meta": {}}))
    with pytest.raises(FileFormatError, match="checksum"):
        load_archive(path)


def test_numbers_that_are_not_finite_are_refused(tmp_path):
    network = random_network(1, 1, 2)
    network.weights[0, 0] = np.inf
    path = save_archive(tmp_path / "inf.palpate", Archive({"a": network}))
    with pytest.raises(FileFormatError, match="finite"):
        load_archive(path)


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(position=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_no_flipped_bit_goes_unnoticed_or_crashes(path, position, bit):
    content = bytearray(path.read_bytes())
    i = int(position * len(content))
    content[i] ^= 1 << bit
    other = path.with_name("flipped.palpate")
    other.write_bytes(content)
    try:
        load_archive(other)
    except PalpateError:
        return
    pytest.fail(f"bit {bit} of byte {i} was flipped and nobody noticed")


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=300))
def test_arbitrary_bytes_are_refused(tmp_path, content):
    path = tmp_path / "noise.palpate"
    path.write_bytes(content)
    with pytest.raises(FileFormatError):
        load_archive(path)
