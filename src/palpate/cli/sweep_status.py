"""Lines of `palpate sweep --status`: how far the sweeps of a study are, by their files."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.format import count, duration

if TYPE_CHECKING:
    from palpate.cli.console import Console
    from palpate.sweeps.ledger import Progress

__all__ = ["print_status"]


def print_status(study: Path, console: Console) -> None:
    """Print how many cases of a study file are on disk, and whether a command works on them; solve nothing."""
    from palpate.study import read_study
    from palpate.study.run import Paths
    from palpate.study.solver_study import read_solver_study, says_solver
    from palpate.study.study_lock import work_on
    from palpate.sweeps.ledger import read_progress

    record = read_solver_study(study) if says_solver(study) else read_study(study)
    paths = Paths(study.parent, record.name)
    wanted = {paths.data: record.sweep.samples if record.sweep else None}
    if getattr(record.test, "random", None) != 0:  # 0: nothing more is solved for testing
        wanted[paths.random] = None
    lines, content = [], dict[str, Any]()
    for path, samples in wanted.items():
        progress = read_progress(path)
        lines.append(f"{path}: {_in_words(progress, samples)}")
        content[str(path)] = None if progress is None else vars(progress)
    work = work_on(paths)
    is_whole = all(p is not None and p["solved"] == p["samples"] for p in content.values())
    then = "" if is_whole else f"; `palpate sweep {study}` goes on"
    lines.append(f"{work} works on it" if work else f"no command works on it now{then}")
    console.result("\n".join(lines), {"files": content, "work": work})


def _in_words(progress: Progress | None, samples: int | None) -> str:
    if progress is None:
        return "not begun"
    whole = progress.samples or samples
    of = f" of {whole}" if whole and not progress.is_complete else ""
    failed = f", {progress.failed} of them failed" if progress.failed else ""
    ago = (
        ""
        if progress.written is None
        else f"; the last written {duration(time.time() - progress.written)} ago"
    )
    return f"{count(progress.solved, 'case')}{of} solved{failed}{ago}"
