"""Profiles of haptic devices that are on the market: workspace, largest force, and how stiff and damped each may be.

Most figures are those that open drivers carry for these devices (CHAI3D 3.2; Conti et al. 2005), rounded as there. No
maker has confirmed them. Where an opened device states its own limits, the smaller of both counts. A device whose type
is not in the table gets the least of each limit that its driver knows, see `weakest_profile`.

Reference: F. Conti, F. Barbagli, D. Morris, C. Sewell (2005), CHAI 3D: an open-source library for the rapid development
of haptic scenes, IEEE World Haptics, Pisa.
"""

from __future__ import annotations

from dataclasses import dataclass

from palpate.checks import did_you_mean
from palpate.errors import UsageError

__all__ = ["PROFILES", "DeviceProfile", "device_profile", "limits_in_words", "weakest_profile"]

_COARSEST = 6e-5  # m
_TORQUE = 0.2  # N m: below what such wrists render, since their makers' figures were not at hand
_CHAI3D = "as open drivers have it (CHAI3D 3.2)"


@dataclass(frozen=True)
class DeviceProfile:
    """The limits of one kind of device."""

    name: str  # as its maker calls it, in small letters
    driver: str  # as in --device
    max_force: float  # F_max, N
    max_stiffness: float  # K_max, N/m: the stiffest spring that it renders; infinite where nobody states one
    max_damping: float  # B_max, N·s/m: the largest virtual damping; infinite where nobody states one
    radius: float  # m, of a sphere in its workspace
    source: str = _CHAI3D  # where the figures come from
    # m, steps of the handle's place, rounded from data sheets; the coarsest where none is known
    resolution: float = _COARSEST
    max_torque: float = 0.0  # N m about any axis, of a wrist with motors; 0: it has none


_UNSTATED = float("inf")
_DHD, _HD, _HAPLY = "forcedimension", "openhaptics", "haply"

PROFILES: dict[str, DeviceProfile] = {
    profile.name: profile
    for profile in (
        DeviceProfile("omega.3", _DHD, 12.0, 5000.0, 30.0, 0.075, resolution=1e-5),
        DeviceProfile("omega.6", _DHD, 12.0, 5000.0, 30.0, 0.075, resolution=1e-5),
        DeviceProfile("omega.7", _DHD, 12.0, 5000.0, 30.0, 0.075, resolution=1e-5),
        DeviceProfile("delta.3", _DHD, 20.0, 5000.0, 30.0, 0.15, resolution=3e-5),
        DeviceProfile("delta.6", _DHD, 20.0, 5000.0, 30.0, 0.15, resolution=3e-5, max_torque=_TORQUE),
        DeviceProfile("sigma.6+", _DHD, 12.0, 4000.0, 30.0, 0.09, max_torque=_TORQUE),
        DeviceProfile("sigma.7", _DHD, 12.0, 4000.0, 30.0, 0.075, max_torque=_TORQUE),
        DeviceProfile("lambda.7", _DHD, 12.0, 8000.0, 30.0, 0.1125, max_torque=_TORQUE),
        DeviceProfile("falcon", _DHD, 8.0, 3000.0, 20.0, 0.04),
        DeviceProfile("touch", _HD, 3.3, 400.0, 4.0, 0.075),
        DeviceProfile("omni", _HD, 3.3, 700.0, 5.0, 0.10),
        DeviceProfile("desktop", _HD, 7.9, 1000.0, 5.0, 0.10, resolution=2.3e-5),
        DeviceProfile(
            "inverse3", _HAPLY, 10.0, _UNSTATED, _UNSTATED, 0.10,
            "radius: the maker's tutorials; force: the Inverse3's peak",
        ),
        DeviceProfile(
            "inverse3x", _HAPLY, 10.0, _UNSTATED, _UNSTATED, 0.10,
            "radius: the maker's tutorials; force: not published, the Inverse3's is taken",
        ),
        DeviceProfile(
            "minverse", _HAPLY, 3.3, _UNSTATED, _UNSTATED, 0.04,
            "radius: the maker's tutorials; force: not published, the least of all devices is taken",
        ),
    )
}  # fmt: skip


def device_profile(name: str) -> DeviceProfile:
    """Return the profile of a device by its name, such as ``"falcon"``."""
    try:
        return PROFILES[name.lower()]
    except KeyError as error:
        raise UsageError(
            f"There is no profile of a device {name!r}.",
            why=f"Profiles: {', '.join(PROFILES)}.",
            fix=did_you_mean(name, PROFILES) or "Choose one of these.",
        ) from error


def weakest_profile(driver: str) -> DeviceProfile:
    """Return what a device of unknown type gets: of each limit the least among the driver's profiles."""
    family = [profile for profile in PROFILES.values() if profile.driver == driver]
    return DeviceProfile(
        "unknown",
        driver,
        min(profile.max_force for profile in family),
        min(profile.max_stiffness for profile in family),
        min(profile.max_damping for profile in family),
        min(profile.radius for profile in family),
        "an unknown type, so the least of each limit that this driver knows",
    )


def limits_in_words(driver: str) -> str:
    """Return the limits of a driver's devices, and of one of unknown type, as a line; empty where it has none."""
    family = [profile for profile in PROFILES.values() if profile.driver == driver]
    if not family:
        return ""
    return "; ".join(
        f"{'any other type' if profile.name == 'unknown' else profile.name} ±{1e3 * profile.radius:g} mm, "
        f"{profile.max_force:g} N"
        + (f", {profile.max_stiffness:g} N/m" if profile.max_stiffness < _UNSTATED else "")
        for profile in (*family, weakest_profile(driver))
    )
