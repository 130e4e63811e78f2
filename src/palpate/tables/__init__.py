"""Tables of numbers with named columns: of other libraries in memory, and from files.

frames   tables of pandas, Polars, PyArrow, NumPy records and mappings as arrays, their columns matched by name
"""

from palpate.tables.frames import column_names, columns_in_order, numbers_of

__all__ = ["column_names", "columns_in_order", "numbers_of"]
