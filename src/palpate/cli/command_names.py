"""Names of commands and options: who mistypes one, or asks by another tool's name, is told what is meant."""

from __future__ import annotations

import contextlib
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from palpate.checks import did_you_mean
from palpate.errors import UsageError

__all__ = ["CommandGroup", "command_paths"]

MEANT = {
    **dict.fromkeys(("simulink", "fmi", "modelica", "dymola", "openmodelica"), "export fmu"),
    **dict.fromkeys(("matlab", "library", "dll"), "export lib"),
    **dict.fromkeys(("unity", "unity3d"), "export unity"),
    **dict.fromkeys(("unreal", "ue5"), "export unreal"),
    **dict.fromkeys(("c99", "arduino", "embedded"), "export c"),
    **dict.fromkeys(("paraview", "vtk"), "export vtu"),
    **dict.fromkeys(("blender", "glb"), "export gltf"),
    **dict.fromkeys(("web", "browser", "page"), "export html"),
    **dict.fromkeys(("comsol", "calculix"), "dataset import"),
    **dict.fromkeys(("train", "fem"), "learn"),
    **dict.fromkeys(("solve",), "sweep"),
    **dict.fromkeys(("open", "serve"), "view"),
    **dict.fromkeys(("check", "test"), "validate"),
    **dict.fromkeys(("record",), "run"),
    **dict.fromkeys(("umbridge", "um-bridge"), "serve-umbridge"),
}
"""Other words for what a command does."""


FILES = {
    "files": "tests.csv",
    "part": "kidney.stl",
    "model": "kidney.palpate",
    "file": "kidney.palpate",
    "dataset": "kidney.zarr",
    "table": "bench.csv",
    "trace": "touch.trace",
}
"""Files for examples of commands, by the names of their arguments."""

WAYS = {
    ("", ".toml"): "sweep",
    ("", ".palpate"): "view",
    ("", ".zarr"): "learn",
    ("", ".stl"): "touch",
    ("", ".obj"): "touch",
    ("", ".step"): "touch",
    ("", ".csv"): "fit",
    ("export", ".palpate"): "export html",
    ("export", ".zarr"): "dataset export",
    ("dataset", ".zarr"): "dataset export",
    ("material", ".csv"): "material fit",
}
"""Commands for a file that stands where a command should, by the group and the end of the file's name."""

_Mistake: Any = typer.BadParameter.__mro__[
    1
]  # Typer's error of arguments, which newer Typers keep to themselves
_HELP = "NoArgsIsHelpError"  # no mistake: the help is printed


class CommandGroup(TyperGroup):
    """A group whose unknown commands and options are refused as palpate refuses, with what is meant."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """Read the group's own options, as Typer does; a wrong one is a `UsageError`."""
        options.setdefault("help_option_names", ["--help", "-h"])
        with _mistakes_in_words(None):
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        """Carry out a command, as Typer does; a wrong argument or option of it is a `UsageError`."""
        with _mistakes_in_words(ctx):
            return super().invoke(ctx)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the arguments begin with, as Typer does; an unknown name is a `UsageError`."""
        known = not args or args[0].startswith("-") or self.get_command(ctx, args[0]) is not None
        if not known and not ctx.resilient_parsing:  # which completion is
            self._refuse(ctx, args[0])
        return super().resolve_command(ctx, args)

    def _refuse(self, ctx: Any, word: str) -> None:
        here = _path(ctx)
        own = {name: " ".join([*here, name]) for name in self.commands}
        # a command of another group is found by its last word; a short path goes before a long one
        paths = sorted(
            (" ".join(path) for path in command_paths(ctx.find_root().command)), key=len, reverse=True
        )
        others = {path.rpartition(" ")[2]: path for path in paths}
        if here == ["devices", "simulate"]:
            from palpate.devices import WORDS  # NumPy is loaded with it, as no right name asks for

            others |= WORDS
        meant = did_you_mean(
            word, own, meant=MEANT | others, shown=lambda name: f"`palpate {own.get(name, name)}`"
        )
        group = " ".join(["palpate", *here])
        if way := WAYS.get((" ".join(here), Path(word).suffix.lower())):
            meant = f"Did you mean `palpate {way} {shlex.quote(word)}`?"
        raise UsageError(
            f"There is no command `{group} {word}`.",
            why=f"Commands of `{group}`: {', '.join(self.commands)}.",
            fix=meant or f"`{group} --help` says what each does.",
        )


@contextlib.contextmanager
def _mistakes_in_words(group: Any) -> Iterator[None]:
    """Turn Typer's errors of arguments and options into palpate's own.

    Those without a context are of the command that the group invokes.
    """
    try:
        yield
    except _Mistake as mistake:
        if type(mistake).__name__ == _HELP:
            raise
        ctx = mistake.ctx or group
        words = ["palpate", *_path(ctx)]
        if mistake.ctx is None and group is not None:
            words.append(str(group.invoked_subcommand or ""))
        raise _explain(mistake, " ".join(filter(None, words))) from mistake


def _path(ctx: Any) -> list[str]:
    """Return the words of a command behind the program's name."""
    words: list[str] = []
    while ctx is not None and ctx.parent is not None:
        words.insert(0, str(ctx.info_name))
        ctx = ctx.parent
    return words


def _explain(mistake: Any, command: str) -> UsageError:
    """Return the error that tells of a wrong argument or option of a command, with what is meant, or an example."""
    ctx, option = mistake.ctx, getattr(mistake, "option_name", None)
    said = mistake.format_message().replace("argument(s)", "arguments")
    what = re.sub(r"\s*\((Possible options|Did you mean).*\)|\s*Did you mean .*", "", said)
    help = f"`{command} --help` says what it takes."
    if type(mistake).__name__ == "NoSuchOption" and ctx is not None:
        options = [name for p in ctx.command.params for name in p.opts if name.startswith("--")]
        question = did_you_mean(str(option), options)
        return UsageError(f"`{command}` has no option {option}.", fix=question or help)
    if type(mistake).__name__ == "MissingParameter" and ctx is not None:
        wanted = [p for p in ctx.command.params if p.param_type_name == "argument" and p.required]
        example = " ".join([command, *(FILES.get(p.name, p.name.upper()) for p in wanted)])
        names = " and ".join(p.name.upper() for p in wanted)
        if wanted:
            return UsageError(f"`{command}` needs {names}.", fix=f"For example `{example}`. {help}")
    return UsageError(f"`{command}`: {what[:1].lower()}{what[1:]}".rstrip(".") + ".", fix=help)


def command_paths(command: Any, *before: str) -> Iterator[tuple[str, ...]]:
    """Yield the words of each command below a group: ("export", "fmu")."""
    for name, child in getattr(command, "commands", {}).items():
        if getattr(child, "commands", None):
            yield from command_paths(child, *before, name)
        yield (*before, name)
