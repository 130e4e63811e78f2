"""Public names of `palpate.validation`, each loaded when it is first used."""

from .dispatch import validate as validate
from .held import HeldLimits as HeldLimits
from .held import HeldValidation as HeldValidation
from .held import validate_held as validate_held
from .limits import Check as Check
from .limits import Limits as Limits
from .report import Chapter as Chapter
from .report import HeldChapter as HeldChapter
from .report import SurrogateChapter as SurrogateChapter
from .report import write_report as write_report
from .result import Validation as Validation
from .solves import TouchFunction as TouchFunction
from .solves import TouchSolves as TouchSolves
from .surrogate import SurrogateValidation as SurrogateValidation
