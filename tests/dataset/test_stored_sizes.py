"""Sizes are checked before anything is decoded: no file makes room for what it does not hold."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest
from numcodecs import Blosc, Zstd

from palpate.dataset import Dataset, Layout, assemble
from palpate.errors import FileFormatError, ResourceError
from palpate.learning.learning_history import History
from palpate.network.packing import unpack
from palpate.sizes import HEAD, promised_size, require_npz
from palpate.units import Range

PROMISE = b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", 2**32 - 1) + b"\0\0\0\0"


@pytest.fixture
def store(tmp_path):
    rows = 64
    scalars = ("strain_energy", "potential_energy", "iterations", "residual", "solve_seconds")
    answers = {name: np.linspace(0.0, 1.0, rows) for name in scalars}
    answers |= {"displacement": np.ones((rows, 1, 3)), "root_reaction": np.ones((rows, 3))}
    answers |= {"converged": np.ones(rows, dtype=bool), "message": np.full(rows, "converged", dtype=object)}
    layout = Layout(np.array([[1.0, 0.0]]), None, (0,), ((0.0, -1.0),))
    inputs = np.linspace(0.0, 1.0, rows)[:, None]
    return assemble((Range("P", 0.0, 1.0, "N"),), layout, inputs, answers, {"problem": {}}).save(
        tmp_path / "a.zarr"
    )


def refusal(store, kind=FileFormatError):
    with pytest.raises(kind) as caught:
        Dataset.open(store)
    return str(caught.value)


def edit(store, name, change):
    file = store / name / "zarr.json"
    metadata = json.loads(file.read_text())
    change(metadata)
    file.write_text(json.dumps(metadata))


@pytest.mark.parametrize("length", [0, 1, 255, 256, 257, 65_791, 65_792, 1_000_000])
@pytest.mark.parametrize("codec", ["zstd", "blosc"])
def test_the_promise_of_an_honest_chunk_is_its_size(codec, length):
    content = np.random.default_rng(0).integers(0, 3, length, dtype=np.uint8).tobytes()
    for plain in (content, bytes(length)):
        chunk = bytes({"zstd": Zstd(), "blosc": Blosc()}[codec].encode(plain))
        assert promised_size(codec, chunk[:HEAD], len(chunk)) == length


@pytest.mark.parametrize("name", ["displacement", "message", "sample"])
def test_thirteen_bytes_that_promise_four_gigabytes_are_refused(store, name):
    (chunk,) = (file for file in (store / name / "c").rglob("*") if file.is_file())
    chunk.write_bytes(PROMISE)
    assert len(PROMISE) == 13
    assert "13 bytes promise 4,294,967,295" in refusal(store)
    assert f"{name}, chunk c/" in refusal(store)


def test_a_chunk_of_another_size_than_its_array_is_refused(store):
    (store / "inputs" / "c" / "0" / "0").write_bytes(Zstd().encode(bytes(80_000)))
    assert "80,000 bytes where 512 belong" in refusal(store)


@pytest.mark.parametrize(
    "change", [{"shape": [10**15, 1]}, {"data_type": "float63"}, {"codecs": [{"name": "gzip"}]}]
)
def test_metadata_that_promise_too_much_or_nonsense_are_refused(store, change):
    edit(store, "inputs", lambda metadata: metadata.update(change))
    if "shape" in change:
        assert "does not fit into memory" in refusal(store, ResourceError)
    else:
        assert "corrupt" in refusal(store)


def test_blosc_chunks_say_how_long_they_are():
    chunk = bytes(Blosc().encode(bytes(1000)))
    with pytest.raises(ValueError, match="and is 999"):
        promised_size("blosc", chunk[:HEAD], 999)
    huge = chunk[:4] + struct.pack("<I", 2**32 - 1) + chunk[8:]
    with pytest.raises(ValueError, match="promise"):
        promised_size("blosc", huge[:HEAD], len(chunk))
    for codec in ("zstd", "blosc", "gzip"):
        with pytest.raises(ValueError, match="it "):
            promised_size(codec, b"abc", 3)


def npz(shape, content):
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": shape})
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("error.npy", head.getvalue() + content)
    file.seek(0)
    return file


def test_an_archive_of_arrays_is_as_large_as_it_says(tmp_path):
    require_npz(npz((2,), bytes(16)))
    with pytest.raises(ValueError, match=r"error\.npy: an array of 4,294,967,296 bytes in a place of 16"):
        require_npz(npz((2**29,), bytes(16)))
    (tmp_path / "a.npz").write_bytes(npz((2**29,), bytes(16)).getvalue())
    with pytest.raises(FileFormatError, match="not a learning history"):
        History.load(tmp_path / "a.npz")


def test_a_packed_table_is_as_large_as_it_can_be():
    with pytest.raises(ValueError, match="13 bytes promise 4,294,967,296"):
        unpack(np.zeros(13, np.uint8), (2**29,))
