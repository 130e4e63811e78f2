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
from palpate.export.c_files import require_name
from palpate.export.check_fmu import CheckFmu
from palpate.export.check_points import Comparison, compare_body
from palpate.export.fmu_binaries import built_binaries, fmu_source
from palpate.export.fmu_description import SOURCE, build_description, model_description
from palpate.export.fmu_variables import has_exchange
from palpate.export.weights_block import WeightsBlock, identifier
from palpate.files import write_file
from palpate.output_files import require_outputs
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import card_of

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

    def compare(self, surrogate: Surrogate) -> Comparison | None:
        """Return how far the FMU is from its body, loaded by FMPy; None where there is none.

        Raises
        ------
        AccuracyError
            If it differs by more than it may.
        """
        if importlib.util.find_spec("fmpy") is None:
            return None
        known = self.deviation and surrogate.hand_energy.root is not None
        with CheckFmu(self.path) as fmu:
            comparison = compare_body(surrogate, fmu, deviation=known, partial=True)
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
    check: bool = True,
    overwrite: bool = False,
) -> ExportedFmu:
    """Write a body as an FMU, and compare it with palpate at 1,000 places if FMPy is installed.

    Parameters
    ----------
    surrogate : Surrogate
        The body; its baseline and memory must be palpate's own.
    out : path
        The file, NAME.fmu.
    name : str, optional
        Model identifier; by default the body's name.
    fmi : str
        Version of FMI: "2.0", which most importers take, or "3.0".
    deviation : bool
        Whether the deviation of the force goes out.
    check : bool
        Whether it is compared.
    overwrite : bool
        True replaces files whatever they are; by default those alone that an earlier export wrote.

    Raises
    ------
    UsageError
        If its baseline or memory is none of those that the generic binary holds, there is no such version, the name
        does not end in ``.fmu``, or a file exists that no export wrote.
    AccuracyError
        If it differs from palpate by more than it may; nothing is written.
    """
    if fmi not in VERSIONS:
        raise UsageError(
            f"There is no export to FMI {fmi}.",
            why="FMUs of different versions are different files.",
            fix=f"Give {' or '.join(VERSIONS)}.",
        )
    require_outputs([out], endings=(".fmu",), overwrite=overwrite)
    name = require_name(identifier(surrogate.name) if name is None else name)
    block = WeightsBlock.of(surrogate, deviation=deviation)
    _, _, baseline, memory = block.tables[0].values[:4].tolist()
    if baseline == 0 or (surrogate.memory is not None and memory == 0):
        kind = f"baseline {surrogate.hand_energy.baseline.name!r}"
        kind = kind if baseline == 0 or surrogate.memory is None else f"memory {surrogate.memory.name!r}"
        raise UsageError(
            f"The {kind} is not in the generic binary of FMUs.",
            why="That binary is built beforehand, of palpate's own baselines and memories.",
            fix="Take the body out as C99, which compiles the C source of your own.",
        )
    binaries = built_binaries(fmi)
    entries: dict[str, bytes] = {
        "modelDescription.xml": model_description(surrogate, name, block.hash, fmi).encode(),
        "resources/weights.bin": block.to_bytes(),
        f"sources/{SOURCE}": fmu_source().encode(),
    }
    if fmi == "3.0":
        entries["sources/buildDescription.xml"] = build_description(name).encode()
    card = card_of(surrogate).with_hash(block.label, block.hash)
    entries |= {
        "documentation/card.md": card.to_markdown().encode(),
        "documentation/card.json": card.to_json().encode(),
    }
    for file, content in binaries.items():
        folder, _, ending = file.partition("/")
        entries[f"binaries/{folder}/{name}{ending}"] = content
    content, platforms = _zip_entries(entries), tuple(f.partition("/")[0] for f in binaries)
    done = ExportedFmu(Path(out), block.hash, platforms, has_exchange(surrogate), fmi, deviation)
    if check:
        with tempfile.TemporaryDirectory() as place:
            tried = replace(done, path=write_file(Path(place) / f"{name}.fmu", content))
            done = replace(done, comparison=tried.compare(surrogate))
    write_file(done.path, content)
    return done


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
