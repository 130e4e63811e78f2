"""How one observation changes the parameters.

kalman     extended Kalman filter over everything (RAN-EKF, MRAN) or unit by unit
winner     the same for the nearest unit alone (EMRAN)
shared     one covariance for the linear parameters of all outputs, one for the units' shapes
gradient   least mean squares (RAN)
bound      how far one update may move a unit
"""

from palpate.rbf.filter.updates.rule import predicted, updated

__all__ = ["predicted", "updated"]
