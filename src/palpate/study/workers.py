"""How many processes a study may use."""

from __future__ import annotations

from palpate.study.stages import AnyStudy

__all__ = ["with_workers"]


def with_workers(study: AnyStudy, workers: int | None) -> AnyStudy:
    """The study with so many processes for its sweep, and for learning where several can share it; None: as it says."""
    if workers is None:
        return study
    fewer = {}
    for name in ("sweep", "learning"):
        part = getattr(study, name, None)  # histories of a held body have neither
        if part is not None and hasattr(part, "workers"):
            fewer[name] = part.model_copy(update={"workers": workers})
    return study.model_copy(update=fewer)
