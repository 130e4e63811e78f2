"""Shapes of rigid tools that press a body, as signed distances.

    tool_shape    the base of all tools, and the functions that their distances are made of
    round_tools   Sphere, Capsule, Fingertip, Cone
    edged_tools   Punch, Cylinder, Box
    scanned_tool  ScannedTool, of the file of a surface: `palpate.read_tool` makes it
    rotations     rotation vectors, their matrices and how turns follow from their changes
    front_balls   a tool's front as balls
    posed_tool    a tool in an orientation, its pose by its inputs, and how it is written to files
    gripper       two jaws as one tool, their opening an input

A tool's own frame has its origin in the tool's centre. The tool points along −z: its foremost point is (0, 0, −front).
"""

from palpate.tools.edged_tools import Box, Cylinder, Punch
from palpate.tools.front_balls import front_balls
from palpate.tools.gripper import Gripper
from palpate.tools.posed_tool import PosedTool, Turns
from palpate.tools.rotations import left_jacobian, rotation_matrix
from palpate.tools.round_tools import Capsule, Cone, Fingertip, Sphere
from palpate.tools.scanned_tool import ScannedTool
from palpate.tools.tool_shape import Tool

__all__ = [
    "Box",
    "Capsule",
    "Cone",
    "Cylinder",
    "Fingertip",
    "Gripper",
    "PosedTool",
    "Punch",
    "ScannedTool",
    "Sphere",
    "Tool",
    "Turns",
    "front_balls",
    "left_jacobian",
    "rotation_matrix",
]
