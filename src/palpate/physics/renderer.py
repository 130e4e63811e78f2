"""One picture of one solution, drawn by the processor: neither a display nor a graphics library is needed.

Triangles become pixels here, with a depth buffer; Matplotlib adds lines and words, and writes the file. So a picture
comes out on any machine, a server in a container included; docs/guide/pictures.md says why.
"""

from __future__ import annotations

import io
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.files import writing
from palpate.kernels import kernel
from palpate.output_files import picture_metadata
from palpate.physics import deformed
from palpate.physics.deformed import Ball, NodalField
from palpate.physics.tool_picture import outline_of, tool_surface
from palpate.tools.tool_mesh import ToolMesh

__all__ = ["Camera", "Picture", "draw_body", "draw_triangles", "palette", "plot_solution"]

SMOOTHING = 2  # samples per pixel along each side
PIECES = 12  # of a line between two nodes, each of which is hidden or not
PLAIN = np.array([0.80, 0.72, 0.66])  # a body without colours
STEEL = np.array([0.72, 0.76, 0.80])  # a probe
LAMP = np.array([-0.22, 0.50, 0.84]) / math.sqrt(1.004)  # to the right, up and towards the camera
HALFWAY = (LAMP + np.eye(3)[2]) / np.linalg.norm(LAMP + np.eye(3)[2])  # between lamp and camera
DARKEST = 0.14  # share of viridis that is left out, as on the page: the deepest violet hides the shading
# colours of lines and words, of hatching, axes and ticks, of the body at rest, of the probe's outline
INK, SOFT, GHOST, BALL = "#1d2730", "#5d6b76", "#7d8b96", "#2b3640"
DPI = 110
BAR = 172  # px that the colour bar takes


class Picture:
    """A drawn solution: a notebook shows it, `save` writes it, `show` opens a window.

    Its matplotlib `figure` is there to write on, or to put beside others.
    """

    def __init__(self, figure: Any) -> None:
        self.figure = figure

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write PNG, PDF, SVG or JPEG, by the name's ending, and return the path."""
        target = Path(path)
        try:
            with writing(target) as part:
                self.figure.savefig(part, metadata=picture_metadata(target))
        except ValueError as error:
            raise UsageError(
                f"Could not write {target}.", why=str(error), fix="Write to NAME.png, .pdf, .svg or .jpg."
            ) from error
        return target

    def show(self) -> None:
        """Open a window and wait until it is closed; to turn the body there is `palpate.show`."""
        from matplotlib import get_backend, pyplot

        if get_backend().lower() == "agg":
            raise UsageError(
                "There is no display to open a window on.",
                fix="Save the picture: result.plot().save('picture.png'), or use palpate.show(result).",
            )
        window = pyplot.figure(figsize=tuple(self.figure.get_size_inches()))
        window.figimage(pyplot.imread(io.BytesIO(self._repr_png_())), resize=True)
        pyplot.show()

    def _repr_png_(self) -> bytes:
        self.figure.savefig(data := io.BytesIO(), format="png")
        return data.getvalue()


