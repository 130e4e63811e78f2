"""Learning while it runs.

learner    the object that observes                  gauge      scaling and modes of a stream
reservoir  samples retained                          refining   bounded refinement on them
"""
