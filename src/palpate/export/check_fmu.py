"""An FMU that answers through FMPy, which loads it as other tools do; one class for each version of FMI."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.errors import ResourceError
from palpate.export.check_points import ANSWERS, CONTACT, NOT_A_NUMBER, TOO_DEEP, TRUSTED
from palpate.export.fmu_variables import ANSWER, ANSWER_DEVIATION, TORQUE

__all__ = ["CheckFmu", "FmuInstance", "open_instance"]

_PLACE, _OUTPUTS, _PARAMETERS = [0, 1, 2], [6, 7, 3, 4, 5], range(16, 48)


class FmuInstance(Protocol):
    """An instance of an FMU in co-simulation or model exchange; variables go by their value references."""

    def begin(self, *, again: bool = True) -> None:
        """Go through initialization; first back to the start, with all that was set, where `again` is true."""

    def restart(self, references: list[int], values: list[float]) -> None:
        """Go back to the start, set real variables or states, and go through initialization."""

    def write(self, references: list[int], values: list[float]) -> None:
        """Set real variables."""

    def read(self, references: list[int]) -> list[float]:
        """Return real variables."""
        ...

    def flags(self) -> list[bool]:
        """Return inside, contact, too deep."""
        ...

    def step(self, time: float, dt: float) -> None:
        """Take a step of co-simulation from a time, s."""

    def slopes(self, unknown: list[int], known: list[int], seed: list[float]) -> list[float]:
        """Return directional derivatives."""
        ...

    def close(self) -> None:
        """End it."""


def open_instance(
    description: Any,
    folder: str,
    *,
    exchange: bool = False,
    log: Callable[..., None] = lambda *_: None,
) -> FmuInstance:
    """Return an instance of an FMU whose parsed description is given and that is unpacked in `folder`.

    Its log is dropped by default: places outside the trained range are asked for here, and the FMU warns of them.
    """
    return _Instance(description, folder, log, exchange=exchange)


class _Instance:
    """An instance through FMPy; `FmuInstance` tells what its methods do."""

    def __init__(self, description: Any, folder: str, log: Callable[..., None], *, exchange: bool) -> None:
        identity = _identity(description, folder, exchange=exchange)
        self._former = description.fmiVersion == "2.0"
        if self._former:
            from fmpy.fmi2 import (
                FMU2Model,
                FMU2Slave,
                defaultCallbacks,
                fmi2CallbackFunctions,
                fmi2CallbackLoggerTYPE,
            )

            calls = fmi2CallbackFunctions()
            calls.logger = fmi2CallbackLoggerTYPE(log)
            calls.allocateMemory = defaultCallbacks.allocateMemory
            calls.freeMemory = defaultCallbacks.freeMemory
            self._calls = calls  # as long as the instance may use them
            self.fmu: Any = (FMU2Model if exchange else FMU2Slave)(**identity)
            self.fmu.instantiate(callbacks=calls)
        else:
            from fmpy.fmi3 import FMU3Model, FMU3Slave

            self.fmu = (FMU3Model if exchange else FMU3Slave)(**identity)
            self.fmu.instantiate(logMessage=log)

    def begin(self, *, again: bool = True) -> None:
        if again:
            self.fmu.reset()
        if self._former:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()

    def restart(self, references: list[int], values: list[float]) -> None:
        self.fmu.reset()
        self.write(references, values)
        self.begin(again=False)

    def write(self, references: list[int], values: list[float]) -> None:
        (self.fmu.setReal if self._former else self.fmu.setFloat64)(references, values)

    def read(self, references: list[int]) -> list[float]:
        return list((self.fmu.getReal if self._former else self.fmu.getFloat64)(references))

    def flags(self) -> list[bool]:
        # in version 2.0 Booleans have numbers of their own
        return [bool(flag) for flag in self.fmu.getBoolean([0, 1, 2] if self._former else [12, 13, 14])]

    def step(self, time: float, dt: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=dt)

    def slopes(self, unknown: list[int], known: list[int], seed: list[float]) -> list[float]:
        return list(self.fmu.getDirectionalDerivative(unknown, known, seed))

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


def _identity(description: Any, folder: str, *, exchange: bool) -> dict[str, str]:
    kind = description.modelExchange if exchange else description.coSimulation
    return {
        "guid": description.guid,
        "unzipDirectory": folder,
        "modelIdentifier": kind.modelIdentifier,
        "instanceName": "checked",
    }


class CheckFmu:
    """An FMU, read from its .fmu file with FMPy, that is asked as every export is; a context manager.

    Steps are those of co-simulation. The force at a place of a body with a memory is that of model exchange where there
    is one, at a body that remembers nothing.
    """

    def __init__(self, path: Path) -> None:
        try:
            import fmpy
        except ImportError as error:
            raise ResourceError(
                "An FMU is compared with palpate through FMPy.", fix="Run: pip install 'palpate[check]'"
            ) from error
        self._description = fmpy.read_model_description(str(path))
        self._folder = fmpy.extract(str(path))
        variables = self._description.modelVariables
        self._parameters = [
            v.valueReference
            for v in variables
            if v.valueReference in _PARAMETERS and v.causality == "parameter"
        ]
        self._inputs = [v.valueReference for v in variables if v.causality == "input"]
        self._answers = [v.valueReference for v in variables if ANSWER <= v.valueReference < ANSWER_DEVIATION]
        # ways of a mass along the felt directions, and these directions
        self._ways = [v.valueReference for v in variables if v.name.startswith("way_")]
        self._remembers = any(v.name == "stored" for v in variables)
        self._steps = open_instance(self._description, self._folder)
        self._felt = self._remembers and self._description.modelExchange is not None
        self._places = (
            open_instance(self._description, self._folder, exchange=True) if self._felt else self._steps
        )

    def __enter__(self) -> CheckFmu:
        return self

    def __exit__(self, *ignored: object) -> None:
        self._steps.close()
        if self._felt:
            self._places.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p); not-a-number what an FMU does not tell."""
        if self._ways:
            return self._steer(X)
        rows, asked = np.full((len(X), ANSWERS), np.nan), self._places
        self._steps.begin()
        if self._felt:
            asked.begin()
        for row, x in zip(rows, X.tolist(), strict=True):
            asked.write([*_PLACE, *self._parameters], x)
            if self._remembers and not self._felt:  # the force is the memory's
                row[:2] = asked.read(_OUTPUTS[:2])
            else:
                row[:5] = asked.read(_OUTPUTS)
            if not self._remembers:
                for i in range(3):
                    seed = [float(i == j) for j in range(3)]
                    row[[5 + i, 8 + i, 11 + i]] = asked.slopes([3, 4, 5], _PLACE, seed)
            row[19] = asked.read([8])[0]
            inside, contact, deep = asked.flags()
            finite = np.isfinite(row[0])
            row[20] = TRUSTED * inside + CONTACT * contact + TOO_DEEP * deep if finite else NOT_A_NUMBER
        return rows

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        rows = np.empty((len(X), 3))
        self._places.begin()
        for row, x in zip(rows, X.tolist(), strict=True):
            if self._ways:  # a free probe is felt along x, y and z
                self._places.restart([*self._ways, *self._parameters], x)
            else:
                self._places.write([*_PLACE, *self._parameters], x)
            row[:] = self._places.read([TORQUE, TORQUE + 1, TORQUE + 2])
        return rows

    def _steer(self, X: np.ndarray) -> np.ndarray:
        """Return `answers` of a body that carries a mass, which begins at each place."""
        rows = np.full((len(X), ANSWERS), np.nan)
        D = self._directions()
        for row, x in zip(rows, X, strict=True):
            ways = (
                x[:3] if len(D) == 3 else np.where(np.isfinite(x[:3]).all(), D @ np.nan_to_num(x[:3]), np.nan)
            )
            self._steps.restart([*self._ways, *self._parameters], [*ways, *x[3:]])
            row[:5], row[19] = self._steps.read(_OUTPUTS), self._steps.read([8])[0]
            inside, contact, deep = self._steps.flags()
            flags = TRUSTED * inside + CONTACT * contact + TOO_DEEP * deep
            row[20] = flags if np.isfinite(row[0]) else NOT_A_NUMBER
        return rows

    def _directions(self) -> np.ndarray:
        """Return the felt directions (k, 3): where a way of one metre leads from the place of none."""
        places = []
        for way in np.vstack([np.zeros(len(self._ways)), np.eye(len(self._ways))]):
            self._steps.restart(self._ways, list(way))
            places.append(self._steps.read(_PLACE))
        return np.asarray(np.array(places[1:]) - np.array(places[0]))

    def outputs(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, None]:
        """Return the answers (N, m) of what no hand feels at X (N, n), and which are in the trained region (N,)."""
        Y, inside = np.empty((len(X), len(self._answers))), np.zeros(len(X), dtype=bool)
        self._steps.begin()
        for i, x in enumerate(X.tolist()):
            self._steps.write(self._inputs, x)
            Y[i] = self._steps.read(self._answers)
            inside[i] = self._steps.flags()[0]
        return Y, inside, None

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p)."""
        rows, time = np.empty((len(X), 5)), 0.0
        self._steps.begin()
        for row, x in zip(rows, X.tolist(), strict=True):
            self._steps.write([*_PLACE, *self._parameters], x[1:])
            self._steps.step(time, x[0])
            time += x[0]
            row[:] = self._steps.read([3, 4, 5, 10, 11])
        return rows

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Refuse: an FMU has no field."""
        raise ResourceError("An FMU has no field.")
