"""What a learnt body costs in a simulator and in batches, and what a bounce on it keeps.

    python -m benchmarks.simulator_forces [--quick] [--record]

Time of a MuJoCo step with the learnt body less that of the same scene without; the energy of an undamped bounce of ten
seconds; forces of a batch in NumPy a second and core, and the times of torch and JAX over NumPy's, in the same run. All
times are those of processors, which other work on the machine lengthens little.
"""

from __future__ import annotations

import math
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.rest_block import HEIGHT, MASS, RADIUS, SIDE, body
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.surrogates import Surrogate

__all__ = ["tables"]

_GRAVITY = 9.81  # m/s²
_STEP_BOUND, _BOUNCE_BOUND, _RATE_BOUND, _SHARE_BOUND = 40.0, 1e-5, 5e5, 2.0
_ROWS = 100_000


def _scene(step: float, *, integrator: str = "Euler", lift: float = 0.002, damping: float = 0.0) -> Any:
    import mujoco

    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step}" integrator="{integrator}" gravity="0 0 -{_GRAVITY}"/><worldbody>
        <body name="ball" pos="0 0 {HEIGHT + RADIUS + lift}"><joint type="slide" axis="0 0 1" damping="{damping}"/>
        <geom name="tool" type="sphere" size="{RADIUS}" mass="{MASS}"/></body></worldbody></mujoco>"""
    )


def _attached(model: Any, touch: Surrogate, count: int = 1) -> tuple[Any, list[Any]]:
    import mujoco

    from palpate.adapters.mujoco import attach

    data = mujoco.MjData(model)
    at = (-SIDE / 2, -SIDE / 2, 0.0)
    return data, [attach(model, data, touch, geom="tool", at=at) for _ in range(count)]


def _scaled(touch: Surrogate, factor: float) -> Surrogate:
    """Return the body with so many times its stiffness."""
    from dataclasses import replace

    network = touch.energy.network
    tail = network.tail.copy()
    tail[:, 0] += math.log(factor) / network.scaling.output_scale
    return Surrogate(replace(touch.energy, network=replace(network, tail=tail)), meta={"name": touch.name})


def _step_rows(touch: Surrogate, steps: int) -> tuple[list[dict[str, Any]], list[Claim]]:
    """Return the time of a tool and step, with one tool in contact and with four."""
    import mujoco

    def seconds(count: int) -> float:
        model = _scene(5e-4, lift=-0.003, damping=1.0)
        data, _ = _attached(model, touch, count) if count else (mujoco.MjData(model), [])
        parts = []
        for _ in range(10):
            start = time.process_time()
            mujoco.mj_step(model, data, nstep=steps // 10)
            parts.append((time.process_time() - start) / (steps // 10))
        return min(parts)

    free, rows, claims = seconds(0), [], []
    for count in (1, 4):
        each = 1e6 * (seconds(count) - free) / count
        rows.append({"what": f"MuJoCo, {count} in contact: a tool and step", "value": each, "unit": "µs"})
        claims.append(Claim(f"a tool and step, {count} in contact, µs", (each,), _STEP_BOUND, ".0f"))
    return rows, claims


def _bounce_rows(touch: Surrogate, seconds: float) -> tuple[list[dict[str, Any]], list[Claim]]:
    """Return by how much the energy of an undamped bounce varies, over what is exchanged with the body."""
    import mujoco

    rows, claims = [], []
    for integrator in ("Euler", "implicitfast"):
        for step in (2.5e-4, 5e-4):
            model = _scene(step, integrator=integrator)
            data, (contact,) = _attached(model, touch)
            energies, stored = [], 0.0
            for _ in range(int(seconds / step)):
                mujoco.mj_step(model, data)
                stored = max(stored, contact.energy)
                if contact.energy == 0.0:  # in the air; the speed is that of half a step before
                    speed = data.qvel[0] - 0.5 * step * _GRAVITY
                    energies.append(MASS * (0.5 * speed**2 + _GRAVITY * data.qpos[0]))
            share = float(np.ptp(energies)) / stored
            what = f"bounce of {seconds:g} s, {integrator}, {1e3 * step:g} ms: energy varies"
            rows.append({"what": what, "value": share, "unit": "of what is exchanged"})
            claims.append(Claim(what, (share,), _BOUNCE_BOUND))
    return rows, claims


def _long_rows(touch: Surrogate, steps: int) -> tuple[list[dict[str, Any]], list[Claim]]:
    """Return how high a dropped ball comes over where it was let go, in long runs of any stiffness."""
    import mujoco

    rows, claims = [], []
    for modulus in (1e3, 1e5, 1e7):
        for step in (5e-4, 5e-3):
            model = _scene(step)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that steps are damped is counted
                data, (contact,) = _attached(model, _scaled(touch, modulus / 9e3))
                highest = -math.inf
                for _ in range(steps):
                    mujoco.mj_step(model, data)
                    highest = max(highest, data.qpos[0] if math.isfinite(data.qpos[0]) else math.inf)
            # Euler's speed is half a step late, which may lift an apex by half a step's way at full speed
            share = highest / (0.5 * step * math.sqrt(2 * _GRAVITY * 0.002))
            damped = contact.damped_steps / steps
            what = f"{modulus:.0e} Pa, {1e3 * step:g} ms, {steps} steps ({damped:.0%} of them damped): apex"
            rows.append({"what": what, "value": share, "unit": "of what a step may lift it"})
            claims.append(Claim(what, (share,), 1.0, ".2f"))
    return rows, claims


def _least(works: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Return the least time of each work, s, over rounds of all of them."""
    times = np.full((rounds, len(works)), np.inf)
    for work in works:
        work()
    for row in times:
        for k, work in enumerate(works):
            start = time.process_time()
            work()
            row[k] = time.process_time() - start
    return [float(least) for least in times.min(axis=0)]


