"""The folder of an experiment, in the manner of BIDS behaviour data: one table a sitting, with what each column means.

::

    NAME/
      derivatives/               pictures of the analysis, drawn anew each time
      dataset_description.json   plan.toml   participants.tsv   participants.json
      task-NAME_events.json      meaning, unit and levels of every column
      stimuli/                   the bodies that were felt
      sub-01/beh/
        sub-01_task-NAME_run-01_events.tsv    one row a trial, appended and synchronised when it is answered
        sub-01_task-NAME_run-01_beh.json      device, software, checksums of plan and bodies
        sub-01_task-NAME_run-01_notes.tsv     notes of the experimenter
        sub-01_task-NAME_run-01_trial-007_interval-1.trace    every tick of a touch, for `palpate replay`

Nothing but the pictures is ever overwritten. Labels are letters and digits; nothing that identifies a person is asked.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import io
import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from palpate.errors import FileFormatError, UsageError
from palpate.experiments.append_record import hold_file
from palpate.experiments.experiment_plan import Plan, read_plan
from palpate.files import system_errors, write_file

__all__ = ["Participant", "SittingFiles", "StudyFolder", "append_row", "checksum", "read_table"]

MISSING = "n/a"

COLUMNS: dict[str, dict[str, Any]] = {
    "onset": {"Description": "Begin of the trial, from the start of this part of the sitting", "Units": "s"},
    "duration": {"Description": "Time from then to the answer", "Units": "s"},
    "part": {"Description": "Part of the sitting: it is one more after each interruption"},
    "trial": {"Description": "Number of the trial, practice included"},
    "kind": {
        "Description": "Kind of trial",
        "Levels": {
            "practice": "with feedback, not counted",
            "trial": "counted",
            "catch": "obvious, tells whether a person attends, not counted",
        },
    },
    "condition": {"Description": "Name of the body that was compared with the reference"},
    "level": {"Description": "Level x of the stimulus: ln of the ratio, of its logarithm, or of the value"},
    "value": {"Description": "Ratio to the reference, or value of the varied input in its SI unit"},
    "intervals": {"Description": "Bodies in the order in which they were felt"},
    "response": {"Description": "Interval that was named, from 1"},
    "correct": {"Description": "1 for the right answer, 0 for another"},
    "response_time": {"Description": "Time from the question to the answer", "Units": "s"},
    "presses": {"Description": "Number of presses in each interval"},
    "peak_force": {"Description": "Largest force in each interval", "Units": "N"},
    "peak_depth": {"Description": "Largest depth in each interval", "Units": "m"},
    "limits_hit": {"Description": "1 where the limit of force acted in the trial"},
    "clock_jump": {
        "Description": "Jump of the machine's clock since the answer before; times don't use it",
        "Units": "s",
    },
    "recordings": {"Description": "Files with every tick of each interval, beside this table"},
}

PEOPLE = {
    "participant_id": {"Description": "Label; nothing that identifies a person"},
    "age_band": {"Description": "Band of ten years, such as 20-29"},
    "hand": {"Description": "Hand that touched", "Levels": {"left": "", "right": "", "both": ""}},
    "expertise": {"Description": "Experience with palpation, as the experimenter defines it"},
}


class Participant:
    """A participant's label and the few facts that are kept."""

    def __init__(
        self, label: str, age_band: str = MISSING, hand: str = MISSING, expertise: str = MISSING
    ) -> None:
        own = label.removeprefix("sub-")
        if not re.fullmatch(r"[A-Za-z0-9]+", own):
            raise UsageError(
                f"{label!r} is no label of a participant.",
                why="A label is letters and digits, and says nothing of who the person is.",
                fix="Number the participants: sub-01, sub-02, …",
            )
        self.label = f"sub-{own}"
        self.facts = {"age_band": age_band, "hand": hand, "expertise": expertise}


