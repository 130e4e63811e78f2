"""Draws docs/images/footprint.svg: a ball over a groove, by its closest point and by all of the surface that it meets.

    python docs/footprint_picture.py

A section of the ball and of the surface; lengths in ball radii. The arrows are computed as `ball_overlap` does, along
the section instead of over the surface.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

CENTRE = np.array([0.03, 0.88])  # of the ball, off the groove's middle
DEEP, WIDE = 0.45, 0.26  # depth of the groove and its half-width
SCALE, MIDDLE, TOP = 150.0, 190.0, 205.0  # pixels to a radius; where the groove's middle lies in a picture
ARROW = 0.75  # length of an arrow
INK, FLESH, BALL, HEAVY = "#333333", "#f3d9cf", "#7f9fbf", "#b5362c"


def height(x: np.ndarray) -> np.ndarray:
    """Return the height of the surface, which rises a little to both sides."""
    return -DEEP * np.exp(-((x / WIDE) ** 4))


def met_points(count: int = 4000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points (n, 2) of the surface, their depths p in the ball and the lengths ds that they stand for."""
    x = np.linspace(-1.3, 1.3, count)
    points = np.stack([x, height(x)], axis=1)
    lengths = np.hypot(*np.gradient(points, axis=0).T)
    return points, 1.0 - np.linalg.norm(CENTRE - points, axis=1), lengths


def place(points: np.ndarray) -> str:
    """Return points (n, 2) as SVG writes them."""
    return " ".join(f"{MIDDLE + SCALE * x:.1f},{TOP - SCALE * y:.1f}" for x, y in np.atleast_2d(points))


def arrow(start: np.ndarray, way: np.ndarray) -> str:
    """Return an arrow from a point along a way."""
    along = way / np.linalg.norm(way)
    end, side = start + ARROW * along, np.array([-along[1], along[0]])
    head = [end, end - 0.12 * along + 0.05 * side, end - 0.12 * along - 0.05 * side]
    return (
        f'<polyline points="{place(np.array([start, end - 0.1 * along]))}" stroke="{HEAVY}" stroke-width="4"/>'
        f'<polygon points="{place(np.array(head))}" fill="{HEAVY}"/>'
    )


def scene(title: str, drawing: str) -> str:
    """Return the ball, the surface and what is drawn on them."""
    points = met_points(200)[0]
    body = np.vstack([points, [[1.3, -0.75], [-1.3, -0.75]]])
    x, y = place(CENTRE).split(",")
    return (
        f'<polygon points="{place(body)}" fill="{FLESH}"/>'
        f'<polyline points="{place(points)}" fill="none" stroke="{INK}" stroke-width="2"/>'
        f'<circle cx="{x}" cy="{y}" r="{SCALE:.0f}" fill="{BALL}" fill-opacity="0.35" stroke="{INK}"/>'
        f'<circle cx="{x}" cy="{y}" r="3" fill="{INK}"/>{drawing}'
        f'<text x="{MIDDLE:.0f}" y="352" text-anchor="middle">{title}</text>'
    )


def main() -> None:
    """Write the picture."""
    points, depth, lengths = met_points()
    nearest = points[int(np.argmax(depth))]
    closest = (
        f'<polyline points="{place(np.array([CENTRE, nearest]))}" stroke="{INK}" stroke-dasharray="4 4"/>'
    )
    closest += arrow(nearest, CENTRE - nearest)
    weight = np.sqrt(np.maximum(depth, 0.0)) * lengths
    way = weight @ ((CENTRE - points) / (1.0 - depth)[:, None])
    # strokes towards the ball's surface, as long as the point lies deep in it, as dark as p^{3/2}
    share = np.maximum(depth, 0.0) ** 1.5 / depth.max() ** 1.5
    strokes = "".join(
        f'<polyline points="{place(np.array([p, p + d * (p - CENTRE) / np.linalg.norm(p - CENTRE)]))}" '
        f'stroke="{HEAVY}" stroke-width="2.5" stroke-opacity="{s:.2f}"/>'
        for p, d, s in zip(points[::20], depth[::20], share[::20], strict=True)
        if d > 0
    )
    foot = weight @ points / weight.sum()
    panels = (
        scene("closest point: one rim, slanted", closest),
        scene("all of the overlap: both rims, nearly upright", strokes + arrow(foot, way)),
    )
    picture = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 365" width="760" height="365" '
        f'font-family="sans-serif" font-size="16" fill="{INK}"><rect width="760" height="365" fill="#ffffff"/>'
        f'<g>{panels[0]}</g><g transform="translate(380 0)">{panels[1]}</g></svg>\n'
    )
    file = Path(__file__).parent / "images" / "footprint.svg"
    file.write_text(picture.replace("><", ">\n<"), encoding="utf-8")


if __name__ == "__main__":
    main()
