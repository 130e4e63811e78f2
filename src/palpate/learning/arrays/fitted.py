"""The result of a fit: a network with the widths of its intervals and the region it was trained in."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.format import duration, share
from palpate.learning.arrays.array_samples import points
from palpate.learning.arrays.compared_rows import ComparedRows, check_outputs
from palpate.learning.search import Trial
from palpate.network import Network, TrainedRegion
from palpate.network.influence import Influence
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates import LearntQuantities, Surrogate
from palpate.surrogates.model_card import ModelCard, card_of

__all__ = ["Fitted"]

_SHOWN = 5  # of what was tried


@dataclass(frozen=True, eq=False)
class Fitted:
    """A network chosen and fitted, n inputs and m outputs; printed, it says what was chosen and what was tried.

    Attributes
    ----------
    network : Network
        In SI units, as it answers.
    form : str
        Of its units: rank-1, rank-2, rotated, axis-aligned; kernel layer; or affine or mean, without units.
    radial : str
        Radial function of its units.
    units : int
        Number of units.
    heldout : float
        Error on held-out samples relative to the outputs' standard deviation, before the weights saw them.
    trials : tuple of Trial
        The candidates, each with its error on held-out samples.
    seconds : float
        Time that the fit took, s.
    uncertainty : Uncertainty
        Of the network.
    region : TrainedRegion
        In scaled inputs.
    level : float
        For which the intervals were calibrated.
    one_output : bool
        Whether the outputs came as (N,), and so go.
    members : tuple of Network
        The networks whose mean answers; none where one alone does.
    notes : tuple of str
        What must be known of it, such as inputs that hardly matter.
    columns : tuple of str
        Names of the columns of the table that it was fitted to, by which columns are matched later; those of the
        inputs if empty.
    influence : Influence, optional
        How the answers hang on single samples, where these were few.
    outlook : str
        What more time, or more rows, may bring; "" for a network read from a file.
    comparison : ComparedRows, optional
        The rows that judged, with what was answered there before they were learnt; not in a file.
    """

    network: Network
    form: str
    radial: str
    units: int
    heldout: float
    trials: tuple[Trial, ...]
    seconds: float
    uncertainty: Uncertainty
    region: TrainedRegion
    level: float = 0.9
    one_output: bool = False
    members: tuple[Network, ...] = ()
    notes: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    influence: Influence | None = None
    outlook: str = ""
    comparison: ComparedRows | None = None

    def predict(self, X: Any) -> np.ndarray:
        """Return outputs (N, m) at inputs X (N, n); (N,) where Y was.

        The columns of a table are matched by name, in any order, here and below.

        Raises
        ------
        UsageError
            If X has the wrong shape, or a table lacks a column or has an unknown one.
        """
        return self._shaped(self.network.predict(self._points(X)))

    def deviation(self, X: Any) -> np.ndarray:
        """Return the standard deviation (N, m) of what would be measured at X (N, n).

        Scaled so that ±1.64 of it hold nine in ten, whatever the law of the errors.

        Raises
        ------
        UsageError
            If X has the wrong shape.
        """
        return self._shaped(self._learnt.deviation(self._points(X)))

    @cached_property
    def _learnt(self) -> LearntQuantities:
        """The network with its uncertainty and region, as a surrogate keeps it."""
        parts = (self.network, self.uncertainty, self.region, self.members, self.influence, self.level)
        return LearntQuantities(*parts)

    def surrogate(self, name: str = "") -> Surrogate:
        """Return the network as a surrogate with quantities: what exports, pages and `palpate.load` take.

        Parameters
        ----------
        name : str
            Its name, for record and page; by default those of its outputs.
        """
        outputs = [q.name for q in self.network.outputs]
        network = self._with_record()
        learnt = replace(
            self._learnt, network=network, uncertainty=replace(self.uncertainty, network=network)
        )
        meta = {**network.meta, "samples": self.network.meta.get("training", {}).get("samples")}
        meta = {k: v for k, v in meta.items() if v is not None} | {"name": name or ", ".join(outputs[:3])}
        return Surrogate(meta=meta, quantities={outputs[0] if len(outputs) == 1 else "outputs": learnt})

    def interval(self, X: Any, level: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (N, m) for what would be measured at X (N, n), output by output.

        At the level that was calibrated for (the default) they hold about that share of unseen samples drawn like
        the training samples, whatever the law of the errors. Outside the trained region nothing is promised.

        Parameters
        ----------
        X : (N, n)
            Inputs, SI units; (N,) for a single input.
        level : float, optional
            Another one stretches the widths by a normal law.

        Raises
        ------
        UsageError
            If X has the wrong shape, or the level is no probability.
        """
        low, high = self._learnt.interval(self._points(X), level)
        return self._shaped(low), self._shaped(high)

    def trusted(self, X: Any) -> np.ndarray:
        """Return which of X (N, n) are like the training samples, (N,) bool.

        They are as near to a sample as those are to each other, and the networks whose mean answers agree there to
        three standard deviations; of few samples, the answers without one of them do, as they do not beside a kink.

        Raises
        ------
        UsageError
            If X has the wrong shape.
        """
        return self._learnt.trusted(self._points(X))

    def score(self, X: Any, Y: Any) -> float:
        """Return the coefficient of determination R², mean of the outputs, as scikit-learn's regressors do.

        1 is perfect, 0 is as good as the outputs' mean. A constant output counts 1 where it is met, else 0.

        Parameters
        ----------
        X : (N, n)
            Inputs, SI units; two rows at least.
        Y : (N, m) or (N,)
            What was measured there.

        Raises
        ------
        UsageError
            If X or Y has the wrong shape.
        """
        X = self._points(X)
        Y = check_outputs(Y, len(X), len(self.network.outputs))
        left = ((Y - self.network.predict(X)) ** 2).sum(axis=0)
        whole = ((Y - Y.mean(axis=0)) ** 2).sum(axis=0)
        ratio = left / np.where(whole > 0, whole, 1.0)
        return float(np.where(whole > 0, 1.0 - ratio, np.where(left > 0, 0.0, 1.0)).mean())

    def plot(self, path: str | os.PathLike[str] | None = None, *, X: Any = None, Y: Any = None) -> Any:
        """Return a Matplotlib figure of answers over what was measured, with the share that the intervals hold.

        Parameters
        ----------
        path : path, optional
            File in which it is saved too, such as ``fit.png``.
        X, Y : (N, n) and (N, m), optional
            Rows to compare with; by default those that judged, as they were answered before they were learnt.

        Raises
        ------
        UsageError
            If a network read from a file is given no rows, or arrays have the wrong shape.
        """
        if X is not None:
            X = self._points(X)
            Y = check_outputs(Y, len(X), len(self.network.outputs))
            rows = ComparedRows(Y, self.network.predict(X), "answers at the rows given")
        elif self.comparison is not None:
            rows = self.comparison
        else:
            raise UsageError(
                "There are no rows to compare with.",
                why="A file keeps the network, not the rows that it was learnt from.",
                fix="Pass rows: model.plot(X=X, Y=Y).",
            )
        return rows.plot(
            self.network.outputs, f"{self._kind}\nerror {share(self.heldout)} of the spread", path
        )

    def card(self, file: str | os.PathLike[str] | None = None) -> ModelCard:
        """Return the model card: inputs with their ranges, error, limits and hashes.

        Parameters
        ----------
        file : path, optional
            Its file, whose hash goes into the card.
        """
        name = "model" if file is None else Path(file).stem
        return card_of(Surrogate.of(self._with_record(), name), file)

    def to_html(self) -> str:
        """Return the model card as one HTML page."""
        return self.card().to_html()

    def _repr_html_(self) -> str:
        """Show the model card in a notebook."""
        return self.card()._repr_html_()

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the network with its uncertainty and region to a network file.

        `load` reads all of it back; `palpate.Network.load` reads the network, and
        `palpate.network.Uncertainty.of(network)` the uncertainty in it.

        Raises
        ------
        UsageError
            If the folder does not exist or can't be written.
        """
        network = self.uncertainty.attached()
        region = {"region_points": self.region.points, "region_radius": np.array([self.region.radius])}
        if self.members:
            region["member_units"] = np.array([float(member.units) for member in self.members])
            region["member_tails"] = np.stack([member.tail for member in self.members])
        if self.influence is not None:
            region |= self.influence.arrays()
        network = self._with_record(network)
        return replace(network, extras={**network.extras, **region}).save(path)

    def _with_record(self, network: Network | None = None) -> Network:
        """Return the network, by default as it answers, with the record of its choice."""
        network = self.network if network is None else network
        kept = {
            "notes": list(self.notes),
            "form": self.form,
            "heldout": self.heldout,
            "level": self.level,
            "one_output": self.one_output,
            "columns": list(self.columns),
        }
        return replace(network, meta={**network.meta, "choice": kept})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Fitted:
        """Read back what `save` wrote, but for what was tried.

        Raises
        ------
        FileFormatError
            If the file is missing, damaged, or holds something else.
        """
        network = Network.load(path)
        try:
            return _restored(network)
        except (KeyError, IndexError, TypeError, ValueError, UsageError) as error:
            raise FileFormatError(
                f"{path} holds a network, but not one that `fit` has saved.",
                why=f"{type(error).__name__}: {error}",
                fix="Read the network alone with palpate.Network.load.",
            ) from error

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        n, m = len(self.network.inputs), len(self.network.outputs)
        took = f"{duration(self.seconds)}; " if self.seconds else ""
        lines = [
            f"Fitted: {n} input{'s' * (n > 1)} → {m} output{'s' * (m > 1)}, {self._kind}",
            f"  {took}error {share(self.heldout)} of the outputs' spread on rows held out; "
            f"intervals of {self.level:.0%}",
        ]
        lines += [f"  {self.outlook}"] if self.outlook else []
        lines += [f"  {note}" for note in self.notes]
        if self.trials:
            lines += self._attempt_lines()
        return "\n".join(lines)

    @property
    def _kind(self) -> str:
        """The network in words."""
        return (
            "the mean of the outputs"
            if self.form == "mean"
            else "an affine function"
            if not self.units
            else f"{self.units} units, {self.form}, {self.radial}"
            if self.form != "kernel layer"
            else f"a kernel layer of {self.units} {self.radial} units"
        )

    def _attempt_lines(self) -> list[str]:
        """Return the best networks that were tried, the best of the chosen form among them, as lines.

        Their errors are of the samples that chose. The winner's own is measured anew, on samples in turn that were left
        out of networks like it, so it may be more than the least one here, which was lucky with its samples.
        """
        best: dict[str, Trial] = {}
        for trial in sorted(self.trials, key=lambda trial: trial.error):
            best.setdefault(trial.name, trial)
        chosen = next((t for t in best.values() if (t.form, t.radial) == (self.form, self.radial)), None)
        shown = list(best.values())[:_SHOWN]
        if chosen is not None and chosen not in shown:
            shown = [*shown[: _SHOWN - 1], chosen]
        head = f"  {len(best)} tried, judged only by the samples that chose, among them:"
        mark = "  (chosen; judged anew above)"
        return [head, *(f"    {t.error:.1e}  {t.name}{mark * (t is chosen)}" for t in shown)]

    def _points(self, X: Any) -> np.ndarray:
        return points(X, self.network.inputs, self.columns)

    def _shaped(self, Y: np.ndarray) -> np.ndarray:
        return Y[:, 0] if self.one_output else Y


def _restored(network: Network) -> Fitted:
    """Return what `save` put into the network's extras and meta; whatever is wrong with these raises."""
    uncertainty, kept = Uncertainty.of(network), network.meta["choice"]
    if uncertainty is None:
        raise KeyError("uncertainty")
    region = TrainedRegion(network.extras["region_points"], float(network.extras["region_radius"][0]))
    if region.points.shape[1] != len(network.inputs):
        raise ValueError("region of other inputs")
    return Fitted(
        network,
        str(kept["form"]),
        network.radial,
        network.units,
        float(kept["heldout"]),
        (),
        0.0,
        uncertainty,
        region,
        float(kept["level"]),
        bool(kept["one_output"]) and len(network.outputs) == 1,
        _members(network),
        tuple(str(note) for note in kept.get("notes", ())),
        tuple(str(name) for name in kept.get("columns", ())),
        Influence.restored(network.extras, network),
    )


def _members(network: Network) -> tuple[Network, ...]:
    """Return the networks of whose units and tails a mean was made."""
    if "member_units" not in network.extras:
        return ()
    tails, counts = network.extras["member_tails"], network.extras["member_units"].astype(int)
    ends = np.cumsum(counts)
    if ends[-1] != network.units or tails.shape != (len(counts), *network.tail.shape):
        raise ValueError("members of another network")
    return tuple(
        replace(
            network,
            factors=network.factors[end - count : end],
            shifts=network.shifts[end - count : end],
            weights=network.weights[:, end - count : end] * len(counts),
            tail=tail,
            extras={},
        )
        for end, count, tail in zip(ends, counts, tails, strict=True)
    )
