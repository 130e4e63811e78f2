"""Messages: one source for Python and TypeScript; bytes there and back."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from pathlib import Path

import numpy as np
import pytest

import palpate.viewer
from palpate.errors import UsageError
from palpate.viewer import typescript
from palpate.viewer.exam_messages import ExamMark, ExamNews, ExamWish, FormerExam
from palpate.viewer.messages import (
    PROTOCOL,
    DrawnTool,
    Feel,
    FieldInfo,
    Frame,
    Hello,
    Hold,
    Line,
    Loop,
    Notice,
    RangeInfo,
    Reason,
    Recording,
    Shown,
    StepInfo,
)
from palpate.viewer.part_messages import (
    Answer,
    FaceInfo,
    LearningProgress,
    MaterialInfo,
    PartFacts,
    PartNews,
    RegionInfo,
    SizeInfo,
    StartWish,
    ToolInfo,
    UnitWish,
    WrapWish,
)
from palpate.viewer.wire import Binary, Json, Layout

VIEWER = Path(palpate.viewer.__file__).parent
# the sources are part of the repository, not of the installed package
CLIENT = Path(__file__).parents[2] / "src" / "palpate" / "viewer" / "client"

LINE = Line(
    rest=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    touch_node=1,
    nodes_of_interest=(0, 1),
    travel=((-0.4, -0.7, 0.0), (0.0, 0.7, 0.0)),
)
FIELD = FieldInfo("displacement", "m", 0.0, 0.01, 3, 12)
HELLO = Hello(
    protocol=PROTOCOL,
    version=1,
    name="rod",
    inputs=(RangeInfo("P", "force", 0.0, 5.0, "N"),),
    parameters=(),
    holds=True,
    radius=0.005,
    radius_parameter=-1,
    tool=None,
    twists=False,
    deepest=0.7,
    force_max=5.0,
    stiffness_max=24.0,
    centre=(0.0, 0.0, 0.0),
    line=LINE,
    fields=(),
    pad="",
    remembers="",
    scale=11.7,
    workspace=0.075,
    max_force=20.0,
    rate=1000.0,
    faults=("no fault", "a bad number"),
    hand="page",
    device="",
    meta={"errors": {"rmse": 1e-5}, "seed": 3},
)
TOOL = DrawnTool(
    "box", (0.0, 0.0, 1.0), (0.0, 0.0, 0.5), (0.0, 0.5, 1.0), (0.0, 0.0, -1.0), (0, 0, 0), (-1, -1, 0)
)
PRESSED = dataclasses.replace(HELLO, holds=False, line=None, fields=(FIELD,), radius_parameter=1, tool=TOOL)
SHOWN = Shown(PROTOCOL, "block", (FIELD,), (StepInfo("sample 3", {"energy": "1 mJ"}),), 0.01, TOOL)
NEWS = Recording(active=True, file="rod.trace", seconds=3.5, size=4e5, lost=0, problem="")
REASON = Reason(now="no force", stopped=True, dropped="a bad number", ago=0.25)
FEEL = Feel(body=900.0, limit=333.0, felt=333.0, override=False, words="softened")
WISH = StartWish(
    "",
    "neo-hookean",
    "10 kPa",
    "0.45",
    "6 mm",
    "3 mm",
    tool="capsule",
    sizes={"radius": "6 mm"},
    regions={"fat": "9 kPa"},
)
FACTS = PartFacts(
    file="kidney.stl",
    unit="mm",
    units=("mm", "m"),
    size=(0.11, 0.06, 0.04),
    faces=(FaceInfo("face 1", 1e-3, (0.0, 0.5, 1.0)),),
    whole=False,
    materials=(MaterialInfo("fat", "soft", "tissue", "3.3 kPa", "0.45"),),
    laws=("neo-hookean",),
    tools=(ToolInfo("capsule", "a bar", (SizeInfo("radius", "radius", "6 mm"),)),),
    regions=(RegionInfo("fat", "5 kPa..30 kPa"),),
    choices=dataclasses.asdict(WISH),
    notes=("repaired",),
)
LEARNING = LearningProgress(
    "solving", 12, 0.02, None, 0.03, "kept", ((0.0, 1.0, 2.0),), 60.0, report=True, remaining=12.5, share=0.25
)
PART = (
    PartNews(PROTOCOL, "kidney", "refused", "words", 2, 1, "1 mm"),
    FACTS,
    WISH,
    UnitWish("m"),
    WrapWish("1 mm"),
    Answer("no", {"depth": "too deep"}, tool=TOOL),
    LEARNING,
)
WRITTEN = (HELLO, PRESSED, SHOWN, Notice("what", "why", "fix"), NEWS, REASON, FEEL, *PART)

MARK = ExamMark(1, (0.0, 0.25, 0.5), "hard", "", "No lump lies here.")
EXAM = (
    ExamNews(
        PROTOCOL,
        "an examination",
        "words",
        "practice",
        "",
        2.5,
        (MARK,),
        (),
        (FormerExam("a", "b", "c", ended=True),),
        "",
    ),
    ExamWish("mark", place=(0.0, 0.25, 0.5)),
)
WRITTEN += EXAM


def sample(message: type[Binary]) -> Binary:
    """A message whose numbers all differ, so that swapped fields are seen; all exact in 32 bits."""
    values = {}
    for i, (name, wire) in enumerate(typescript.Wire.fields(message)):
        n = float(i + 1)
        values[name] = {
            "flag": i % 2 == 0,
            "u8": 200 + i,
            "u16": 60000 + i,
            "u32": 4_000_000_000 + i,
            "f32": n / 8,
            "f64": n / 3,
            "vec3": (n, -n / 4, n / 16),
            "vec3d": (n / 3, -n / 7, n / 11),
            "floats": np.arange(i, dtype="f4") - 0.5,
        }[wire.kind]
    return message(**values)


def same(a: Binary, b: Binary) -> bool:
    names = [f.name for f in dataclasses.fields(type(a))]  # type: ignore[arg-type]
    return type(a) is type(b) and all(np.array_equal(getattr(a, n), getattr(b, n)) for n in names)


def test_generated_typescript_is_up_to_date():
    written = (CLIENT / "src" / "messages.ts").read_text(encoding="utf-8")
    assert written == typescript.generate(), "run python -m palpate.viewer.messages > …/messages.ts"


def test_the_built_page_is_of_these_sources():
    own = [
        "index.html",
        "package-lock.json",
        "package.json",
        "tsconfig.json",
        "vite.config.js",
    ]
    inside = [f"{folder}/{p.name}" for folder in ("public", "src") for p in (CLIENT / folder).iterdir()]
    digest = hashlib.sha256()
    for name in sorted([*own, *inside]):
        text = (CLIENT / name).read_text(encoding="utf-8").replace("\r\n", "\n")
        digest.update(f"{name}\n{text}\n".encode())
    stamp = (VIEWER / "static" / "sources.sha256").read_text(encoding="utf-8").strip()
    assert stamp == digest.hexdigest(), "run npm ci && npm run build in src/palpate/viewer/client"


def test_the_built_page_is_small_and_names_no_other_host():
    built = [p for p in (VIEWER / "static").rglob("*") if p.is_file()]
    assert sum(p.stat().st_size for p in built) < 800_000  # three.js is there once
    index = (VIEWER / "static" / "index.html").read_text(encoding="utf-8")
    assert "http:" not in index
    assert "https:" not in index


@pytest.mark.parametrize("message", typescript.BINARY)
def test_binary_messages_come_back_the_same(message: type[Binary]):
    before = sample(message)
    data = before.pack()
    lists = Layout.of(message).lists
    assert len(data) == Layout.of(message).packer.size + sum(4 + 4 * len(getattr(before, n)) for n in lists)
    assert same(message.unpack(data), before)


@pytest.mark.parametrize("message", WRITTEN)
def test_json_messages_come_back_the_same(message: Json):
    assert type(message).from_json(message.to_json()) == message


def test_a_number_that_is_not_finite_becomes_null():
    hello = dataclasses.replace(HELLO, meta={"error": math.nan, "list": [math.inf, 1.0]})
    assert Hello.from_json(hello.to_json()).meta == {"error": None, "list": [None, 1.0]}


@pytest.mark.parametrize("message", typescript.BINARY)
@pytest.mark.parametrize("harm", ["empty", "short", "long", "other"])
def test_bytes_that_are_no_message_are_refused(message: type[Binary], harm: str):
    data = sample(message).pack()
    broken = {"empty": b"", "short": data[:-1], "long": data + b"\0", "other": b"\xff" + data[1:]}[harm]
    with pytest.raises(UsageError, match=message.__name__):
        message.unpack(broken)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"kind": "Notice"}', '{"kind": "Hello", "x": 1}'])
def test_text_that_is_no_message_is_refused(text: str):
    with pytest.raises(UsageError, match="Hello"):
        Hello.from_json(text)


def test_a_frame_of_21_nodes_is_small():
    nothing = dict.fromkeys(("parameters", "coefficients", "indentation"), np.zeros(0))
    frame = dataclasses.replace(sample(Frame), displacement=np.zeros((21, 3)), **nothing)
    assert len(frame.pack()) < 416


def test_enumerations_and_kinds_are_distinct():
    assert len({m.KIND for m in typescript.BINARY}) == len(typescript.BINARY)
    assert {Loop(0), Hold(0)} == {0}
