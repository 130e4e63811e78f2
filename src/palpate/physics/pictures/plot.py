"""One picture of one solution."""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np

from palpate.errors import UsageError
from palpate.physics.pictures import lines
from palpate.physics.pictures.camera import Camera
from palpate.physics.pictures.fields import NodalField, nodal_field
from palpate.physics.pictures.fine import fine_body
from palpate.physics.pictures.picture import Picture
from palpate.physics.pictures.render import SMOOTHING, Layer, body_layer, composed, palette
from palpate.physics.pictures.scales import round125, scaled
from palpate.physics.pictures.skin import clip, corner_normals, section, section_lines
from palpate.physics.pictures.tool import Ball, ball_of, fixed_of, require_state

__all__ = ["plot_solution"]

Colour = Literal["displacement", "von_mises", "largest_strain"]
Plane = tuple[Any, Any]

INK, SOFT, GHOST, BALL = "#1d2730", "#5d6b76", "#7d8b96", "#2b3640"
DPI = 110
BAR, TITLE = 172, 36  # px that colour bar and title take


def plot_solution(
    solution: Any,
    colour: Colour | None = "displacement",
    *,
    scale: float = 1.0,
    path: str | os.PathLike[str] | None = None,
    probe: Any = True,
    fixed: tuple[str, ...] | None = None,
    cut: str | Plane | None = None,
    limits: tuple[float, float] | None = None,
    outline: bool = True,
    edges: bool = False,
    view: tuple[float, float] = (-58.0, 28.0),
    size: tuple[int, int] = (1000, 680),
    title: str | None = None,
) -> Picture:
    """Draw the deformed body.

    Needs neither a display nor a graphics library.

    Parameters
    ----------
    solution : SolidSolution
        Anything with `mesh` (points, tetrahedra, triangles, surfaces) and `displacement` (node, 3).
    colour : "displacement", "von_mises", "largest_strain" or None
        What the colours show.
    scale : float
        Displacement as drawn over true displacement.
    path : path, optional
        File to write at once.
    probe : bool, SphereProbe or ((x, y, z), radius)
        Whether the solution's probe is drawn where it is, or which sphere.
    fixed : tuple of str, optional
        Surfaces to mark as fixed, by default those that the solution knows of.
    cut : "x", "y", "z" or (point, normal), optional
        A plane through the body at rest, by default through its middle; what lies on the normal's side is left out.
    limits : (low, high), optional
        Ends of the colour scale in SI units, so that pictures can be compared.
    outline : bool
        Whether the undeformed body is outlined.
    edges : bool
        Whether the mesh's edges are drawn.
    view : (azimuth, elevation)
        Of the camera, in degrees.
    size : (width, height)
        Pixels.
    title : str, optional

    Returns
    -------
    Picture

    Raises
    ------
    UsageError
        For an unknown colour or plane, stresses that were not computed, or a solution that did not converge.
    """
    require_state(solution)
    shown = nodal_field(solution, colour) if colour is not None else None
    sphere = ball_of(solution, probe)
    body = _Body(solution, scale, shown, _plane(solution.mesh, cut))
    room = (size[0] - (BAR if shown is not None else 0), size[1] - (TITLE if title else 0))
    pixels = (SMOOTHING * room[0], SMOOTHING * room[1])
    camera = Camera.around(body.seen(sphere, scale), view, pixels)
    span = limits or body.span()
    layer = body_layer(body.soup, camera, span if shown is not None else None)
    figure, axes = _canvas(size, room, composed(layer, sphere, camera))
    pen = _Pen(axes, camera, layer, body)
    pen.strokes(body.outlines(camera.axes[2], body.moved), INK, 0.7, hidden=0.0)
    pen.strokes(body.cut_rim(), INK, 0.7, hidden=0.0)
    if edges:
        pen.strokes(body.wires(), INK, 0.25, hidden=0.0)
    if outline:
        pen.strokes(body.outlines(camera.axes[2], body.points), GHOST, 0.9, hidden=0.25)
    if sphere is not None:
        pen.strokes(lines.ball_lines(*sphere, camera.axes[2]), BALL, 1.1, hidden=0.25)
    _mark_fixed(pen, body, fixed_of(solution) if fixed is None else fixed)
    _furnish(figure, axes, camera, scale, title)
    if shown is not None:
        _colour_bar(figure, shown, span)
    picture = Picture(figure)
    if path is not None:
        picture.save(path)
    return picture


