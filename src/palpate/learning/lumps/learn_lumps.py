"""The energy that a lump adds to a press, learnt from lookups in presses without a lump.

Rows are the lumps looked up in each press of a `LumpProblem`; `palpate.surrogates.lumps.lump_contrast` has formulas.
Of ln(D/U) values and slopes by the place of the hand are fitted, of ln β values. The constant k of the closed form, and
its error, come from the presses that were solved with a lump. The error is that of presses whose places were left out:
‖learnt − solved change of force‖ over the solved change, where that is above 1 % of the force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.learning.dataset_symmetry import declared_symmetry
from palpate.learning.lumps.gaussian_surfaces import Samples, as_sum, fit_surface, fit_widths
from palpate.surrogates.lumps.lump_contrast import LumpContrast, closed_form, contrast_inputs
from palpate.surrogates.lumps.lump_room import LumpRoom, skin_of
from palpate.units import Range

__all__ = ["LEAST_CONTRAST", "LumpPresses", "change_errors", "learn_lumps"]

LEAST_CONTRAST = 0.01  # of the force: a change below it is felt by nobody, and has no error
FELT = 0.003  # ΔU/U at which a lookup counts half
IMAGES = 4  # of each lookup by the body's symmetry, at most
UNITS, FEWER_UNITS = 640, 120  # of ln(D/U), and of ln β
FOLDS = 4
WIDTHS = np.array([2.0, 2.0, 2.0, 0.8, 0.8, 0.8, 3.0])  # to begin with: offsets matter most
FEWEST = 8  # presses with a lump that say k and an error


@dataclass(frozen=True, eq=False)
class LumpPresses:
    """Presses without a lump, the lumps looked up in them, and those solved with one; SI units.

    Attributes
    ----------
    X, energy, force : (N, 3), (N,), (N, 3)
        Places of the hand, U and F.
    place, radius, density, slope : (N, L, 3), (N, L), (N, L), (N, L, 3)
        Lumps looked up, D and its slopes by the hand's place.
    compliance : (N, K)
        β of the first K.
    ratio, added, change : (N,), (N,), (N, 3)
        Of the first lump where the press was solved with it, else NaN: ratio, energy and force that it adds.
    room : LumpRoom
        Where lumps may be.
    symmetry, about : (k, 3, 3), (3,)
        The body's isometries and the point that stays, m.
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    place: np.ndarray
    radius: np.ndarray
    density: np.ndarray
    slope: np.ndarray
    compliance: np.ndarray
    ratio: np.ndarray
    added: np.ndarray
    change: np.ndarray
    room: LumpRoom
    symmetry: np.ndarray = field(default_factory=lambda: np.eye(3)[None])
    about: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def of(cls, data: Dataset) -> LumpPresses:
        """Return the presses of a dataset of a `LumpProblem`.

        Raises
        ------
        UsageError
            If its lumps were not looked up by palpate.
        """
        record = data.provenance.get("problem", {}).get("lumps")
        if record is None or "lump_energy" not in data:
            raise UsageError(
                "This dataset knows nothing of lumps.",
                why="Its presses were solved without looking lumps up.",
                fix="Sweep a `palpate.LumpProblem`.",
            )
        data = data.ok
        data = data.take(np.flatnonzero(data.potential_energy > 0.0))
        (least, largest), (softest, hardest) = record["radius"], record["ratio"]
        lower, upper = map(np.array, record["room"])
        sizes = Range("radius", least, largest, "m"), Range("ratio", softest, hardest)
        room = LumpRoom(lower, upper, *sizes, record["cover"], skin_of(data.rest, data.triangles))
        columns = {
            "density": "energy", "change": "force",
            **{name: name for name in ("place", "radius", "slope", "compliance", "ratio", "added")},
        }  # fmt: skip
        lumps: dict[str, Any] = {own: np.asarray(data[f"lump_{name}"]) for own, name in columns.items()}
        lumps["symmetry"], lumps["about"] = declared_symmetry(data)
        return cls(data.X, data.potential_energy, data.response, room=room, **lumps)

    def take(self, rows: np.ndarray) -> LumpPresses:
        """Return some of the presses."""
        whole = ("room", "symmetry", "about")
        return replace(self, **{k: v[rows] for k, v in vars(self).items() if k not in whole})

    @property
    def groups(self) -> np.ndarray:
        """Number (N,) of each press's place over the surface: presses at one place are left out together."""
        unit = 1e-3  # m
        return np.unique(np.round(self.X[:, :2] / unit), axis=0, return_inverse=True)[1].ravel()

    @property
    def contrast_rows(self) -> np.ndarray:
        """Rows of presses solved with a lump whose change of force counts."""
        size = np.linalg.norm(self.force, axis=1)
        with np.errstate(invalid="ignore"):
            return np.flatnonzero(np.linalg.norm(self.change, axis=1) > LEAST_CONTRAST * size)


