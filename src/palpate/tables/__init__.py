"""Tables of numbers with named columns: from files, and of other libraries in memory.

table         Table: columns with names and units, and rows of cells; read_table, the one reader
table_text    bytes of a file as text
table_layout  rows of cells, head and data of a text table; workbook: rows of an .xlsx file
numerals      decimal marks, thousands, cells without a value
unit_names    names and units in a head, SI units
frames        tables of pandas, Polars, PyArrow, NumPy records and mappings as arrays, their columns matched by name
"""

from palpate.tables.frames import column_names, columns_in_order, numbers_of
from palpate.tables.table import Column, Table, read_table
from palpate.tables.unit_names import plain_unit

__all__ = [
    "Column",
    "Table",
    "column_names",
    "columns_in_order",
    "numbers_of",
    "plain_unit",
    "read_table",
]
