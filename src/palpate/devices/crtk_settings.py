"""Settings of the connection to an arm that speaks CRTK, and the types of its topics as ROS 1 spells them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.devices.crtk_pedals import PEDALS, Pedals
from palpate.devices.device import Axes
from palpate.devices.device_options import DeviceOptions, number, switch, word
from palpate.errors import UsageError

__all__ = [
    "LARGEST_FORCE",
    "LARGEST_RADIUS",
    "LONGEST_DELAY",
    "TYPES",
    "CrtkSettings",
    "axes_in_words",
]

LARGEST_RADIUS, LARGEST_FORCE, LONGEST_DELAY = 0.15, 12.0, 0.02  # m, N, s
TYPES = {
    "measured_cp": "geometry_msgs/PoseStamped",
    "measured_cv": "geometry_msgs/TwistStamped",
    "operating_state": "crtk_msgs/OperatingState",
    "state_command": "crtk_msgs/StringStamped",
    "body/set_cf_orientation_absolute": "std_msgs/Bool",
    "palpate_echo": "std_msgs/String",
    "servo_cf": "geometry_msgs/WrenchStamped",
    "body/servo_cf": "geometry_msgs/WrenchStamped",
    "use_gravity_compensation": "std_msgs/Bool",
    "lock_orientation": "geometry_msgs/Quaternion",
    "unlock_orientation": "std_msgs/Empty",
    "orientation_locked": "std_msgs/Bool",
    "pedal": "sensor_msgs/Joy",
}


@dataclass(frozen=True)
class CrtkSettings(DeviceOptions):
    """Settings of the connection."""

    driver = "crtk"
    url: str = "ws://localhost:9090"  # address of the ROS bridge
    arm: str = ""  # namespace of the arm, such as MTMR; empty for none
    wrench: str = word("body/servo_cf", "servo_cf")  # topic of the force
    # ros1 spells geometry_msgs/PoseStamped, ros2 geometry_msgs/msg/PoseStamped; auto tries both
    types: str = word("auto", "ros1", "ros2")
    axes: str = "-y+z-x"  # where right, up and towards the user lie in the axes of the arm's base
    # centre of the workspace: where the handle is while it is opened; base: the arm's own origin
    origin: str = word("here", "base")
    radius: float = number(0.05, 0.0, LARGEST_RADIUS, above=True)  # m, of the workspace
    force: float = number(3.0, 0.0, LARGEST_FORCE, above=True)  # N, the largest
    delay: float = number(-1.0, most=LONGEST_DELAY)  # s, round trip through the bridge; negative measures it
    state: float = switch(1.0)  # 0 does without the arm's operating state
    enable: float = switch(0.0)  # 1 lets the driver enable the arm
    home: float = switch(0.0)  # 1 lets the driver home the arm: it moves by itself
    gravity: float = switch(1.0)  # 1 asks the arm to bear its own weight; 0 leaves that as it is
    # 1 asks an arm whose wrist is passive under a force to hold its orientation, as it is while it is opened
    lock: float = switch(1.0)
    pedals: str = "footpedals"  # namespace of the console's pedals; empty for none
    clutch: str = "clutch"  # pedal that lets the handle move alone; empty for none
    # pedal that is the first button, the dead-man button where one is asked for; empty for none
    dead_man: str = "coag"
    # pedal that holds the body while pressed; empty: the hand always holds it. All other pedals stop the force
    hold: str = ""
    wait: float = number(0.0, 0.0, 1.0)  # s, longest wait of a tick for a position
    search: float = number(2.0, 0.0, 60.0, above=True)  # s to wait for the arm while opening

    def __post_init__(self) -> None:
        super().__post_init__()
        named = [pedal for pedal in (self.clutch, self.dead_man, self.hold) if pedal]
        if len(set(named)) < len(named) or not all("/" in pedal or pedal in PEDALS for pedal in named):
            raise UsageError(
                "A pedal of crtk is not known, or has two meanings.",
                fix=f"clutch, dead_man and hold are three of {', '.join(PEDALS)}, or topics with a slash, such as "
                "console/operator_present.",
            )
        axes_in_words(self.axes)

    def console_pedals(self) -> Pedals:
        """Return the pedals, at rest."""
        return Pedals(self.pedals, self.clutch, self.dead_man, self.hold)


def axes_in_words(text: str) -> Axes:
    """Return the rotation of three signed letters: where right, up and towards the user lie in the arm's axes."""
    rows = np.zeros((3, 3))
    good = len(text) == 6 and all(text[k] in "+-" and text[k + 1] in "xyz" for k in (0, 2, 4))
    for k in range(3 if good else 0):
        rows[k, "xyz".index(text[2 * k + 1])] = 1.0 if text[2 * k] == "+" else -1.0
    if not (good and np.isclose(np.linalg.det(rows), 1.0)):
        raise UsageError(
            f"The axes {text!r} are no rotation.",
            fix="Write right, up and towards you in the arm's axes, such as -y+z-x; they must be right-handed.",
        )
    (a, b, c), (d, e, f), (g, h, i) = rows.tolist()
    return (a, b, c), (d, e, f), (g, h, i)
