"""Keeping the answers of a sweep: labelled arrays with units and provenance, in a Zarr store."""

from palpate.dataset.assemble import Layout, assemble
from palpate.dataset.dataset import Dataset

__all__ = ["Dataset", "Layout", "assemble"]
