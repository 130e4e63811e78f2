"""A body made by formula that bends far: its whole length is one circular arc."""

from __future__ import annotations

import numpy as np

from palpate.network import Network, Scaling
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range

LOAD = 5.0  # N
BEND = 1.6  # rad, angle of the tip under LOAD
META = {
    "made": "by formula",
    "settings": {"noise": 1e-8, "edge_weight": 0.005},
    "body": {"young": 2.0e9, "length": 1.0},
    "validation": {
        "unseen solves": 101,
        "displacement RMSE / full scale": 3.412e-7,
        "force error, 95th percentile": 0.01234,
        "limits kept": True,
    },
}


def arc(angle: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Displacements (A, N, 2) of points s (N,) of a 1 m rod bent down to end slopes `angle` (A,)."""
    turn = np.where(angle == 0, 1e-12, angle)[:, None]
    x, y = np.sin(turn * s) / turn - s, -(1 - np.cos(turn * s)) / turn
    return np.stack([x, y], axis=2)


def fitted(inputs: list[Range], outputs: list[Quantity], X: np.ndarray, Y: np.ndarray) -> Network:
    """Least squares on affine terms and eight Gaussians."""
    scaling = Scaling.of(inputs, Y)
    xi, eta = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    centres, widths = np.linspace(-1, 1, 8)[:, None], np.full((8, 1), 0.6)
    phi = np.exp(-(((xi - centres.T) / 0.6) ** 2))
    A = np.hstack([np.ones_like(xi), xi, phi])
    solution = np.linalg.lstsq(A, eta, rcond=None)[0].T
    return Network.axis_aligned(
        inputs,
        outputs,
        centres=centres,
        widths=widths,
        weights=solution[:, 2:],
        tail=solution[:, :2],
        scaling=scaling,
    )


def arc_beam(nodes: int = 21) -> TouchModel:
    """A 1 m rod, bent to a circular arc in proportion to a tip load of 0 … 5 N downwards."""
    rest = np.zeros((nodes, 3))
    rest[:, 0] = np.linspace(0.0, 1.0, nodes)
    load = np.linspace(0.0, LOAD, 101)[:, None]
    shapes = arc(BEND * load[:, 0] / LOAD, rest[:, 0])
    drop = -shapes[:, -1, 1:]
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(nodes) for c in "xy"]
    field = fitted([Range("tip force", 0.0, LOAD, "N")], names, load, shapes.reshape(101, -1))
    force = fitted([Range("h", 0.0, float(drop[-1, 0]), "m")], [Quantity("tip force", "N")], drop, load)
    return TouchModel(
        name="rod",
        networks={"nodes": field, "field": field, "force": force},
        rest=rest,
        nodes_of_interest=np.arange(0, nodes, (nodes - 1) // 5),
        touch_node=nodes - 1,
        touched=(0,),
        directions=np.array([[0.0, -1.0, 0.0]]),
        compliance=0.0,
        mirrors=True,
        reach=float(np.linalg.norm(shapes[-1, -1])),
        stiffness_max=float(np.max(np.diff(load[:, 0]) / np.diff(drop[:, 0]))),
        radius=0.005,
        meta=META,
    )