def _plane(mesh: Any, cut: str | Plane | None) -> tuple[np.ndarray, np.ndarray] | None:
    if cut is None:
        return None
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    if isinstance(cut, str):
        if cut not in {"x", "y", "z"}:
            raise UsageError(f"There is no plane {cut!r}.", fix="Choose 'x', 'y', 'z' or (point, normal).")
        axis = "xyz".index(cut)
        # what stands between the usual camera and the plane goes
        return (low + high) / 2, np.eye(3)[axis] * (-1.0 if cut == "y" else 1.0)
    point, normal = (np.asarray(v, dtype=float).reshape(3) for v in cut)
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise UsageError("The cutting plane's normal is zero.", fix="Give (point, normal) with a direction.")
    return point, normal / length


class _Body:
    """Geometry to draw: the skin, cut or whole, at rest and deformed."""

    def __init__(
        self,
        solution: Any,
        scale: float,
        shown: NodalField | None,
        plane: tuple[np.ndarray, np.ndarray] | None,
    ) -> None:
        mesh = fine_body(solution)
        self.mesh, self.points, self.plane = mesh, mesh.points, plane
        self.moved = mesh.points + scale * mesh.displacement
        self.values = np.zeros(len(mesh.points)) if shown is None else shown.over(mesh)
        self.heights = np.full(len(mesh.points), -1.0)
        if plane is not None:
            self.heights = (mesh.points - plane[0]) @ plane[1]
        self.soup = self._soup()

    def _soup(self) -> np.ndarray:
        """Triangles (t, 3, 7): position as drawn, normal, value."""
        skin, values = self.mesh.triangles, self.values[:, None]
        columns = (self.moved[skin], corner_normals(self.moved, skin), values[skin])
        soup = np.concatenate(columns, axis=2)
        if self.plane is None:
            return soup
        inside = np.concatenate([self.moved, values], axis=1)[self.mesh.tetrahedra]
        faces = section(inside, self.heights[self.mesh.tetrahedra])
        # no normals: a cut is shown in its true colours, without light and shade
        bare = np.zeros((*faces.shape[:2], 3))
        cut = np.concatenate([faces[:, :, :3], bare, faces[:, :, 3:]], axis=2)
        return np.concatenate([clip(soup, self.heights[skin]), cut])

    def span(self) -> tuple[float, float]:
        """Ends of the colour scale: from zero, where the values allow; smoothed stresses dip a little below."""
        low, high = float(self.soup[:, :, 6].min()), float(self.soup[:, :, 6].max())
        return (low if low < -0.05 * abs(high) else 0.0), high or 1.0

    def seen(self, sphere: Ball | None, scale: float) -> np.ndarray:
        """Points that must be in the picture."""
        kept = self.points[self.heights <= 0]
        parts = [self.soup[:, :, :3].reshape(-1, 3), kept]
        if sphere is not None and scale == 1.0:
            parts += [sphere[0] + sphere[1] * side * np.eye(3) for side in (1, -1)]
        return np.concatenate(parts)

    def outlines(self, towards: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Segments (s, 2, 3) that draw the skin at `points`, what the plane takes left out."""
        return self._kept(points, lines.outline(points, self.mesh.triangles, towards))

    def cut_rim(self) -> np.ndarray:
        """Segments (s, 2, 3) in which the plane cuts the skin as drawn."""
        if self.plane is None:
            return np.empty((0, 2, 3))
        return section_lines(self.moved[self.mesh.triangles], self.heights[self.mesh.triangles])

    def wires(self) -> np.ndarray:
        """Edges of the mesh on the skin as drawn, segments (s, 2, 3)."""
        return self._kept(self.moved, self.mesh.wires)

    def rim(self, surfaces: tuple[str, ...]) -> np.ndarray:
        """Edges around named surfaces as drawn, segments (s, 2, 3)."""
        chosen = np.isin(self.mesh.surface_of, [self.mesh.surfaces.index(name) for name in surfaces])
        return self._kept(self.moved, lines.border(self.mesh.triangles, chosen))

    def _kept(self, points: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Segments (s, 2, 3) of edges (n, 2), cut off at the plane."""
        return lines.cut_off(points[ends], self.heights[ends])


class _Pen:
    """Draws lines over the image, and knows which parts of them the body hides."""

    def __init__(self, axes: Any, camera: Camera, layer: Layer, body: _Body) -> None:
        self.axes, self.camera, self.depth = axes, camera, layer.depth
        self.slack = 0.006 * float(np.linalg.norm(np.ptp(body.points, axis=0)))

    def strokes(self, segments: np.ndarray, colour: str, width: float, *, hidden: float) -> None:
        """Draw segments (s, 2, 3); parts behind the body at opacity `hidden`."""
        from matplotlib.collections import LineCollection

        seen, behind = lines.split_hidden(segments, self.camera, self.depth, self.slack)
        for pieces, opacity in ((seen, 1.0), (behind, hidden)):
            if len(pieces) and opacity > 0:
                drawn = pieces / SMOOTHING
                self.axes.add_collection(
                    LineCollection(
                        list(drawn), colors=colour, linewidths=width, alpha=opacity, capstyle="round"
                    )
                )


def _mark_fixed(pen: _Pen, body: _Body, surfaces: tuple[str, ...]) -> None:
    """A heavy rim and hatching where the body is held."""
    if not surfaces:
        return
    rim, length = body.rim(surfaces), float(np.linalg.norm(np.ptp(body.points, axis=0)))
    pen.strokes(rim, INK, 1.8, hidden=0.0)
    chosen = np.isin(body.mesh.surface_of, [body.mesh.surfaces.index(name) for name in surfaces])
    a, b, c = np.moveaxis(body.points[body.mesh.triangles[chosen]], 1, 0)
    outward = np.cross(b - a, c - a).sum(axis=0)
    outward = outward / max(float(np.linalg.norm(outward)), 1e-300)
    slant = outward - 0.8 * pen.camera.axes[0]
    strokes = lines.hatching(rim, 0.022 * length, 0.016 * length * slant)
    pen.strokes(strokes, SOFT, 0.8, hidden=0.0)


def _canvas(size: tuple[int, int], room: tuple[int, int], image: np.ndarray) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    width, height = room
    axes = figure.add_axes((0, 0, width / size[0], height / size[1]))
    axes.imshow(image, extent=(0, width, height, 0), interpolation="none")
    axes.set_xlim(0, width)
    axes.set_ylim(height, 0)
    axes.set_axis_off()
    return figure, axes


def _furnish(figure: Any, axes: Any, camera: Camera, scale: float, title: str | None) -> None:
    """Scale bar, directions, and in words what is not true to scale."""
    width, height = (pixels / SMOOTHING for pixels in camera.size)
    per_metre = camera.scale / SMOOTHING
    bar = round125(0.22 * width / per_metre)
    size, unit = scaled(bar, "m")
    x, y = 24, height - 24
    axes.plot([x, x + bar * per_metre], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt")
    words = f"{bar / size:g} {unit}" + ("" if scale == 1.0 else f", displacement drawn × {scale:g}")
    axes.text(x, y - 8, words, color=INK, fontsize=9, va="bottom")
    _triad(axes, camera, np.array([width - 52.0, height - 44.0]))
    if title:
        figure.text(0.022, 0.965, title, color=INK, fontsize=12, va="top")


def _triad(axes: Any, camera: Camera, origin: np.ndarray) -> None:
    for name, direction in zip("xyz", camera.axes.T, strict=True):
        tip = origin + 26 * np.array([direction[0], -direction[1]])
        if np.linalg.norm(tip - origin) < 4:
            continue
        axes.annotate(
            "",
            xy=tip,
            xytext=origin,
            arrowprops={"arrowstyle": "-|>", "color": SOFT, "lw": 0.9, "shrinkA": 0},
        )
        at = origin + 1.38 * (tip - origin)
        axes.text(*at, name, color=SOFT, fontsize=9, ha="center", va="center")


def _colour_bar(figure: Any, shown: NodalField, span: tuple[float, float]) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    size, unit = scaled(max(map(abs, span)), shown.unit)
    colours = ScalarMappable(Normalize(span[0] / size, span[1] / size), ListedColormap(palette()))
    width = figure.get_size_inches()[0] * DPI
    axes = figure.add_axes((1 - 0.77 * BAR / width, 0.22, 17 / width, 0.54))
    bar = figure.colorbar(colours, cax=axes)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9, length=3, color=SOFT, labelcolor=INK)
    bar.ax.set_title(f"{shown.title}\n({unit})", fontsize=9.5, color=INK, pad=10, loc="left")
