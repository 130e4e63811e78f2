"""Asking a body many questions: spaces of inputs, designs of samples, and the parallel sweep."""

from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.designs import DESIGNS, Design, grid, random, sobol
from palpate.sweeps.external import ExternalProblem
from palpate.sweeps.problem import Answer, Chained, Designed, Problem, Resettable, Solver
from palpate.sweeps.space import Space
from palpate.sweeps.sweep import sweep

__all__ = [
    "DESIGNS",
    "Answer",
    "Chained",
    "Design",
    "Designed",
    "ExternalProblem",
    "LocalCluster",
    "Problem",
    "Resettable",
    "Solver",
    "Space",
    "grid",
    "local_cluster",
    "random",
    "sobol",
    "sweep",
]
