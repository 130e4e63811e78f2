"""A simulated hand on a simulated device: a mass that the loop really pushes, so that its stability can be seen.

    m ẍ = F − b ẋ + k_g (x_g − x) − b_g ẋ − f sign(ẋ)

F is the loop's force, b the device's own damping, f its Coulomb friction; the hand holds it by a spring k_g and damper
b_g and wants it at x_g, which a script moves. The motion is integrated in steps of a tenth of a millisecond, implicit
in all dampers. What the loop reads is noisy, rounded to the encoder's steps and `delay` seconds old, as its time says.
It runs by the loop's own clock, which may be any: live, or as fast as it can be computed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.devices.device import Driver, Sample, Traits
from palpate.devices.device_options import DeviceOptions, number, word
from palpate.devices.hand_kind import HandKind
from palpate.devices.profiles import device_profile
from palpate.devices.trace_file import read_stroke
from palpate.kernels import kernel, part

__all__ = ["SimulatedHand", "SimulatedSettings"]

_SHAPES = ("sine", "press", "random", "adversarial")
_RECORDED = len(_SHAPES)
_STEP = 1e-4  # s, of the motion's integration
_PAST = 512  # samples kept for the delay
# s: staler input counts as stalled; a longer pause isn't simulated
_LONGEST_DELAY, _LONGEST_STRETCH = 0.015, 0.1
_WAVES = 6  # of the random script: tremor has 8 to 12 Hz, voluntary motion ends near 6
_SLOWEST, _FASTEST = 0.2, 8.0  # Hz, of the random script's waves
_RISE = 0.2  # s, of a press


@dataclass(frozen=True)
class SimulatedSettings(DeviceOptions):
    """Settings of the hand, of the device in it, and of the script."""

    driver = "simulated"
    mass: float = number(0.3, 0.0, above=True)  # kg, of device and hand together
    damping: float = number(0.5, 0.0)  # N·s/m, the device's own b
    friction: float = number(0.0, 0.0)  # N, the device's Coulomb friction
    grip: float = number(300.0, 0.0)  # N/m, the hand's spring
    grip_damping: float = number(5.0, 0.0)  # N·s/m, the hand's damper
    step: float = number(0.0, 0.0)  # m, of the encoder; 0 for none
    noise: float = number(0.0, 0.0)  # m, standard deviation of what is read, along one axis; 0 for none
    delay: float = number(0.0, 0.0, _LONGEST_DELAY)  # s, age of what is read, at most 0.015
    # s by up to which what is read is older still, evenly distributed; its time doesn't say so
    jitter: float = number(0.0, 0.0, _LONGEST_DELAY)
    # where the hand wants to be. sine: A sin 2πft along the direction; press: A within 0.2 s, and stay; random: A times
    # smooth noise in all directions about 0.6 A; adversarial: A and 0.2 A by turns, whichever way it already moves, in
    # order to shake
    shape: str = word(*_SHAPES)
    amplitude: float = number(0.03)  # A, m
    frequency: float = number(0.5)  # f, Hz, of the sine
    x: float = number(0.0)  # direction, normalised, with y and z
    y: float = number(-1.0)
    z: float = number(0.0)
    seed: float = number(0.0, 0.0)  # of the random script; a whole number
    profile: str = "omega.3"  # device whose workspace and limits it has; see `profiles.PROFILES`
    file: str = ""  # recorded touch whose hand it follows over and over, instead of `shape`

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.hypot(self.x, self.y, self.z) > 0.0:
            raise self.refusal("x=0,y=0,z=0", "A direction is not zero, for example y=-1.")
        if self.delay + self.jitter > _LONGEST_DELAY:
            raise self.refusal(
                f"delay={self.delay:g},jitter={self.jitter:g}",
                f"Both together are {_LONGEST_DELAY:g} s at most.",
            )


class SimulatedHand(Driver):
    """Holds the body and moves by the script, as far as the loop's force lets it.

    `place` and `velocity` (3,) are the true handle's, m and m/s, without encoder and delay; `push` (3,) is the loop's
    force on it, N, and `work` what that force has done on it, J: positive where the loop gave energy.
    """

    settings_kind = SimulatedSettings
    hand = HandKind.PROGRAM
    traits = Traits(
        0.075, 12.0, 0.5, "a simulation; radius and force limit are omega.3's", mass=0.2, stamped=True
    )

    def __init__(self, settings: SimulatedSettings | None = None) -> None:
        s = self.settings = settings or SimulatedSettings()
        known, limits = type(self).traits, device_profile(s.profile)
        self.name = f"simulated {limits.name}"
        self.traits = self.limited_traits(
            limits,
            f"a simulation; radius and limits are those of {limits.name}",
            damping=s.damping,
            mass=min(s.mass, known.mass),
            resolution=s.step,
        )
        rng = np.random.default_rng(int(s.seed))
        self._sensor, self._error = np.random.default_rng(int(s.seed)), np.zeros(3)
        along = np.array([s.x, s.y, s.z]) / math.hypot(s.x, s.y, s.z)
        frequencies = rng.uniform(_SLOWEST, _FASTEST, (_WAVES, 3))
        phases = rng.uniform(0.0, 2.0 * math.pi, (_WAVES, 3))
        damper, radius = s.damping + s.grip_damping, self.traits.radius
        figures = np.array([s.mass, damper, s.friction, s.grip, s.amplitude, s.frequency, radius])
        shape = _RECORDED if s.file else _SHAPES.index(s.shape)
        path = _recorded_path(s.file) if s.file else np.zeros((2, 4))
        self._script = (shape, along, figures, frequencies, phases, path)
        self.place, self.velocity, self.push = np.zeros(3), np.zeros(3), np.zeros(3)
        self._clock = np.zeros(2)  # s since the first reading; J of work
        self._past, self._count = np.zeros((_PAST, 4)), 0
        self._began, self._last = math.nan, math.nan
        self.sample = Sample()
        self.sample.holding = True
        self._move(0.0)
        _delayed(self._past, 1, 0.0, 0.0, self._error, self.sample.position)

    @classmethod
    def traits_of(cls, options: Mapping[str, str]) -> Traits:
        """Return the traits of the hand on the device that the options name."""
        return cls(SimulatedSettings(profile=options.get("profile", SimulatedSettings.profile))).traits

    @property
    def work(self) -> float:
        """Work of the loop's force on the handle, J."""
        return float(self._clock[1])

    def read(self, now: float) -> Sample:
        """Let the hand move until `now`, s, and return what the encoders say of the moment `delay` ago."""
        if math.isnan(self._began):
            self._began = self._last = now
        self._move(min(max(0.0, now - self._last), _LONGEST_STRETCH))
        self._last = now
        past, k = self._past, self._count % _PAST
        past[k, 0] = now
        past[k, 1:] = self.place
        self._count += 1
        s = self.settings
        self.sample.time = seen = max(now - s.delay, self._began)
        if s.jitter > 0.0:
            seen = max(seen - s.jitter * self._sensor.random(), self._began)
        if s.noise > 0.0:
            self._error[:] = self._sensor.normal(0.0, s.noise, 3)
        _delayed(past, self._count, seen, s.step, self._error, self.sample.position)
        return self.sample

    def _move(self, span: float) -> None:
        _integrate(self.place, self.velocity, self.push, self._clock, span, *self._script)

    def write(self, force: np.ndarray) -> None:
        """Push with a force (3,), N, until the next call."""
        self.push[:] = force

    def close(self) -> None:
        """Stop pushing and let go."""
        self.push[:] = 0.0
        self.sample.holding = False


