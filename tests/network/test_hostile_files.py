"""Files made with bad intent, checksum and all: refused by name, or networks of finite answers."""

from __future__ import annotations

import copy
import json
import struct
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from palpate.errors import FileFormatError
from palpate.network import Network

from .forgery import forge, parts_of
from .networks import any_network, points

NETWORK = any_network(2, 4, 3, form="rotated", modes=2, extras={"covariance": np.eye(2)}, meta={"a": 1})
CONTENT, TENSORS = parts_of(NETWORK)
FUZZ = settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def survives(path) -> None:
    """Refused with FileFormatError, or answers with finite numbers inside its ranges."""
    try:
        network = Network.load(path)
    except FileFormatError:
        return
    assert np.isfinite(network.predict(points(network, 5))).all()
    assert np.isfinite(network.jacobian(points(network, 1)[0])).all()
    assert str(network)


def mutated(**arrays):
    return TENSORS | {f"net/network/{k}": v for k, v in arrays.items()}


def with_part(*keys, value):
    content = copy.deepcopy(CONTENT)
    inner = content
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    return content


OWN = ("networks", "network")
BAD_CONTENT = {
    "no mapping": [],
    "a number": 3,
    "no networks": {"meta": {}},
    "networks are a list": {"networks": [], "meta": {}},
    "network is text": {"networks": {"network": "x"}, "meta": {}},
    "meta is a list": CONTENT | {"meta": []},
    "a range upside down": with_part(*OWN, "inputs", 0, "low", value=1e9),
    "a range without width": with_part(
        *OWN, "inputs", 0, value={"name": "a", "low": 1, "high": 1, "unit": ""}
    ),
    "a range that is not a number": with_part(*OWN, "inputs", 0, "low", value=float("nan")),
    "an infinite range": with_part(*OWN, "inputs", 0, "high", value=float("inf")),
    "a range as text": with_part(*OWN, "inputs", 0, "low", value="-1"),
    "a range as truth": with_part(*OWN, "inputs", 0, "low", value=False),
    "a range of an enormous integer": with_part(*OWN, "inputs", 0, "high", value=10**400),
    "a range so wide that scaling overflows": with_part(*OWN, "inputs", 0, "high", value=1e308),
    "an input too few": with_part(*OWN, "inputs", value=CONTENT["networks"]["network"]["inputs"][:1]),
    "no inputs": with_part(*OWN, "inputs", value=[]),
    "no outputs": with_part(*OWN, "outputs", value=[]),
    "an output without unit": with_part(*OWN, "outputs", 0, value={"name": "y"}),
    "an output with more": with_part(*OWN, "outputs", 0, "colour", value="red"),
    "a name that is a number": with_part(*OWN, "outputs", 0, "name", value=3),
    "an unknown radial function": with_part(*OWN, "radial", value="cubic"),
    "a radial function by number": with_part(*OWN, "radial", value=0),
    "a basis denied": with_part(*OWN, "basis", value=False),
    "extras denied": with_part(*OWN, "extras", value=[]),
    "extras of another kind": with_part(*OWN, "extras", value=[3]),
    "an entry more": with_part(*OWN, "hook", value="import os"),
    "two networks of one set of arrays": with_part("networks", "b", value=CONTENT["networks"]["network"]),
    "an enormous integer text": json.dumps(CONTENT).replace(
        '"meta": {}', '"meta": {"a": ' + "9" * 5000 + "}"
    ),
    "deep nesting": '{"networks": {}, "meta": ' + '{"a":' * 100_000 + "1" + "}" * 100_001,
    "a key twice": json.dumps(CONTENT).replace('"meta": {}', '"meta": {}, "meta": {}'),
    "half a text": json.dumps(CONTENT)[:-9],
    "no text": "",
}


@pytest.mark.parametrize("content", BAD_CONTENT.values(), ids=BAD_CONTENT.keys())
def test_a_description_that_lies_is_refused(tmp_path, content):
    with pytest.raises(FileFormatError, match="does not describe a network"):
        Network.load(forge(tmp_path / "f.palpate", content, TENSORS))


W = TENSORS["net/network/weights"]
BAD_TENSORS = {
    "missing": {k: v for k, v in TENSORS.items() if not k.endswith("weights")},
    "more": mutated(more=np.zeros(3)),
    "nobody's": TENSORS | {"stray": np.zeros(3)},
    "single precision": mutated(weights=W.astype(np.float32)),
    "integers": mutated(weights=W.astype(np.int64)),
    "flat": mutated(weights=W.ravel()),
    "transposed": mutated(weights=np.ascontiguousarray(W.T)),
    "not a number": mutated(weights=np.full_like(W, np.nan)),
    "infinite": mutated(tail=np.full((2, 3), np.inf)),
    "overflowing weights": mutated(weights=np.full_like(W, 1e308)),
    "overflowing factors": mutated(factors=np.full((3, 2, 2), 1e308)),
    "overflowing basis": mutated(basis=np.full((4, 2), 1e308)),
    "rank above inputs": mutated(factors=np.ones((3, 5, 2)), shifts=np.ones((3, 5))),
    "rank zero": mutated(factors=np.ones((3, 0, 2)), shifts=np.ones((3, 0))),
    "no units of enormous rank": mutated(
        factors=np.zeros((0, 2**40, 2)), shifts=np.zeros((0, 2**40)), weights=np.zeros((2, 0))
    ),
    "no modes": mutated(basis=np.zeros((4, 0)), weights=np.zeros((0, 3)), tail=np.zeros((0, 3))),
    "half width zero": mutated(input_half=np.array([1.0, 0.0])),
    "half width negative": mutated(input_half=np.array([1.0, -1.0])),
    "half width vanishing": mutated(input_half=np.array([1.0, 5e-324])),
    "scale zero": mutated(output_scale=np.zeros(4)),
    "scale of one output": mutated(output_scale=np.ones(1)),
    "centre far away": mutated(input_centre=np.array([0.0, 1e308])),
    "covariance not a number": TENSORS | {"net/network/extra/covariance": np.full(3, np.nan)},
}


