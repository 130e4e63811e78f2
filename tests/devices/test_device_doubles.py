"""Doubles of the vendors' libraries are compiled, and libraries loaded, with errors that say what to do."""

from __future__ import annotations

import subprocess
import sys

import pytest

from palpate.devices.doubles import library_doubles
from palpate.devices.doubles.library_doubles import DOUBLES, c_compiler, compile_double
from palpate.devices.force_dimension_library import DhdLibrary
from palpate.devices.openhaptics_library import HdLibrary
from palpate.devices.surroundings import Surroundings
from palpate.errors import DeviceError, ResourceError, UsageError

LIBRARIES = {kind.places.device: kind.places for kind in (DhdLibrary, HdLibrary)}


@pytest.fixture
def empty(tmp_path):
    return Surroundings(tmp_path, {}, "linux", lambda host, port: False)


@pytest.mark.full
@pytest.mark.parametrize("device", sorted(DOUBLES))
def test_every_double_compiles_and_loads(double, device):
    assert LIBRARIES[device].load(str(double(device)))


@pytest.mark.grid
@pytest.mark.parametrize(
    "module", ["palpate.devices", "palpate.devices.device_search", "palpate.runtime.child"]
)
def test_doubles_are_loaded_by_nothing_that_drives_or_searches(module):
    """What a run has loaded at its end is in its report, see `palpate.runtime.child.FOREIGN`."""
    code = f"import sys, {module}; print(*[name for name in sys.modules if 'doubles' in name])"
    loaded = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=60
    )
    assert loaded.stdout.split() == []


def test_a_machine_without_a_compiler_says_what_to_install(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ResourceError, match="apt install gcc"):
        c_compiler()


def test_a_double_that_does_not_compile_shows_what_the_compiler_says(c_compiler, tmp_path, monkeypatch):
    broken = tmp_path / "broken.c"
    broken.write_text("this is no C", encoding="utf-8")
    monkeypatch.setattr(library_doubles, "DOUBLES", {"broken": (str(broken), "broken")})
    with pytest.raises(ResourceError, match="error:") as caught:
        compile_double("broken", tmp_path / "new" / "folder")
    assert str(broken) in caught.value.fix


def test_a_device_without_a_double_is_refused(tmp_path):
    with pytest.raises(UsageError, match="'page'"):
        compile_double("page", tmp_path)


@pytest.mark.parametrize("library", LIBRARIES.values(), ids=LIBRARIES)
def test_a_missing_library_names_files_folders_variable_and_download(empty, library):
    with pytest.raises(DeviceError) as caught:
        library.load(surroundings=empty)
    text = str(caught.value)
    for words in (*library.files["linux"], *library.folders, library.override, library.download):
        assert words in text


def test_a_file_that_is_no_library_is_refused(tmp_path):
    for library in LIBRARIES.values():
        file = tmp_path / library.files["linux"][0]
        with pytest.raises(DeviceError, match="is not there"):
            library.load(str(file))
        file.write_text("no library", encoding="utf-8")
        with pytest.raises(DeviceError, match="can't be loaded"):
            library.load(str(file))
