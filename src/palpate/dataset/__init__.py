"""Answers of many solves: labelled arrays with units and provenance, kept in a Zarr store.

::

    dataset.py   Dataset: the frozen value, its arrays by name, its rows taken, split and joined
    schema.py    Field, Layout: the quantities that a solver answers, and the nodes that they belong to
    carried_surface.py  a body's own surface at full detail, bound to the elements on which solves are known
    assemble.py  inputs and answers, labelled and joined into a dataset
    histories.py  samples of histories, for a body with memory
    store.py     a dataset on disk, with a checksum
    dataset_tables.py  the same as CSV, Parquet and netCDF, for other tools
    measured/    forces measured on a specimen: text tables, and lines from a sensor
"""

from palpate.dataset.assemble import assemble
from palpate.dataset.dataset import Dataset
from palpate.dataset.histories import LoadHistory, histories_of, is_history
from palpate.dataset.schema import (
    BOOKKEEPING,
    Field,
    Layout,
    beam_fields,
    check_schema,
    conjugate_unit,
    solid_fields,
    with_bookkeeping,
)

__all__ = [
    "BOOKKEEPING",
    "Dataset",
    "Field",
    "Layout",
    "LoadHistory",
    "assemble",
    "beam_fields",
    "check_schema",
    "conjugate_unit",
    "histories_of",
    "is_history",
    "solid_fields",
    "with_bookkeeping",
]
