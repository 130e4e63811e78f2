"""Forces measured on a specimen: from tables and from a live sensor.

measured_columns   Measured: N measurements in SI units; the columns and units that make one
measured_table     tables with units, read and written
live               lines of text from a pipe or a TCP connection, and the line protocol
"""

from palpate.dataset.measured.live import Connection, lines_of, listening, measurements
from palpate.dataset.measured.measured_columns import Measured
from palpate.dataset.measured.measured_table import read_measured, write_measured

__all__ = [
    "Connection",
    "Measured",
    "lines_of",
    "listening",
    "measurements",
    "read_measured",
    "write_measured",
]
