"""A ball pressed into layered tissue: force, stiffness, picture, and a small sweep.

Skin, fat and muscle, each a strain energy of its own; a ball of 10 mm that presses them. Each solve gives the energy U,
the force on the ball −∂U/∂c and its derivative, the stiffness that a hand feels.
"""

import numpy as np

import palpate as pp

flesh = pp.shapes.LayeredBlock(
    extent=(0.06, 0.06), layers=(("skin", 0.003), ("fat", 0.010), ("muscle", 0.020))
)
tissue = {
    "skin": pp.materials.NeoHookean(young=30e3, poisson=0.45),
    "fat": pp.materials.NeoHookean(young=4e3, poisson=0.47),
    "muscle": pp.materials.NeoHookean(young=20e3, poisson=0.47),
}
body = pp.Body(flesh, tissue, fixed="bottom")
ball = pp.SphereProbe(radius=0.010, touches="top", depth=(0.0, 0.006), over=((0.025, 0.025), (0.035, 0.035)))
problem = body.problem(ball, element=0.0075)  # m beneath the ball; without, half its radius: finer and slower
print(problem)

solver = problem.open()  # keeps the finite elements; each solve starts from the nearest one before
top = 0.033 + ball.radius
print(" depth      force    stiffness   pad pressed by")
for depth in (0.002, 0.004, 0.006):
    pressed = solver.solve([0.03, 0.03, top - depth], fields=True)
    force, stiffness = pressed.response[2], -pressed.response_gradient[2, 2]
    print(
        f"{1e3 * depth:4.0f} mm  {force:7.4f} N  {stiffness:6.1f} N/m  {1e3 * pressed.penetration:10.2f} mm"
    )
print(pressed)

# the force is the slope of the energy, whatever the mesh
step = 1e-6
above, below = (solver.solve([0.03, 0.03, top - depth + s]).potential_energy for s in (step, -step))
print(f"force from differences of the energy: {-(above - below) / (2 * step):.4f} N")

pressed.plot("von_mises", cut="y").save("tissue.png")
pressed.to_vtu("tissue.vtu")  # for ParaView

data = pp.sweep(problem, samples=4, seed=0, path="tissue.zarr")
print(data)
deepest = np.argmax(np.linalg.norm(data.force, axis=1))
print(f"largest force: {np.linalg.norm(data.force[deepest]):.4f} N at {1e3 * data.X[deepest]} mm")