def learn_lumps(
    presses: LumpPresses, log: Callable[[str], None] = lambda _: None, *, units: int = UNITS
) -> LumpContrast:
    """Learn what any lump adds to a press.

    Parameters
    ----------
    presses : LumpPresses
        Presses without a lump and what was looked up in them.
    log : callable
        Told what begins, as one line.
    units : int
        Most units of the network of ln(D/U).

    Raises
    ------
    UsageError
        If fewer than four places were pressed.
    """
    places = np.unique(presses.groups)
    if len(places) < FOLDS:
        raise UsageError(
            f"Lumps are learnt from presses at {FOLDS} places or more; there are {len(places)}.",
            why="What a lump adds changes from place to place.",
            fix="Sweep more samples.",
        )
    log(f"learning what lumps add, from {presses.radius.size} lookups")
    with threadpool_limits(1):
        shape = _Shape.of(presses)
        k = _curvature(presses)
        whole = shape.fit(presses, k, units)
        errors = _left_out_errors(presses, shape, k, units)
    meta: dict[str, Any] = {
        "presses": len(presses.X),
        "lookups": int(presses.radius.size),
        "presses with a lump": int(np.isfinite(presses.added).sum()),
    }
    if errors.size >= FEWEST:
        median, p95 = np.quantile(errors, [0.5, 0.95])
        meta["contrast_error"] = {"median": float(median), "p95": float(p95), "count": int(errors.size)}
    return replace(whole, meta=meta)


@dataclass(frozen=True, eq=False)
class _Shape:
    """The choices of a fit, made once before presses are left out: scaling, distance exponent and widths."""

    middle: np.ndarray
    half: np.ndarray
    decay: float
    widths: np.ndarray
    soft_widths: np.ndarray

    @classmethod
    def of(cls, presses: LumpPresses) -> _Shape:
        Z, _, _ = _rows(presses)
        low, high = Z.min(axis=0), Z.max(axis=0)
        first = cls((low + high) / 2.0, (high - low) / 2.0, 0.0, WIDTHS, WIDTHS)
        rows, groups = first.density_rows(presses)
        far = np.log(np.linalg.norm(Z[:, 3:6], axis=1))
        B = np.column_stack([np.ones(len(far)), rows.Z, far]) * np.sqrt(rows.weight)[:, None]
        decay = -float(np.linalg.lstsq(B, rows.value * np.sqrt(rows.weight), rcond=None)[0][-1])
        second = replace(first, decay=decay)
        rows, groups = second.density_rows(presses)
        soft, soft_groups = second.compliance_rows(presses)
        return replace(
            second,
            widths=fit_widths(rows, groups, WIDTHS),
            soft_widths=fit_widths(soft, soft_groups, 2.0 * WIDTHS),
        )

    def density_rows(self, presses: LumpPresses) -> tuple[Samples, np.ndarray]:
        """Return rows of ln(D/U) less its closed form, and their groups."""
        Z, images, index = _rows(presses)
        i, j = index.T
        D, U = presses.density[i, j], presses.energy[i]
        offset = Z[:, 3:6]
        squared = (offset**2).sum(axis=1)
        value = np.log(D / U) - 3.0 * Z[:, 6] + 0.5 * self.decay * np.log(squared)
        slope = presses.slope[i, j] / D[:, None] + presses.force[i] / U[:, None]
        slope = np.einsum("nij,nj->ni", images, slope) - self.decay * offset / squared[:, None]
        share = D / U
        weight = (share / (share + FELT)) ** 2
        # along a coordinate of the hand at a fixed lump: half ranges turn slopes into those by scaled inputs
        half = self.half
        directions = np.vstack(
            [np.diag(half[:3].mean() / half[:3]), np.diag(-half[:3].mean() / half[3:6]), np.zeros((1, 3))]
        )
        reach = U / np.linalg.norm(presses.force[i], axis=1) / half[:3].mean()
        rows = Samples(
            (Z - self.middle) / self.half, value, weight, slope * half[:3].mean(), directions, reach
        )
        return rows, presses.groups[i]

    def compliance_rows(self, presses: LumpPresses) -> tuple[Samples, np.ndarray]:
        """Return rows of ln β, and their groups."""
        Z, _, index = _rows(presses)
        few = index[:, 1] < presses.compliance.shape[1]
        i, j = index[few].T
        share = presses.density[i, j] / presses.energy[i]
        rows = Samples(
            (Z[few] - self.middle) / self.half,
            np.log(presses.compliance[i, j]),
            (share / (share + FELT)) ** 2,
        )
        return rows, presses.groups[i]

    def fit(self, presses: LumpPresses, k: float, units: int) -> LumpContrast:
        """Return the contrast learnt from presses, with a given k."""
        dense = fit_surface(self.density_rows(presses)[0], self.widths, units)
        soft = fit_surface(self.compliance_rows(presses)[0], self.soft_widths, min(units, FEWER_UNITS))
        density, compliance = (as_sum(surface, self.middle, self.half) for surface in (dense, soft))
        return LumpContrast(density, compliance, self.decay, k, presses.room)


