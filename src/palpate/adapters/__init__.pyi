"""Public names of `palpate.adapters`, each loaded when it is first used."""

from .jax import JaxBody as JaxBody
from .mujoco import SoftContact as SoftContact
from .mujoco import StiffStepWarning as StiffStepWarning
from .mujoco import attach as attach
from .mujoco_mesh import MeshDrawing as MeshDrawing
from .mujoco_mesh import add_mesh as add_mesh
from .press_env import PressEnv as PressEnv
from .torch import TorchBody as TorchBody
