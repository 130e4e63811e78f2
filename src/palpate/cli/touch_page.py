"""The page of `palpate touch`: opened at once, fed by a process that solves, and touched while it gets better."""

from __future__ import annotations

import contextlib
import json
import math
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.cli.console import Console
from palpate.cli.improvement_lines import mesh_in_words, step_line, trial_in_words
from palpate.cli.work_estimate import WorkEstimate
from palpate.errors import PalpateError, UsageError
from palpate.format import duration, share
from palpate.processes import helper_environment, kill_group
from palpate.runtime.warm_up import WarmUp
from palpate.study import Study
from palpate.viewer.part_page import PartPage, Progress
from palpate.viewer.shown_part import PartChoices, ShownPart
from palpate.viewer.web_server import wait_until_interrupted

__all__ = ["TouchedPart", "touch_on_page"]

_GRACE = 8.0  # s that the work has to end in good order


class _Work:
    """The process that solves and learns; it starts at once, so that its imports are done when it is asked."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "palpate.study.part_work"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=helper_environment(),
            start_new_session=True,  # Ctrl-C in the terminal is for this process, which then ends the work
        )
        self._heard = False

    def ask(self, line: str) -> None:
        """Send a line; nothing happens where the process has ended."""
        with contextlib.suppress(OSError, ValueError):
            assert self._process.stdin is not None
            self._process.stdin.write(line + "\n")
            self._process.stdin.flush()

    def __iter__(self) -> Any:
        assert self._process.stdout is not None
        self._heard = True
        with self._process.stdout as lines:
            for line in lines:
                with contextlib.suppress(ValueError):  # cut off by a kill
                    yield dict(json.loads(line))

    def close(self) -> int:
        """End the process and all that it started; return its exit code."""
        process = self._process
        with contextlib.suppress(OSError, ValueError):
            assert process.stdin is not None
            process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(_GRACE)
        kill_group(process)  # type: ignore[arg-type]
        if not self._heard and process.stdout is not None:  # a listener closes it
            process.stdout.close()
        return int(process.returncode)


class TouchedPart:
    """One part on its page: what a person chooses, the work, and the surrogates that come of it.

    `until` is the wanted relative force error, `limit` the time in s after which no further batch of solves begins.
    With `refine` finer solves decide the size of the elements before the study's own begin.
    `times` are those in s from the making of this object to ``page``, ``start``, ``touch`` and ``end``.
    """

    page: PartPage  # to be set before `begin`

    def __init__(
        self, until: float, limit: float, workers: int | None, console: Console, *, refine: bool = False
    ) -> None:
        self.refine = refine
        self.until, self.limit, self.workers, self.console = until, limit, workers, console
        self.times: dict[str, float] = {}
        self.exit_code = 0  # of the work, once it has ended: 2 where it refused the study
        self.refusal: UsageError | None = None  # then with its reason
        self._made = time.monotonic()
        self._progress = Progress("starting", target=until)
        self._estimate = WorkEstimate()
        self._work = _Work()
        self._warm_up = WarmUp("pressed", "loop")  # beside choosing, solving and learning
        self._recalled = 0  # solves of a surrogate of an earlier run
        self._stopped, self._begun, self._beginning = False, False, threading.Lock()
        self._bodies: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []

    def mark(self, name: str) -> None:
        """Note that something has happened now, and print how long it took."""
        if name not in self.times:
            self.times[name] = time.monotonic() - self._made

    def begin(self, file_of: Callable[[], Path]) -> None:
        """Let the work on a study file begin, and return at once; a second time is refused.

        Nothing is written then. `file_of` writes the study where that is to be done, and returns its file. Where it
        fails nothing has begun.
        """
        with self._beginning:
            if self._begun:
                raise UsageError(
                    "The work has begun already.",
                    why="A part's page carries out one study.",
                    fix="Touch what comes of it, or end the command and give it again.",
                )
            file = file_of()
            self._begun = True
        self.mark("start")
        wish = {"study": str(file), "until": self.until, "limit": self.limit, "workers": self.workers}
        wish["refine"] = self.refine
        self._work.ask(json.dumps(wish))
        for target in (self._listen, self._show_bodies, self._heed_stop):
            thread = threading.Thread(target=target, daemon=True)
            thread.start()
            self._threads.append(thread)

    def close(self) -> None:
        """End the work; everything that it has done is kept."""
        self._stopped = True
        self._bodies.put(None)
        self._warm_up.close()
        self.exit_code = self._work.close()
        for thread in self._threads:
            thread.join(1.0)

    def _heed_stop(self) -> None:
        while not self._stopped:
            if self.page.stopped.wait(0.5):
                self._work.ask("stop")
                return

    def _listen(self) -> None:
        """Show and print what the work says, until it ends."""
        handlers: dict[str, Callable[[Any], None]] = {
            "log": self._log,
            "progress": self._count,
            "step": self._step,
            "judged": self._recall,
            "body": self._take_body,
            "ended": self._end,
            "failed": self._fail,
        }
        done = False
        for said in self._work:
            for name, content in said.items():
                handlers[name](content)
                done = done or name in {"ended", "failed"}
        if not done and not self._stopped:
            self._fail(
                {"what": "The process that solves has ended.", "why": "", "fix": "Give the command again."}
            )

    def _show(self, **changes: Any) -> None:
        began = self._made + self.times.get("start", 0.0)
        work = self._estimate
        now = {"phase": work.words, "remaining": work.remaining, "share": work.share}
        known = vars(self._progress) | {"seconds": time.monotonic() - began} | now | changes
        self._progress = Progress(**known)
        self.page.show_progress(self._progress)

    def _log(self, words: str) -> None:
        self._estimate.begin(words)
        self._show()
        self.console.say(f"{words} …")

    def _count(self, progress: list[int]) -> None:
        self._estimate.count_solves(*progress)
        self._show()

    def _take_body(self, path: str) -> None:
        self._estimate.end_round()
        self._bodies.put(path)

    def _recall(self, figures: dict[str, Any]) -> None:
        """Show the error of a surrogate of an earlier run, until it is judged anew."""
        self._recalled = figures["solves"]
        self._show(solves=figures["solves"], error_median=figures["median"], error_p95=figures["error"])

    def _step(self, figures: dict[str, Any]) -> None:
        step = SimpleNamespace(**figures)
        if step.phase == "solved":
            self._estimate.learn()
        elif step.phase == "learnt" and not step.is_new:
            self._estimate.end_round()  # a new one comes as a body
        is_known = math.isnan(step.error) and step.solves == self._recalled  # of an earlier run
        if step.phase in {"learnt", "judged"} and not is_known:
            self.console.say(step_line(step))
        places = np.array(step.places, dtype=float).reshape(-1, 3)
        known: dict[str, Any] = {
            "solves": step.solves,
            "error_median": step.median,
            "error_p95": step.error,
            "places": places,
            **{name: figures[name] for name in ("painted_area", "trained_area") if name in figures},
        }
        words = "; ".join(filter(None, (trial_in_words(step), mesh_in_words(step))))
        earlier = self._progress.error_p95
        if is_known:
            del known["error_median"], known["error_p95"]
        elif math.isnan(step.error) and not math.isnan(earlier):
            words = f"{share(earlier)} before; the new one is being checked"
        elif math.isnan(earlier):
            self._progress = replace(self._progress, trial="")  # it told of the error of the one before
        self._show(**known, trial=words or self._progress.trial)

    def _end(self, outcome: dict[str, Any]) -> None:
        self.mark("end")
        report = outcome["report"] or None
        self._show(phase="done", report=report, remaining=math.nan, share=1.0)
        reached = "The wanted force error is kept." if outcome["reached"] else outcome["reason"]
        self.page.end(f"{reached} Everything is kept beside the part; the same command goes on.")
        self.console.say(outcome.get("validation") or outcome["reason"])
        if report:
            self.console.say(f"report  {report}")
        self.console.say(reached)

    def _fail(self, error: dict[str, str]) -> None:
        self.refusal = UsageError(error["what"], why=error["why"], fix=error["fix"])
        words = " ".join(filter(None, (error["what"], error["why"], error["fix"])))
        self.page.end(words)
        self.console.say(words)

    def _show_bodies(self) -> None:
        """Put each surrogate into the hand: the newest, where several came while one was blended."""
        while (path := self._bodies.get()) is not None:
            while not self._bodies.empty():
                path = self._bodies.get()
                if path is None:
                    return
            if words := self._warm_up.words:
                self._log(words)
            self._warm_up.wait()
            try:
                self.page.show_body(path)
            except PalpateError as error:
                self.console.say(f"{path} is not in the hand: {error}")
                continue
            if "touch" not in self.times:
                self.mark("touch")
                self.console.say(
                    f"It can be touched, {duration(self.times['touch'] - self.times['start'])} after the start."
                )


def touch_on_page(
    name: str,
    study_of: Callable[[str | None, float | None], tuple[Study, Path, bool]],
    write: Callable[[Study], Path],
    touched: TouchedPart,
    *,
    at_once: bool = False,
    on_ready: Callable[[PartPage], object] | None = None,
    on_address: Callable[[str], object] = lambda _: None,
    **options: Any,
) -> None:
    """Open the page of a part, let a person choose, and work until Ctrl-C.

    `study_of` gets a unit of the file's numbers and the size of a wrap in m, both None at first; it returns the study
    of the part, its file, and whether that was there before: then the work goes on at once, as with `at_once`, which
    begins with the first choices. A part that is refused and may be wrapped is so by a click, unless `at_once`.
    `write` writes a chosen study and returns its file. `on_ready` is called once with the running page; by default its
    address is printed, and opened in the user's browser where there is a terminal. `on_address` gets that address. The
    options are those of `PartPage`.
    """
    from palpate.study.part_choices import chosen_study, shown_part

    known: list[Study] = []
    failures: list[BaseException] = []
    wraps: list[float | None] = [None]

    def begin(choices: PartChoices) -> None:
        touched.begin(lambda: write(chosen_study(known[0], choices)))

    def renew(unit: str | None, size: float | None) -> ShownPart:
        study = study_of(unit, size)[0]
        part = shown_part(study)
        known[:], wraps[:] = [study], [size]
        failures.clear()
        return part

    def read(page: PartPage) -> None:
        try:
            study, file, there = study_of(None, None)
            known.append(study)
            part = shown_part(study)
            page.show_part(part, begun=there or at_once)
            if there:
                touched.begin(lambda: file)
            elif at_once:
                begin(part.choices)
        except PalpateError as error:
            failures.append(error)
            _show_refusal(page, error, touched.console, is_final=at_once)

    def ready(page: PartPage) -> None:
        touched.mark("page")
        on_address(page.url)
        if on_ready is not None:
            on_ready(page)
        else:
            touched.console.say(f"{page.url} shows {page.caption} Ctrl-C ends it.")
        threading.Thread(target=read, args=(page,), daemon=True).start()

    options |= {"on_unit": lambda unit: renew(unit, wraps[0]), "on_wrap": lambda size: renew(None, size)}
    touched.page = PartPage(name, on_start=begin, **options)
    try:
        wait_until_interrupted(
            touched.page, open_browser=on_ready is None and sys.stdout.isatty(), on_ready=ready
        )
    finally:
        touched.close()
    if failures:
        raise failures[0]


def _show_refusal(page: PartPage, error: PalpateError, console: Console, *, is_final: bool) -> None:
    """Say on the page why a part is refused; a wrap is offered where that is a way, unless the refusal is final."""
    words = str(error).replace("\n", " ")
    if isinstance(error, UsageError) and error.wrap and not is_final:
        console.say(f"{words} A click on the page wraps it.")
        page.offer_wrap(words, error.wrap)
        return
    page.end(words)
    if not page.visited.is_set():
        threading.Thread(target=page.stop, daemon=True).start()
