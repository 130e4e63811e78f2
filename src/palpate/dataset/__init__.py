"""Keeping the answers of a sweep: labelled arrays with units and provenance, in a Zarr store.

::

    fields.py     Field: one quantity that each solve answers; schemas of beams and solids
    layout.py     Layout: nodes at rest, axes, surface
    assemble.py   inputs and answers → a labelled dataset
    dataset.py    Dataset: the frozen value
    named.py      its arrays by name
    words.py      a dataset in words
    join.py       the rows of several datasets as one
    store.py      on disk, with a checksum
"""

from palpate.dataset.assemble import assemble
from palpate.dataset.dataset import Dataset
from palpate.dataset.fields import Field, beam_fields, conjugate_unit, solid_fields
from palpate.dataset.layout import Layout

__all__ = ["Dataset", "Field", "Layout", "assemble", "beam_fields", "conjugate_unit", "solid_fields"]
