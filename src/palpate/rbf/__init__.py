"""Radial-basis-function networks, learnt one sample at a time (MRAN with an extended Kalman filter) and then refined.

forms          forms of a unit                    symmetric_units  units with their images under a group
regressors     units and tail at samples, with all their derivatives (derivative_kernels)
filter         the sequential filter and its family: `step`, and the rules that it is made of
refinement     variable projection, the posterior and the way back to the filter
output_modes   the few directions in which many outputs move
sample_checks  samples as arrays that fit together
freezing       the network value of what was learnt, and the hash of its samples

Knows nothing of where samples come from.
"""
