"""The network file: bit for bit there and back, and every kind of damage named."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save_file

from palpate.errors import FileFormatError, PalpateError, UsageError
from palpate.network import Archive, Network, load_archive, save_archive
from palpate.network.radial import RADIAL_FUNCTIONS

from .forgery import forge, parts_of
from .networks import FORMS, any_network, points
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


def test_the_same_network_is_the_same_file_each_time(archive, tmp_path):
    """A recorded touch knows its body again by the checksum of the file."""
    files = {save_archive(tmp_path / f"{k}.palpate", archive).read_bytes() for k in range(12)}
    assert len(files) == 1  # by chance, of four entries in any order: 24^-11


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


@pytest.mark.parametrize("version", ["3", "20", "two", "", "-1", "0", "²"])
def test_future_version(path, version):
    rewritten(path, version=version)
    with pytest.raises(FileFormatError, match="Upgrade palpate"):
        load_archive(path)


def test_another_kind(path):
    with pytest.raises(FileFormatError, match="'touch'; 'field' is needed"):
        load_archive(path, kind="field")


def test_changed_description_is_found_by_the_checksum(path):
    rewritten(path, content=json.dumps({"networks": {}, "meta": {}}))
    with pytest.raises(FileFormatError, match="checksum"):
        load_archive(path)


@pytest.mark.parametrize(("part", "value"), [("shifts", 1e200), ("weights", 1e306)])
def test_numbers_that_can_not_be_evaluated_are_refused(tmp_path, part, value):
    network = random_network(2, 1, 2)
    bad = np.array(getattr(network, part))
    bad[0, 0] = value
    with pytest.raises(UsageError, match=r"can't be saved: its .* overflow"):
        replace(network, **{part: bad}).save(tmp_path / "inf.palpate")
    assert not list(tmp_path.iterdir())


def test_extra_arrays_that_are_not_finite_are_refused(tmp_path):
    with pytest.raises(UsageError, match=r"can't be saved: its extra array 'covariance'"):
        replace(random_network(1, 1, 2), extras={"covariance": np.full(3, np.nan)}).save(
            tmp_path / "a.palpate"
        )


def test_settings_that_json_does_not_know_are_refused(tmp_path):
    with pytest.raises(UsageError, match="can't be saved"):
        replace(random_network(1, 1, 2), meta={"made": {1, 2}}).save(tmp_path / "a.palpate")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("radial", RADIAL_FUNCTIONS)
@pytest.mark.parametrize("modes", [None, 3])
def test_every_network_comes_back_bit_for_bit(tmp_path, form, radial, modes):
    extras = {"covariance": np.eye(5), "groups": np.arange(4)}
    meta = {"training": "sha256 of the samples", "rmse": 1e-3}
    network = any_network(3, 8, 6, form=form, radial=radial, modes=modes, extras=extras, meta=meta)
    again = Network.load(network.save(tmp_path / "n.palpate"))
    X = points(network, 9)
    np.testing.assert_array_equal(again.predict(X), network.predict(X))
    np.testing.assert_array_equal(again.jacobian(X[0]), network.jacobian(X[0]))
    assert (again.radial, again.form, again.inputs, again.outputs) == (
        radial,
        form,
        network.inputs,
        network.outputs,
    )
    assert again.meta == meta
    assert again.extras.keys() == extras.keys()
    for name, array in extras.items():
        np.testing.assert_array_equal(again.extras[name], array)
        assert again.extras[name].dtype == array.dtype


def test_a_file_of_several_networks_is_not_one(path, archive, tmp_path):
    with pytest.raises(FileFormatError, match="a network of data is needed"):
        Network.load(path)
    several = save_archive(tmp_path / "two.palpate", replace(archive, kind="networks"))
    with pytest.raises(FileFormatError, match="2 networks"):
        Network.load(several)


def test_version_1_is_read_as_gaussian(tmp_path):
    network = any_network(2, 3, 4)
    content, tensors = parts_of(network)
    for key in ("radial", "basis", "extras"):
        del content["networks"]["network"][key]
    again = Network.load(forge(tmp_path / "old.palpate", content, tensors, version="1"))
    X = points(network, 5)
    assert again.radial == "gaussian"
    np.testing.assert_array_equal(again.predict(X), network.predict(X))


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