class StudyFolder:
    """The folder of a plan: made by its first sitting, and held to that plan from then on."""

    def __init__(self, root: Path, plan: Plan) -> None:
        self.root, self.plan = root, plan

    @classmethod
    def beside(cls, plan_file: Path) -> StudyFolder:
        """Return the folder beside a plan's file."""
        plan = read_plan(plan_file)
        return cls(plan_file.parent / plan.name, plan)

    def prepare(self, plan_file: Path) -> None:
        """Make the folder with its descriptions; a plan that has changed since the first sitting is refused."""
        self.require_plan(plan_file)
        if (self.root / "plan.toml").exists():
            return
        self._require_own()
        with system_errors(f"Could not write {self.root}."):
            (self.root / "stimuli").mkdir(parents=True, exist_ok=True)
        from palpate.version import __version__

        described = {
            "Name": self.plan.name,
            "BIDSVersion": "1.10.0",
            "DatasetType": "raw",
            "GeneratedBy": [{"Name": "palpate", "Version": __version__}],
        }
        write_file(self.root / "dataset_description.json", _json(described))
        write_file(self.root / "participants.json", _json(PEOPLE))
        write_file(self.root / f"task-{self.plan.name}_events.json", _json(self.columns))
        write_file(self.root / "participants.tsv", "\t".join(PEOPLE) + "\n")
        write_file(self.root / "plan.toml", plan_file.read_bytes())

    def require_plan(self, plan_file: Path) -> None:
        """Refuse a plan that has changed since the first sitting."""
        kept = self.root / "plan.toml"
        if kept.exists() and kept.read_bytes() != plan_file.read_bytes():
            raise UsageError(
                f"{plan_file} has changed since the first sitting.",
                why=f"All sittings of an experiment follow one plan; {kept} is the one they began with.",
                fix="Put the plan back, or give the changed one another name.",
            )

    def _require_own(self) -> None:
        """Refuse a folder without a plan that holds something else than an earlier start has left."""
        own = {"stimuli", "dataset_description.json", "participants.json"}
        own.add(f"task-{self.plan.name}_events.json")
        table = self.root / "participants.tsv"
        if not (table.exists() and read_table(table)):
            own.add(table.name)
        there = {p.name for p in self.root.glob("[!.]*")}
        if others := sorted(there - own):
            raise UsageError(
                f"{self.root} is there already, and is no experiment's folder.",
                why=f"It holds {', '.join(others[:3])}, and nothing is ever overwritten.",
                fix="Give the plan another name.",
            )

    @property
    def columns(self) -> dict[str, dict[str, Any]]:
        """Meaning of each column of a table of trials."""
        levels = {str(k): "" for k in range(1, 8)}
        rated = {r.name: {"Description": r.text, "Levels": levels} for r in self.plan.rating}
        return COLUMNS | rated

    @property
    def pictures(self) -> tuple[Path, Path]:
        """The picture of the analysis as SVG and PNG; it shows each person."""
        stem = self.root / "derivatives" / f"task-{self.plan.name}_psychometric"
        return stem.with_suffix(".svg"), stem.with_suffix(".png")

    def enrol(self, participant: Participant) -> None:
        """Add a participant to the table, unless they are in it."""
        table = self.root / "participants.tsv"
        if participant.label not in {row["participant_id"] for row in read_table(table)}:
            append_row(table, [participant.label, *participant.facts.values()])

    def people(self) -> list[str]:
        """Return the labels of all who have a folder."""
        return sorted(p.name for p in self.root.glob("sub-*") if p.is_dir())

    def tables(self) -> Iterator[tuple[str, Path]]:
        """Yield label and table of each sitting."""
        for path in sorted(self.root.glob("sub-*/beh/*_events.tsv")):
            yield path.name.partition("_")[0], path

    def sitting(self, participant: Participant, run: int) -> SittingFiles:
        """Return the files of a sitting; a label that another one equals but for its case is refused."""
        if alike := {p for p in self.people() if p.lower() == participant.label.lower()} - {
            participant.label
        }:
            raise UsageError(
                f"{participant.label} and {min(alike)} differ by their case alone.",
                why="Some file systems take them for one person.",
                fix="Number the participants: sub-01, sub-02, …",
            )
        folder = self.root / participant.label / "beh"
        with system_errors(f"Could not write {folder}."):
            folder.mkdir(parents=True, exist_ok=True)
        return SittingFiles(
            folder, f"{participant.label}_task-{self.plan.name}_run-{run:02d}", tuple(self.columns)
        )

    def forget(self, participant: Participant) -> int:
        """Remove a person's folder, their row, and the pictures, which show them; return how many files they had.

        Who isn't there is refused.
        """
        folder, table = self.root / participant.label, self.root / "participants.tsv"
        rows = read_table(table) if table.exists() else []
        known = [row for row in rows if row["participant_id"] != participant.label]
        if not folder.exists() and len(known) == len(rows):
            raise UsageError(
                f"{participant.label} is not in {self.root}.",
                why=f"It holds {', '.join(self.people()) or 'nobody'}.",
                fix="Name one of them.",
            )
        _require_free(folder)
        count = sum(1 for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))
        with system_errors(f"Could not remove {folder}."):
            for picture in self.pictures:
                picture.unlink(missing_ok=True)
            if folder.exists():
                shutil.rmtree(folder)
        lines = ["\t".join(PEOPLE), *("\t".join(row[k] for k in PEOPLE) for row in known)]
        write_file(table, "\n".join(lines) + "\n")
        return count


