"""Names of commands: who mistypes one, or asks by another tool's name, is told the command that is meant."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from typer.core import TyperGroup

from palpate.checks import did_you_mean
from palpate.errors import UsageError

__all__ = ["CommandGroup", "command_paths"]

MEANT = {
    **dict.fromkeys(("simulink", "fmi", "modelica", "dymola", "openmodelica"), "export fmu"),
    **dict.fromkeys(("unity", "unreal", "matlab", "library", "dll"), "export lib"),
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


class CommandGroup(TyperGroup):
    """A group whose unknown commands are refused as palpate refuses, with the command that is meant."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the arguments begin with, as Typer does; an unknown name is a `UsageError`."""
        known = not args or args[0].startswith("-") or self.get_command(ctx, args[0]) is not None
        if not known and not ctx.resilient_parsing:  # which completion is
            self._refuse(ctx, args[0])
        return super().resolve_command(ctx, args)

    def _refuse(self, ctx: Any, word: str) -> None:
        here: list[str] = []
        while ctx.parent is not None:
            here.insert(0, str(ctx.info_name))
            ctx = ctx.parent
        own = {name: " ".join([*here, name]) for name in self.commands}
        # a command of another group is found by its last word; a short path goes before a long one
        paths = sorted((" ".join(path) for path in command_paths(ctx.command)), key=len, reverse=True)
        others = {path.rpartition(" ")[2]: path for path in paths}
        if here == ["devices", "simulate"]:
            from palpate.devices import WORDS  # NumPy is loaded with it, as no right name asks for

            others |= WORDS
        meant = did_you_mean(
            word, own, meant=MEANT | others, shown=lambda name: f"`palpate {own.get(name, name)}`"
        )
        group = " ".join(["palpate", *here])
        raise UsageError(
            f"There is no command `{group} {word}`.",
            why=f"Commands of `{group}`: {', '.join(self.commands)}.",
            fix=meant or f"`{group} --help` says what each does.",
        )


def command_paths(command: Any, *before: str) -> Iterator[tuple[str, ...]]:
    """Yield the words of each command below a group: ("export", "fmu")."""
    for name, child in getattr(command, "commands", {}).items():
        if getattr(child, "commands", None):
            yield from command_paths(child, *before, name)
        yield (*before, name)