def _batch_works(touch: Surrogate, X: np.ndarray) -> dict[str, Callable[[], object]]:
    """Return what answers a batch, by name; NumPy first."""
    works: dict[str, Callable[[], object]] = {"NumPy, force": lambda: touch.energy.force(X)}
    try:
        import torch

        from palpate.adapters.torch import TorchBody
    except ImportError:
        print("torch is not installed: left out", file=sys.stderr)
    else:
        rows, by_torch = torch.from_numpy(X), TorchBody(touch)

        def slope() -> Any:
            leaf = rows.clone().requires_grad_()
            return torch.autograd.grad(by_torch.energy(leaf).sum(), leaf)

        works |= {"torch, force": lambda: by_torch.force(rows), "torch, energy and its gradient": slope}
    try:
        import jax

        jax.config.update("jax_enable_x64", True)
        from palpate.adapters.jax import JaxBody
    except ImportError:
        print("JAX is not installed: left out", file=sys.stderr)
    else:
        many, by_jax = jax.numpy.asarray(X), JaxBody(touch)
        force = jax.jit(by_jax.force)
        works["JAX, force"] = lambda: force(many).block_until_ready()
    return works


def _batch_rows(touch: Surrogate, count: int, rounds: int) -> tuple[list[dict[str, Any]], list[Claim]]:
    low, high = (np.array([getattr(r, end) for r in touch.inputs]) for end in ("low", "high"))
    X = np.random.default_rng(0).uniform(low, high, (count, 3))
    works = _batch_works(touch, X)
    own, *others = _least(list(works.values()), rounds)
    rate = count / own
    rows: list[dict[str, Any]] = [
        {"what": f"NumPy, force, {count} rows", "value": rate, "unit": "forces/s and core"}
    ]
    claims = [
        Claim(
            "time of NumPy over that of 500,000 forces a second and core", (_RATE_BOUND / rate,), 1.0, ".2f"
        )
    ]
    for what, seconds in zip(list(works)[1:], others, strict=True):
        rows.append({"what": what, "value": seconds / own, "unit": "of NumPy's time"})
        claims.append(Claim(f"{what}, of NumPy's time", (seconds / own,), _SHARE_BOUND, ".2f"))
    return rows, claims


def tables(*, quick: bool) -> list[Table]:
    """Return the table of times, energies and rates."""
    touch = body()
    parts = [
        _step_rows(touch, 200 if quick else 20_000),
        _bounce_rows(touch, 0.2 if quick else 10.0),
        _long_rows(touch, 500 if quick else 100_000),
        _batch_rows(touch, 2_000 if quick else _ROWS, 2 if quick else 9),
    ]
    rows = [row for some, _ in parts for row in some]
    for row in rows:
        row["text"] = f"{row['value']:.3g}"
    claims = [claim for _, some in parts for claim in some]
    columns = (Column("what", "what"), Column("text", "value"), Column("unit", "unit"))
    notes = ("the block of 9 kPa that a ball rests on; its stiffness is scaled for other moduli",)
    title = f"A learnt body in simulators and batches{quick_mark(quick)}"
    return [Table("simulator_forces", title, columns, rows, [] if quick else claims, notes)]


if __name__ == "__main__":
    sys.exit(main(only="simulator_forces"))
