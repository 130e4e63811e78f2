"""Batch refinement by variable projection, and what follows from it.

refine         all units at once, from a start
rows           samples, weights and slopes as rows      projection   cost and Gauss–Newton matrix
levenberg      damped steps, and one for a stream       leave_one_out  errors of samples and units left out
posterior      the structured posterior, and the way back to the filter
"""