def _rows(presses: LumpPresses) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return inputs (R, 7) of all lookups and some images, the isometries (R, 3, 3), and (R, 2) of press and lump."""
    N, L = presses.radius.shape
    group, about = presses.symmetry, presses.about
    count = min(len(group), IMAGES)
    rng = np.random.default_rng(0)
    order = np.argsort(rng.random((N * L, len(group))), axis=1)[:, :count]  # other images for each lookup
    M = group[order.ravel()]
    inside = np.repeat(presses.density.ravel() > 0, count)  # a small lump may meet no quadrature point
    M, index = M[inside], np.repeat(np.stack(np.divmod(np.arange(N * L), L), axis=1), count, axis=0)[inside]
    X = about + np.einsum("nij,nj->ni", M, presses.X[index[:, 0]] - about)
    P = about + np.einsum("nij,nj->ni", M, presses.place[index[:, 0], index[:, 1]] - about)
    return contrast_inputs(X, P, presses.radius[index[:, 0], index[:, 1]]), M, index


def _curvature(presses: LumpPresses) -> float:
    """Return the constant k that fits the presses solved with a lump best; 0 where there are few."""
    rows = np.flatnonzero(np.isfinite(presses.added) & (presses.ratio != 1.0))
    if len(rows) < FEWEST:
        return 0.0
    x, beta = presses.ratio[rows] - 1.0, presses.compliance[rows, 0]
    s = beta * x / (1.0 + beta * x)
    beside = presses.added[rows] * (1.0 + beta * x) / (x * presses.density[rows, 0])
    weight = np.where(beside > 0, s**2, 0.0)  # a change below the solves' own error may have either sign
    return float((weight @ np.log(np.where(beside > 0, beside, 1.0))) / max(weight @ weight, 1e-300))


def _left_out_errors(presses: LumpPresses, shape: _Shape, k: float, units: int) -> np.ndarray:
    """Return the contrast error (M,) of presses in `contrast_rows`, each learnt without the presses at its place."""
    contrast_rows, groups = presses.contrast_rows, presses.groups
    if len(contrast_rows) < FEWEST:
        return np.empty(0)
    names = np.random.default_rng(0).permutation(np.unique(groups))
    errors = []
    for fold in range(FOLDS):
        out = np.isin(groups, names[fold::FOLDS])
        asked = contrast_rows[out[contrast_rows]]
        if not len(asked):
            continue
        contrast = shape.fit(presses.take(np.flatnonzero(~out)), k, units)
        errors.append(change_errors(contrast, presses.take(asked)))
    return np.concatenate(errors)


def change_errors(contrast: LumpContrast, presses: LumpPresses) -> np.ndarray:
    """Return ‖learnt − solved change of force‖ over the solved change (N,), of presses solved with a lump."""
    Z = contrast_inputs(presses.X, presses.place[:, 0], presses.radius[:, 0])
    looked_up = contrast.looked_up_at(Z)
    value, slopes = closed_form(
        np.exp(looked_up[0]),
        looked_up[1],
        np.exp(looked_up[2]),
        looked_up[3],
        presses.ratio - 1.0,
        contrast.curvature,
    )
    change = presses.force * value[:, None] - presses.energy[:, None] * slopes
    missed = np.linalg.norm(change - presses.change, axis=1)
    return np.asarray(missed / np.linalg.norm(presses.change, axis=1))
