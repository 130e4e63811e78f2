"""What the README and the documentation say is so: the program runs, the commands exist, the links lead somewhere."""

from __future__ import annotations

import functools
import importlib.util
import re
from pathlib import Path

import pytest
import typer

from programs import run_program

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")])

COMMAND_LINES = (
    "python3 -m venv .venv && . .venv/bin/activate && pip install . && palpate demo",
    'python3 -m venv .venv && . .venv/bin/activate && pip install ".[test]" && pytest',
    r"py -m venv .venv; .venv\Scripts\Activate.ps1; pip install .; palpate demo",
    r'py -m venv .venv; .venv\Scripts\Activate.ps1; pip install ".[test]"; pytest',
)

# serving would never end: the program's last line is answered by this
STANDS_IN = """
import palpate
palpate.serve = lambda touch: print("served:", touch)
"""


def program(text: str) -> str:
    """The first Python block of a page."""
    return re.search(r"```python\n(.*?)```", text, re.DOTALL)[1]


@pytest.mark.full
@pytest.mark.timeout(240)
def test_the_program_runs_as_a_file_without_a_guard(tmp_path: Path):
    text = program(README)
    assert "__main__" not in text
    assert len([line for line in text.splitlines() if line and not line.startswith("import")]) <= 9
    site = tmp_path / "site"
    site.mkdir()
    (site / "sitecustomize.py").write_text(STANDS_IN, encoding="utf-8")
    printed = run_program(text, tmp_path, 200, site=site, alone=False)
    assert "served: Surrogate" in printed
    assert (tmp_path / "beam.palpate").is_file()


def titled(title: str) -> str:
    """The program under a heading of the README."""
    return re.search(rf"^## {title}\n.*?```python\n(.*?)```", README, re.DOTALL | re.MULTILINE)[1]


@pytest.mark.full
@pytest.mark.timeout(620)
def test_the_program_for_soft_bodies_runs(tmp_path: Path):
    text = titled("Soft bodies")
    coarse = {"0.10, 0.05))": "0.10, 0.05), element=0.03)", "element=0.0075": "element=0.010"}
    for said, quick in {"samples=12": "samples=8", "effort=0.2": "effort=0.02", **coarse}.items():
        assert said in text
        text = text.replace(said, quick)
    printed = run_program(text, tmp_path, 600)
    assert printed.startswith("Solid of ")
    assert {path.name for path in tmp_path.iterdir()} >= {"pressed.png", "pressed.vtu", "block.zarr"}


@pytest.mark.full
def test_the_program_for_arrays_runs(tmp_path: Path):
    printed = run_program(titled("From your own arrays"), tmp_path, 100)
    assert printed.startswith("Fitted: 2 inputs → 2 outputs")
    assert (tmp_path / "model.palpate").is_file()


def test_the_quick_start_has_the_same_program():
    assert program((ROOT / "docs" / "quickstart.md").read_text(encoding="utf-8")) == program(README)


@pytest.mark.parametrize("line", COMMAND_LINES)
def test_the_command_lines_stand_there(line: str):
    assert line in [text.strip() for text in README.splitlines()]


def commands() -> dict[str, set[str]]:
    """Every command of the command line, with its options."""
    from palpate.cli.app import app

    group = typer.main.get_command(app)
    return {
        name: {
            opt
            for one in (command, *_below(command))
            for p in one.params
            for opt in (*p.opts, *p.secondary_opts)
        }
        for name, command in group.commands.items()  # type: ignore[attr-defined]
    }


def _below(command) -> list:
    """Every command of a group and of groups in it, as `palpate dataset import`."""
    own = list(getattr(command, "commands", {}).values())
    return own + [deeper for each in own for deeper in _below(each)]


def code(text: str) -> str:
    """Everything that is set as code: inline, fenced and indented."""
    inline = re.findall(r"`([^`\n]+)`", text)
    blocks = re.findall(r"^(?: {4}|\t)(.*)$", text, re.MULTILINE)
    fenced = re.findall(r"```\w*\n(.*?)```", text, re.DOTALL)
    return "\n".join([*inline, *blocks, *fenced])


@pytest.mark.grid
@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_every_command_named_exists(page: Path):
    known = commands()
    for line in code(page.read_text(encoding="utf-8")).splitlines():
        for call in re.split(r"&&|;", line):
            if found := re.match(r"\s*palpate ([a-z]+(?:-[a-z]+)*)\b(.*)", call):
                name, rest = found.groups()
                assert name in known, line
                unknown = set(re.findall(r"(?<!\S)--[a-z-]+", rest)) - known[name]
                assert not unknown, line


