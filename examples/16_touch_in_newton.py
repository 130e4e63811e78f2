"""Sixteen balls come to rest on a learnt block in Newton: one batch of forces a step, added to `State.body_f`.

The block is fixed and without inertia, the balls rigid, and none feels the others. Newton compiles its kernels at the
first run, for minutes. On a GPU the forces stay there: TorchBody answers on the device that its tensors are on.
"""

import newton
import numpy as np
import warp as wp

import palpate as pp
from palpate.adapters.torch import TorchBody

block = pp.shapes.Block(size=(0.06, 0.06, 0.03))  # m
body = pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=0.45), fixed="bottom")
ball = pp.SphereProbe(radius=0.010, touches="top", depth=(0.0, 0.006), over=((0.027, 0.027), (0.033, 0.033)))
data = pp.sweep(body.problem(ball, element=0.0075), samples=16, seed=0)
touch = TorchBody(pp.learn(data, effort=0.2)[0])

MASS, TOP, STEP, DAMPER = 0.025, 0.040, 5e-4, 1.0  # kg, m, s, N s/m
builder = newton.ModelBuilder()
for x, y in np.random.default_rng(0).uniform(0.028, 0.032, (16, 2)):
    one = builder.add_body(xform=wp.transform((x, y, TOP), wp.quat_identity()))
    builder.add_shape_sphere(
        one, radius=0.010, cfg=newton.ModelBuilder.ShapeConfig(density=MASS / (4 / 3 * np.pi * 1e-6))
    )
model = builder.finalize()
solver, (now, after) = newton.solvers.SolverSemiImplicit(model), (model.state(), model.state())


@wp.kernel
def add_forces(force: wp.array(dtype=wp.vec3d), speed: wp.array(dtype=wp.spatial_vector),
               body_f: wp.array(dtype=wp.spatial_vector)):  # fmt: skip
    i = wp.tid()
    body_f[i] += wp.spatial_vector(wp.vec3(force[i]) - DAMPER * wp.spatial_top(speed[i]), wp.vec3())


for _ in range(2000):
    now.clear_forces()
    force = touch.force(wp.to_torch(now.body_q)[:, :3].double())  # N, of balls whose frame is the block's
    wp.launch(add_forces, len(force), [wp.from_torch(force, dtype=wp.vec3d), now.body_qd, now.body_f])
    solver.step(now, after, None, None, STEP)
    now, after = after, now
places = wp.to_torch(now.body_q)[:, :3].double()
force = touch.force(places)
print(f"rest depths {1e3 * (TOP - places[:, 2]).min():.3f} to {1e3 * (TOP - places[:, 2]).max():.3f} mm")
print(f"borne by {force[:, 2].mean():.4f} N of {MASS * 9.81:.4f} N")