@pytest.mark.parametrize("tensors", BAD_TENSORS.values(), ids=BAD_TENSORS.keys())
def test_arrays_that_lie_are_refused(tmp_path, tensors):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(FileFormatError, match="does not describe a network"):
            Network.load(forge(tmp_path / "f.palpate", CONTENT, tensors))


def by_hand(path, header: object, body: bytes = b"") -> None:
    """A safetensors file from its bare layout (length, JSON, numbers)."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + body)


META = {"palpate": "networks", "version": "2", "content": "{}", "sha256": ""}


@pytest.mark.parametrize(
    "header",
    [
        b"\xff\xfe" * 20,
        b"[" * 5000,
        b'{"__metadata__": {"palpate": "\xc3\x28"}}',
        {"__metadata__": META, "a": {"dtype": "F64", "shape": [2**62], "data_offsets": [0, 8]}},
        {"__metadata__": META, "a": {"dtype": "F64", "shape": [2**40, 2**40], "data_offsets": [0, 8]}},
        {"__metadata__": META, "a": {"dtype": "F64", "shape": [-1], "data_offsets": [0, 8]}},
        {"__metadata__": META, "a": {"dtype": "F64", "shape": [1], "data_offsets": [8, 0]}},
        {"__metadata__": META, "a": {"dtype": "X99", "shape": [1], "data_offsets": [0, 8]}},
        *(
            {"__metadata__": META, "a": {"dtype": kind, "shape": [8 // size], "data_offsets": [0, 8]}}
            for kind, size in {"BF16": 2, "F8_E4M3": 1, "F8_E5M2": 1, "F16": 2, "C64": 8, "BOOL": 1}.items()
        ),
        {"__metadata__": META | {"version": 2}},
        {"__metadata__": "x"},
        {"__metadata__": {}},
    ],
)
def test_containers_made_by_hand_are_refused(tmp_path, header):
    by_hand(tmp_path / "f.palpate", header, b"\0" * 8)
    with pytest.raises(FileFormatError):
        Network.load(tmp_path / "f.palpate")


@FUZZ
@given(data=st.data())
def test_bytes_cut_spliced_and_overwritten(tmp_path, data):
    path = NETWORK.save(tmp_path / "f.palpate")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        i = data.draw(st.integers(0, len(content)))
        j = data.draw(st.integers(i, min(len(content), i + 64)))
        content[i:j] = data.draw(st.binary(max_size=16) | st.just(bytes(content[:32])))
    path.write_bytes(content)
    survives(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)


def places(value, path=()):
    """Paths of everything inside a JSON value."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key))


@pytest.mark.full
@FUZZ
@given(path_to=st.sampled_from([p for p in places(CONTENT) if p]), value=JSON, drop=st.booleans())
def test_any_part_of_the_description_replaced(tmp_path, path_to, value, drop):
    content = with_part(*path_to, value=value)
    if drop:
        inner = content
        for key in path_to[:-1]:
            inner = inner[key]
        del inner[path_to[-1]]
    survives(forge(tmp_path / "f.palpate", content, TENSORS))


NUMBERS = st.floats() | st.sampled_from([0.0, -0.0, 1e-320, 1e99, 1e101, 1e200, -1e308])


@pytest.mark.full
@FUZZ
@given(name=st.sampled_from(sorted(TENSORS)), data=st.data())
def test_any_number_of_an_array_replaced(tmp_path, name, data):
    array = TENSORS[name].copy()
    for _ in range(data.draw(st.integers(1, 3))):
        array.flat[data.draw(st.integers(0, array.size - 1))] = data.draw(NUMBERS)
    survives(forge(tmp_path / "f.palpate", CONTENT, TENSORS | {name: array}))


@pytest.mark.full
@FUZZ
@given(
    name=st.sampled_from(sorted(TENSORS)),
    shape=st.lists(st.integers(0, 4), max_size=4),
    kind=st.sampled_from(["<f8", "<f4", "<i8", "|u1", "|b1", "<f2"]),
)
def test_any_array_replaced(tmp_path, name, shape, kind):
    survives(forge(tmp_path / "f.palpate", CONTENT, TENSORS | {name: np.ones(shape, kind)}))