def test_the_page_on_commands_is_complete():
    text = (ROOT / "docs" / "guide" / "commands.md").read_text(encoding="utf-8")
    known = commands()
    assert sorted(re.findall(r"^## palpate ([a-z-]+)", text, re.MULTILINE)) == sorted(known)
    named = set(re.findall(r"--[a-z][a-z-]+", text))
    completing = {"--help", "--install-completion", "--show-completion"}  # of the program itself, by Typer
    assert named <= {option for options in known.values() for option in options} | completing
    # `palpate NAME` stands in the README's table for each of them
    assert {name for name in known if f"| `palpate {name}` |" in README} == set(known)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_to_files_lead_somewhere(page: Path):
    targets = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    for target in targets:
        if not target.startswith(("http://", "https://")):
            assert (page.parent / target).exists(), target


@functools.cache
def repository_paths() -> tuple[str, ...]:
    """Every file and folder of the repository's own parts, from a slash on."""
    parts = ("src", "tests", "docs", "examples", "benchmarks", ".ci")
    files = [
        path.relative_to(ROOT)
        for part in parts
        for path in (ROOT / part).rglob("*")
        if path.is_file() and not {"node_modules", "__pycache__"} & set(path.parts)
    ]
    return tuple("/" + path.as_posix() for file in files for path in (file, *file.parents))


def exists(path: str) -> bool:
    ends = [
        "/" + path.strip("/.") + suffix for suffix in ("", ".in")
    ]  # a file that is written has its template
    return any(there.endswith(tuple(ends)) for there in repository_paths())


@pytest.mark.grid
@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_every_path_named_exists(page: Path):
    """A path from the root, or the last part of one: `devices/page.py`, `test_cook.py`."""
    text = code(page.read_text(encoding="utf-8"))
    named = set(re.findall(r"(?<![\w./-])(?:[\w.-]+/)*\w+\.(?:py|ts)\b", text))
    named |= set(re.findall(r"(?<![\w./-])(?:src|tests|docs|examples|benchmarks)(?:/[\w.-]+)+", text))
    assert {path for path in named if not exists(path)} == set()


def test_the_reference_has_every_public_name():
    text = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "reference").glob("*.md"))
    import palpate
    import palpate.adapters
    import palpate.experiments

    paths = re.findall(r"^::: palpate\.(\S+)", text, re.MULTILINE)
    inner = {"adapters": palpate.adapters, "experiments": palpate.experiments}
    for name, package in {"": palpate, **inner}.items():
        listed = [
            path.rpartition(".")[2]
            for path in paths
            if (path.partition(".")[0] == name if name else path.partition(".")[0] not in inner)
        ]
        assert sorted(listed) == sorted(package.__all__)


def test_every_page_is_in_the_navigation():
    docs = ROOT / "docs"
    named = set(re.findall(r"[\w/-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")))
    assert named == {page.relative_to(docs).as_posix() for page in docs.rglob("*.md")}


def test_pictures_are_small():
    pictures = list((ROOT / "docs" / "images").iterdir())
    assert pictures
    moving = {picture for picture in pictures if picture.suffix == ".webp"}
    assert all(picture.stat().st_size < 1_000_000 for picture in moving)
    assert all(picture.stat().st_size < 200_000 for picture in set(pictures) - moving)


def test_the_readme_is_read_in_a_minute():
    assert len(README.splitlines()) <= 110
    assert README.index("palpate touch kidney.stl") < README.index("cantilevers")
    assert re.search(r"!\[[^]]*\]\(([^)]+)\)", README)[1] == "docs/images/pressed-kidney.webp"


def test_the_study_files_reference_is_that_of_the_code():
    script = ROOT / "docs" / "study_reference.py"
    spec = importlib.util.spec_from_file_location("study_reference", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = module.PAGE.read_text(encoding="utf-8")
    assert module.renewed(text) == text, "run python docs/study_reference.py"


def test_the_study_in_the_guide_is_a_study(tmp_path: Path):
    from palpate.study import read_study

    text = (ROOT / "docs" / "guide" / "study-file.md").read_text(encoding="utf-8")
    file = tmp_path / "study.toml"
    file.write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1], encoding="utf-8")
    study = read_study(file)
    assert study.body.length == pytest.approx(0.15)
    assert study.body.nodes == pytest.approx((0.0, 0.05, 0.1, 0.15))
