"""Doubles of the vendors' libraries are compiled, and libraries loaded, with errors that say what to do."""

from __future__ import annotations

import pytest

from palpate.errors import DeviceError, ResourceError, UsageError
from palpate.runtime import device_doubles
from palpate.runtime.device_doubles import DOUBLES, c_compiler, compile_double
from palpate.runtime.device_search import HARDWARE, LibrarySearch, Surroundings, load_library

LIBRARIES = [entry for entry in HARDWARE if isinstance(entry, LibrarySearch)]


@pytest.fixture
def empty(tmp_path):
    return Surroundings(tmp_path, {}, "linux", lambda host, port: False)


@pytest.mark.parametrize("device", sorted(DOUBLES))
def test_every_double_compiles_and_loads(double, device):
    assert load_library(device, str(double(device)))


def test_a_machine_without_a_compiler_says_what_to_install(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ResourceError, match="apt install gcc"):
        c_compiler()


def test_a_double_that_does_not_compile_shows_what_the_compiler_says(c_compiler, tmp_path, monkeypatch):
    broken = tmp_path / "broken.c"
    broken.write_text("this is no C", encoding="utf-8")
    monkeypatch.setattr(device_doubles, "DOUBLES", {"broken": (str(broken), "broken")})
    with pytest.raises(ResourceError, match="error:") as caught:
        compile_double("broken", tmp_path / "new" / "folder")
    assert str(broken) in caught.value.fix


def test_a_device_without_a_double_is_refused(tmp_path):
    with pytest.raises(UsageError, match="'page'"):
        compile_double("page", tmp_path)


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda library: library.device)
def test_a_missing_library_names_files_folders_variable_and_download(empty, library):
    with pytest.raises(DeviceError) as caught:
        load_library(library.device, surroundings=empty)
    text = str(caught.value)
    for words in (*library.files["linux"], *library.folders, library.override, library.download):
        assert words in text


def test_a_file_that_is_no_library_is_refused(tmp_path):
    for library in LIBRARIES:
        file = tmp_path / library.files["linux"][0]
        with pytest.raises(DeviceError, match="is not there"):
            load_library(library.device, str(file))
        file.write_text("no library", encoding="utf-8")
        with pytest.raises(DeviceError, match="can't be loaded"):
            load_library(library.device, str(file))
