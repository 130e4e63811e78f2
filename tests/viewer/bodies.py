"""A body made by formula that bends far: its whole length is one circular arc."""

from __future__ import annotations

import dataclasses

import numpy as np

from models import DOWN, planar_field
from palpate.network import Network, Scaling
from palpate.surrogates import LearntEnergy, PadBaseline, RestStiffness, Stiffening, Surrogate
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


def arc_beam(nodes: int = 21) -> Surrogate:
    """A 1 m rod, bent to a circular arc in proportion to a tip load of 0 … 5 N downwards."""
    points = np.zeros((nodes, 3))
    points[:, 0] = np.linspace(0.0, 1.0, nodes)
    load = np.linspace(0.0, LOAD, 101)[:, None]
    shapes = arc(BEND * load[:, 0] / LOAD, points[:, 0])
    drop, top = -shapes[:, -1, 1], float(-shapes[-1, -1, 1])
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(nodes) for c in "xy"]
    network = fitted([Range("tip force", 0.0, LOAD, "N")], names, load, shapes.reshape(101, -1))
    interest = np.arange(0, nodes, (nodes - 1) // 5)
    field = planar_field("displacement", network, points, mirror=DOWN[0], of_interest=interest)
    # ln of the energy ∫P dw over ½ K w², on both sides
    work = np.concatenate([[0.0], np.cumsum((load[1:, 0] + load[:-1, 0]) / 2 * np.diff(drop))])
    K = load[1, 0] / drop[1]
    ratio = np.log(work[2:] / (0.5 * K * drop[2:] ** 2))
    w, ratio = np.concatenate([-drop[:1:-1], drop[2:]]), np.concatenate([ratio[::-1], ratio])
    flat = fitted([Range("h", -top, top, "m")], [Quantity("ℓ", "")], w[:, None], ratio[:, None])
    baseline = PadBaseline(RestStiffness.even(np.array([[K]])), Stiffening.none(1), axes=DOWN)
    return Surrogate(LearntEnergy(flat, baseline), {"displacement": field}, meta={"name": "rod", **META})


def one_sided(rod: Surrogate) -> Surrogate:
    """The same body, whose drawing knows one sign of the load."""
    field = dataclasses.replace(rod.fields["displacement"], mirror=None)
    return dataclasses.replace(rod, fields={"displacement": field})


def loaded_twice(rod: Surrogate) -> Surrogate:
    """A one-sided rod with a further input: a load that lifts its middle, and stiffens the tip a little."""
    lift = Range("middle load", -2.0, 2.0, "N")

    def widened(network: Network, share: np.ndarray) -> Network:
        """Return the network with the further input, on which each output depends by an affine share (m,)."""
        m = len(network.outputs)
        scaling = network.scaling
        return dataclasses.replace(
            network,
            inputs=(*network.inputs, lift),
            factors=np.concatenate([network.factors, np.zeros((*network.factors.shape[:2], 1))], axis=2),
            tail=np.hstack([network.tail, share.reshape(m, 1)]),
            scaling=dataclasses.replace(
                scaling,
                input_centre=np.append(scaling.input_centre, 0.0),
                input_half=np.append(scaling.input_half, lift.high),
                input_bend=np.append(scaling.input_bend, 0.0),
            ),
        )

    field = one_sided(rod).fields["displacement"]
    x = field.points[field.columns[:, 0], 0]
    up = np.where(field.columns[:, 1] == 1, 0.1 * x * x, 0.0) / field.network.scaling.output_scale
    field = dataclasses.replace(field, network=widened(field.network, up))
    rest = dataclasses.replace(rod.energy.baseline.rest, count=1)
    baseline = dataclasses.replace(rod.energy.baseline, rest=rest, stiffening=Stiffening.none(2))
    energy = LearntEnergy(widened(rod.energy.network, np.array([0.1])), baseline)
    return dataclasses.replace(rod, energy=energy, fields={"displacement": field})
