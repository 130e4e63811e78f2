"""Two jaws that pinch a body: one interaction whose inputs are the centre between the jaws and their opening."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres, number
from palpate.physics.interactions.interaction import Attached, Energy, Field, PlainInteraction
from palpate.physics.interactions.interaction_checks import range_of
from palpate.physics.interactions.pressing import CLEAR, MOST_INSET, MOST_STEPS, SIDEWAYS, Corner, checked_box
from palpate.physics.interactions.sphere import require_pad
from palpate.physics.interactions.sphere_design import depth_series, depths_per_series
from palpate.physics.interactions.surface_patch import Patch, surface_of
from palpate.physics.interactions.surface_tool import SurfaceTool, rigid_motions
from palpate.physics.interactions.tool_contact import Contact, pad_energy
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.shapes.naming import require_known
from palpate.physics.stop import Stop, Verdict
from palpate.tools import Gripper, Tool
from palpate.tools.gripper import GRIP, OPENING
from palpate.units import Range, bounds

if TYPE_CHECKING:
    from palpate.physics.shapes.shape import Geometry

__all__ = ["Pinch"]

LAG = -0.1  # least depth of the jaw that lags over that of the other: below 0 it is not in touch yet
LINES = 9  # lines through the body along each axis, between whose ends the ranges are taken
MARGIN = 1.3  # how far beyond its lines a jaw may touch, over its size
INSET = 2.0  # distance of the lines from the surface's ends over the jaws' size, unless `over` is given
SAME_LINE = 1e-3  # distance over the jaws' size within which two lines are one
CROWDED = 0.8  # share of the body's thickness that both jaws together may press in
TRIALS = 20  # lines that are tried for each one wanted: a body need not fill its box
ROUNDING = 1e-12  # m, by which rounding may carry inputs out of their ranges


@dataclass(frozen=True)
class Pinch(PlainInteraction):
    """Two rigid jaws with a compliant skin (the pad), which close on a body between them.

    The inputs are the centre (grip_x, grip_y, grip_z) between the jaws' foremost points and their distance, the
    opening grip_opening, in m. The response is −∂U by them: the force on the gripper in N, the sum of both jaws', and
    the effort G in N with which the body pushes the jaws apart. The force along the axis on each jaw is half the sum
    plus or minus G, exactly (`palpate.tools.Gripper.axial_forces`); across the axis only the sum is known. The torque
    about the centre stands beside it in the solution. The equilibrium meant is the one that is reached when the jaws
    close around a centre that stays.

    Attributes
    ----------
    jaw : Tool
        The jaw on the positive side of the axis, one of `palpate.tools`.
    other : Tool, optional
        The jaw on the negative side; by default the mirror image of the first.
    axis : {"x", "y", "z"}
        Axis of the body along which the jaws close.
    roll : float
        Angle in rad by which both jaws are turned about that axis; at 0 their own x axis lies level.
    touches : str
        Name of the surface that the jaws meet, such as "side", the four upright sides of a block.
    pad : float
        Stiffness k of each pad in N/m³, with a stop at 4 mm or at the jaw's least radius of curvature.
    depth : tuple of two floats
        Least and largest depth in m of the jaw that presses deeper, along the axis, below the body's outermost point.
        The other jaw is between that depth and a tenth of it before touch.
    over : tuple of two corners, optional
        Corners of the box of lines along which the body is pinched: two coordinates across the axis, in m. By default
        the surface less a margin in which the jaws do not reach its ends.
    element : float, optional
        Size in m of the elements under the jaws; by default that of a `SurfaceTool`.

    Raises
    ------
    UsageError
        For a jaw that is no tool, an edge sharper than the elements, or a depth or box whose ends are not in order.
        Once it has a body, also where that is not between the jaws, or is too thin for the depth.
    """

    jaw: Tool
    other: Tool | None = None
    axis: Literal["x", "y", "z"] = "x"
    roll: float = 0.0
    touches: str = "side"
    pad: float = 2e6
    depth: tuple[float, float] = (0.0, 0.004)
    over: tuple[Corner, Corner] | None = None
    element: float | None = None

    def __post_init__(self) -> None:
        _ = self.gripper
        require_pad(self.pad)
        low, high = range_of("The depth of a pinch", self.depth, "m")
        if not 0 <= low < high:
            raise UsageError(
                f"The depth of a pinch goes from {low:g} to {high:g} m.",
                why="It is how far a jaw presses into the body, from 0 on, the least depth first.",
                fix="For example depth=(0.0, 0.004).",
            )
        object.__setattr__(self, "depth", (low, high))
        if self.over is not None:
            object.__setattr__(self, "over", checked_box(self.over))
        if self.element is not None:
            checks.positive("The element under a jaw", self.element, "m")
        _ = self.tools

    def __str__(self) -> str:
        return f"{self.gripper} on {self.touches!r}, pad {number(self.pad)} N/m³"

    def describe(self) -> dict[str, Any]:
        """Return everything that decides its energy, as plain data for a JSON file."""
        return {**super().describe(), **self.gripper.describe()}

    @property
    def gripper(self) -> Gripper:
        """The two jaws as one tool."""
        return Gripper(self.jaw, self.other, self.axis, self.roll)

    @property
    def tools(self) -> tuple[SurfaceTool, SurfaceTool]:
        """Each jaw as a tool of its own, that on the positive side first."""
        first, last = (
            SurfaceTool(
                jaw.shape, self.touches, self.pad, self.depth, rotation=jaw.rotation, element=self.element
            )
            for jaw in self.gripper.jaws
        )
        return first, last

    @property
    def _size(self) -> float:
        return max(tool.shape.size for tool in self.tools)

    def require_fine_elements(self, element: float) -> None:
        """Refuse elements of a size in m that are too large for a jaw's edge, as a `SurfaceTool` does."""
        for tool in self.tools:
            tool.require_fine_elements(element)

    def refinements(self, geometry: Geometry) -> tuple[FineMesh, ...]:
        """Return small elements wherever a jaw may touch: on both ends of the lines."""
        require_known("surface", self.touches, geometry.surfaces)
        patch = Patch.from_mesh(geometry.rest(), self.touches)
        element = min(tool._size_of_elements() for tool in self.tools)  # its own rule for elements
        low, high = self._box(patch)
        reach = max(max(tool.shape.half_widths(max(self.depth))) for tool in self.tools) + MARGIN * self._size
        along = self._along
        low, high = low - reach, high + reach
        low[along], high[along] = patch.box[0][along] - reach, patch.box[1][along] + reach
        return (FineMesh(self.touches, element, tuple(low.tolist()), tuple(high.tolist())),)

    def ranges(self, geometry: Geometry) -> tuple[Range, ...]:
        """Return the ranges of the centre's coordinates and of the opening, all in m."""
        grid = np.stack(np.meshgrid(*[np.linspace(0, 1, LINES)] * 2), axis=-1).reshape(-1, 2)
        ends = self._ends(geometry, grid)[0]
        deepest, least = max(self.depth), min(self.depth)
        self._require_thickness(float(self._thickness(ends).min()), deepest)
        lags = [pair for depth in (least, deepest) for pair in ((depth, LAG * depth), (LAG * depth, depth))]
        rows = self._rows(ends, np.array([(deepest, deepest), *lags]))
        low, high = rows.min(axis=0), rows.max(axis=0)
        names = (*GRIP, OPENING)
        return tuple(
            Range(name, float(a), float(b), "m") for name, a, b in zip(names, low, high, strict=True)
        )

    def design(self, geometry: Geometry, samples: int, seed: int, depths: int | None = None) -> np.ndarray:
        """Return inputs (samples, 4) in series, in each of which the jaws close along one line.

        The lines and the ratio of both depths are a scrambled Sobol sequence; one jaw leads, and the other presses at
        most as deep. `depths` is their number in a series, by default the fourth root of the samples. Lines on which
        inputs would leave their ranges, as at the rim of a curved body, are passed over.

        Raises
        ------
        UsageError
            If fewer lines than are wanted go through the body.
        """
        from scipy.stats import qmc

        count = depths_per_series(samples, 4) if depths is None else depths
        wanted = -(-samples // count)
        unit = qmc.Sobol(4, scramble=True, rng=np.random.default_rng(seed)).random(
            1 << int(np.ceil(np.log2(TRIALS * wanted)))
        )
        low, high = bounds(self.ranges(geometry))
        ends, hit = self._ends(geometry, unit[:, :2])
        series: list[np.ndarray] = []
        for end, (ratio, shift) in zip(ends, unit[hit][:, 2:], strict=True):
            lead, other = depth_series(self.depth, count, shift), LAG + (1 - LAG) * abs(2 * ratio - 1)
            pair = np.stack([lead, other * lead], axis=1)
            rows = self._rows(end[None], pair if ratio < 0.5 else pair[:, ::-1])
            if ((rows >= low - ROUNDING) & (rows <= high + ROUNDING)).all():
                series.append(rows)
            if len(series) == wanted:
                return np.concatenate(series)[:samples]
        raise UsageError(
            f"The jaws find {len(series)} lines through the body, and {wanted} are wanted.",
            why=f"Of {len(unit)} lines in their box the others miss the body, or leave its ranges.",
            fix="Give `over` a box of lines that the body fills, in m, or ask for fewer samples.",
        )

    def chains(self, geometry: Geometry, points: np.ndarray) -> list[np.ndarray]:
        """Return rows of inputs (N, 4) in chains: those along one line, from wide to narrow."""
        rows = np.asarray(points, dtype=float)
        across = np.round(rows[:, self._across] / (SAME_LINE * self._size)).astype(np.int64)
        _, which = np.unique(across, axis=0, return_inverse=True)
        groups = [np.flatnonzero(which.ravel() == line) for line in range(int(which.max()) + 1)]
        return [own[np.argsort(-rows[own, 3], kind="stable")] for own in groups]

    def attach(self, field: Field) -> Attached:
        """Return the contact energies of both jaws on an opened body."""
        import ngsolve

        inputs = tuple(ngsolve.Parameter(0.0) for _ in range(4))
        contacts, energies, shifts = [], [], []
        motions, turns = rigid_motions(field)
        for tool, side in zip(self.tools, (0.5, -0.5), strict=True):
            contact = Contact(field, field.rest, tool)
            way = (side * self.gripper.along).tolist()
            place = tuple(c + e * inputs[3] for c, e in zip(inputs, way, strict=False))
            penetration = contact.penetration(field.trial, place)
            energies.append(Energy(pad_energy(penetration, self.pad, tool.stop), contact.measure()))
            shifts.append(np.vstack([motions, np.array(way) @ motions]))
            contacts.append(contact)
        jaws = _Jaws(self, (contacts[0], contacts[1]))
        return Attached(
            inputs,
            tuple(energies),
            inspect=jaws.inspect,
            approach=jaws.approach,
            distance=jaws.distance,
            first_step=min(tool._first_step() for tool in self.tools),  # its own rule for steps
            shifts=np.array(shifts),
            turns=turns,
        )

    @property
    def _along(self) -> int:
        return "xyz".index(self.axis)

    @property
    def _across(self) -> list[int]:
        return [i for i in range(3) if i != self._along]

    def _box(self, patch: Patch) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners (3,) in m of the box of lines, as long as the surface along the axis."""
        low, high = (corner.copy() for corner in patch.box)
        across = self._across
        if self.over is None:
            inset = np.minimum(INSET * self._size, MOST_INSET * (high - low))
            low[across], high[across] = (low + inset)[across], (high - inset)[across]
            return low, high
        for box, given in zip((low, high), self.over, strict=True):
            box[across] = given if len(given) == 2 else np.array(given)[across]
        return low, high

    def _ends(self, geometry: Geometry, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the body's outermost points (M, 2, 3) in m along lines, and which places (N, 2) have both."""
        require_known("surface", self.touches, geometry.surfaces)
        patch = surface_of(geometry, self.touches, self.refinements(geometry))
        low, high = self._box(patch)
        places = low[self._across] + unit * (high - low)[self._across]
        ends = np.stack([patch.cast(self._along, sign, places) for sign in (1.0, -1.0)], axis=1)
        hit = np.isfinite(ends).all(axis=(1, 2)) & (self._thickness(ends) > 0)
        if hit.any():
            return ends[hit], hit
        raise UsageError(
            f"The body is not between the jaws: along {self.axis} no line meets the surface {self.touches!r} twice.",
            why=f"The lines are sought in {np.round(low, 4)} … {np.round(high, 4)} m, and both ends must be of that "
            "surface.",
            fix='Name a surface with two sides along the axis, such as touches="side", or give `over` within it, in m.',
        )

    def _thickness(self, ends: np.ndarray) -> np.ndarray:
        return np.asarray(ends[:, 0, self._along] - ends[:, 1, self._along])

    def _require_thickness(self, thickness: float, deepest: float) -> None:
        if 2 * deepest <= CROWDED * thickness:
            return
        raise UsageError(
            f"Two jaws would press {millimetres(deepest)} deep each.",
            why=f"The body is {millimetres(thickness)} thick between them: the jaws would all but meet.",
            fix=f"Give a depth of at most {0.3 * thickness:.3g} (m).",
        )

    def _rows(self, ends: np.ndarray, depths: np.ndarray) -> np.ndarray:
        """Return inputs (N · d, 4) along lines (N, 2, 3) at depths (d, 2) in m of the first and the second jaw."""
        depths = np.atleast_2d(depths)
        jaws = np.repeat(ends[:, None, :, self._along], len(depths), axis=1) - depths * [1.0, -1.0]
        rows = np.empty((*jaws.shape[:2], 4))
        rows[:, :, :3] = ends[:, None, 0]
        rows[:, :, self._along], rows[:, :, 3] = jaws.mean(axis=2), jaws[:, :, 0] - jaws[:, :, 1]
        return rows.reshape(-1, 4)


class _Jaws:
    """The approach of both jaws to a body, and the verdict on a state under them."""

    def __init__(self, pinch: Pinch, contacts: tuple[Contact, Contact]) -> None:
        self._pinch, self._contacts = pinch, contacts

    def _each(self, x: np.ndarray) -> list[tuple[Contact, np.ndarray]]:
        return list(zip(self._contacts, self._pinch.gripper.places(x), strict=True))

    def inspect(self, x: np.ndarray) -> Verdict:
        """Return the first verdict that does not admit the state, with the larger penetration."""
        verdicts = [contact.inspect(place) for contact, place in self._each(x)]
        deepest = {"penetration": max(v.figures.get("penetration", 0.0) for v in verdicts)}
        worse = next((v for v in verdicts if v.stop is not Stop.CONVERGED), verdicts[0])
        return replace(worse, figures=deepest)

    def approach(self, x: np.ndarray) -> np.ndarray | None:
        """Return the inputs (4,) of the same centre at which the jaws are open and clear of the body; None for none."""
        away, clear = np.array(x, dtype=float), CLEAR * self._pinch.jaw.size
        if away[3] < 0:
            return None
        for _ in range(MOST_STEPS):
            overlap = max(contact.overlap(place) for contact, place in self._each(away))
            if overlap <= 0:
                ways = zip(self._each(away), self._each(x), strict=True)
                met = any(contact.meets_fixed_part(out, into) for (contact, out), (_, into) in ways)
                return None if met else away
            away[3] += 2 * (overlap + clear)
        return None

    def distance(self, here: np.ndarray, there: np.ndarray) -> float:
        """Return the mean length in m of both jaws' ways, their parts across the axis counted several times."""
        along = self._pinch.gripper.along
        squares = []
        for start, end in zip(
            self._pinch.gripper.places(here), self._pinch.gripper.places(there), strict=True
        ):
            step = end - start
            axial = float(step @ along)
            squares.append(axial**2 + SIDEWAYS**2 * float(step @ step - axial**2))
        return float(np.sqrt(np.mean(squares)))
