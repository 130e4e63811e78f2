"""Plans that are ready to be filled in: each is a commented text with the file names of the user's bodies."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

from palpate import checks
from palpate.errors import UsageError

__all__ = ["KINDS", "ready_plan"]

_HEAD = """\
# A plan of an experiment with people, for `palpate experiment`. Lengths are in m, forces in N, times in s, unless a
# unit is given: depth = "4 mm". The same seed gives each participant the same trials again.
name = "{name}"
question = "{question}"  # discrimination, odd-one-out, detection or rating
seed = 1
# read by each participant before the first touch; write what your ethics board approved
consent = \"\"\"
You will touch simulated bodies and answer questions about them. It takes at most {minutes} minutes, with breaks.
The force never exceeds {max_force} N. You may stop at any time, without giving a reason, and have your data removed.
Your answers, forces and movements are stored under a number, without your name.\"\"\"
reference = {reference}  # files beside this one, or whole paths
"""

_REST = """
[placement]
kind = "{placement}"  # adaptive; constant; staircase, with down, step_up and step_down
trials = {trials}  # counted ones, of each comparison

[sitting]
practice = 4  # obvious trials with feedback before the first
catch = 4  # obvious trials mixed in, of each comparison: they tell whether a person attends
break_every = 40  # trials
break_seconds = 60
interval_seconds = 3.0  # of each touch, from first contact
limit_minutes = {minutes}
# depth = "4 mm"  # guided; by default half of the trained depth. People reproduce it and compare end forces

[device]
name = "page"  # as `palpate devices` lists them; the page's mouse feels nothing: its force is drawn
max_force = {max_force}  # N, and never more than the device's own limit
dead_man = false  # whether a button of the device must be held

[wanted]
people = 12
margin = 0.5  # JNDs within which a comparison counts as the same
level = 0.05  # of the tests
power = 0.8

[expect]  # the people who are expected, for `palpate experiment simulate`; logarithms of ratios
spread = {spread}  # σ: a JND is 0.67 of it
spread_between = 0.3  # standard deviation of ln σ over people
location_between = 0.05
lapse = 0.02
side = 0.0  # preference of the second interval
fatigue = 0.0  # growth of σ until the end, as a share
learning = 0.0  # surplus of σ at the begin, as a share
"""

_VARY = """
[vary]
what = "{what}"  # force: the learnt body's force times a ratio; or the name of an input
low = {low}  # {meaning}
high = {high}
count = 25
"""

_RATINGS = """
[[rating]]
name = "stiffness"
text = "It was as stiff as the real one."

[[rating]]
name = "smoothness"
text = "It felt smooth."

[[rating]]
name = "resemblance"
text = "It resembled the real one."

[[rating]]
name = "confidence"
text = "I am sure of these answers."
"""

KINDS = {
    "discrimination": "the smallest difference of stiffness that a person tells with this device and body",
    "full-model": "whether learnt surrogates feel the same as the full model, whose presses were recorded",
    "odd-one-out": "whether a body can be told from the reference at all, by the odd one of three",
    "detection": "the smallest lump that a person finds, in one of two bodies",
    "rating": "how real experts find bodies: beside blind trials, never alone",
}
"""Kinds of plans, and what each asks."""


def ready_plan(kind: str, name: str, bodies: Sequence[str | Path], notes: Sequence[str] = ()) -> str:
    """Return the text of a plan of a kind of `KINDS`, with the experiment's name in letters and digits.

    `bodies` are files of learnt bodies, the reference first; of discrimination one is enough. `notes` become comments
    beside them. An unknown kind, a name with other signs, or a file too few, is a UsageError.
    """
    kind = checks.one_of("The kind of plan", kind, tuple(KINDS))
    if not re.fullmatch("[A-Za-z0-9]+", name):
        raise UsageError(
            f"{name!r} is no name of an experiment.",
            why="It stands in the names of files, of which BIDS asks for letters and digits alone.",
            fix="Give a name such as stiffness or kidney2.",
        )
    files = [str(b) for b in bodies]
    if kind == "discrimination" and len(files) == 1:
        files *= 2
    if kind == "detection" and len(files) == 1:
        files *= 2
    if len(files) < 2:
        raise UsageError(
            f"A plan of the kind {kind} needs the reference and at least one body that is compared with it.",
            why=f"It asks {KINDS[kind]}.",
            fix="Name their files, NAME.palpate, the reference first.",
        )
    question = "discrimination" if kind == "full-model" else kind
    rating = kind == "rating"
    text = _HEAD.format(
        name=name, question=question, reference=json.dumps(files[0]), minutes=45, max_force=3.0
    )
    beside = [f"# {note}\n" for note in notes] or [""] * len(files)
    text += beside[0]
    for number, file in enumerate(files[1:], 1):
        label = "same" if file == files[0] else f"body{number}"
        text += f"\n[[comparison]]\nname = {json.dumps(label)}\nfile = {json.dumps(file)}\n{beside[number]}"
    if not rating:
        text += _vary(kind)
    trials, spread = (10, 0.2) if rating else (80, 0.4 if kind in {"odd-one-out", "detection"} else 0.2)
    placement = "constant" if rating else "adaptive"
    text += _REST.format(placement=placement, trials=trials, minutes=45, max_force=3.0, spread=spread)
    return text + (_RATINGS if rating else "")


def _vary(kind: str) -> str:
    if kind == "detection":
        text = _VARY.format(what="lump", low=0.003, high=0.012, meaning="least and largest radius, m")
        return text.replace("# force: the learnt body's force times a ratio; or", "# a hidden lump; or") + (
            "place = [0.0, 0.0, -0.02]  # m, the lump's centre in the body\n"
            "stiffer = 5  # its modulus over that of the tissue\n"
        )
    if kind == "odd-one-out":
        return _VARY.format(what="force", low=1.03, high=2.0, meaning="ratios to the reference, above 1")
    return _VARY.format(what="force", low=0.55, high=1.8, meaning="ratios to the reference, about 1")
