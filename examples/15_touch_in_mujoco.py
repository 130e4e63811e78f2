"""A ball comes to rest on a learnt block in MuJoCo, as deep as finite elements say; then it bounces for ten seconds.

The block is fixed and without inertia, the ball rigid: each force is that of a static equilibrium.
"""

import mujoco
import numpy as np

import palpate as pp
from palpate.adapters.mujoco import attach

block = pp.shapes.Block(size=(0.06, 0.06, 0.03))  # m
body = pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=0.45), fixed="bottom")
ball = pp.SphereProbe(radius=0.010, touches="top", depth=(0.0, 0.006), over=((0.027, 0.027), (0.033, 0.033)))
problem = body.problem(ball, element=0.0075)  # m beneath the ball: coarse and quick
touch, _ = pp.learn(pp.sweep(problem, samples=16, seed=0), effort=0.2)

MASS, TOP = 0.025, 0.040  # kg; m, height of a ball that just touches
scene = """<mujoco><option timestep="2.5e-4"/><worldbody><body name="ball" pos=".03 .03 {}">
    <joint type="slide" axis="0 0 1" damping="{}"/><geom name="tool" type="sphere" size=".01" mass="{}"/>
    </body></worldbody></mujoco>"""

model = mujoco.MjModel.from_xml_string(scene.format(TOP, 1.0, MASS))
data = mujoco.MjData(model)
contact = attach(model, data, touch, geom="tool", at=(0.0, 0.0, 0.0))
mujoco.mj_step(model, data, nstep=8000)
print(f"the ball rests {1e3 * contact.depth:.3f} mm deep, borne by {contact.force[2]:.4f} N")
there = problem.solve([0.03, 0.03, TOP - contact.depth])
missing = (MASS * 9.81 - there.force[2]) / -there.response_gradient[2, 2]
print(f"finite elements: {1e3 * (contact.depth + missing):.3f} mm")

model = mujoco.MjModel.from_xml_string(scene.format(TOP + 0.002, 0.0, MASS))
data, energies = mujoco.MjData(model), []
contact = attach(model, data, touch, geom="tool", at=(0.0, 0.0, 0.0))
for _ in range(40_000):
    mujoco.mj_step(model, data)
    if contact.energy == 0.0:  # in the air; Euler's speed is that of half a step before
        energies.append(MASS * (0.5 * (data.qvel[0] - 1.25e-4 * 9.81) ** 2 + 9.81 * data.qpos[0]))
print(f"in 10 s of bouncing the energy varies by {np.ptp(energies):.1e} J of {MASS * 9.81 * 0.005:.1e} J")
