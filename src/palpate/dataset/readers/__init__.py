"""Results of other solvers, read and made into datasets: one file for each format.

results         the value that every reader returns, and how several files are joined
formats         the formats, and the one door to all of them
comsol, calculix_frd, calculix_dat, vtk_files, array_files, text_tables   the readers, and
abaqus_report, abaqus_odb, febio_records, solver_meshes
odb_to_npz      a script for Abaqus's own Python, which writes what abaqus_odb asks for
case_results    the results of one solve
mapping         which columns are inputs, outputs and coordinates
column_choice   columns found by name, reduced and converted
import_results  all of it made into a dataset
"""

from palpate.dataset.readers.formats import FORMATS, Format, read_results
from palpate.dataset.readers.import_results import Imported, import_results
from palpate.dataset.readers.mapping import ImportMapping, read_mapping
from palpate.dataset.readers.results import Places, Results

__all__ = [
    "FORMATS",
    "Format",
    "ImportMapping",
    "Imported",
    "Places",
    "Results",
    "import_results",
    "read_mapping",
    "read_results",
]
