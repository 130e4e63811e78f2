"""The sequential filter: one observation at a time.

step         the whole of it: the rules below in order
settings     the rules followed, their thresholds, and the named members of the family
state        parameters and memory as a value            covariance   the uncertainty of the parameters
observation  a value of the map with slopes              prediction   the network's value, Jacobian and deviation
growth       rules that add and remove units             regression      the limit on undoing what was learnt
updates      rules by which an observation changes z     kalman       the extended Kalman filter among them
"""
