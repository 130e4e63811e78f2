"""Fixtures shared by all tests."""

from __future__ import annotations

import os
import signal

import pytest
from hypothesis import settings

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
