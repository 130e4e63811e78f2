"""Asking a body many questions: spaces of inputs, designs of samples, and the parallel sweep.

::

    space.py       named ranges
    designs.py     where to sample
    problem.py     what a sweep expects of whatever it asks
    external.py    a problem made of one function
    sweep.py       the sweep, from its plan to its dataset
    plan.py        what will be solved, in which order
    chunks.py      chains of neighbours, for problems without chains of their own
    answers.py     the answers as arrays, filled by workers
    runner.py      chains on Dask, through failures
    cluster.py     workers on this machine; worker.py is their process
    ledger.py      what an interrupted sweep has done so far
    provenance.py  where a dataset comes from
    progress.py    telling a person how far it is
    interrupt.py   Ctrl-C at a safe point
"""

from palpate.sweeps.cluster import LocalCluster, local_cluster
from palpate.sweeps.designs import DESIGNS, Design, grid, random, sobol
from palpate.sweeps.external import ExternalProblem
from palpate.sweeps.problem import Answer, Chained, Checking, Designed, Problem, Resettable, Solver
from palpate.sweeps.space import Space
from palpate.sweeps.sweep import sweep

__all__ = [
    "DESIGNS",
    "Answer",
    "Chained",
    "Checking",
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
