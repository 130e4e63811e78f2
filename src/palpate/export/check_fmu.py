"""An FMU that answers through FMPy, which loads it as other tools do."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import ResourceError
from palpate.export.check_points import ANSWERS, CONTACT, NOT_A_NUMBER, TOO_DEEP, TRUSTED

__all__ = ["CheckFmu"]

_PLACE, _OUTPUTS, _PARAMETER = [0, 1, 2], [6, 7, 3, 4, 5], 16


class CheckFmu:
    """An FMU in co-simulation; a context manager.

    Parameters
    ----------
    path : Path
        The .fmu file.

    Raises
    ------
    ResourceError
        If there is no FMPy.
    """

    def __init__(self, path: Path) -> None:
        try:
            import fmpy
            from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
        except ImportError as error:
            raise ResourceError(
                "An FMU is compared with palpate through FMPy.", fix="pip install fmpy"
            ) from error
        self._description = fmpy.read_model_description(str(path))
        self._folder = fmpy.extract(str(path))
        self._parameters = [
            v.valueReference for v in self._description.modelVariables if v.valueReference >= _PARAMETER
        ]
        self._elastic = self._description.modelExchange is not None
        self._fmu: Any = FMU2Slave(
            guid=self._description.guid,
            unzipDirectory=self._folder,
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            instanceName="checked",
        )
        # warnings of places outside are what is asked for here: nothing is printed
        self._calls = fmi2CallbackFunctions()
        self._calls.logger = fmi2CallbackLoggerTYPE(lambda *_: None)
        self._calls.allocateMemory = defaultCallbacks.allocateMemory
        self._calls.freeMemory = defaultCallbacks.freeMemory
        self._fmu.instantiate(callbacks=self._calls)

    def __enter__(self) -> CheckFmu:
        return self

    def __exit__(self, *ignored: object) -> None:
        self._fmu.terminate()
        self._fmu.freeInstance()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _begin(self) -> None:
        self._fmu.reset()
        self._fmu.setupExperiment(startTime=0.0)
        self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p); not-a-number what an FMU does not tell."""
        rows = np.full((len(X), ANSWERS), np.nan)
        self._begin()
        for row, x in zip(rows, X.tolist(), strict=True):
            self._fmu.setReal([*_PLACE, *self._parameters], x)
            if not self._elastic:  # the force is the memory's; energy, depth and flags are of the place
                row[0], row[1] = self._fmu.getReal(_OUTPUTS[:2])
            else:
                row[:5] = self._fmu.getReal(_OUTPUTS)
                for i in range(3):
                    seed = [float(i == j) for j in range(3)]
                    row[[5 + i, 8 + i, 11 + i]] = self._fmu.getDirectionalDerivative([3, 4, 5], _PLACE, seed)
            row[19] = self._fmu.getReal([8])[0]
            inside, contact, deep = self._fmu.getBoolean([0, 1, 2])
            finite = all(map(np.isfinite, x))
            row[20] = TRUSTED * inside + CONTACT * contact + TOO_DEEP * deep if finite else NOT_A_NUMBER
        return rows

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p)."""
        rows, time = np.empty((len(X), 5)), 0.0
        self._begin()
        for row, x in zip(rows, X.tolist(), strict=True):
            self._fmu.setReal([*_PLACE, *self._parameters], x[1:])
            self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=x[0])
            time += x[0]
            row[:] = self._fmu.getReal([3, 4, 5, 10, 11])
        return rows

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Refuse: an FMU has no field."""
        raise ResourceError("An FMU has no field.")
