"""A beam on its march through a history: one step, how far to trust it, and what is left where none is found."""

from __future__ import annotations

import numpy as np

from palpate.physics.beam.cantilever import Cantilever
from palpate.physics.beam.history_beam import HistoryBeam, Step
from palpate.physics.beam.marching import Failure, Moment
from palpate.physics.beam.plastic_section import PlasticSection
from palpate.physics.beam.solver import COARSE, FAR_BEND, FAR_TURN
from palpate.physics.equilibrium.newton import minimise
from palpate.physics.equilibrium.stop import Stop

__all__ = ["MarchingBeam"]

NEWTON_LIMIT = 40  # a step that needs more iterations is cheaper in two halves


class MarchingBeam:
    """The steps of one beam (a `marching.Marching`).

    Parameters
    ----------
    body : Cantilever
    beam : HistoryBeam
        Its finite elements.
    """

    def __init__(self, body: Cantilever, beam: HistoryBeam) -> None:
        self._body, self._beam = body, beam
        # time steps are of second order: two halves err by a third of their difference from the whole (Richardson 1911)
        self._share = 1 / 3 if body.kind == "viscous" else 1.0

    def take(self, start: Moment, time: float, load: np.ndarray, guess: np.ndarray) -> Moment | Failure:
        """One step to a time and load."""
        step = self._beam.step(start.internal, time - start.time if time > start.time else None)
        found = minimise(step, load, _lower(step, load, start.z, guess), limit=NEWTON_LIMIT)
        stop = found.stop if found.stop is not Stop.CONVERGED else self._verdict(start.z, found.z)
        if self._is_mechanism(stop, step.energy(found.z)):
            stop = Stop.STEP_TOO_SMALL
        if stop is not Stop.CONVERGED:
            return Failure(stop, start, found.z, found.iterations)
        return Moment(
            time=time,
            load=load,
            z=found.z,
            internal=step.outcome(found.z),
            dissipated=start.dissipated + step.dissipated(found.z),
            reach=max(start.reach, float(np.abs(found.z[self._beam.is_translation]).max())),
            iterations=found.iterations,
            residual=found.residual,
        )

    def error(self, whole: Moment, halves: Moment) -> float:
        """The larger of the errors in displacement and dissipation, both relative, over the tolerance."""
        moved = self._beam.is_translation
        offset = float(np.abs((whole.z - halves.z)[moved]).max())
        reach = max(halves.reach, 1e-9 * self._body.length)
        lost = abs(whole.dissipated - halves.dissipated)
        energy = self._beam.stored(halves.z, halves.internal) + halves.dissipated
        relative = max(offset / reach, lost / max(energy, self._beam.energy_floor))
        return float(self._share * relative / self._body.step_tolerance)

    def fibre_strain(self, state: np.ndarray) -> float:
        """Largest |ε| + |κ| times the section's half height, at the Gauss points."""
        axial, _, curvature = np.moveaxis(np.abs(self._beam.strains(state)), -1, 0)
        return float((axial + self._body.section.half_height * curvature).max())

    def detail(self, failure: Failure) -> str:
        """Figures that belong to a failure's reason."""
        if failure.stop is Stop.BAD_INPUT:
            return ""
        figures = [f"{100 * failure.share:.3g} % of the way to this load was found"]
        if isinstance(self._beam.law, PlasticSection):
            forces = self._beam.step(failure.moment.internal, None).resultants(failure.moment.z)
            share = float(np.abs(forces[..., 2]).max()) / self._beam.law.plastic_moment
            figures.append(f"there the largest moment is {share:.3g} of the first plastic one")
        if failure.stop is Stop.STRAIN_LIMIT:
            figures.append(
                f"a strain of {self.fibre_strain(failure.z):.2g} against {self._body.strain_limit:g}"
            )
        return "; ".join(figures)

    def _is_mechanism(self, stop: Stop, energy: float) -> bool:
        """Whether a search failed for want of stiffness alone.

        A beam that has yielded through may have a tangent that is singular to the last digit; at small displacements
        nothing can buckle.
        """
        if stop is Stop.UNSTABLE:
            return self._body.kinematics == "small"
        return stop is Stop.NOT_FINITE and bool(np.isfinite(energy))

    def _verdict(self, before: np.ndarray, after: np.ndarray) -> Stop:
        """Whether the model has a say at a state, and whether the step to it was short enough."""
        if self.fibre_strain(after) > self._body.strain_limit:
            return Stop.STRAIN_LIMIT
        if self._body.kinematics == "small":
            return Stop.CONVERGED  # one equilibrium only
        if self._bend(after) > COARSE:
            return Stop.COARSE_MESH
        far = self._bend(after - before) > FAR_BEND or self._turn(after - before) > FAR_TURN
        return Stop.STEP_TOO_SMALL if far else Stop.CONVERGED

    def _bend(self, state: np.ndarray) -> float:
        """Largest angle in rad by which one element bends."""
        return float(np.abs(np.diff(state[self._beam.vertex_dofs[:, 2]], prepend=0.0)).max())

    def _turn(self, state: np.ndarray) -> float:
        """Largest angle in rad by which a section turns."""
        return float(np.abs(state[self._beam.vertex_dofs[:, 2]]).max())


def _lower(step: Step, load: np.ndarray, state: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Whichever of two states has the lower potential energy."""
    gain = (step.energy(guess) - load @ guess) - (step.energy(state) - load @ state)
    return guess if gain < 0 else state  # NaN keeps the state
