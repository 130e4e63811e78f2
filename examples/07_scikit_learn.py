"""The networks as scikit-learn estimators: cross-validation, a pipeline with a grid search, and a stream.

What is learnt is the tip deflection of a strip of nylon under a force at its end, w = 4 F L³/(E b t³), over force,
length and thickness. Needs scikit-learn: pip install "palpate[sklearn]".
"""

import numpy as np
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

from palpate.estimators import MRANRegressor, RBFNetworkRegressor

MODULUS, BREADTH = 2.4e9, 0.01
LOW, HIGH = (
    np.array([0.0, 0.10, 0.002]),
    np.array([2.0, 0.20, 0.004]),
)  # force in N, length and thickness in m


def deflection(X):
    force, length, thickness = X.T
    return 4 * force * length**3 / (MODULUS * BREADTH * thickness**3)


rng = np.random.default_rng(0)
X = rng.uniform(LOW, HIGH, (240, 3))
y = deflection(X)

refined = RBFNetworkRegressor(target=2e-3, effort=0.2, random_state=0)
print(f"refined, cross-validated R²: {cross_val_score(refined, X, y, cv=3).mean():.5f}")

# scikit-learn's own tools change the inputs: length and thickness in logarithms
logarithms = FunctionTransformer(lambda X: np.column_stack([X[:, 0], np.log(X[:, 1:])]))
search = GridSearchCV(
    make_pipeline(logarithms, RBFNetworkRegressor(effort=0.1, random_state=0, units_max=12)),
    {"rbfnetworkregressor__form": ["isotropic", "axis-aligned", "rotated"]},
    cv=3,
)
search.fit(X, y)
print(f"grid search: {search.best_params_['rbfnetworkregressor__form']}, R² {search.best_score_:.5f}")

# a stream: each sample is seen once, then forgotten
Z = logarithms.fit_transform(X)
stream = MRANRegressor(target=2e-2, random_state=0)
for part in np.array_split(np.arange(len(Z)), 4):
    stream.partial_fit(Z[part], y[part])
    print(
        f"after {stream.state_.count:3d} samples: {stream.network_.units:2d} units, R² {stream.score(Z, y):.4f}"
    )

# all samples at once, five times each
whole = MRANRegressor(target=2e-2, random_state=0).fit(Z, y)
print(f"five passes: {whole.network_.units} units, R² {whole.score(Z, y):.5f}")
whole.history_.plot().savefig("history.png")
whole.network_.save("strip.palpate")
