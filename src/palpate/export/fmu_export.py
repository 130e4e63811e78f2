"""Export as a Functional Mock-up Unit, FMI 2.0 or 3.0: a description, the weights, a generic binary for each platform.

Nothing is compiled: the binaries were built beforehand (`palpate.export.fmu_binaries`) and read the weights from
resources/weights.bin, whose SHA-256 is the guid or instantiation token. The sources are in the FMU too.
"""

from __future__ import annotations

import importlib.util
import os
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.errors import UsageError
from palpate.export.answer_network import Choice, answer_network
from palpate.export.c_files import require_name
from palpate.export.carried_mass import CarriedMass
from palpate.export.check_answers import compare_answers
from palpate.export.check_fmu import CheckFmu
from palpate.export.check_points import Comparison, compare_body
from palpate.export.core_source import fill_template
from palpate.export.fmu_binaries import built_binaries, fmu_source, require_generic
from palpate.export.fmu_description import SOURCE, Described, build_description, model_description
from palpate.export.fmu_variables import (
    answer_variables,
    body_variables,
    has_exchange,
    moving_variables,
)
from palpate.export.weights_block import WeightsBlock, identifier
from palpate.files import write_file
from palpate.output_files import is_own, require_outputs, with_seal
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import ModelCard, card_of

__all__ = ["VERSIONS", "ExportedFmu", "export_fmu"]

VERSIONS = ("2.0", "3.0")
_WHEN = (1980, 1, 1, 0, 0, 0)  # date of each file in the archive, so that equal contents make equal archives


@dataclass(frozen=True)
class ExportedFmu:
    """An FMU that was written.

    Attributes
    ----------
    path : Path
        The .fmu file.
    hash : str
        SHA-256 of the weights, which is the guid or instantiation token.
    platforms : tuple of str
        Folders of binaries that are in.
    exchange : bool
        Whether it is for model exchange too.
    fmi : str
        Version of FMI.
    deviation : bool
        Whether the deviation of the force went out.
    comparison : Comparison, optional
        How far it is from palpate; None where FMPy is not installed, or nothing was to be compared.
    """

    path: Path
    hash: str
    platforms: tuple[str, ...]
    exchange: bool
    fmi: str = "2.0"
    deviation: bool = True
    comparison: Comparison | None = None

    def compare(self, surrogate: Surrogate, *, choice: Choice | None = None) -> Comparison | None:
        """Return how far the FMU is from its surrogate, loaded by FMPy; None where there is none.

        Parameters
        ----------
        surrogate : Surrogate
            What was exported.
        choice : Choice, optional
            The values of fields that went out, of a surrogate that no hand feels.

        Raises
        ------
        AccuracyError
            If it differs by more than it may.
        """
        if importlib.util.find_spec("fmpy") is None:
            return None
        with CheckFmu(self.path) as fmu:
            if surrogate.can_be_touched:
                certain = self.deviation and surrogate.hand_energy.root is not None
                comparison = compare_body(surrogate, fmu, deviation=certain, partial=True)
            else:
                answers = answer_network(surrogate, choice or Choice())
                answers = answers if self.deviation else answers.without_doubts()
                comparison = compare_answers(answers, fmu.outputs)
        why, fix = "Its binary or this machine may bend the arithmetic.", "Report this: it must not be used."
        comparison.require("The FMU does", why=why, fix=fix)
        return comparison

    def as_dict(self) -> dict[str, Any]:
        """Return what was written and compared, for JSON."""
        return {
            "file": str(self.path),
            "hash": self.hash,
            "fmi": self.fmi,
            "platforms": list(self.platforms),
            "exchange": self.exchange,
            "compared": None if self.comparison is None else self.comparison.as_dict(),
        }


