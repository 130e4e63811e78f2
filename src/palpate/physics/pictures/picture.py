"""What `plot_solution` returns."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

from palpate.errors import UsageError

__all__ = ["Picture"]


class Picture:
    """A drawn solution: a notebook shows it, `save` writes it, `show` opens a window.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        To write on, or to put beside others.
    """

    def __init__(self, figure: Any) -> None:
        self.figure = figure

    def save(self, path: str | os.PathLike[str], *, dpi: float | None = None) -> Path:
        """Write PNG, PDF, SVG or JPEG, by the name's ending, and return the path.

        Raises
        ------
        UsageError
            If the ending is none of those, or the file can't be written.
        """
        target = Path(path)
        try:
            self.figure.savefig(target, dpi=dpi or "figure")
        except (ValueError, OSError) as error:
            raise UsageError(
                f"Could not write {target}.", why=str(error), fix="Write to NAME.png, .pdf, .svg or .jpg."
            ) from error
        return target

    def show(self) -> None:
        """Open a window and wait until it is closed; to turn the body there is `palpate.show`.

        Raises
        ------
        UsageError
            Where no window can be opened.
        """
        import matplotlib as mpl
        from matplotlib import pyplot

        if mpl.get_backend().lower() == "agg":
            raise UsageError(
                "There is no display to open a window on.",
                fix="Save the picture: result.plot().save('picture.png'), or use palpate.show(result).",
            )
        width, height = self.figure.get_size_inches()
        window = pyplot.figure(figsize=(width, height))
        axes = window.add_axes((0, 0, 1, 1))
        axes.imshow(pyplot.imread(io.BytesIO(self._repr_png_())))
        axes.set_axis_off()
        pyplot.show()

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.figure.savefig(data, format="png")
        return data.getvalue()
