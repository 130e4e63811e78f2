"""Study: the whole pipeline, from body to touch, as one declared, frozen record.

models     what a study says, checked when it is read (pydantic)
text       the record as TOML, with comments, and back
presets    studies that have a name
pipeline   a study carried out: sweep, learn, validate, report
"""

from palpate.study.models import Study
from palpate.study.presets import named, preset_names, preset_study
from palpate.study.text import read_study, study_schema, to_toml

__all__ = ["Study", "named", "preset_names", "preset_study", "read_study", "study_schema", "to_toml"]