def export_fmu(
    surrogate: Surrogate,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    fmi: str = "2.0",
    deviation: bool = True,
    choice: Choice | None = None,
    carried: CarriedMass | None = None,
    check: bool = True,
    overwrite: bool = False,
) -> ExportedFmu:
    """Write a surrogate as an FMU, and compare it with palpate at 1,000 places if FMPy is installed.

    A body that a hand feels answers a place by a force, or with a mass a force by a place. What no hand feels answers
    its inputs by its numbers, its curves and chosen values of its fields. ``run_fmu.py`` beside it runs it with FMPy.

    Parameters
    ----------
    surrogate : Surrogate
        The surrogate; the baseline and the memory of a body must be palpate's own.
    out : path
        The file, NAME.fmu.
    name : str, optional
        Model identifier; by default the body's name.
    fmi : str
        Version of FMI: "2.0", which most importers take, or "3.0".
    deviation : bool
        Whether deviations go out: of the force, or of the answers of what no hand feels.
    choice : Choice, optional
        Values of fields that go out; by default mean, largest and least value of each.
    carried : CarriedMass, optional
        A mass at the tip of a body, which the FMU moves.
    check : bool
        Whether it is compared.
    overwrite : bool
        True replaces files whatever they are; by default those alone that an earlier export wrote.

    Raises
    ------
    UsageError
        If its baseline or memory is none of those that the generic binary holds, there is no such version, the name
        does not end in ``.fmu``, a choice or a mass does not fit the surrogate, or a file exists that no export wrote.
    AccuracyError
        If it differs from palpate by more than it may; nothing is written.
    """
    if fmi not in VERSIONS:
        raise UsageError(
            f"There is no export to FMI {fmi}.",
            why="FMUs of different versions are different files.",
            fix=f"Give {' or '.join(VERSIONS)}.",
        )
    script = Path(out).with_name("run_fmu.py")
    require_outputs([out], endings=(".fmu",), overwrite=overwrite)
    name = require_name(identifier(surrogate.name) if name is None else name)
    if surrogate.can_be_touched:
        block, described = _body(surrogate, name, deviation, choice, carried)
    else:
        block, described = _answers(surrogate, name, deviation, choice, carried)
    card = card_of(surrogate).with_hash(block.label, block.hash)
    if carried is not None:
        card = replace(card, limits=(*card.limits, carried.sentence))
    binaries = built_binaries(fmi)
    entries = _entries(described, block, card, fmi, binaries)
    content, platforms = _zip_entries(entries), tuple(f.partition("/")[0] for f in binaries)
    done = ExportedFmu(Path(out), block.hash, platforms, described.exchange, fmi, deviation)
    if check:
        with tempfile.TemporaryDirectory() as place:
            tried = replace(done, path=write_file(Path(place) / f"{name}.fmu", content))
            done = replace(done, comparison=tried.compare(surrogate, choice=choice))
    write_file(done.path, content)
    if overwrite or not script.exists() or is_own(script):  # one that somebody changed stays
        write_file(script, with_seal(script.name, fill_template("run_fmu.py", {}, ())))
    return done


def _body(
    surrogate: Surrogate, name: str, deviation: bool, choice: Choice | None, carried: CarriedMass | None
) -> tuple[WeightsBlock, Described]:
    """Return weights and description of a body that a hand feels."""
    if choice is not None and not choice.is_default:
        raise UsageError(
            f"{surrogate.name!r} is touched: values of its fields do not go out in an FMU.",
            why="An FMU of a touched body answers the place of a hand by a force.",
            fix="Leave --at-nodes, --means and --extremes out, or take the field out as C99.",
        )
    block = WeightsBlock.of(surrogate, deviation=deviation)
    require_generic(surrogate, block, "binary of FMUs")
    words = str(surrogate).splitlines()[0]
    if carried is None:
        return block, Described(name, words, body_variables(surrogate), has_exchange(surrogate))
    carried.require_body(surrogate)
    moving = moving_variables(surrogate, carried)
    return carried.added_to(block), Described(name, words, moving, derivatives=False)


def _answers(
    surrogate: Surrogate, name: str, deviation: bool, choice: Choice | None, carried: CarriedMass | None
) -> tuple[WeightsBlock, Described]:
    """Return weights and description of a surrogate that no hand feels."""
    if carried is not None:
        raise UsageError(
            f"{surrogate.name!r} can't carry a mass.",
            why="No hand feels it: it has no energy whose slope would be a force.",
            fix="Leave --mass and --damping out.",
        )
    answers = answer_network(surrogate, choice or Choice())
    answers = answers if deviation else answers.without_doubts()
    words = str(surrogate).splitlines()[0]
    return WeightsBlock.of_answers(answers), Described(name, words, answer_variables(answers))


def _entries(
    described: Described, block: WeightsBlock, card: ModelCard, fmi: str, binaries: Mapping[str, bytes]
) -> dict[str, bytes]:
    """Return the contents of all files of the archive by their names."""
    entries: dict[str, bytes] = {
        "modelDescription.xml": model_description(described, block.hash, fmi).encode(),
        "resources/weights.bin": block.to_bytes(),
        f"sources/{SOURCE}": fmu_source().encode(),
    }
    if fmi == "3.0":
        entries["sources/buildDescription.xml"] = build_description(described.name).encode()
    entries |= {
        "documentation/card.md": card.to_markdown().encode(),
        "documentation/card.json": card.to_json().encode(),
    }
    for file, content in binaries.items():
        folder, _, ending = file.partition("/")
        entries[f"binaries/{folder}/{described.name}{ending}"] = content
    return entries


def _zip_entries(entries: Mapping[str, bytes]) -> bytes:
    from io import BytesIO

    whole = BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in entries.items():
            info = zipfile.ZipInfo(name, _WHEN)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o755 << 16
            file.writestr(info, content)
    return whole.getvalue()
