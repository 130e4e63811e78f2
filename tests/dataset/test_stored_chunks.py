"""Sizes are checked before anything is decoded: no file makes room for what it does not hold."""

import io
import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from numcodecs import Blosc, Zstd

from palpate.dataset import Dataset, Layout, assemble
from palpate.errors import DataWarning, FileFormatError, ResourceError
from palpate.learning.learning_history import History
from palpate.network.packing import unpack
from palpate.sizes import HEAD, promised_size, require_npz
from palpate.units import Range

PROMISE = b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", 2**32 - 1) + b"\0\0\0\0"


CRC = bytes(4)  # where a chunk's checksum stands; sizes are looked at before it


@pytest.fixture
def store(tmp_path):
    return make_store(tmp_path, 64)


def make_store(tmp_path, rows):
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


@pytest.mark.grid
@pytest.mark.parametrize("name", ["displacement", "message", "sample"])
def test_thirteen_bytes_that_promise_four_gigabytes_are_refused(store, name):
    (chunk,) = (file for file in (store / name / "c").rglob("*") if file.is_file())
    chunk.write_bytes(PROMISE + CRC)
    assert len(PROMISE) == 13
    assert "13 bytes promise 4,294,967,295" in refusal(store)
    assert f"{name}, chunk c/" in refusal(store)


def test_thirteen_bytes_that_promise_millions_of_texts_are_refused(store):
    """They decode to four bytes, the number of texts, for all of which the decoder would make room."""
    (chunk,) = (file for file in (store / "message" / "c").rglob("*") if file.is_file())
    content = bytes(Zstd().encode(struct.pack("<I", 300_000_000)))
    assert len(content) == 13
    chunk.write_bytes(content + struct.pack("<I", crc32c(content)))
    assert "it promises 300,000,000 texts where 64 belong" in refusal(store)


def crc32c(content):
    """Return Castagnoli's cyclic redundancy check (RFC 3720, appendix B.4), bit by bit."""
    value = 0xFFFFFFFF
    for byte in content:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0x82F63B78 * (value & 1)
    return value ^ 0xFFFFFFFF


def flip(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 4
    file.write_bytes(content)


DAMAGES = [
    flip,
    Path.unlink,
    lambda file: file.write_bytes(b""),
    lambda file: file.write_bytes(PROMISE + CRC),
]


@pytest.mark.full
@pytest.mark.grid
@pytest.mark.parametrize(
    ("name", "damage"),
    [*(("displacement", damage) for damage in DAMAGES), *((name, flip) for name in ("inputs", "message"))],
)
def test_a_damaged_chunk_costs_its_rows(tmp_path, name, damage):
    whole = make_store(tmp_path, 640)
    kept = Dataset.open(whole)
    damage(sorted(file for file in (whole / name / "c").rglob("*") if file.is_file())[2])
    with pytest.warns(DataWarning, match="80 of 640 rows of .* are damaged") as told:
        data = Dataset.open(whole)
    assert f"{name}, chunk c/2" in str(told[0].message)
    rows = np.delete(np.arange(640), slice(160, 240))
    np.testing.assert_array_equal(data["sample"], rows)
    assert data.hash == kept.take(rows).hash


@pytest.mark.grid
@pytest.mark.parametrize("name", ["sample", "rest", "input_low"])
def test_damage_beside_the_rows_is_refused(tmp_path, name):
    whole = make_store(tmp_path, 640)
    (chunk,) = (file for file in (whole / name / "c").rglob("*") if file.is_file())
    flip(chunk)
    assert "corrupt" in refusal(whole)


@pytest.mark.full
def test_damaged_rows_excuse_no_other_change(tmp_path):
    whole = make_store(tmp_path, 640)
    flip(whole / "inputs" / "c" / "1" / "0")
    file = whole / "zarr.json"
    file.write_text(file.read_text().replace('\\"problem\\"', '\\"Problem\\"'))
    assert "its contents don't match its checksum" in refusal(whole)


@pytest.mark.full
def test_a_chunk_of_another_size_than_its_array_is_refused(store):
    (store / "inputs" / "c" / "0" / "0").write_bytes(Zstd().encode(bytes(80_000)) + CRC)
    assert "80,000 bytes where 512 belong" in refusal(store)


@pytest.mark.grid
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
