"""The evaluator core's sources as one text: the parts that a body needs, in the order in which they use each other."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from importlib import resources

from palpate.export.weights_block import WeightsBlock

__all__ = ["core_file", "core_source", "fill_template", "generic_source"]

_BASELINES = (
    "contact_baseline.c",
    "pad_baseline.c",
    "constant_baseline.c",
    "overlap_baseline.c",
    "posed_baseline.c",
    "pinch_baseline.c",
)
_PART = re.compile(r"@IF (\w+)@\n(.*?)@END@\n", re.DOTALL)
_MEMORIES = ("relaxation.c", "indentation.c", "iwan_elements.c", "friction.c")

# by the numbers of palpate.surrogates.memories.friction
_UNDER_FRICTION = (
    "#define FRICTION_UNDER(code) (code == 1 ? relaxation_step : code == 2 ? indentation_step : 0)\n"
)


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
        parts += [core_file("torque.c")] if block.torque else []
    else:
        parts.append(core_file("answers.c"))
    if block.memory:
        parts.append(block.sources[block.memory])
    if block.field:
        parts.append(core_file("field.c"))
    return "\n".join(parts)


def generic_source(*programs: str) -> str:
    """Return the core with all baselines and memories, and programs (``fmi2.c``) that read blocks of weights."""
    surrogates = resources.files("palpate.surrogates")
    texts = [core_file(name) for name in ("palpate_core.h", "prelude.c", "network.c", "surface.c")]
    texts += [(surrogates / "baselines" / name).read_text("utf-8") for name in _BASELINES]
    texts += [core_file("generic.c"), core_file("energy.c"), core_file("torque.c"), _UNDER_FRICTION]
    texts += [(surrogates / "memories" / name).read_text("utf-8") for name in _MEMORIES]
    texts += [core_file(name) for name in ("generic_memory.c", "block.c", *programs)]
    return "\n".join(texts)


def fill_template(name: str, words: Mapping[str, str], parts: Collection[str]) -> str:
    """Return a text of ``templates`` with words filled in one after the other, and with those of its IF parts."""
    text = (resources.files("palpate.export") / "templates" / f"{name}.in").read_text("utf-8")
    text = _PART.sub(lambda match: match[2] if match[1] in parts else "", text)
    for word, value in words.items():
        text = text.replace(word, value)
    return text


def _hooks(name: str) -> str:
    return "".join(f"#define PP_{hook.upper()} {name}_{hook}\n" for hook in ("enter", "rest", "log", "leave"))
