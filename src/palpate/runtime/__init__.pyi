"""Public names of `palpate.runtime`, each loaded when it is first used."""

from .loop_report import LoopReport as LoopReport
from .process import LoopProcess as LoopProcess
from .safety import Fault as Fault
from .shared_state import Shared as Shared
from .shared_state import State as State
from .shared_state import now as now
from .workspace import Workspace as Workspace
