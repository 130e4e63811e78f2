"""Newton's vertex block descent (VBD) on the mesh of the case, with a ball whose place is prescribed.

Newton is run in an environment of its own, on the processor: `pip install newton` beside palpate.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .stepped import SteppedBall, with_mesh

__all__ = ["BEST", "SETTINGS", "load"]

DENSITY = 1000.0  # kg/m³: only the way to rest depends on it
FAR = 1.0  # m, where the ball waits
PLAIN: dict[str, Any] = {"step": 5e-3, "iterations": 10, "contact": 1e3}
SETTINGS: tuple[dict[str, Any], ...] = (
    PLAIN,
    PLAIN | {"surface": 4e-3},
    PLAIN | {"contact": 1e2},
    PLAIN | {"step": 2e-2},
    PLAIN | {"contact": 1e4},
    PLAIN | {"skin": 2e-3},
    PLAIN | {"iterations": 40},
    PLAIN | {"surface": 3e-3},
)
BEST: dict[str, Any] = SETTINGS[0]


class _Vbd:
    def __init__(
        self, case: Any, step: float, iterations: int, contact: float, skin: float, damping: float
    ) -> None:
        import newton
        import warp as wp

        wp.config.quiet = True
        self._wp, self.seconds, self._contact = wp, step, contact
        self._radius, self._skin = case.radius - skin, skin
        young, poisson = (
            np.array([m[key] for m in case.materials.values()])[case.mesh["label"]]
            for key in ("young", "poisson")
        )
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        builder.add_soft_mesh(
            pos=wp.vec3(),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(),
            vertices=[wp.vec3(*point) for point in case.mesh["points"]],
            indices=case.mesh["tetrahedra"].ravel().tolist(),
            density=DENSITY,
            k_mu=young / (2.0 * (1.0 + poisson)),
            k_lambda=young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            k_damp=damping,
            particle_radius=skin,
        )
        for held in np.flatnonzero(case.mesh["fixed"]):
            builder.particle_mass[held] = 0.0
        ball = builder.add_body(xform=wp.transform((FAR, FAR, FAR), wp.quat_identity()))
        material = newton.ModelBuilder.ShapeConfig(ke=contact, kd=0.0, mu=0.0)
        builder.add_shape_sphere(ball, radius=self._radius, cfg=material)
        builder.color()
        self._model = builder.finalize(device="cpu")
        self._model.soft_contact_ke, self._model.soft_contact_kd = contact, 0.0
        self._model.soft_contact_mu = 0.0
        self._solver = newton.solvers.SolverVBD(
            self._model,
            iterations=iterations,
            integrate_with_external_rigid_solver=True,
            particle_enable_tile_solve=False,  # tiles are for graphics cards
        )
        self._pipeline = newton.CollisionPipeline(self._model, soft_contact_margin=2.0 * skin + 1e-3)
        self._contacts, self._control = self._pipeline.contacts(), self._model.control()
        self._free = ~case.mesh["fixed"]
        self.reset()

    def reset(self) -> None:
        self._states = self._model.state(), self._model.state()

    def advance(self, place: np.ndarray) -> np.ndarray:
        now, after = self._states
        pose = self._wp.array([(*place, 0.0, 0.0, 0.0, 1.0)], dtype=self._wp.transform, device="cpu")
        for state in (now, after):
            state.body_q.assign(pose)
        now.clear_forces()
        self._pipeline.collide(now, self._contacts)
        self._solver.step(now, after, self._control, self._contacts, self.seconds)
        self._states = after, now
        away = place - after.particle_q.numpy()[self._free].astype(float)
        distance = np.linalg.norm(away, axis=1)
        pressed = distance < self._radius + self._skin
        depth = self._radius + self._skin - distance[pressed]
        return np.asarray(self._contact * (depth / distance[pressed]) @ away[pressed])


def load(case: Any, **setting: Any) -> SteppedBall:
    """Return the method; `setting` is one of `SETTINGS`."""
    used = {"skin": 1e-3, "damping": 0.0, **(setting or BEST)}
    surface = used.pop("surface", None)
    words = (
        f"step {1e3 * used['step']:g} ms, {used['iterations']} iterations, contact {used['contact']:g} N/m"
    )
    words += f", skin {1e3 * used['skin']:g} mm" + f", damping {used['damping']:g} Pa s" * (
        used["damping"] != 0.0
    )
    words += f", surface {1e3 * surface:g} mm" if surface else ""
    body = with_mesh(case, surface)
    return SteppedBall(_Vbd(body, **used), body, words)
