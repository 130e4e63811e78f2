"""What is said between the server and the page of a body pressed anywhere; see `messages` for the conversation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from palpate.viewer.messages import Beat, Faceted, Greeting, Vec3
from palpate.viewer.wire import Binary, Wire

__all__ = ["Look", "Modes", "Press", "Skin", "Touched"]


@dataclass(frozen=True, eq=False)
class Press(Beat):
    """One picture of a body pressed anywhere, server to page."""

    KIND: ClassVar[int] = 6

    depth: Annotated[float, Wire("f32", "m, of the rigid probe in the surface at rest; negative in the air")]
    stiffness: Annotated[float, Wire("f32", "N/m, along the force")]
    deviation: Annotated[
        float, Wire("f32", "standard deviation of the force relative to it, NaN where unknown")
    ]
    drawn: Annotated[float, Wire("f32", "m, depth of the shape drawn: after release it goes back to 0")]
    foot: Annotated[Vec3, Wire("vec3", "m, of the dimples at rest")]
    normal: Annotated[Vec3, Wire("vec3", "of the surface there")]
    coefficients: Annotated[
        np.ndarray, Wire("floats", "for each field its modes' coefficients and its dimple's profile")
    ]
    prints: Annotated[
        np.ndarray, Wire("floats", "m, how deep it stays pressed at each of Skin.printable; empty if nowhere")
    ]


@dataclass(frozen=True, eq=False)
class Skin(Faceted):
    """The surface of a touchable body at rest, server to page. Points are split along sharp edges."""

    KIND: ClassVar[int] = 7

    touchable: Annotated[np.ndarray, Wire("floats", "1 for each triangle that a probe may touch, else 0")]
    printable: Annotated[
        np.ndarray, Wire("floats", "points that keep prints; none where the body keeps none")
    ]
    normals: Annotated[np.ndarray, Wire("floats", "outward unit normal of each of them")]


@dataclass(frozen=True, eq=False)
class Modes(Binary):
    """A field on a Skin's points, server to page: rest + coefficients · modes + the dimple of a profile."""

    KIND: ClassVar[int] = 8

    reach: Annotated[float, Wire("f32", "m, of the dimple from its foot; 0 for none")]
    rows: Annotated[int, Wire("u16", "splines of the distance from the foot; 0 for none")]
    rest: Annotated[np.ndarray, Wire("floats", "components of each point")]
    modes: Annotated[np.ndarray, Wire("floats", "the same of each mode")]
    touched: Annotated[np.ndarray, Wire("floats", "points that the dimple may move")]


@dataclass(frozen=True)
class Look:
    """A field that deforms or colours a touched body, and its range over the trained region."""

    name: str
    unit: str
    low: float
    high: float
    components: int
    modes: int


@dataclass(frozen=True)
class Touched(Greeting):
    """A body pressed anywhere and its loop, once per connection, server to page.

    Attributes
    ----------
    radius : float
        Of the probe, m.
    radius_parameter : int
        Which parameter that is; -1 where none.
    deepest : float
        Deepest trained depth, m.
    force_max : float
        Largest force of the trained region, N.
    stiffness_max : float
        Largest stiffness of the trained region, N/m.
    centre : (3,)
        The device's centre in the body's coordinates, m.
    fields : looks
        The first moves the surface where it has three components; none where the file holds no field.
    remembers : str
        How the force relaxes, or prints stay, in words; empty where neither does.
    """

    radius: float
    radius_parameter: int
    deepest: float
    force_max: float
    stiffness_max: float
    centre: Vec3
    fields: tuple[Look, ...]
    remembers: str
