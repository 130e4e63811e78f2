"""Study: the whole pipeline, from body to touch, as one declared, frozen record.

record     what the records of all studies are made of (pydantic)
models     what a study of a beam says, checked when it is read
touching   studies of solid bodies that a probe presses
held       studies of beams that remember
text       the record as TOML, with comments, and back
presets    studies that have a name
stages     what each kind of study does at each stage (beams, touching.stages, held.stages)
pipeline   a study carried out: sweep, learn, validate, report
"""

from palpate.study.held import HeldStudy
from palpate.study.models import Study
from palpate.study.presets import named, preset_names, preset_study
from palpate.study.text import read_study, study_schema, to_toml
from palpate.study.touching import TouchStudy

__all__ = [
    "HeldStudy",
    "Study",
    "TouchStudy",
    "named",
    "preset_names",
    "preset_study",
    "read_study",
    "study_schema",
    "to_toml",
]
