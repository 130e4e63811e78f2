"""Study: the whole way, from the body to the touch, as one declared, frozen record.

study                the record: a body, what acts on it, and the tables of its stages
body_records         `[body]`
loads_kind, probe_kind, tool_kind, pinch_kind, pad_kind, memory_kind   what acts on it, with its tables
material_records     materials         part_records          `[body]` of a part, and names for its surfaces
stage_records        the registry of the tables of each kind, and what several kinds share; `[runtime]`
interaction_records  what acts on a surface, and `[[varied]]`
quantities           frozen tables with quantities that may carry units
toml                 the record as a TOML file with comments, and back
named_studies        studies that have a name
part_study           study of a part that the user has, and region_choices its materials and labels as they are typed
study_lock           one command at a time for the files of a study
run                  the stages: sweep, load the data, learn, validate, report
improve_study        a study whose solves are chosen batch by batch, until a force error is reached
part_work            the work behind the page of `palpate touch`, in a process of its own
solver_study         study of another program's solver, `[solver]`, and solver_sweep its sweep
study_advice         number of solves that would keep the limits
"""

from palpate.study.named_studies import preset_names, preset_study
from palpate.study.study import Study
from palpate.study.toml import read_study, study_schema, to_toml

__all__ = ["Study", "preset_names", "preset_study", "read_study", "study_schema", "to_toml"]
