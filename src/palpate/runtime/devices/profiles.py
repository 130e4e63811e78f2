"""Profiles of haptic devices that are on the market: workspace, largest force, and how stiff and damped each may be.

The figures are those that open drivers carry for these devices (CHAI3D 3.2; Conti et al. 2005), rounded as there. No
maker has confirmed them. Where an opened device states its own limits, the smaller of both counts.

Reference: F. Conti, F. Barbagli, D. Morris, C. Sewell (2005), CHAI 3D: an open-source library for the rapid development
of haptic scenes, IEEE World Haptics, Pisa.
"""

from __future__ import annotations

from dataclasses import dataclass

from palpate.errors import UsageError

__all__ = ["PROFILES", "DeviceProfile", "device_profile"]


@dataclass(frozen=True)
class DeviceProfile:
    """The limits of one kind of device.

    Attributes
    ----------
    name : str
        As its maker calls it, in small letters.
    max_force : float
        F_max, N.
    max_stiffness : float
        The stiffest spring that it renders, K_max, N/m; infinite where nobody states one.
    max_damping : float
        The largest virtual damping, B_max, N·s/m; infinite where nobody states one.
    radius : float
        Of a sphere in its workspace, m.
    """

    name: str
    max_force: float
    max_stiffness: float
    max_damping: float
    radius: float


_UNSTATED = float("inf")

PROFILES: dict[str, DeviceProfile] = {
    profile.name: profile
    for profile in (
        DeviceProfile("omega.3", 12.0, 5000.0, 30.0, 0.075),
        DeviceProfile("omega.6", 12.0, 5000.0, 30.0, 0.075),
        DeviceProfile("omega.7", 12.0, 5000.0, 30.0, 0.075),
        DeviceProfile("delta.3", 20.0, 5000.0, 30.0, 0.15),
        DeviceProfile("sigma.7", 12.0, 4000.0, 30.0, 0.075),
        DeviceProfile("lambda.7", 12.0, 8000.0, 30.0, 0.1125),
        DeviceProfile("falcon", 8.0, 3000.0, 20.0, 0.04),
        DeviceProfile("touch", 3.3, 400.0, 4.0, 0.075),
        DeviceProfile("omni", 3.3, 700.0, 5.0, 0.10),
        DeviceProfile("desktop", 7.9, 1000.0, 5.0, 0.10),
        DeviceProfile("inverse3", 10.0, _UNSTATED, _UNSTATED, 0.10),
    )
}


def device_profile(name: str) -> DeviceProfile:
    """Return the profile of a device by its name, such as ``"falcon"``.

    Raises
    ------
    UsageError
        If no device of that name is known.
    """
    try:
        return PROFILES[name.lower()]
    except KeyError as error:
        raise UsageError(
            f"There is no profile of a device {name!r}.", fix=f"Choose one of {', '.join(PROFILES)}."
        ) from error
