"""The study: a body, what acts on it, and everything that is done with them, as one frozen record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias

from pydantic import Field, ValidationError, ValidationInfo, field_validator, model_validator

from palpate.errors import UsageError
from palpate.learning import FEWEST
from palpate.physics import BodyFamily, Varied
from palpate.record_complaints import complaints
from palpate.records import Record
from palpate.study.body_records import BodyRecord, CantileverRecord
from palpate.study.interaction_records import VariedRecord
from palpate.study.loads_kind import (
    FilterRecord,
    LoadLearningRecord,
    LoadsRecord,
    LoadSweepRecord,
    LoadTargetRecord,
    LoadTestRecord,
)
from palpate.study.memory_kind import HistoryTargetRecord, MemoryRecord
from palpate.study.pad_kind import PadRecord, PadSweepRecord, PadTestRecord
from palpate.study.pinch_kind import PinchRecord
from palpate.study.probe_kind import ProbeLearningRecord, ProbeRecord, ProbeSweepRecord, ProbeTestRecord
from palpate.study.stage_records import (
    SECTIONS,
    EnergyLearningRecord,
    PressSweepRecord,
    RuntimeRecord,
    TouchTargetRecord,
)
from palpate.study.tool_kind import ToolRecord, ToolSweepRecord

__all__ = ["InteractionRecord", "Study"]

_TABLES = ("sweep", "test", "filter", "learning", "target")

InteractionRecord: TypeAlias = LoadsRecord | ProbeRecord | ToolRecord | PinchRecord | PadRecord
Sweep: TypeAlias = LoadSweepRecord | ProbeSweepRecord | ToolSweepRecord | PadSweepRecord
Test: TypeAlias = LoadTestRecord | ProbeTestRecord | PadTestRecord
Learning: TypeAlias = LoadLearningRecord | ProbeLearningRecord | EnergyLearningRecord
Target: TypeAlias = LoadTargetRecord | TouchTargetRecord | HistoryTargetRecord


class Study(Record):
    """A body, what acts on it, and everything that is done with them.

    `interaction` decides which keys `sweep`, `test`, `filter`, `learning` and `target` have; with `memory` the body
    follows histories of its load, and only `target` is left of these. Parts that a study has not are None.
    """

    name: str = Field(
        "beam-nylon", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="files are named after it"
    )
    body: Annotated[BodyRecord, Field(discriminator="kind")] = CantileverRecord()
    interaction: Annotated[InteractionRecord, Field(discriminator="kind")]
    memory: MemoryRecord | None = None
    varied: tuple[VariedRecord, ...] = Field((), description="what makes a family of bodies, if anything")
    sweep: Sweep | None = None
    test: Test | None = None
    filter: FilterRecord | None = None
    learning: Learning | None = None
    target: Target | None = None
    runtime: RuntimeRecord = RuntimeRecord()

    @model_validator(mode="before")
    @classmethod
    def _kinds_by_default(cls, content: Any) -> Any:
        """Return the content with the kinds of its body and its interaction, which may be left out."""
        if not isinstance(content, Mapping):
            return content
        content = dict(content)
        body = content.setdefault("body", {})
        if isinstance(body, Mapping):
            content["body"] = body = {"kind": "cantilever", **body}
        acting = content.setdefault("interaction", {})
        if isinstance(acting, Mapping) and isinstance(body, Mapping):
            usual = "loads" if body["kind"] == "cantilever" else "probe"
            content["interaction"] = acting = {"kind": usual, **acting}
        # what the tables of the stages are depends on it, even where the interaction itself has mistakes
        kind = acting.get("kind") if isinstance(acting, Mapping) else getattr(acting, "kind", "")
        if content.get("memory") is not None:
            kind = "memory"
        return content | {name: (str(kind), content.get(name)) for name in _TABLES}

    @field_validator(*_TABLES, mode="before")
    @classmethod
    def _table_of_its_kind(cls, tagged: tuple[str, Any], info: ValidationInfo) -> Any:
        """Return the record that the kind of interaction asks for, in place of that kind and a table."""
        kind, value = tagged
        record = SECTIONS.get(kind, {}).get(info.field_name or "")
        if record is None:
            if value and kind in SECTIONS:
                what = "of a body with memory" if kind == "memory" else f"with the interaction {kind}"
                raise ValueError(f"a study {what} has no table [{info.field_name}]")
            return None
        return value if isinstance(value, record) else record.model_validate(value or {})

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Study:
        body, acting = self.body, self.interaction
        if acting.kind not in body.INTERACTIONS:
            raise ValueError(
                f"a {body.kind} takes the interaction {' or '.join(body.INTERACTIONS)}, not {acting.kind}"
            )
        if fault := acting.fault(body):
            raise ValueError(fault)
        pinched = isinstance(acting, PinchRecord)
        if self.runtime.friction and (pinched or not self.presses):
            state = "pinched by two jaws" if pinched else "held"
            raise ValueError(f"[runtime] friction is of a tool that slides on a body; this one is {state}")
        if self.varied and pinched:
            raise ValueError("nothing of a body that two jaws pinch can vary: make a study of each")
        remembers = self.memory is not None
        if body.has_memory and not remembers:
            raise ValueError(
                f"the material {_material_name(body)!r} remembers its history: give a table [memory]"
            )
        if remembers and not body.has_memory:
            material = _material_name(body)
            raise ValueError(f"[memory] is for materials that yield or creep, which {material!r} does not")
        if self.varied and not body.surface_names():
            raise ValueError(f"nothing of a {body.kind} can vary")
        paths = [item.path for item in self.varied]
        if len(set(paths)) < len(paths):
            raise ValueError(f"of {', '.join(paths)} one varies twice")
        self._check_memory()
        self._check_rows()
        return self

    def _check_memory(self) -> None:
        if self.memory is None:
            return
        loads: tuple[Any, ...] = getattr(self.interaction, "loads", ())
        if len(loads) != 1 or loads[0].at not in {None, getattr(self.body, "length", None)}:
            raise ValueError("a body with memory is learnt under one load, at its tip")

    def _check_rows(self) -> None:
        if not isinstance(self.test, LoadTestRecord) or self.sweep is None:
            return
        kept = self.sweep.samples // self.test.every if self.test.every else 0
        if self.sweep.samples - kept < FEWEST:
            raise ValueError(
                f"{self.sweep.samples - kept} solves are left for training; {FEWEST} are the fewest"
            )
        if not kept and not self.test.random:
            raise ValueError("test.every and test.random are both 0: nothing is kept for testing")

    @property
    def presses(self) -> bool:
        """True where a probe or a tool presses the body, which is else held."""
        return isinstance(self.sweep, PressSweepRecord)

    def problem(self, *, whole: bool = False) -> Any:
        """Return the problem to solve: the body, or a family of bodies, under what acts on it.

        Parameters
        ----------
        whole : bool
            Whether to act on all of the touched part; else on the part that symmetry leaves to be solved.
        """
        body: Any = self.body.build()
        element = self.sweep.element if self.sweep else None
        part = self.sweep is not None and self.sweep.symmetric and not whole
        # a tool judges its edge by the size of the elements
        edged = isinstance(self.interaction, ToolRecord | PinchRecord)
        sized: dict[str, Any] = {"element": element} if edged else {}
        acting = self.interaction.build(body, whole=not part, **sized)
        varied = tuple(Varied(v.path, v.low, v.high) for v in self.varied)
        family: Any = BodyFamily(body, varied) if varied else body
        return family.problem(acting, **({} if element is None else {"element": element}))

    def renamed(self, name: str) -> Study:
        """Return the study under another name.

        Raises
        ------
        UsageError
            If files can't have that name.
        """
        try:
            return Study.model_validate(self.model_dump() | {"name": name})
        except ValidationError as error:
            raise UsageError(
                f"{name!r} can't name a study and its files.",
                fix="Use letters, digits, dots, dashes and underscores, a letter or a digit first.",
            ) from error

    def with_samples(self, samples: int | None) -> Study:
        """Return the study with a number of solves to learn from; None: as the study says.

        Raises
        ------
        UsageError
            If the study has no such number, or it does not suit its design.
        """
        if samples is None:
            return self
        if self.sweep is None:
            raise UsageError(
                "The histories of this study are not counted by samples.",
                fix="Change `histories` in [memory], or leave --samples out.",
            )
        content = self.model_dump()
        content["sweep"]["samples"] = samples
        try:
            return Study.model_validate(content)
        except ValidationError as error:
            why = ". ".join(complaints(error, Study))
            raise UsageError(
                f"{samples} solves do not suit this study.", why=f"{why}.", fix="Give another number."
            ) from error

    def with_workers(self, workers: int | None) -> Study:
        """Return the study with a number of processes for its sweep and for learning; None: as the study says."""
        if workers is None:
            return self
        parts = {"sweep": self.sweep, "learning": self.learning}
        changed = {
            name: part.model_copy(update={"workers": workers})
            for name, part in parts.items()
            if part is not None and "workers" in type(part).model_fields
        }
        return self.model_copy(update=changed)


def _material_name(body: BodyRecord) -> str:
    material = getattr(body, "material", "")
    return material if isinstance(material, str) else material.name
