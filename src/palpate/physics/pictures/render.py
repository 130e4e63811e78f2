"""A body and a ball as an image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.physics.pictures.camera import Camera
from palpate.physics.pictures.raster import draw_triangles
from palpate.physics.pictures.skin import ball
from palpate.physics.pictures.tool import Ball

__all__ = ["PLAIN", "SMOOTHING", "Layer", "body_layer", "composed", "palette"]

SMOOTHING = 2  # samples per pixel along each side
PLAIN = np.array([0.80, 0.72, 0.66])  # of a body without colours
STEEL = np.array([0.72, 0.76, 0.80])
GROUND = np.array([1.0, 1.0, 1.0])
DARKEST = 0.14  # of viridis is left out, as on the page: the deepest violet hides the shading
LIGHT = np.array([-0.22, 0.50, 0.84])  # to the right, up and towards the camera


@dataclass(frozen=True, eq=False)
class Layer:
    """One pass of the renderer.

    Attributes
    ----------
    depth : (height, width) array
        m towards the camera; −inf where there is nothing.
    colour : (height, width, 3) array
        0 … 1.
    """

    depth: np.ndarray
    colour: np.ndarray


def palette() -> np.ndarray:
    """Viridis (van der Walt & Smith 2015) without its darkest part, shape (256, 3)."""
    from matplotlib import colormaps

    return np.asarray(colormaps["viridis"](np.linspace(DARKEST, 1, 256))[:, :3])


def body_layer(soup: np.ndarray, camera: Camera, limits: tuple[float, float] | None) -> Layer:
    """Draw triangles (t, 3, 7) of position, normal and scalar, coloured between `limits` or plain."""
    depth, image = _drawn(soup[:, :, :3], soup[:, :, 3:], camera)
    there = np.isfinite(depth)
    normals, values = image[there][:, :3], image[there][:, 3]
    if limits is None:
        return _layer(depth, there, _lit(PLAIN, normals, camera, shine=0.10))
    share = (values - limits[0]) / ((limits[1] - limits[0]) or 1.0)
    base = palette()[np.clip(share * 255 + 0.5, 0, 255).astype(int)]
    return _layer(depth, there, _lit(base, normals, camera, shine=0.10))


def ball_layer(sphere: Ball, camera: Camera) -> Layer:
    """Draw the probe."""
    depth, image = _drawn(*ball(*sphere), camera)
    there = np.isfinite(depth)
    return _layer(depth, there, _lit(STEEL, image[there], camera, shine=0.30))


def _layer(depth: np.ndarray, there: np.ndarray, colours: np.ndarray) -> Layer:
    """Colours (n, 3) where there is something, on the ground."""
    colour = np.empty((*depth.shape, 3))
    colour[:] = GROUND
    colour[there] = colours
    return Layer(depth, colour)


def composed(body: Layer, sphere: Ball | None, camera: Camera) -> np.ndarray:
    """The image (height, width, 3), 0 … 1, at one sample per pixel: body on white, the ball beside it.

    The ball is not drawn over the body: its colours are to be read from the scale, also under the ball.
    """
    shown = body.colour
    if sphere is not None:
        front = ball_layer(sphere, camera)
        beside = np.isfinite(front.depth) & ~np.isfinite(body.depth)
        shown = np.where(beside[..., None], front.colour, shown)
    height, width = body.depth.shape
    s = SMOOTHING
    return np.asarray(shown.reshape(height // s, s, width // s, s, 3).mean(axis=(1, 3)))


def _drawn(corners: np.ndarray, attributes: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    width, height = camera.size
    depth = np.full((height, width), -np.inf)
    image = np.zeros((height, width, attributes.shape[2]))
    screen = np.ascontiguousarray(camera.project(corners))
    draw_triangles(screen, np.ascontiguousarray(attributes), depth, image)
    return depth, image


def _lit(base: np.ndarray, normals: np.ndarray, camera: Camera, shine: float) -> np.ndarray:
    """Colours (n, 3) under a lamp over the observer's left shoulder (Blinn 1977), both sides of a surface alike.

    Where there is no normal there is no shading.
    """
    n = normals @ camera.axes.T
    size = np.linalg.norm(n, axis=-1, keepdims=True)
    n = n / np.maximum(size, 1e-12)
    n = np.where(n[..., 2:] < 0, -n, n)
    lamp = LIGHT / np.linalg.norm(LIGHT)
    half = lamp + np.array([0.0, 0.0, 1.0])
    half = half / np.linalg.norm(half)
    diffuse = np.clip(n @ lamp, 0, 1)[..., None]
    glint = np.clip(n @ half, 0, 1)[..., None] ** 40
    shaded = base * (0.62 + 0.46 * diffuse) + shine * glint
    return np.asarray(np.clip(np.where(size > 0, shaded, base), 0, 1))
