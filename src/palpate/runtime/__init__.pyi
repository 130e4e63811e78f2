"""Public names of `palpate.runtime`, each loaded when it is first used."""

from .faults import Fault as Fault
from .process import LoopProcess as LoopProcess
from .report import LoopReport as LoopReport
from .shared import Shared as Shared
from .shared import State as State
from .shared import now as now
from .workspace import Workspace as Workspace
