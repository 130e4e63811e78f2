"""Options, printing, and the blocks of docs/benchmarks.md."""

from __future__ import annotations

import argparse
import importlib
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from rich.console import Console
from threadpoolctl import threadpool_limits

from benchmarks.machine import machine_line, machine_record
from benchmarks.table import Table

__all__ = ["BENCHMARKS", "Benchmark", "main"]

BENCHMARKS = (
    "active_choice",
    "cantilever",
    "cold_start",
    "device_round_trips",
    "export_speed",
    "faults",
    "few_rows",
    "filters",
    "hand_drives",
    "latency",
    "literature",
    "online",
    "page_speed",
    "peers",
    "punctuality",
    "refinement",
    "runtime",
    "scale",
    "stability",
    "streams",
    "surrogates",
    "sweep",
    "touching",
    "touching_cost",
    "touching_feel",
    "touching_mesh",
    "trust",
)


class Benchmark(Protocol):
    """What each module of `BENCHMARKS` offers."""

    def tables(self, *, quick: bool) -> list[Table]:
        """Measure; `quick` only checks that it can be done."""


def main(arguments: Sequence[str] | None = None, *, only: str | None = None) -> int:
    """Run benchmarks and print their tables.

    Parameters
    ----------
    arguments : sequence of str, optional
        Of the command line by default.
    only : str, optional
        The one benchmark to run.

    Returns
    -------
    int
        Exit status; a claim that is missed is printed, and no failure.
    """
    options = _parser(only).parse_args(arguments)
    names = [only] if only else (options.only or list(BENCHMARKS))
    tables: list[Table] = []
    console = Console(width=None if sys.stdout.isatty() else 180)
    with threadpool_limits(1):  # as in palpate's own learning and loop
        for name in names:
            print(f"{name} …", file=sys.stderr, flush=True)
            studies = {"studies": options.study} if name == "surrogates" and options.study else {}
            found = importlib.import_module(f"benchmarks.{name}").tables(quick=options.quick, **studies)
            tables += found
            if not (options.json or options.markdown):
                for table in found:
                    table.show(console)
    if options.json:
        print(json.dumps({"machine": machine_record(), "tables": [t.plain() for t in tables]}, indent=2))
    elif options.markdown:
        print("\n\n".join(_block(table) for table in tables))
    else:
        console.print(machine_line(), highlight=False, soft_wrap=True)
    if options.into:
        _replace(options.into, tables)
    return 0


def _parser(only: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks{f'.{only}' if only else ''}")
    parser.add_argument("--quick", action="store_true", help="few seeds and repetitions: is it able to run?")
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument("--json", action="store_true", help="numbers for machines")
    shape.add_argument("--markdown", action="store_true", help="the blocks of docs/benchmarks.md")
    parser.add_argument("--into", type=Path, metavar="FILE", help="replace the blocks in this Markdown file")
    if only in {None, "surrogates"}:
        parser.add_argument(
            "--study",
            nargs="+",
            metavar="NAME",
            help="of the surrogates: some of the studies, query or relaxation",
        )
    else:
        parser.set_defaults(study=None)
    if only is None:
        parser.add_argument("--only", nargs="+", choices=BENCHMARKS, help="some of them")
    return parser


def _block(table: Table) -> str:
    return f"{_begin(table)}\n{table.markdown()}\n\n*{machine_line()}*\n{_end(table)}"


def _begin(table: Table) -> str:
    return f"<!-- benchmark {table.name}: begin -->"


def _end(table: Table) -> str:
    return f"<!-- benchmark {table.name}: end -->"


def _replace(path: Path, tables: Sequence[Table]) -> None:
    text = path.read_text(encoding="utf-8")
    for table in tables:
        pattern = re.compile(re.escape(_begin(table)) + ".*?" + re.escape(_end(table)), re.DOTALL)
        if not pattern.search(text):
            print(f"{path} has no block for {table.name}", file=sys.stderr)
        block = _block(table)
        text = pattern.sub(lambda _, block=block: block, text)
    path.write_text(text, encoding="utf-8")
