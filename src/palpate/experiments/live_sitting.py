"""A live sitting: files, bodies, loop and pages are opened, and the conductor leads until the end."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from palpate.errors import UsageError
from palpate.experiments.conductor import STEP, Conductor
from palpate.experiments.experiment_pages import SittingPage
from palpate.experiments.sitting import Sitting
from palpate.experiments.stimuli import Stimuli
from palpate.experiments.study_folder import Participant, SittingFiles, StudyFolder, checksum
from palpate.runtime import LoopProcess
from palpate.runtime.recorder import machine_facts
from palpate.runtime.warm_up import WarmUp

__all__ = ["run_sitting"]

_LINGER = 3.0  # s for which the pages stay after the end


def run_sitting(
    plan_file: Path,
    participant: Participant,
    *,
    run: int = 1,
    device: str | None = None,
    port: int = 8080,
    token: bool = True,
    say: Callable[[str], None] = print,
    on_ready: Callable[[SittingPage, SittingPage], None] | None = None,
) -> Conductor:
    """Run a participant's sitting until it ends; one that was interrupted goes on where it was.

    The experiment's folder lies beside the plan. `run` counts the participant's sittings from 1; `device` is another
    one than the plan's, such as ``haply:ws://localhost:10001``. The participant's page has the `port`, and the control
    page the next free one; with `token` both ask for a token. `say` takes lines of progress, and `on_ready` both pages.

    The conductor comes back as it stands at the end. A changed plan, a sitting that is finished and one that runs
    elsewhere are UsageErrors.
    DeviceError
        If the device is missing.
    """
    folder = StudyFolder.beside(plan_file)
    plan = folder.plan
    if device is not None:
        plan = plan.model_copy(update={"device": plan.device.model_copy(update={"name": device})})
    stimuli = Stimuli(plan, plan_file.parent, folder.root / "stimuli")
    folder.prepare(plan_file)
    files = folder.sitting(participant, run)
    with files.held(), contextlib.ExitStack() as closing:
        sitting, part = _taken_up(Sitting(plan, participant.label, run), files, say)
        body = stimuli.bodies["reference"]
        warm_up = WarmUp("loop", body=body)
        if warm_up.words:
            say(f"{warm_up.words} …")
        closing.enter_context(warm_up)
        first = stimuli.files["reference"]
        parameters = [(r.low + r.high) / 2.0 for r in body.parameters]
        rules = plan.device
        loop = closing.enter_context(
            LoopProcess(
                first,
                device=rules.name,
                max_force=rules.max_force,
                dead_man=rules.dead_man,
                parameters=parameters,
                aim=True,
            )
        )
        folder.enrol(participant)
        if (warning := loop.read().felt_stiffness.warning) is not None:
            say(f"On this device the body feels softer than it is: {warning}")
        files.describe(_facts(plan_file, stimuli, loop, part))
        conductor = Conductor(plan, sitting, stimuli, files, loop, part=part)
        hers = SittingPage("participant", conductor.participant_view, conductor.hear, port, token=token)
        control = SittingPage(
            "control", conductor.control_view, conductor.command, port and port + 1, token=token
        )
        for page in (hers, control):
            closing.enter_context(page)
        if on_ready is not None:
            on_ready(hers, control)
        _lead(conductor)
    return conductor


def _taken_up(sitting: Sitting, files: SittingFiles, say: Callable[[str], None]) -> tuple[Sitting, int]:
    """Return the sitting after its answers so far, and the number of the part that begins now."""
    rows = files.rows()
    if not rows:
        return sitting, 1
    sitting.restore(list(rows))
    if sitting.next() is None:
        raise UsageError(
            f"{sitting.participant} has finished run {sitting.run} of {sitting.plan.name}.",
            why=f"All {sitting.total} trials are in {files.table}, and nothing is ever overwritten.",
            fix=f"Begin another one with --run {sitting.run + 1}, or name another participant.",
        )
    say(f"The sitting goes on: {sitting.done} of {sitting.total} trials are answered.")
    return sitting, max(int(row["part"]) for row in rows) + 1


def _facts(plan_file: Path, stimuli: Stimuli, loop: LoopProcess, part: int) -> dict[str, object]:
    state = loop.read()
    return {
        "part": part,
        "begun": datetime.now(UTC).isoformat(timespec="seconds"),
        "plan_sha256": checksum(plan_file),
        "bodies_sha256": stimuli.checksums,
        "device": loop.device,
        "device_name": state.device,
        "max_force": state.max_force,
        "rate": loop.rate,
        "software": machine_facts(),
    }


def _lead(conductor: Conductor) -> None:
    """Step until the sitting ends, and let the pages stay a little so that the last words are read."""
    while conductor.phase not in {"done", "failed"}:
        conductor.step()
        time.sleep(STEP)
    time.sleep(_LINGER)
