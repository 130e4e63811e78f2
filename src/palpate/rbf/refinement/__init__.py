"""Batch refinement by variable projection, and what follows from it.

refine         all units at once, from a start
rows           samples, weights and slopes as rows      projection     cost and Gauss–Newton matrix
marquardt      one damped step                          nudge          one such step for a stream
leave_one_out  errors of samples and units left out
posterior      the way back to the filter               laplace        the structured posterior
inverse        of an information matrix, whatever the data left open
"""
