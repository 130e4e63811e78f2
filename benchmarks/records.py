"""Tables of record: one JSON file each in benchmarks/records, and the blocks of the documentation made from them.

python -m benchmarks --record           measures, writes the records, and renews the blocks
python -m benchmarks.records            renews the blocks alone
python -m benchmarks.records NAME …     prints records whole
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.machine import machine_line
from benchmarks.table import Table

__all__ = ["DOCS", "RECORDS", "Record", "pages", "renew", "renewed"]

ROOT = Path(__file__).parents[1]
RECORDS, DOCS = ROOT / "benchmarks" / "records", ROOT / "docs"
_BLOCK = re.compile(r"<!-- benchmark (\S+): begin -->\n.*?<!-- benchmark \1: end -->", re.DOTALL)


@dataclass(frozen=True)
class Record:
    """A table as it was measured: every cell as it is printed, each bound with whether it was kept, and the machine."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    claims: tuple[str, ...]  # each begins with "met" where it was kept in all cases
    notes: tuple[str, ...]
    machine: str  # date; processor (load); system; versions

    @classmethod
    def of(cls, table: Table) -> Record:
        """Return the record of a table that this machine has just measured."""
        return cls(
            table.title,
            tuple(column.title for column in table.columns),
            tuple(tuple(column.text(row) for column in table.columns) for row in table.rows),
            tuple(map(str, table.claims)),
            tuple(table.notes),
            machine_line(),
        )

    @classmethod
    def read(cls, name: str, folder: Path = RECORDS) -> Record:
        """Read the record of a table."""
        plain = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        rows = tuple(tuple(row) for row in plain.pop("rows"))
        return cls(rows=rows, **{k: tuple(v) if isinstance(v, list) else v for k, v in plain.items()})

    def write(self, name: str, folder: Path = RECORDS) -> Path:
        """Write it, a line for each row of the table."""
        folder.mkdir(exist_ok=True)
        plain = {**asdict(self), "rows": "@"}
        rows = ",\n".join(f"    {json.dumps(row, ensure_ascii=False)}" for row in self.rows)
        text = json.dumps(plain, ensure_ascii=False, indent=2).replace('"@"', f"[\n{rows}\n  ]")
        path = folder / f"{name}.json"
        path.write_text(text + "\n", encoding="utf-8")
        return path

    def markdown(self) -> str:
        """Return all of it as Markdown."""
        lines = [f"- {line}" for line in (*self.claims, *self.notes)]
        return "\n".join([self._table(), "", *lines, "", f"*{self.machine}*"])

    def block(self, name: str) -> str:
        """Return the block of the documentation: the table, how many bounds were kept and which were not, the notes."""
        kept = [claim for claim in self.claims if claim.startswith("met:") or claim.startswith("met on all")]
        missed = [claim for claim in self.claims if claim not in kept]
        of = f"{len(kept)} of {len(self.claims)}" if missed else f"All {len(kept)}"
        counted = [f"{of} bounds that were set beforehand are kept."] if len(self.claims) > 1 else kept
        lines = [f"- {line}" for line in (*(counted if self.claims else ()), *missed, *self.notes)]
        when, processor, *_ = self.machine.split("; ")
        begin, end = (f"<!-- benchmark {name}: {edge} -->" for edge in ("begin", "end"))
        source = f"*{when}, {processor}; `benchmarks/records/{name}.json`*"
        return "\n".join([begin, self._table(), "", *lines, "", source, end])

    def _table(self) -> str:
        rule = "|" + "|".join(["---"] + ["--:"] * (len(self.columns) - 1)) + "|"
        rows = ("| " + " | ".join(row) + " |" for row in (self.columns, *self.rows))
        return "\n".join([f"**{self.title}**", "", next(rows), rule, *rows])


def pages(docs: Path = DOCS) -> Iterator[Path]:
    """Yield the pages of the documentation that have blocks."""
    return (page for page in sorted(docs.rglob("*.md")) if _BLOCK.search(page.read_text(encoding="utf-8")))


def renewed(text: str, folder: Path = RECORDS) -> str:
    """The page's text with each block made anew from its record."""
    return _BLOCK.sub(lambda block: Record.read(block[1], folder).block(block[1]), text)


def renew() -> None:
    """Make all blocks of the documentation anew."""
    for page in pages():
        page.write_text(renewed(page.read_text(encoding="utf-8")), encoding="utf-8")


def main(names: list[str]) -> int:
    """Print the named records, or renew the pages."""
    for name in names:
        print(Record.read(name).markdown(), end="\n\n")
    if not names:
        renew()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
