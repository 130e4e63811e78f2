"""What carries a study out, one set of stages for each kind of body. A new kind brings its record and its stages.

The rest, files, clusters, reports and commands, is the same for all kinds and lives in `pipeline`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from palpate.errors import UsageError
from palpate.study.held import HeldStudy
from palpate.study.models import Study
from palpate.study.paths import Paths
from palpate.study.touching import TouchStudy

if TYPE_CHECKING:
    from palpate.study.pipeline import Outcome

__all__ = ["AnyStudy", "Stages", "stages_of"]

AnyStudy: TypeAlias = Study | TouchStudy | HeldStudy
Rows: TypeAlias = Any
"""What was solved: a Dataset, or the HeldPaths of a body that remembers."""


class Stages(Protocol):
    """The stages between a study's record and its report; models, histories and judgements are the kind's own."""

    def swept(self, study: Any, paths: Paths | None, cluster: Any, progress: Any) -> tuple[Rows, Rows | None]:
        """Solves to learn from, and further ones for testing only."""

    def parted(self, study: Any, paths: Paths) -> tuple[Rows, Rows]:
        """Training and unseen rows of what lies in files, refused if they are of another study."""

    def train_and_test(self, study: Any, data: Rows, random: Rows | None) -> tuple[Rows, Rows]:
        """Training and unseen rows of a sweep."""

    def learnt(self, study: Any, train: Rows, test: Rows | None, progress: Any, say: Any) -> tuple[Any, Any]:
        """Model and history."""

    def validated(self, study: Any, model: Any, test: Rows, history: Any) -> Any:
        """Judgement on unseen rows, by the study's targets."""

    def judged(self, model: Any, validation: Any) -> Any:
        """The model with its errors written into it."""

    def rivals(self, study: Any, train: Rows, test: Rows, history: Any) -> dict[str, Any]:
        """Histories of others, to draw beside it."""

    def chapter(self, outcome: Outcome) -> Any:
        """The report's."""

    def save(self, paths: Paths, model: Any, history: Any) -> None:
        """Write model and history."""

    def load(self, paths: Paths, train: Rows) -> tuple[Any, Any]:
        """Read them back, refused if they were learnt from other rows."""

    def told(self, model: Any, validation: Any) -> tuple[str, dict[str, Any]]:
        """What `palpate learn` prints of it, as text and as data."""


def stages_of(study: AnyStudy) -> Stages:
    """The stages of a study's kind.

    Raises
    ------
    UsageError
        If it is no study.
    """
    if isinstance(study, TouchStudy):
        from palpate.study.touching.stages import TouchStages

        return TouchStages()
    if isinstance(study, Study):
        from palpate.study.beams import BeamStages

        return BeamStages()
    if isinstance(study, HeldStudy):
        from palpate.study.held.stages import HeldStages

        return HeldStages()
    raise UsageError(f"{type(study).__name__} is no study.", fix="Pass a Study, a TouchStudy or a HeldStudy.")
