"""Benchmarks: palpate beside named rivals, as tables of ratios.

    python -m benchmarks                all of them; --quick only checks that they run
    python -m benchmarks.cantilever     one of them; the same options

cantilever  the filter's forms, the refined network and batch rivals on the founding study's two beams
latency     one query, interleaved with NumPy, SciPy and scikit-learn in the same run
online      a stream with bounded refinement beside refining all of it at once
stability   regressions of the pure filter over many orders of presentation and thresholds
runtime     the 1 kHz loop in its own process: CPU time of a tick, and lateness
scale       fits to many rows beside a perceptron and boosted trees
sweep       solves per second, serial and on the local Dask cluster
tools_against_laws  tools beside laws of contact and axisymmetric solves
touching    a sphere on a block: a sweep beside a plain NGSolve script, the mesh's imprint, nearly incompressible tissue
touching_cost  time and memory of one Newton iteration over the number of unknowns

plain_touch the plain NGSolve script, and how long its load steps may be
cases       the solves that all of them learn from     rivals   interpolation and regression by others
table       a table as a value                         machine  where the figures come from
records     tables of record, and the blocks of the documentation
runner      options and printing
"""
