"""The estimators keep scikit-learn's conventions, and work where its own do."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, KFold, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import estimator_checks_generator, parametrize_with_checks

from palpate.errors import UsageError
from palpate.estimators import MRANRegressor, RBFNetworkRegressor
from palpate.estimators.radial_regressor import merge_rows
from palpate.learning import Settings
from palpate.network import Network

BOTH = [
    pytest.param(MRANRegressor(settings="default", passes=3, random_state=0), id="MRAN"),
    pytest.param(RBFNetworkRegressor(units_max=10, random_state=0), id="RBF"),
]


@pytest.fixture(scope="module")
def wave():
    """A smooth map of two inputs, 120 samples."""
    X = np.random.default_rng(3).uniform(-1, 1, (120, 2))
    return X, np.sin(2 * X[:, 0]) * np.exp(-X[:, 1])


# 200 samples of 10 features, eight times in arrays of other kinds
SAME_FIT_AGAIN = {"check_regressors_train", "check_regressor_data_not_an_array"}


@pytest.fixture
def array_api(monkeypatch):
    """Scikit-learn leaves out its check of arrays of other kinds where this switch of SciPy is off."""
    monkeypatch.setenv("SCIPY_ARRAY_API", "1")


@pytest.mark.grid
@pytest.mark.usefixtures("array_api")
@parametrize_with_checks([RBFNetworkRegressor()])
def test_conventions(estimator, check):
    check(estimator)


# one pass, so that the many small fits of the checks stay quick
@pytest.mark.full
@pytest.mark.usefixtures("array_api")
@parametrize_with_checks([MRANRegressor(passes=1)])
def test_conventions_of_the_filter(estimator, check):
    if check.func.__name__ in SAME_FIT_AGAIN:
        # few parameters of ten inputs each
        estimator.set_params(settings="default", form="isotropic", units_max=5)
    check(estimator)


# a target that is met at once, so that no clock decides what is found
CHOOSING = RBFNetworkRegressor(form="auto", target=0.9, effort=0.02, random_state=0)


@pytest.mark.full
@pytest.mark.usefixtures("array_api")
@pytest.mark.filterwarnings("ignore:The network predicts no better")  # some checks fit noise
def test_conventions_of_a_form_that_is_chosen():
    done = 0
    for estimator, check in estimator_checks_generator(CHOOSING):
        if check.func.__name__ not in SAME_FIT_AGAIN:
            check(estimator)  # one that is left out raises
            done += 1
    assert done > 45


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_grid_search_pipeline_and_cross_validation(model, wave):
    X, y = wave
    folds = KFold(3, shuffle=True, random_state=0)
    pipe = make_pipeline(StandardScaler(), clone(model))
    assert cross_val_score(pipe, X, y, cv=folds).min() > 0.95
    name = type(model).__name__.lower()
    search = GridSearchCV(pipe, {f"{name}__units_max": [0, 10]}, cv=folds).fit(X, y)
    # a plane alone can't follow the wave
    assert search.best_params_ == {f"{name}__units_max": 10}
    assert search.best_estimator_[-1].network_.units > 0
    assert search.cv_results_["mean_test_score"][0] < search.best_score_ - 0.05


@pytest.mark.full
def test_automatic_settings_in_a_pipeline(wave):
    X, y = wave
    model = MRANRegressor(target=0.1, random_state=0)
    assert cross_val_score(model, 1e6 * X + 1e7, 1e-9 * y, cv=3).min() > 0.95


def test_refined_meets_its_target_with_few_units(wave):
    X, y = wave
    model = RBFNetworkRegressor(target=1e-3, random_state=0).fit(X[:100], y[:100])
    assert model.error_ <= 1e-3
    assert 1.0 - model.score(X[100:], y[100:]) < (10 * 1e-3) ** 2
    assert model.network_.units <= 12
    looser = RBFNetworkRegressor(target=1e-1, random_state=0).fit(X[:100], y[:100])
    assert looser.network_.units < model.network_.units


@pytest.mark.full
def test_form_and_kernel_by_trial(wave):
    X, y = wave
    Y = np.vstack([1e3 * y, X[:, 0] ** 2]).T
    model = RBFNetworkRegressor(form="auto", target=1e-2, effort=0.15, random_state=0).fit(X[:100], Y[:100])
    assert 1.0 - model.score(X[100:], Y[100:]) < (5 * 1e-2) ** 2
    assert model.error_ < 0.05
    # differing weights are not for the trial; they count all the same
    half = (np.arange(120) < 60).astype(float)
    weighted = RBFNetworkRegressor(form="auto", units_max=5, random_state=0)
    assert (
        weighted.fit(X, Y, sample_weight=2.0 - half).predict(X) != weighted.fit(X, Y, 1.0 + half).predict(X)
    ).any()


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_shape_of_y_comes_back(model, wave):
    X, y = wave
    model = clone(model)
    assert model.fit(X, y).predict(X[:5]).shape == (5,)
    assert model.fit(X, y[:, None]).predict(X[:5]).shape == (5, 1)
    assert model.fit(X, np.vstack([y, y, y]).T).predict(X[:5]).shape == (5, 3)


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_outputs_of_different_size_are_learnt_alike(model, wave):
    X, y = wave
    Y = np.vstack([1e6 * y, 1e-6 * X[:, 0] * X[:, 1]]).T
    each = clone(model).fit(X, Y)
    assert min(1 - ((each.predict(X) - Y) ** 2).sum(axis=0) / ((Y - Y.mean(axis=0)) ** 2).sum(axis=0)) > 0.95
    together = clone(model).set_params(scale_outputs="together").fit(X, Y)
    assert np.ptp(together.network_.scaling.output_scale) == 0.0
    assert np.ptp(each.network_.scaling.output_scale) > 0.0


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_constant_columns_survive(model, wave):
    X, y = wave
    wide = np.hstack([X, np.full((len(X), 1), 7.0), np.zeros((len(X), 1))])
    Y = np.vstack([y, np.full(len(y), 1 / 3)]).T
    predicted = clone(model).fit(wide, Y).predict(wide)
    assert np.isfinite(predicted).all()
    np.testing.assert_allclose(predicted[:, 1], 1 / 3, rtol=1e-12)
    assert np.corrcoef(predicted[:, 0], y)[0, 1] > 0.95
    np.testing.assert_allclose(clone(model).fit(wide, np.full(len(y), 3.0)).predict(wide[:4]), 3.0)


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_order_of_rows_does_not_matter_and_the_seed_decides(model, wave):
    X, y = wave
    order = np.random.default_rng(0).permutation(len(X))
    first = clone(model).fit(X, y).predict(X)
    assert (clone(model).fit(X[order], y[order]).predict(X) == first).all()
    assert (clone(model).fit(X, y).predict(X) == first).all()
    if isinstance(model, MRANRegressor):
        assert (clone(model).set_params(random_state=1).fit(X, y).predict(X) != first).any()


def test_equal_rows_become_one():
    X = np.array([[1.0], [0.0], [1.0], [-0.0], [2.0]])
    Y = np.array([[5.0], [6.0], [5.0], [6.0], [7.0]])
    rows, values, weights = merge_rows(X, Y, np.array([1.0, 2.0, 3.0, 2.0, 0.0]))
    np.testing.assert_array_equal(rows, [[0.0], [1.0]])
    np.testing.assert_array_equal(values, [[6.0], [5.0]])
    np.testing.assert_allclose(weights, [1.0, 1.0])


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_a_heavy_sample_is_met_more_closely(model, wave):
    X, y = wave
    odd = y.copy()
    odd[7] += 0.5
    heavy = np.ones(len(y))
    heavy[7] = 1e4
    even = clone(model).fit(X, odd).predict(X[7:8]) - odd[7]
    drawn = clone(model).fit(X, odd, sample_weight=heavy).predict(X[7:8]) - odd[7]
    # the filter guards what its window remembers, so it gives way less than a refit
    assert abs(drawn[0]) < 0.75 * abs(even[0])


@pytest.mark.full
@pytest.mark.parametrize("batch", [1, 7, 80])
@pytest.mark.parametrize("settings", ["default", "shared", "emran", "ran", None])
def test_batches_are_one_pass_to_the_last_bit(batch, settings, wave):
    X, y = wave
    whole = MRANRegressor(settings=settings, random_state=0, passes=1).partial_fit(X[:40], y[:40])
    cut = pickle.loads(pickle.dumps(whole))
    whole.partial_fit(X[40:], y[40:])
    for i in range(40, len(X), batch):
        cut.partial_fit(X[i : i + batch], y[i : i + batch])
    assert (cut.predict(X) == whole.predict(X)).all()
    assert cut.state_.count == len(X)


def test_learning_goes_on_after_fit_and_fit_begins_anew(wave):
    X, y = wave
    model = MRANRegressor(settings="default", passes=2, random_state=0).fit(X[:60], y[:60])
    before = model.state_
    assert model.partial_fit(X[60:], y[60:]).state_.count == 180
    assert before.count == 120
    assert (model.fit(X[:60], y[:60]).state_.vector() == before.vector()).all()
    with pytest.raises(ValueError, match="outputs"):
        model.partial_fit(X, np.vstack([y, y]).T)


def test_samples_of_no_weight_are_passed_over(wave):
    X, y = wave
    zero = np.ones(len(y))
    zero[50:] = 0.0
    spoilt = np.where(zero > 0, y, 1e6)
    model = MRANRegressor(settings="default").partial_fit(X, spoilt, sample_weight=zero)
    assert (
        model.predict(X) == MRANRegressor(settings="default").partial_fit(X[:50], y[:50]).predict(X)
    ).all()
    for wrong in (-zero, 0 * zero, zero[:3], np.full(len(y), np.nan)):
        with pytest.raises(ValueError, match=r"weight"):
            model.fit(X, y, sample_weight=wrong)


@pytest.mark.full
@pytest.mark.parametrize("model", BOTH)
def test_names_and_ranges_reach_the_network(model, wave, tmp_path):
    X, y = wave
    table = pd.DataFrame(X, columns=["force", "modulus"])
    fitted = clone(model).set_params(ranges=((-2, 2), (-1, 3))).fit(table, y)
    assert [r.name for r in fitted.network_.inputs] == list(fitted.feature_names_in_) == ["force", "modulus"]
    assert [(r.low, r.high) for r in fitted.network_.inputs] == [(-2.0, 2.0), (-1.0, 3.0)]
    again = Network.load(fitted.network_.save(tmp_path / "wave.palpate"))
    assert (again.predict(X)[:, 0] == fitted.predict(table)).all()
    with pytest.raises(ValueError, match="1 ranges"):
        clone(model).set_params(ranges=((-2, 2),)).fit(X, y)


def test_what_is_wrong_is_told(wave):
    X, y = wave
    with pytest.raises(ValueError, match="no preset"):
        MRANRegressor(settings="mram").fit(X, y)
    with pytest.raises(ValueError, match="scale_outputs"):
        MRANRegressor(scale_outputs="both").fit(X, y)
    for model in (MRANRegressor(target=0.0), RBFNetworkRegressor(target=-1.0)):
        with pytest.raises(UsageError, match="target"):
            model.fit(X, y)


def interval_share(model, X, y):
    """Share of samples within ±1.64 standard deviations."""
    predicted, deviation = model.predict(X, return_std=True)
    assert predicted.shape == deviation.shape == y.shape
    assert (deviation > 0).all()
    return (np.abs(predicted - y) <= 1.645 * deviation).mean()


@pytest.mark.full
@pytest.mark.parametrize("form", [None, "auto"])
@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_deviations_hold_nine_in_ten(form, size):
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (2300, 2))
    y = size * (np.sin(2 * X[:, 0]) * np.exp(-X[:, 1]) + 0.1 * rng.normal(size=2300))
    model = RBFNetworkRegressor(form=form, effort=0.1, random_state=0).fit(X[:300], y[:300])
    assert interval_share(model, X[300:], y[300:]) == pytest.approx(0.9, abs=0.07)


def test_deviations_of_few_samples_are_of_the_errors_size(wave):
    X, y = wave
    for form in (None, "auto"):
        model = RBFNetworkRegressor(form=form, random_state=0).fit(X[:15], y[:15])
        assert interval_share(model, X[15:], y[15:]) > 0.7
        assert np.median(model.predict(X[15:], return_std=True)[1]) < 2 * np.std(y)


@pytest.mark.full
@pytest.mark.grid
@pytest.mark.parametrize("settings", [None, "shared", "emran"])
def test_the_filter_knows_its_deviation(settings, wave):
    X, y = wave
    Y = np.vstack([1e3 * y, 1e-3 * X[:, 0]]).T
    model = MRANRegressor(settings=settings, random_state=0, passes=2).fit(X[:100], Y[:100])
    predicted, deviation = model.predict(X, return_std=True)
    assert predicted.shape == deviation.shape == Y.shape
    assert (deviation > 0).all()
    # in the units of each output; blocks without what correlates them say too much, never too little
    most = 10.0 if settings == "emran" else 0.2
    assert (deviation.mean(axis=0) < most * np.std(Y, axis=0)).all()
    assert (np.abs(predicted - Y).mean(axis=0) < deviation.mean(axis=0)).all()
    if settings != "emran":  # whose units leave nothing to be unsure of where nothing was seen
        assert (model.predict(30 * X, return_std=True)[1].mean(axis=0) > 5 * deviation.mean(axis=0)).all()
    ran = MRANRegressor(settings="ran", passes=1).fit(X, y)
    with pytest.raises(UsageError, match="no predictive variance"):
        ran.predict(X, return_std=True)


WRONG = {
    "both": (
        {"ranges": 3},
        {"ranges": [(0, 1, 2), (3, 4, 5)]},
        {"ranges": [(1, -1), (0, 1)]},
        {"ranges": "ab"},
        {"target": "low"},
        {"target": None},
        {"tail": "bogus"},
        {"radial": "bogus"},
        {"form": "bogus"},
        {"form": 3},
        {"units_max": -1},
        {"units_max": 2.5},
        {"units_max": "many"},
        {"scale_outputs": None},
        {"scale_outputs": ["each"]},
    ),
    "MRAN": (
        {"settings": {}},
        {"settings": 5},
        {"passes": 1.5},
        {"passes": 0},
        {"passes": "x"},
        {"update": "bogus"},
    ),
    "RBF": (
        {"seconds": "a"},
        {"effort": 0.0},
        {"seconds": -1.0},
        {"seconds": float("nan")},
        {"tail": None},
        {"radial": None},
        {"units_max": None},
    ),
}


@pytest.mark.grid
@pytest.mark.parametrize(
    ("kind", "wrong"),
    [(MRANRegressor, w) for w in (*WRONG["both"], *WRONG["MRAN"])]
    + [(RBFNetworkRegressor, w) for w in (*WRONG["both"], *WRONG["RBF"])],
    ids=lambda v: v.__name__ if isinstance(v, type) else str(v),
)
def test_parameters_that_can_not_be_are_refused(kind, wrong, wave):
    with pytest.raises(UsageError) as error:
        kind(**wrong).fit(*wave)
    assert isinstance(error.value, ValueError)
    if kind is MRANRegressor:
        with pytest.raises(UsageError):
            kind(**wrong).partial_fit(*wave)


@pytest.mark.full
def test_settings_by_hand_and_single_ones(wave):
    X, y = wave
    hand = Settings(distance_min=0.7, units_max=5)
    model = MRANRegressor(settings=hand, form="isotropic", passes=1).fit(X, y)
    assert model.settings_.distance_min == 0.7
    assert model.settings_.form == "isotropic"
    assert model.network_.units <= 5
    assert model.history_.units.size == len(y)
    automatic = MRANRegressor(target=0.5, radial="matern-5/2", passes=1).fit(X, y)
    assert automatic.network_.radial == "matern-5/2"


@pytest.mark.full
def test_without_scikit_learn_the_way_is_told():
    probe = (
        "import sys; sys.modules['sklearn'] = None\n"
        "import palpate.learning\n"
        "from palpate.errors import UsageError\n"
        "try:\n    import palpate.estimators\n"
        "except UsageError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert "pip install 'palpate[sklearn]'" in done.stdout
