"""The networks as scikit-learn estimators, for pipelines, grid search and cross-validation.

mran              MRANRegressor: the sequential filter, with `partial_fit`
refined           RBFNetworkRegressor: all units at once
radial_regressor  their base: rows, weights and parameters as scikit-learn has them

They need scikit-learn: `pip install 'palpate[sklearn]'`.
"""

from palpate.errors import UsageError

try:
    import sklearn  # noqa: F401
except ImportError as error:
    raise UsageError(
        "The estimators need scikit-learn, which is not installed.",
        why=str(error),
        fix="Install it with palpate: pip install 'palpate[sklearn]'.",
    ) from error

from palpate.estimators.mran import MRANRegressor
from palpate.estimators.refined import RBFNetworkRegressor

__all__ = ["MRANRegressor", "RBFNetworkRegressor"]
