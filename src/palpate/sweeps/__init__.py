"""Many questions to a body: spaces of inputs, designs of samples, and the parallel sweep.

::

    space.py       named ranges, and designs that place samples in them
    problem.py     the contract of whatever a sweep asks; a problem made of one function
    sweep.py       the sweep, from its plan to its dataset
    plan.py        points, chains of neighbours and labels, settled before the first solve
    case.py        one case after the other, in a child process that may crash or hang
    runner.py      the chains on Dask, through the loss of workers
    cluster.py     worker processes on this machine; worker.py is the process
    job_queue.py   workers as jobs of a cluster's queue
    ledger.py      finished parts of an interrupted sweep, on disk
    grow_sweep.py  a finished sweep that is asked for more samples
    solve_histories.py  histories of one load, for a body with memory; drives.py makes their loads

    command_problem.py  a problem that another program solves, once for each case
    template_files.py   its input files, made of templates; program_run.py starts and ends it
    umbridge_problem.py a problem that a model of UM-Bridge solves
    mapped_problem.py   what these two share
    answer_files.py     answers of a case, kept until the sweep is whole
"""

from palpate.sweeps.cluster import LocalCluster, OnDemandCluster, Scheduler, local_cluster
from palpate.sweeps.grow_sweep import grow, is_begun
from palpate.sweeps.job_queue import JobQueue
from palpate.sweeps.problem import (
    Answer,
    Chained,
    Checking,
    Designed,
    ExternalProblem,
    Problem,
    Resettable,
    Solver,
)
from palpate.sweeps.solve_histories import HistoryProblem, solve_histories
from palpate.sweeps.space import DESIGNS, Design, Space, grid, random, sobol
from palpate.sweeps.sweep import sweep

__all__ = [
    "DESIGNS",
    "Answer",
    "Chained",
    "Checking",
    "Design",
    "Designed",
    "ExternalProblem",
    "HistoryProblem",
    "JobQueue",
    "LocalCluster",
    "OnDemandCluster",
    "Problem",
    "Resettable",
    "Scheduler",
    "Solver",
    "Space",
    "grid",
    "grow",
    "is_begun",
    "local_cluster",
    "random",
    "sobol",
    "solve_histories",
    "sweep",
]
