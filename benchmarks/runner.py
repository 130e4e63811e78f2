"""Options and printing of the benchmarks, and their tables of record."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from rich.console import Console
from threadpoolctl import threadpool_limits

from benchmarks.machine import machine_line, machine_record
from benchmarks.records import RECORDS, Record, renew
from benchmarks.table import Table

__all__ = ["BENCHMARKS", "Benchmark", "main"]

BENCHMARKS = (
    "active_choice",
    "bracket",
    "cantilever",
    "cold_start",
    "device_round_trips",
    "experiment_plans",
    "export_speed",
    "faults",
    "few_rows",
    "filters",
    "find_lump",
    "hand_drives",
    "heated_plate",
    "latency",
    "literature",
    "many_cases",
    "mujoco_flex",
    "newton_balls",
    "online",
    "page_speed",
    "peers",
    "punctuality",
    "refinement",
    "runtime",
    "scale",
    "simulator_forces",
    "soft_bodies",
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
            if not options.json:
                for table in found:
                    table.show(console)
    if options.json:
        print(json.dumps({"machine": machine_record(), "tables": [t.plain() for t in tables]}, indent=2))
    else:
        console.print(machine_line(), highlight=False, soft_wrap=True)
    if options.record:
        for table in tables:
            Record.of(table).write(table.name, options.record)
        if options.record == RECORDS:
            renew()
    return 0


def _parser(only: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks{f'.{only}' if only else ''}")
    parser.add_argument("--quick", action="store_true", help="few seeds and repetitions: is it able to run?")
    parser.add_argument("--json", action="store_true", help="numbers for machines")
    parser.add_argument(
        "--record",
        nargs="?",
        type=Path,
        const=RECORDS,
        metavar="FOLDER",
        help="write the tables of record, by default those of the project, and renew the documentation's blocks",
    )
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
