"""Measured indentation: from tables and from a live sensor.

units     what its numbers may come in        columns   what makes a measurement
record    arrays in SI units                  table     text tables with units
lines     a line protocol                     live      lines from a pipe or from a TCP connection
"""

from palpate.dataset.measured.lines import measurements
from palpate.dataset.measured.live import Connection, lines_of, listening
from palpate.dataset.measured.record import Measured
from palpate.dataset.measured.table import read_measured, write_measured

__all__ = [
    "Connection",
    "Measured",
    "lines_of",
    "listening",
    "measurements",
    "read_measured",
    "write_measured",
]