def plot_solution(
    solution: Any,
    colour: str | None = "displacement",
    *,
    scale: float = 1.0,
    path: str | os.PathLike[str] | None = None,
    probe: Any = True,
    fixed: tuple[str, ...] | None = None,
    cut: str | tuple[Any, Any] | None = None,
    limits: tuple[float, float] | None = None,
    outline: bool = True,
    edges: bool = False,
    view: tuple[float, float] = (-58.0, 28.0),
    size: tuple[int, int] = (1000, 680),
) -> Picture:
    """Draw the deformed body.

    Parameters
    ----------
    solution : SolidSolution
        Anything with `mesh` (points, tetrahedra, triangles, surfaces) and `displacement` (node, 3).
    colour : "displacement", "von_mises", "largest_strain" or None
        Quantity that colours the body; None leaves it plain.
    scale : float
        Displacement as drawn over true displacement.
    path : path, optional
        File to write at once.
    probe : bool, SphereProbe or ((x, y, z), radius)
        Whether the solution's probe or tool is drawn where it is, or which sphere, m.
    fixed : tuple of str, optional
        Surfaces to mark as fixed, by default those that the solution knows of.
    cut : "x", "y", "z" or (point, normal), optional
        A plane through the body at rest, by default through its middle; what lies on the normal's side is left out.
    limits : (low, high), optional
        Ends of the colour scale in SI units, so that pictures can be compared.
    outline : bool
        Whether the body at rest is outlined.
    edges : bool
        Whether the mesh's edges are drawn.
    view : (azimuth, elevation)
        Direction of the camera as seen from the body, degrees; azimuth 0 on the x axis, 90 on the y axis.
    size : (width, height)
        Pixels of the whole picture.

    Returns
    -------
    Picture

    Raises
    ------
    UsageError
        For an unknown colour or plane, stresses that were not computed, or a solution that did not converge.
    """
    deformed.require_state(solution)
    field = deformed.nodal_field(solution, colour) if colour is not None else None
    sphere, body = deformed.ball_of(solution, probe), deformed.fine_body(solution)
    moved, skin = body.points + scale * body.displacement, body.triangles
    heights = deformed.heights_above(body.points, cut)
    values = np.zeros(len(body.points)) if field is None else field.over(body)
    nodes = np.column_stack([moved, values])
    cap = deformed.section(nodes[body.tetrahedra], heights[body.tetrahedra])
    visible = np.concatenate([nodes[heights <= 0], cap.reshape(-1, 4)])
    low, high = limits or deformed.colour_limits(visible[:, 3])

    room = (size[0] - (BAR if field is not None else 0), size[1])
    around = [visible[:, :3], body.points[heights <= 0]]
    tool = tool_surface(solution) if probe is True else None
    if tool is not None and scale == 1.0:
        around.append(tool.points)
    if sphere is not None and scale == 1.0:
        around += [sphere[0] + sphere[1] * side * np.eye(3) for side in (1, -1)]
    camera = Camera.around(np.concatenate(around), view, (SMOOTHING * room[0], SMOOTHING * room[1]))
    columns = [nodes[skin], deformed.corner_normals(moved, skin), heights[skin][..., None]]
    # without a normal a cut is shown in its true colours, free of light and shade
    drawn = np.concatenate([np.concatenate(columns, axis=2), np.pad(cap, [(0, 0), (0, 0), (0, 4)])])
    depth, image = draw_body(drawn, camera, None if field is None else (low, high))
    if sphere is not None:
        _draw_ball_beside(image, depth, sphere, camera)
    if tool is not None:
        _draw_tool_beside(image, depth, tool, camera)

    canvas = _Canvas(size, image, depth, camera, float(np.linalg.norm(np.ptp(body.points, axis=0))))
    towards = camera.axes[2]
    canvas.stroke(deformed.cut_lines(moved, heights, deformed.outline(moved, skin, towards)), INK, 0.7)
    canvas.stroke(deformed.section(moved[skin], heights[skin]), INK, 0.7)
    if edges:
        canvas.stroke(deformed.cut_lines(moved, heights, body.wires), INK, 0.25)
    if outline:
        at_rest = deformed.outline(body.points, skin, towards)
        canvas.stroke(deformed.cut_lines(body.points, heights, at_rest), GHOST, 0.9, hidden=0.25)
    if tool is not None:
        canvas.stroke(outline_of(tool, towards), BALL, 1.1, hidden=0.25)
    if sphere is not None:
        canvas.stroke(deformed.circles(*sphere, towards), BALL, 1.1, hidden=0.25)
    rim, outward = deformed.rim(body, deformed.fixed_of(solution) if fixed is None else fixed)
    canvas.mark_fixed(deformed.cut_lines(moved, heights, rim), outward)
    canvas.furnish(scale if np.any(body.displacement) else 1.0)  # at rest nothing is exaggerated
    if field is not None:
        canvas.add_colour_bar(field, (low, high))
    picture = Picture(canvas.figure)
    if path is not None:
        picture.save(path)
    return picture


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera that looks at a body from far away."""

    axes: np.ndarray  # (3, 3) rows: to the right, up, and towards the camera
    centre: np.ndarray  # (3,) point in the middle of the picture, m
    scale: float  # pixels per metre
    size: tuple[int, int]  # pixels: width, height

    @classmethod
    def around(cls, points: np.ndarray, view: tuple[float, float], size: tuple[int, int]) -> Camera:
        """Return the camera that sees all points (n, 3) from azimuth and elevation `view` in degrees."""
        azimuth, elevation = map(math.radians, view)
        right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
        level = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        towards = math.cos(elevation) * level + math.sin(elevation) * np.array([0.0, 0.0, 1.0])
        axes = np.array([right, np.cross(towards, right), towards])
        low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
        extent = np.maximum(high - low, 1e-12)[:2] * 1.12  # with a margin
        return cls(axes, (low + high) / 2 @ axes, float(np.min(size / extent)), size)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Column and row in pixels from the upper left, and depth towards the camera in m, of (..., 3) points."""
        right, up, depth = np.moveaxis((points - self.centre) @ self.axes.T, -1, 0)
        width, height = self.size
        return np.stack([width / 2 + self.scale * right, height / 2 - self.scale * up, depth], axis=-1)


