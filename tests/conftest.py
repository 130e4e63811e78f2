"""Fixtures shared by all tests."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

import kernels
from system_programs import require_program

# machines are shared and kernels compile on first use: time is no law here; examples are the same on every run
settings.register_profile("palpate", deadline=None, derandomize=True)
settings.load_profile("palpate")

# there are as many workers as cores: a second thread of each would only wait for the other's; programs inherit it
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# a run in the background of a shell ignores interrupts, and so would the programs that tests interrupt
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


LONG_FILES = Path(__file__).with_name("long_files.txt").read_text(encoding="utf-8").split()
"""Files of tests that take longest, from the root of the repository, the longest first."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config) -> None:
    """Compile the kernels once, where all tests are about to run in workers and none has begun."""
    if config.args_source is pytest.Config.ArgsSource.TESTPATHS and not config.option.collectonly:
        config.pluginmanager.get_plugin("terminalreporter").write_line(kernels.compile_all())


@pytest.hookimpl(tryfirst=True)  # before tests are left out by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave all cases of a grid but the first to the full tier, and put the long files first.

    What a worker takes last is then short, and no core waits at the end.
    """
    begun: set[str] = set()
    for item in items:
        function = item.nodeid.partition("[")[0]
        if item.get_closest_marker("grid"):
            if function in begun:
                item.add_marker(pytest.mark.full)
            begun.add(function)
    places = {name: place for place, name in enumerate(LONG_FILES)}
    items.sort(key=lambda item: places.get(item.nodeid.partition("::")[0], len(places)))


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of a Chromium executable."""
    return require_program("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def ccx() -> str:
    """Path of CalculiX's solver."""
    return require_program("ccx")


@pytest.fixture(scope="session")
def c_compiler() -> str:
    """Path of a C compiler."""
    return require_program("cc", "gcc", "clang")
