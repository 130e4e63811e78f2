"""A body that a probe presses, and what each press tells of lumps that might be in it.

Every press is solved without a lump. In its state any lump is looked up for a few sums and one back-substitution (see
`palpate.surrogates.lumps.lump_contrast`), and some presses are solved once more with a lump, from that state on the
same mesh, which takes about one factorisation. All of it stands in the answer, and so in the row of a sweep.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.dataset import Field
from palpate.errors import UsageError
from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.shapes.meshing import INSIDE, FineMesh
from palpate.physics.solid.lump_solver import LumpSolver
from palpate.surrogates.lumps.lump_room import LumpRoom, skin_of
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.dataset import Layout
    from palpate.physics.solid.lump_solver import LumpSolution
    from palpate.physics.solid.solid_problem import SolidProblem

__all__ = ["LumpProblem"]

FINE = (
    0.6  # largest element in the room over the least radius of a lump: its contrast is then true to about 5 %
)


@dataclass(frozen=True)
class LumpProblem:
    """A press on a body, and the lumps that are looked up in each: a problem that `palpate.sweep` takes.

    Attributes
    ----------
    base : SolidProblem
        The body without a lump under one `SphereProbe`.
    room : tuple of two corners
        Box of a lump's centre in m, two corners (x, y, z) in the body's frame.
    radius : tuple of two floats
        Least and largest radius of a lump in m.
    ratio : tuple of two floats
        Least and largest ratio of moduli of the lumps that presses are solved with.
    element : float, optional
        Largest element in m where lumps may be; by default 0.6 of the least radius.
    cover : float
        Least tissue in m between a lump's edge and any surface of the body.
    lookups : int
        Lumps that are looked up in each press.
    compliances : int
        How many of them with the tissue's give, which takes a back-substitution each.
    solved : float
        Share of the presses that are also solved with their first lump.

    Raises
    ------
    UsageError
        If not just one sphere acts, the body has a history, or the room, sizes or numbers make no sense.
    """

    base: SolidProblem
    room: tuple[tuple[float, float, float], tuple[float, float, float]]
    radius: tuple[float, float] = (0.003, 0.008)
    ratio: tuple[float, float] = (1.5, 10.0)
    element: float | None = None
    cover: float = 0.001
    lookups: int = 192
    compliances: int = 24
    solved: float = 0.5

    def __post_init__(self) -> None:
        if len(self.base.interactions) != 1 or not isinstance(self.base.interactions[0], SphereProbe):
            raise UsageError(
                "Lumps are looked up under one sphere.",
                why=f"What acts is {', '.join(map(str, self.base.interactions))}.",
                fix="Press the body with one SphereProbe.",
            )
        if self.base.body.has_history:
            raise UsageError(
                "Lumps can't be looked up in a body with a history.",
                why="Their energy is that of an elastic equilibrium.",
                fix="Use elastic materials; relaxation comes afterwards, as a memory.",
            )
        lower, upper = (checks.triple("A corner of the room for lumps", corner, "m") for corner in self.room)
        object.__setattr__(self, "room", (lower, upper))
        checks.fits("The tissue around a lump", self.cover, "m", least=0.0)
        checks.fits("The number of lumps looked up", self.lookups, least=1, whole=True)
        checks.fits("The number of compliances", self.compliances, least=1, most=self.lookups, whole=True)
        checks.fits("The share of presses with a lump", self.solved, least=0.0, most=1.0)
        if self.element is not None:
            checks.positive("The element size where lumps may be", self.element, "m")
        _ = self._box
        fine = (*self.base.refinements, self._inside)
        if self._inside not in self.base.refinements:
            object.__setattr__(self, "base", replace(self.base, fine=fine))

    @property
    def _box(self) -> LumpRoom:
        """The room without the body's skin."""
        radius, ratio = Range("radius", *self.radius, "m"), Range("ratio", *self.ratio)
        return LumpRoom(np.array(self.room[0]), np.array(self.room[1]), radius, ratio, self.cover)

    @cached_property
    def lump_room(self) -> LumpRoom:
        """The room, the sizes and the skin as a learnt body keeps them."""
        return replace(self._box, skin=skin_of(self.mesh.points, self.mesh.triangles))

    @property
    def _inside(self) -> FineMesh:
        """The fine part inside the body: the room, and the largest lump about its ends."""
        size = FINE * self.radius[0] if self.element is None else self.element
        lower, upper = (np.array(corner) for corner in self.room)
        return FineMesh(
            INSIDE, size, tuple((lower - self.radius[1]).tolist()), tuple((upper + self.radius[1]).tolist())
        )

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input: the place of the probe."""
        return self.base.ranges

    @property
    def layout(self) -> Layout:
        """Nodes at rest and the surface's triangles."""
        return self.base.layout

    @property
    def mesh(self) -> Any:
        """The body at rest as plain arrays."""
        return self.base.mesh

    @cached_property
    def schema(self) -> tuple[Field, ...]:
        """Fields of each answer: those of the press, and the lumps."""
        n = (self.lookups,)
        lump, along = ("lump",), ("lump", "axis")
        return (
            *self.base.schema,
            Field("lump_place", along, (*n, 3), "m", "centres of the lumps looked up", True),
            Field("lump_radius", lump, n, "m", "their radii", True),
            Field("lump_energy", lump, n, "J", "strain energy D = ∫ χ W dV where each would be", True),
            Field("lump_slope", along, (*n, 3), "N", "∂D/∂input", True),
            Field("lump_compliance", ("soft lump",), (self.compliances,), "", "β of the first ones", True),
            Field("lump_ratio", meaning="modulus of the first lump in the solve with it", optional=True),
            Field("lump_added", unit="J", meaning="energy that this lump adds to the press", optional=True),
            Field("lump_force", ("axis",), (3,), "N", "force that it adds", True),
            Field("lump_message", meaning="why there is no solve with it", fill=""),
        )

    @property
    def design_name(self) -> str | None:
        """Name of the probe's own design."""
        return self.base.design_name

    @property
    def symmetry(self) -> dict[str, Any] | None:
        """Isometries of the body without a lump."""
        return self.base.symmetry

    @property
    def words(self) -> str:
        """The body in a few words."""
        return f"{self.base.words}, with lumps looked up"

    @property
    def hash(self) -> str:
        """SHA-256 of the description."""
        import json

        return hashlib.sha256(json.dumps(self.describe(), sort_keys=True).encode()).hexdigest()

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""
        lumps = {
            "room": [list(corner) for corner in self.room],
            **{name: list(getattr(self, name)) for name in ("radius", "ratio")},
            **{name: getattr(self, name) for name in ("cover", "lookups", "compliances", "solved")},
        }
        return self.base.describe() | {"lumps": lumps}

    def open(self) -> LumpSolver:
        """Build the finite elements."""
        return LumpSolver(self)

    def solve(self, x: Any) -> LumpSolution:
        """Solve for the probe's place x (3,), from the body without contact."""
        return self.open().solve(x)

    def design(self, samples: int, seed: int = 0, **options: Any) -> np.ndarray:
        """Return places (samples, 3) of the probe by its own design."""
        return self.base.design(samples, seed, **options)

    def chains(self, points: Any) -> list[np.ndarray]:
        """Return rows of places (N, 3) in chains that are solved well."""
        return self.base.chains(points)

    def check_points(self, points: np.ndarray) -> None:
        """Refuse places far from the body."""
        self.base.check_points(points)

    def __str__(self) -> str:
        low, high = (2e3 * r for r in self.radius)
        return f"{self.base}\n  lumps    ⌀{low:.3g} to {high:.3g} mm, {self.lookups} looked up in each press"