@kernel
def draw_triangles(screen: np.ndarray, attributes: np.ndarray, depth: np.ndarray, image: np.ndarray) -> None:
    """Draw triangles: each pixel keeps the attributes of the nearest one, interpolated linearly.

    `screen` (t, 3, 3) holds column, row and depth of each corner, larger depths nearer. Pixels in which the last of the
    `attributes` (t, 3, k) is positive are left out. `depth` (height, width), which starts at −inf, and `image` (height,
    width, k) are changed in place.
    """
    height, width = depth.shape
    last = attributes.shape[2] - 1
    for t in range(len(screen)):
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = screen[t, 0], screen[t, 1], screen[t, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        for row in range(max(math.floor(min(y0, y1, y2)), 0), min(math.ceil(max(y0, y1, y2)) + 1, height)):
            for column in range(
                max(math.floor(min(x0, x1, x2)), 0), min(math.ceil(max(x0, x1, x2)) + 1, width)
            ):
                x, y = column + 0.5, row + 0.5
                w1 = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
                w2 = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
                w0 = 1.0 - w1 - w2
                z = w0 * z0 + w1 * z1 + w2 * z2
                if w0 < -1e-9 or w1 < -1e-9 or w2 < -1e-9 or z <= depth[row, column]:
                    continue
                a = attributes[t]
                if w0 * a[0, last] + w1 * a[1, last] + w2 * a[2, last] > 0.0:
                    continue
                depth[row, column] = z
                for k in range(last + 1):
                    image[row, column, k] = w0 * a[0, k] + w1 * a[1, k] + w2 * a[2, k]


def palette() -> np.ndarray:
    """Viridis (van der Walt & Smith 2015) without its darkest part, shape (256, 3)."""
    from matplotlib import colormaps

    return np.asarray(colormaps["viridis"](np.linspace(DARKEST, 1, 256))[:, :3])


def draw_body(
    corners: np.ndarray, camera: Camera, limits: tuple[float, float] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Depth (height, width) and colours (height, width, 3) of triangles (t, 3, 8).

    Each corner has a position, the value that colours it between `limits`, a normal and a height above the cut.
    """
    depth = np.full(camera.size[::-1], -np.inf)
    attributes, image = np.zeros((*depth.shape, 5)), np.ones((*depth.shape, 3))
    screen = np.ascontiguousarray(camera.project(corners[:, :, :3]))
    draw_triangles(screen, np.ascontiguousarray(corners[:, :, 3:]), depth, attributes)
    there = np.isfinite(depth)
    base = PLAIN
    if limits is not None:
        share = (attributes[there][:, 0] - limits[0]) / ((limits[1] - limits[0]) or 1.0)
        base = palette()[np.clip(share * 255 + 0.5, 0, 255).astype(int)]
    image[there] = _lit(base, attributes[there][:, 1:4] @ camera.axes.T, shine=0.10)
    return depth, image


def _lit(base: np.ndarray, normals: np.ndarray, shine: float) -> np.ndarray:
    """Colours (n, 3) under a lamp over the observer's left shoulder (Blinn 1977), both sides of a surface alike.

    `normals` (n, 3) are seen from the camera; without one there is no shading.
    """
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(size, 1e-12) * np.where(normals[:, 2:] < 0, -1.0, 1.0)
    diffuse, glint = np.clip(normals @ LAMP, 0, 1)[:, None], np.clip(normals @ HALFWAY, 0, 1)[:, None] ** 40
    return np.asarray(np.clip(np.where(size > 0, base * (0.62 + 0.46 * diffuse) + shine * glint, base), 0, 1))


def _draw_ball_beside(image: np.ndarray, depth: np.ndarray, sphere: Ball, camera: Camera) -> None:
    """Draw the probe beside the body, never over it: the body's colours are to be read from the scale."""
    (column, row, _), radius = camera.project(sphere[0]), sphere[1] * camera.scale
    rows, columns = np.indices(depth.shape)
    x, y = (columns + 0.5 - column) / radius, (row - rows - 0.5) / radius
    beside = (x * x + y * y < 1) & ~np.isfinite(depth)
    x, y = x[beside], y[beside]
    image[beside] = _lit(STEEL, np.column_stack([x, y, np.sqrt(1 - x * x - y * y)]), shine=0.30)


def _draw_tool_beside(image: np.ndarray, depth: np.ndarray, tool: ToolMesh, camera: Camera) -> None:
    """Draw a tool beside the body, as a ball is."""
    screen = np.ascontiguousarray(camera.project(tool.points)[tool.triangles])
    corners = np.pad(tool.normals[tool.triangles], [(0, 0), (0, 0), (0, 1)])
    own, seen = np.full(depth.shape, -np.inf), np.zeros((*depth.shape, 4))
    draw_triangles(screen, np.ascontiguousarray(corners), own, seen)
    beside = np.isfinite(own) & ~np.isfinite(depth)
    image[beside] = _lit(STEEL, seen[beside][:, :3] @ camera.axes.T, shine=0.30)


class _Canvas:
    """A figure with the image, to which lines and words are added.

    Lines may lie 0.6 % of the body's diagonal `length` behind what covers them: their own surface must not hide them.
    """

    def __init__(
        self, size: tuple[int, int], image: np.ndarray, depth: np.ndarray, camera: Camera, length: float
    ) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.depth, self.camera, self.length = depth, camera, length
        self.figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
        FigureCanvasAgg(self.figure)
        width, height = (pixels // SMOOTHING for pixels in camera.size)
        self.axes: Any = self.figure.add_axes((0, 0, width / size[0], height / size[1]))
        smooth = image.reshape(height, SMOOTHING, width, SMOOTHING, 3).mean(axis=(1, 3))
        self.axes.imshow(smooth, extent=(0, width, height, 0), interpolation="none")
        self.axes.set(xlim=(0, width), ylim=(height, 0))
        self.axes.set_axis_off()

    def stroke(self, segments: np.ndarray, colour: str, width: float, *, hidden: float = 0.0) -> None:
        """Draw segments (s, 2, 3); parts behind the body at opacity `hidden`."""
        from matplotlib.collections import LineCollection

        ends = self.camera.project(segments)
        share = np.linspace(0, 1, PIECES + 1)[None, :, None]
        knots = ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])
        middle = (knots[:, 1:] + knots[:, :-1]) / 2
        column, row = (np.clip(middle[..., i].astype(int), 0, self.camera.size[i] - 1) for i in (0, 1))
        seen = middle[..., 2] >= self.depth[row, column] - 0.006 * self.length
        pieces = np.stack([knots[:, :-1, :2], knots[:, 1:, :2]], axis=2) / SMOOTHING
        for chosen, opacity in ((seen, 1.0), (~seen, hidden)):
            if opacity > 0 and chosen.any():
                lines = LineCollection(list(pieces[chosen]), colors=colour, linewidths=width, alpha=opacity)
                lines.set_capstyle("round")
                self.axes.add_collection(lines)

    def mark_fixed(self, rim: np.ndarray, outward: np.ndarray) -> None:
        """Draw a heavy rim with the draughtsman's hatching on the side that faces `outward` (3,)."""
        if not len(rim):
            return
        self.stroke(rim, INK, 1.8)
        offset = 0.016 * self.length * (outward - 0.8 * self.camera.axes[0])
        self.stroke(deformed.hatching(rim, 0.022 * self.length, offset), SOFT, 0.8)

    def furnish(self, scale: float) -> None:
        """Add a scale bar, the directions, and in words what is not true to scale."""
        from matplotlib.ticker import EngFormatter

        width, height = (pixels / SMOOTHING for pixels in self.camera.size)
        per_metre = self.camera.scale / SMOOTHING
        largest = 0.22 * width / per_metre
        power = 10.0 ** math.floor(math.log10(largest))
        bar = max(step * power for step in (1, 2, 5) if step * power <= largest)
        x, y = 24, height - 24
        self.axes.plot([x, x + bar * per_metre], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt")
        words = EngFormatter("m")(bar) + ("" if scale == 1.0 else f", displacement drawn × {scale:g}")
        self.axes.text(x, y - 8, words, color=INK, fontsize=9, va="bottom")
        origin = np.array([width - 52.0, height - 44.0])
        arrow = {"arrowstyle": "-|>", "color": SOFT, "lw": 0.9, "shrinkA": 0}
        for name, direction in zip("xyz", self.camera.axes.T, strict=True):
            way = 26 * np.array([direction[0], -direction[1]])
            if np.linalg.norm(way) >= 4:
                self.axes.annotate("", xy=origin + way, xytext=origin, arrowprops=arrow)
                self.axes.text(*(origin + 1.38 * way), name, color=SOFT, fontsize=9, ha="center", va="center")

    def add_colour_bar(self, field: NodalField, limits: tuple[float, float]) -> None:
        """Add the scale of the colours on the right."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import ListedColormap, Normalize
        from matplotlib.ticker import EngFormatter, PercentFormatter

        width = self.figure.get_size_inches()[0] * DPI
        axes = self.figure.add_axes((1 - 0.77 * BAR / width, 0.22, 17 / width, 0.54))
        colours = ScalarMappable(Normalize(*limits), ListedColormap(palette()))
        ticks = EngFormatter(field.unit) if field.unit else PercentFormatter(1.0)
        bar = self.figure.colorbar(colours, cax=axes, format=ticks)
        bar.outline.set_visible(False)
        bar.ax.tick_params(labelsize=9, length=3, color=SOFT, labelcolor=INK)
        bar.ax.set_title(field.title, fontsize=9.5, color=INK, pad=10, loc="left")
