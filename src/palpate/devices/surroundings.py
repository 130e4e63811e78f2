"""The machine that is searched for devices: its files, ports, sockets and packages, as a test can lay them out."""

from __future__ import annotations

import importlib.util
import os
import socket
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Surroundings"]

_ANSWER = 0.2  # s that a port of this machine may take to answer


def _port_answers(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), _ANSWER):
            return True
    except OSError:
        return False


def _socket_answers(path: Path) -> bool:
    try:
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(path))
            return True
    except (AttributeError, OSError):  # a system without such sockets, or nothing that listens
        return False


def _is_installed(package: str) -> bool:
    return importlib.util.find_spec(package) is not None


@dataclass(frozen=True)
class Surroundings:
    """The machine that is searched; a test lays out one of its own."""

    root: Path = Path("/")  # folder below which absolute paths are looked up
    environment: Mapping[str, str] = field(default_factory=lambda: os.environ)
    platform: str = sys.platform  # linux, darwin or win32
    answers: Callable[[str, int], bool] = _port_answers  # does something listen on a host's port
    installed: Callable[[str], bool] = _is_installed  # is a package of Python there, by its name
    listens: Callable[[Path], bool] = _socket_answers  # does something listen at a Unix socket

    def place(self, path: str) -> Path:
        """Return where an absolute path lies below the root."""
        if self.root == Path("/"):
            return Path(path)
        return self.root / path.lstrip("/")

    def text(self, path: str) -> str:
        """Return the text of a file at an absolute path; empty where it can't be read."""
        try:
            return self.place(path).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""
