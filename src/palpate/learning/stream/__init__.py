"""Learning while it runs.

learner    the object that observes                  output_scaling  scaling and modes of a stream
reservoir  samples retained                          refining        bounded refinement on them
"""