class SittingFiles:
    """The files of one sitting: rows are appended, and are on the disk when `append` returns."""

    def __init__(self, folder: Path, stem: str, columns: tuple[str, ...]) -> None:
        self.folder, self.stem, self._columns = folder, stem, columns
        self.table = folder / f"{stem}_events.tsv"

    def rows(self) -> list[dict[str, str]]:
        """Return the rows so far; a last line that a kill has cut off is left out, and removed from the file."""
        if not self.table.exists():
            return []
        text = self.table.read_text("utf-8")
        if not text.endswith("\n"):
            whole = text[: text.rfind("\n") + 1]
            with self.table.open("r+b") as file:
                file.truncate(len(whole.encode()))
        return read_table(self.table)

    def append(self, row: Mapping[str, Any]) -> None:
        """Append a row."""
        if not self.table.exists() or not self.table.stat().st_size:
            append_row(self.table, list(self._columns))
        append_row(self.table, [row.get(name, MISSING) for name in self._columns])

    def note(self, text: str, trial: int) -> None:
        """Append a note of the experimenter."""
        path = self.folder / f"{self.stem}_notes.tsv"
        if not path.exists():
            append_row(path, ["time", "trial", "note"])
        append_row(path, [datetime.now(UTC).isoformat(timespec="seconds"), trial, text])

    def describe(self, facts: Mapping[str, Any]) -> None:
        """Write down device, software and checksums; a later part of the sitting adds its own file."""
        number = 1
        while (path := self.folder / f"{self.stem}_part-{number:02d}_beh.json").exists():
            number += 1
        write_file(path, _json(dict(facts)))

    def recording(self, trial: int, interval: int) -> Path:
        """Return a new file for a touch; of an attempt that was interrupted, the file stays, under another name."""
        for attempt in range(1, 1000):
            again = "" if attempt == 1 else f"_attempt-{attempt}"
            path = self.folder / f"{self.stem}_trial-{trial:03d}_interval-{interval}{again}.trace"
            if not path.exists():
                return path
        raise UsageError(f"Trial {trial} was begun a thousand times.", fix="See what interrupts it.")

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Hold the sitting: no other process goes on with it meanwhile. A killed process lets go by itself."""
        path = self.folder / f".{self.stem}.lock"
        with system_errors(f"Could not write {path}."):
            file = path.open("ab")
        with file:
            if not hold_file(file):
                raise UsageError(
                    f"The sitting {self.stem} is being run by another process.",
                    fix="Go on there, or end it first.",
                )
            yield  # the file stays: one that is removed here could be locked by two at once


def _require_free(folder: Path) -> None:
    """Refuse to go on where another process runs a sitting in a person's folder."""
    for path in folder.glob("beh/.*.lock"):
        with path.open("ab") as file:
            if not hold_file(file):
                raise UsageError(
                    f"A sitting of {folder.name} is being run.",
                    why="It would write down more.",
                    fix="End it first.",
                )


def append_row(path: Path, cells: list[Any]) -> None:
    """Append a line of a table, and wait until it is on the disk."""
    line = "\t".join(re.sub(r"[\t\r\n]+", " ", str(cell)) for cell in cells) + "\n"
    with system_errors(f"Could not write {path}."), path.open("ab") as file:
        file.write(line.encode())
        file.flush()
        os.fsync(file.fileno())


def read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table by column."""
    with system_errors(f"Could not read {path}."):
        text = path.read_text("utf-8")
    rows = list(csv.DictReader(io.StringIO(text), delimiter="\t", quoting=csv.QUOTE_NONE))
    if rows and not text.endswith("\n") and None in rows[-1].values():
        del rows[-1]  # a kill has cut it off
    if any(None in row or None in row.values() for row in rows):
        raise FileFormatError(
            f"{path} has a line with too few or too many columns.",
            fix="See whether another program changed it.",
        )
    return rows


def checksum(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"
