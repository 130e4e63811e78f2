"""Public names of `palpate.validation`, each loaded when it is first used."""

from .limits import Check as Check
from .limits import Limits as Limits
from .report import Chapter as Chapter
from .report import write_report as write_report
from .unseen_solves import TouchFunction as TouchFunction
from .unseen_solves import TouchSolves as TouchSolves
from .validate import Validation as Validation
from .validate import validate as validate
