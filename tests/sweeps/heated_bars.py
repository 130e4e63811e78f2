"""Studies of a small program that stands for a solver, for tests of `[solver]`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

SOLVER = Path(__file__).parents[1] / "data" / "solver_case" / "heated_bar.py"

STUDY = """
name = "bar"
values = { length = "40 cm" }

[solver]
command = ["{python}", "{templates}/heated_bar.py", "{case}"]
raw = ["*.py"]
results = ["{case}.npz"]
limit = "LIMIT s"

[[inputs]]
name = "power"
range = ["0 W", "10 W"]

[mapping.units]
length = "mm"

[[mapping.outputs]]
name = "temperature"
from = "temperature"
unit = "K"

[[mapping.outputs]]
name = "heat"
from = "heat"
unit = "W"

[sweep]
samples = SAMPLES
design = "grid"

[test]
random = RANDOM
"""


def heated_bar(
    folder: Path,
    *,
    faults=(),
    samples: int = 11,
    random: int = 0,
    limit: float = 30.0,
    seconds: float = 0.0,
    log: Path | None = None,
    study: str = STUDY,
) -> Path:
    """Write the study and the templates of a heated bar into a folder; faults are (name, from, to) in W."""
    templates = folder / "templates"
    templates.mkdir(parents=True, exist_ok=True)
    shutil.copy(SOLVER, templates)
    said = {"faults": faults, "seconds": seconds, "log": None if log is None else str(log)}
    text = json.dumps(said)[:-1] + ', "power in mW": {{ power | mW }}, "length in mm": {{length|mm}} }'
    (templates / "{case}.in").write_text(text)
    content = study.replace("LIMIT", f"{limit:g}").replace("SAMPLES", str(samples))
    path = folder / "bar.toml"
    path.write_text(content.replace("RANDOM", str(random)))
    return path