def _recorded_path(file: str) -> np.ndarray:
    """Return times, s from the first, and places, m, of a recorded hand (N, 4)."""
    trace = read_stroke(file)
    return np.column_stack([trace.time - trace.time[0], trace.ticks["hand"]])


@part
def _scripted(shape, time, i, toward, along, amplitude, frequency, frequencies, phases):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    if shape == 0:
        return amplitude * along[i] * math.sin(2.0 * math.pi * frequency * time)
    if shape == 1:
        return amplitude * along[i] * min(1.0, time / _RISE)
    if shape == 2:
        noise = 0.0
        for j in range(len(frequencies)):
            noise += math.sin(2.0 * math.pi * frequencies[j, i] * time + phases[j, i])
        return amplitude * 0.4 / math.sqrt(len(frequencies) / 2.0) * noise + 0.6 * amplitude * along[i]
    return amplitude * along[i] * (1.0 if toward >= 0.0 else 0.2)


@part
def _recorded(time, i, path):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    since = time % path[-1, 0]
    row = min(np.searchsorted(path[:, 0], since, side="right") - 1, len(path) - 2)
    share = (since - path[row, 0]) / (path[row + 1, 0] - path[row, 0])
    return path[row, 1 + i] + share * (path[row + 1, 1 + i] - path[row, 1 + i])


@kernel
def _integrate(place, velocity, push, clock, span, shape, along, figures, frequencies, phases, path):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    mass, damper, friction, grip, amplitude, frequency, radius = figures
    count = max(1, math.ceil(span / _STEP))
    h = span / count
    if h <= 0.0:
        return
    for _ in range(count):
        clock[0] += h
        time, speed, toward = clock[0], 0.0, 0.0
        for i in range(3):
            toward += velocity[i] * along[i]
        for i in range(3):
            if shape == _RECORDED:
                aim = _recorded(time, i, path)
            else:
                aim = _scripted(shape, time, i, toward, along, amplitude, frequency, frequencies, phases)
            velocity[i] += h / mass * (push[i] + grip * (aim - place[i]))
            velocity[i] /= 1.0 + h * damper / mass
            speed += velocity[i] * velocity[i]
        speed = math.sqrt(speed)
        kept = max(0.0, 1.0 - friction * h / mass / speed) if speed > 0.0 else 0.0
        distance = 0.0
        for i in range(3):
            velocity[i] *= kept
            place[i] += h * velocity[i]
            clock[1] += push[i] * h * velocity[i]
            distance += place[i] * place[i]
        if distance > radius * radius:  # the device's own end stop, which takes all motion
            shrink = radius / math.sqrt(distance)
            for i in range(3):
                clock[1] += push[i] * (shrink - 1.0) * place[i]
                place[i] *= shrink
                velocity[i] = 0.0


@kernel
def _delayed(past, count, seen, step, error, position):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    newest = (count - 1) % _PAST
    k, older = newest, newest
    for _ in range(min(count, _PAST) - 1):
        older = (k - 1) % _PAST
        if past[older, 0] <= seen:
            break
        k = older
    span = past[k, 0] - past[older, 0]
    share = min(1.0, max(0.0, (seen - past[older, 0]) / span)) if span > 0.0 else 1.0
    for i in range(3):
        value = past[older, 1 + i] + share * (past[k, 1 + i] - past[older, 1 + i]) + error[i]
        position[i] = math.floor(value / step + 0.5) * step if step > 0.0 else value
