"""Baselines: what of an energy is known before anything is learnt, one file for each kind of interaction.

baseline            the contract, and the registry by name
contact_baseline    a sphere that presses a surface, by the closest point
overlap_baseline  the same, by all of the surface that it meets
tool_baseline       a rigid tool that presses a plane surface, by its deepest point
pad_baseline        a patch or node that is held and displaced
constant_baseline   a constant, for several loads whose place of rest moves
"""

from palpate.surrogates.baselines.baseline import (
    Baseline,
    Solves,
    register_baseline,
    registered_baselines,
)
from palpate.surrogates.baselines.constant_baseline import ConstantBaseline
from palpate.surrogates.baselines.contact_baseline import ContactBaseline, depth_series
from palpate.surrogates.baselines.overlap_baseline import OverlapBaseline
from palpate.surrogates.baselines.pad_baseline import PadBaseline
from palpate.surrogates.baselines.pinch_baseline import PinchBaseline, require_one_tool
from palpate.surrogates.baselines.posed_baseline import PosedBaseline
from palpate.surrogates.baselines.rest_stiffness import RestStiffness
from palpate.surrogates.baselines.stiffening import Stiffening
from palpate.surrogates.baselines.tool_baseline import ToolBaseline, deepest_ball, require_ball

__all__ = [
    "Baseline",
    "ConstantBaseline",
    "ContactBaseline",
    "OverlapBaseline",
    "PadBaseline",
    "PinchBaseline",
    "PosedBaseline",
    "RestStiffness",
    "Solves",
    "Stiffening",
    "ToolBaseline",
    "deepest_ball",
    "depth_series",
    "register_baseline",
    "registered_baselines",
    "require_ball",
    "require_one_tool",
]
