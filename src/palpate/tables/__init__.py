"""Tables of numbers with named columns: from files, and of other libraries in memory.

table         Table: columns with names and units, and rows of cells; read_table, the one reader
table_text    bytes of a file as text
table_layout  rows of cells, and the head of a text table; workbook: rows of an .xlsx file; labview: of an .lvm file
table_body    the readings among the rows: repeated heads and rows of statistics are left out
numerals      decimal marks, thousands, cells without a value
quantity_names  time, force, strain, … by the names that testing machines give their columns
unit_names    names and units in a head, SI units
frames        tables of pandas, Polars, PyArrow, NumPy records and mappings as arrays, their columns matched by name
"""

from palpate.tables.frames import column_names, columns_in_order, numbers_of
from palpate.tables.quantity_names import NamedQuantity, named_quantity
from palpate.tables.table import Column, Table, read_table
from palpate.tables.unit_names import plain_unit

__all__ = [
    "Column",
    "NamedQuantity",
    "Table",
    "column_names",
    "columns_in_order",
    "named_quantity",
    "numbers_of",
    "plain_unit",
    "read_table",
]
