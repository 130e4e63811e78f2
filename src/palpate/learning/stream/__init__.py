"""Learning while it runs.

learner    the object that observes                  output_scaling  scaling and modes of a stream
following  rest, drift, jumps, outliers: the default  tracker  its bank of filters, with tracker_kernels
scales     how a map varies, from some readings       noise_level  noise of the readings, by place
reservoir  samples retained                           refining     bounded refinement on them
"""
