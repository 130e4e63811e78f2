"""Learnt bodies inside other programs: one program a file, each an extra that is installed beside palpate.

====================  ====================================================================================
`mujoco`              `attach`: the force between a tool of a MuJoCo scene and a learnt body, with its reaction
`mujoco_callbacks`    MuJoCo's callbacks, for some scenes only
`mujoco_mesh`         `add_mesh` and `MeshDrawing`: the deformed body as a mesh of a scene
`press_env`           `PressEnv`: a Gymnasium environment, to reach a force with a soft body in the way
`torch`, `jax`        `TorchBody` and `JaxBody`: energy, force and stiffness as functions of their arrays
`array_program`       a learnt body as operators of arrays, which those two carry out
`extra`               packages that palpate does not need itself, missed in words
====================  ====================================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
