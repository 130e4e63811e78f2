"""MuJoCo's flex on the mesh of the case: the elements' stiffness is that of their own material."""

from __future__ import annotations

from typing import Any

import numpy as np

from .stepped import SteppedBall, with_mesh

__all__ = ["BEST", "SETTINGS", "load"]

DENSITY = 1000.0  # kg/m³: only the way to rest depends on it
STIFF = 'solref="0.004 1" solimp="0.99 0.999 0.0001"'
FAR = 1.0  # m, where the ball waits
PLAIN: dict[str, Any] = {"step": 2e-3, "skin": 5e-4, "stiff": True}
SETTINGS: tuple[dict[str, Any], ...] = (
    PLAIN,
    PLAIN | {"stiff": False},
    PLAIN | {"step": 5e-3, "surface": 4e-3},
    PLAIN | {"step": 5e-3},
    PLAIN | {"stiff": False, "surface": 4e-3},
    PLAIN | {"skin": 2e-3},
    PLAIN | {"damping": 0.1},
    PLAIN | {"solver": "Newton"},
    PLAIN | {"step": 1e-3},
    PLAIN | {"step": 5e-3, "surface": 3e-3},
)
BEST: dict[str, Any] = SETTINGS[2]


class _Flex:
    def __init__(self, case: Any, step: float, skin: float, stiff: bool, damping: float, solver: str) -> None:
        import mujoco

        self._step_model, self.seconds = mujoco.mj_step, step
        models = [_model(case, step, skin, stiff, damping, solver, m) for m in case.materials.values()]
        self._model = models[0]
        for label, model in enumerate(models):
            rows = case.mesh["label"] == label
            for name in ("flex_stiffness", "flex_damping"):
                values = getattr(self._model, name)
                if values.shape[:1] == (len(rows),) or values.size == 21 * len(rows):
                    values.reshape(len(rows), -1)[rows] = getattr(model, name).reshape(len(rows), -1)[rows]
        self._data = mujoco.MjData(self._model)
        self._contact_force = mujoco.mj_contactForce

    def reset(self) -> None:
        import mujoco

        mujoco.mj_resetData(self._model, self._data)
        self._data.mocap_pos[0] = FAR

    def advance(self, place: np.ndarray) -> np.ndarray:
        self._data.mocap_pos[0] = place
        self._step_model(self._model, self._data)
        total, wrench = np.zeros(3), np.zeros(6)
        for i in range(self._data.ncon):
            contact = self._data.contact[i]
            self._contact_force(self._model, self._data, i, wrench)
            push = contact.frame.reshape(3, 3).T @ wrench[:3]
            # the frame's first axis points from the first geometry to the second
            total += push if contact.geom[1] >= 0 else -push
        return total if np.isfinite(self._data.qpos).all() else np.full(3, np.nan)


def _model(
    case: Any, step: float, skin: float, stiff: bool, damping: float, solver: str, material: dict[str, Any]
) -> Any:
    """Return the scene with one material; the surface lies a skin farther out, the ball is as much smaller."""
    import mujoco

    mesh = case.mesh
    points = " ".join(f"{v:.9g}" for v in mesh["points"].ravel())
    corners = " ".join(map(str, mesh["tetrahedra"].ravel()))
    pins = " ".join(map(str, np.flatnonzero(mesh["fixed"])))
    a, b, c, d = mesh["points"][mesh["tetrahedra"]].transpose(1, 0, 2)
    mass = DENSITY * float(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a).sum()) / 6.0
    return mujoco.MjModel.from_xml_string(f"""<mujoco><size memory="1G"/>
    <option timestep="{step}" solver="{solver}" integrator="discrete" tolerance="1e-8" gravity="0 0 0"/>
    <worldbody><body name="ball" mocap="true" pos="{FAR} {FAR} {FAR}">
    <geom name="tool" type="sphere" size="{case.radius - skin}" condim="1"/></body>
    <flexcomp name="soft" dim="3" type="direct" point="{points}" element="{corners}" mass="{mass}" radius="{skin}">
    <elasticity young="{material["young"]}" poisson="{material["poisson"]}" damping="{damping}"/>
    <contact selfcollide="none" condim="1" {STIFF if stiff else ""}/><pin id="{pins}"/></flexcomp>
    </worldbody></mujoco>""")


def load(case: Any, **setting: Any) -> SteppedBall:
    """Return the method; `setting` is one of `SETTINGS`."""
    used = {"damping": 0.01, "solver": "CG", **(setting or BEST)}
    surface = used.pop("surface", None)
    words = f"step {1e3 * used['step']:g} ms, skin {1e3 * used['skin']:g} mm, {used['solver']}"
    words += ", stiff contact" * used["stiff"] + f", damping {used['damping']:g} s" * (
        used["damping"] != 0.01
    )
    words += f", surface {1e3 * surface:g} mm" if surface else ""
    body = with_mesh(case, surface)
    return SteppedBall(_Flex(body, **used), body, words)
