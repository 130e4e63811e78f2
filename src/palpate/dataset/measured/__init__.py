"""Forces measured on a specimen: from tables and from a live sensor.

measured_columns   Measurements: N measurements in SI units; the columns and units that make one
measured_table     tables with units, read and written
live               lines of text from a pipe or a TCP connection, and the line protocol
sensor_port        the TCP port, and the token that a sensor shows there
"""

from palpate.dataset.measured.live import Connection, lines_of, measurements
from palpate.dataset.measured.measured_columns import Measurements
from palpate.dataset.measured.measured_table import read_measurements, write_measurements
from palpate.dataset.measured.sensor_port import listening

__all__ = [
    "Connection",
    "Measurements",
    "lines_of",
    "listening",
    "measurements",
    "read_measurements",
    "write_measurements",
]
