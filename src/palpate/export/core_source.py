"""The evaluator core's sources as one text: the parts that a body needs, in the order in which they use each other."""

from __future__ import annotations

from importlib import resources

from palpate.export.weights_block import WeightsBlock

__all__ = ["core_file", "core_source"]


def core_file(name: str) -> str:
    """Return one of the core's files as text."""
    return (resources.files("palpate.export") / "core" / name).read_text("utf-8")


def core_source(block: WeightsBlock) -> str:
    """Return the core for one body or network, without its numbers."""
    parts = [core_file("palpate_core.h"), core_file("prelude.c"), core_file("network.c")]
    if block.baseline:
        parts += [
            core_file("surface.c"),
            block.sources[block.baseline],
            _hooks(block.baseline),
            core_file("energy.c"),
        ]
    if block.memory:
        parts.append(block.sources[block.memory])
    if block.field:
        parts.append(core_file("field.c"))
    return "\n".join(parts)


def _hooks(name: str) -> str:
    return "".join(f"#define PP_{hook.upper()} {name}_{hook}\n" for hook in ("enter", "rest", "log", "leave"))
