"""What is no file, or has no end, is refused before it is read; texts of files show as they stand."""

import os
import socket
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate import Dataset, load, read_results
from palpate.dataset.measured import read_measurements
from palpate.devices.trace_file import read_trace
from palpate.errors import FileFormatError, PalpateError
from palpate.input_files import LARGEST, open_input, plain_text, plain_texts, read_input, read_toml
from palpate.study.toml import read_study
from palpate.tables import read_table

READERS = {
    "a.csv": read_table,
    "b.csv": read_measurements,
    "a.xlsx": read_table,
    "a.frd": read_results,
    "a.dat": read_results,
    "a.vtu": read_results,
    "a.pvd": read_results,
    "a.npz": read_results,
    "a.parquet": read_results,
    "a.txt": read_results,
    "a.toml": read_study,
    "a.trace": read_trace,
    "a.palpate": load,
    "a.zarr": Dataset.open,
}


@pytest.mark.parametrize("name", READERS)
def test_every_reader_refuses_a_pipe_and_a_device(tmp_path, name):
    """A reader that opened the pipe would wait for a writer, and one of the device would read for ever."""
    os.mkfifo(tmp_path / name)
    with pytest.raises(PalpateError) as pipe:
        READERS[name](tmp_path / name)
    (tmp_path / name).unlink()
    (tmp_path / name).symlink_to("/dev/zero")
    with pytest.raises(PalpateError) as device:
        READERS[name](tmp_path / name)
    for caught in (pipe, device):
        assert caught.value.exit_code == 2
        assert name in caught.value.what


def test_what_is_no_file_is_named(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to("loop")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "socket"))
    for name, kind in {"": "a folder", "pipe": "a named pipe", "socket": "a socket"}.items():
        with pytest.raises(FileFormatError, match="can't be read") as caught:
            open_input(tmp_path / name)
        assert caught.value.why == f"It is {kind}."
    with pytest.raises(FileFormatError, match="It is a device"):
        open_input("/dev/zero")
    for name in ("loop", "missing", "zero\0byte", "n" * 300):
        with pytest.raises(FileFormatError, match="can't be read"):
            open_input(tmp_path / name)


def test_a_file_without_end_is_no_file(tmp_path):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(LARGEST + 1)  # a hole: it takes no room
    with pytest.raises(FileFormatError, match="more than 4"):
        open_input(tmp_path / "large")
    with pytest.raises(FileFormatError, match="more than"):
        read_input(tmp_path / "large", largest=10)
    assert read_input("/proc/self/status")  # whose size is stated as zero


@given(st.text(st.characters(codec=None), max_size=30))
def test_a_plain_text_has_no_mark_that_is_obeyed(text):
    plain = plain_text(text)
    plain.encode()  # no halves of characters
    assert not {unicodedata.bidirectional(c) for c in plain} & {
        "LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"
    }  # fmt: skip
    assert not {c for c in plain if unicodedata.category(c) == "Cc"} - {"\n", "\t"}
    assert plain_text(plain) == plain


def test_letters_of_all_scripts_stay():
    for text in (
        "Kraft [N]",
        "σ₀₁ in µm²",
        "العربية",
        "עברית",
        "\u0645\u06cc\u200c\u062e",
        "力\tx\ny",
        "👩‍🔬",
    ):
        assert plain_text(text) == text
    assert plain_text("a\x1b]0;x\x07\u202egnp.exe\ud800") == "a\\x1b]0;x\\x07gnp.exe\\ud800"
    assert plain_texts({"a\x07": ["\u2066b", (1, None)]}) == {"a\\x07": ["b", (1, None)]}


NO_TOML = (
    "a = " + "[" * 5000 + "]" * 5000,
    "a" + ".a" * 5000 + " = 1",
    "a = " + "9" * 9999,
    "a = 1\na = 2",
    'a = "\xff"'.encode("latin-1"),
)


@pytest.mark.parametrize("content", NO_TOML)
def test_no_toml_is_said_in_a_sentence(tmp_path, content):
    (tmp_path / "a.toml").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(FileFormatError, match="TOML"):
        read_toml(tmp_path / "a.toml")
