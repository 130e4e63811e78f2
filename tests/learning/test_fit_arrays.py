"""`palpate.fit` for someone with arrays only: what goes in, what comes out, how far it may be off, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import palpate
from palpate.errors import FileFormatError, UsageError
from palpate.learning.arrays import calibration
from palpate.learning.arrays.calibration import Evidence
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.kernel_layer import KernelLayer, Metric
from palpate.network import Network, Uncertainty
from palpate.rbf.forms import unit_form
from palpate.rbf.refinement.refine import refine
from palpate.rbf.regressors import Regressors

NOISE = 0.05


def noisy(count, seed=0, noise=NOISE):
    rng = np.random.default_rng(seed)
    X = rng.uniform([0, 10], [2, 30], (count, 2))
    u, v = X[:, 0] - 1, X[:, 1] / 10 - 2
    Y = np.column_stack([np.sin(2 * u) * np.exp(-v), 1 / (1 + u * u + v * v)])
    return X, Y + noise * rng.normal(size=Y.shape)


@pytest.fixture(scope="module")
def found():
    return palpate.fit(*noisy(300), effort=0.13)


@pytest.fixture(scope="module")
def single():
    """One input, one output, both flat."""
    x = np.linspace(-2, 2, 60)
    return palpate.fit(x, np.sin(3 * x), effort=0.07)


def covered(found, X, Y, level=None):
    low, high = found.interval(X, level)
    return ((low <= Y) & (high >= Y)).mean(axis=0)


@pytest.mark.full
def test_intervals_hold_nine_in_ten_of_unseen_samples(found):
    share = covered(found, *noisy(4000, seed=1))
    assert share.mean() == pytest.approx(0.9, abs=0.05)
    # of Gaussian noise the deviation is the noise's
    assert np.median(found.deviation(noisy(50, seed=2)[0])) == pytest.approx(NOISE, rel=0.25)
    narrow = covered(found, *noisy(4000, seed=1), level=0.5)
    assert narrow.mean() == pytest.approx(0.5, abs=0.1)


@pytest.mark.full
@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_intervals_of_few_samples_are_rather_too_wide(noise):
    shares = [
        covered(palpate.fit(*noisy(40, s, noise), effort=0.1), *noisy(2000, 9, noise)) for s in range(3)
    ]
    assert np.mean(shares) > 0.85


@pytest.mark.full
def test_another_level_is_calibrated_for():
    found = palpate.fit(*noisy(300), effort=0.07, level=0.6)
    share = covered(found, *noisy(4000, seed=1))
    # sixty samples are held out, and how many of sixty fall inside scatters by √(0.6 · 0.4/60) = 0.063
    assert share.mean() == pytest.approx(0.6, abs=3 * 0.063)
    wide = found.interval(noisy(5)[0], 0.9)
    assert (wide[1] - wide[0] > np.diff(found.interval(noisy(5)[0]), axis=0)[0]).all()


def test_a_kernel_layers_widths_are_its_gaussian_process():
    rng = np.random.default_rng(0)
    X, Y = rng.uniform(-1, 1, (30, 2)), rng.normal(size=(30, 1))
    metric = Metric("gaussian", np.array([1.5, 0.7]), 1e-3)
    layer = KernelLayer.fit(metric, X, Y)
    Z = rng.uniform(-2, 2, (7, 2))
    C = metric.kernel(X, X) + 1e-3 * np.eye(30)
    k = metric.kernel(Z, X)
    variance = 1 + 1e-3 - np.diag(k @ np.linalg.solve(C, k.T))
    np.testing.assert_allclose(calibration.kernel_spread(layer, Z), variance / (1 + 1e-3), rtol=1e-9)
    row = np.hstack([np.ones((7, 1)), Z, k])
    M = calibration.kernel_covariance(layer)
    np.testing.assert_allclose(1 + np.diag(row @ M @ row.T), variance / (1 + 1e-3), rtol=1e-8)


def test_root_gives_the_coefficients_of_least_squares():
    rng = np.random.default_rng(0)
    X, Y = rng.uniform(-1, 1, (60, 2)), rng.normal(size=(60, 3))
    r = Regressors(unit_form("isotropic", 2), "gaussian")
    units = np.array([r.form.unit(x, 0.3, seed=0) for x in X[:10]])
    two = [refine(X, Y, theta, r, ridge=1e-12, iterations=0) for theta in (units[:4], units[4:])]
    np.testing.assert_allclose(calibration.regressor_root(two[0], X) @ Y, two[0].coefficients, atol=1e-6)
    both = calibration.mean_root(two, X) @ Y
    np.testing.assert_allclose(both[:3], (two[0].tail + two[1].tail) / 2, atol=1e-6)
    np.testing.assert_allclose(both[3:], np.vstack([one.weights for one in two]) / 2, atol=1e-6)


@pytest.mark.full
def test_quantile_is_conformal_and_students_where_samples_are_few(found):
    network = found.network
    missed = np.random.default_rng(0).normal(size=(99, 2)) * [1.0, 7.0]
    evidence = Evidence(missed, np.ones(99))
    half = calibration.calibrated(network, None, [evidence], 0.9).interval(noisy(1)[0], 0.9)
    width = (half[1] - half[0])[0] / 2 / network.scaling.output_scale
    np.testing.assert_allclose(width, np.sort(abs(missed), axis=0)[89], rtol=1e-9)
    few = Evidence(missed[:5], np.ones(5))
    from scipy.stats import t

    half = calibration.calibrated(network, None, [few], 0.9).interval(noisy(1)[0], 0.9)
    width = (half[1] - half[0])[0] / 2 / network.scaling.output_scale
    np.testing.assert_allclose(width, t.ppf(0.95, 5) * np.sqrt((missed[:5] ** 2).mean(axis=0)), rtol=1e-9)


def test_of_two_evidences_the_wider_counts(found):
    rng = np.random.default_rng(0)
    one, two = (Evidence(rng.normal(size=(99, 2)) * scale, np.ones(99)) for scale in ([1, 7], [3, 2]))
    widths = [
        calibration.calibrated(found.network, None, parts, 0.9).deviation(noisy(1)[0])
        for parts in ([one], [two], [one, two])
    ]
    np.testing.assert_array_equal(widths[2], np.maximum(*widths[:2]))


def test_trusted_are_places_between_samples(found):
    X, _ = noisy(200, seed=3)
    assert found.trusted(X).mean() > 0.9
    away = X + np.array([0.0, 40.0])
    assert not found.trusted(away).any()
    assert not found.trusted(np.full((1, 2), np.nan)).any()


def test_what_is_saved_comes_back(found, tmp_path):
    path = found.save(tmp_path / "map.palpate")
    again, X = Fitted.load(path), noisy(40, seed=4)[0]
    for ours, theirs in zip(found.interval(X), again.interval(X), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(found.predict(X), again.predict(X))
    np.testing.assert_array_equal(found.trusted(X + 1), again.trusted(X + 1))
    assert (again.form, again.heldout, again.level) == (found.form, found.heldout, found.level)
    network = Network.load(path)
    np.testing.assert_array_equal(Uncertainty.of(network).deviation(X), found.deviation(X))
    with pytest.raises(FileFormatError, match="not one that"):
        Fitted.load(found.network.save(tmp_path / "bare.palpate"))


@pytest.mark.full
def test_flat_arrays_and_lists_do(single):
    assert single.one_output
    low, high = single.interval([0.1, 0.2, 0.3])
    assert single.predict([0.1, 0.2, 0.3]).shape == low.shape == high.shape == (3,)
    np.testing.assert_allclose(single.predict([0.5]), np.sin(1.5), atol=0.02)
    assert single.trusted([[0.5]]).tolist() == [True]
    X, Y = noisy(30)
    listed = palpate.fit(X.tolist(), Y.tolist(), effort=0.03, target=0.5)
    assert listed.predict(X.tolist()).shape == (30, 2)


def test_names_and_ranges():
    X, Y = noisy(40)
    table = pd.DataFrame(X, columns=["force", "modulus"])
    named = palpate.fit(table, pd.DataFrame(Y, columns=["tip", "middle"]), target=0.9).network
    assert [r.name for r in named.inputs] == ["force", "modulus"]
    assert [q.name for q in named.outputs] == ["tip", "middle"]
    assert (named.inputs[0].low, named.inputs[0].high) == (X[:, 0].min(), X[:, 0].max())
    bare = palpate.fit(X, Y, target=0.9).network
    assert [r.name for r in bare.inputs] + [q.name for q in bare.outputs] == ["x0", "x1", "y0", "y1"]
    inputs = [palpate.Range("F", 0, 2, "N"), palpate.Range("E", 10, 30, "Pa")]
    outputs = [palpate.Quantity("u", "m"), palpate.Quantity("v", "m")]
    declared = palpate.fit(X, Y, inputs, outputs, target=0.9).network
    assert declared.inputs == tuple(inputs)
    assert declared.outputs == tuple(outputs)


def test_printed_it_says_what_and_how_good(found):
    text = str(found)
    assert f"{found.units} units" in text
    assert found.form in text
    assert f"{found.heldout:.1e}" in text
    assert 3 <= len(text.splitlines()) <= 9
    listed = [line for line in text.splitlines() if "chosen; judged anew" in line]
    assert len(listed) == 1
    assert f"{found.form} {found.radial}" in listed[0]


BAD = {
    "few": (lambda X, Y: (X[:10], Y[:10]), "too few"),
    "nan": (lambda X, Y: (X, np.where(np.arange(40)[:, None] == 7, np.nan, Y)), "1 of 40 .* row 7"),
    "shapes": (lambda X, Y: (X, Y[:30]), "not samples"),
    "text": (lambda X, Y: (X.astype(str), Y), "Samples are real numbers"),
    "ragged": (lambda X, Y: ([[1.0, 2.0], [3.0]] * 20, Y), "Samples are real numbers"),
    "complex": (lambda X, Y: (X + 1j, Y), "Samples are real numbers"),
    "constant": (lambda X, Y: (X, np.full(40, 3.0)), "same outputs"),
    "nothing varied": (lambda X, Y: (np.ones((40, 2)), Y), "same inputs"),
    "huge": (lambda X, Y: (X * 1e200, Y), "other units"),
    "cube": (lambda X, Y: (X[:, None], Y), "not samples"),
}


@pytest.mark.parametrize("name", BAD)
def test_samples_that_are_none_are_refused(name):
    spoil, message = BAD[name]
    with pytest.raises(UsageError, match=message) as error:
        palpate.fit(*spoil(*noisy(40)))
    assert error.value.fix


@pytest.mark.parametrize(
    "option",
    [
        *({"seconds": v} for v in (-1, 0, float("nan"), float("inf"), "ten", True)),
        *({"effort": v} for v in (-1, 0, float("nan"), float("inf"), "much", True)),
        *({"target": v} for v in (-1, 0, float("nan"), "small")),
        *({"seed": v} for v in (-1, 1.5, None)),
        *({"level": v} for v in (0, 1, 90, float("nan"), "high")),
        {"inputs": [palpate.Range("F", 0, 1)]},
        {"inputs": [(0, 1), (10, 30)]},
        {"outputs": ["u", "v"]},
    ],
    ids=str,
)
def test_options_that_can_not_be_are_refused(option):
    with pytest.raises(UsageError):
        palpate.fit(*noisy(40), **option)


def test_questions_of_the_wrong_shape_are_refused(found):
    for ask in (found.predict, found.deviation, found.interval, found.trusted):
        with pytest.raises(UsageError, match="takes 2 inputs"):
            ask([1.0, 2.0])
    with pytest.raises(UsageError, match="level"):
        found.interval([[1.0, 20.0]], 90)


def test_copies_of_samples_do_not_judge_what_was_learnt_from_them():
    """Twenty-five noisy places, four times each: memorising them tells nothing of the noise in between."""
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (25, 2))
    y = np.sin(5 * X[:, 0]) * np.exp(X[:, 1]) + 0.2 * rng.normal(size=25)
    found = palpate.fit(np.tile(X, (4, 1)), np.tile(y, 4), effort=0.07)
    Z = rng.uniform(-1, 1, (1000, 2))
    truth = np.sin(5 * Z[:, 0]) * np.exp(Z[:, 1])
    error = np.sqrt(((found.predict(Z) - truth) ** 2).mean()) / truth.std()
    assert found.heldout > 0.2 * error


def test_masked_numbers_are_missing_numbers():
    X = np.random.default_rng(0).uniform(-1, 1, (60, 1))
    Y = np.ma.masked_array(np.where(X > 0.8, 9999.0, X), mask=X > 0.8)
    with pytest.raises(palpate.PalpateError, match="finite"):
        palpate.fit(X, Y, effort=0.03)


@pytest.mark.full
@pytest.mark.parametrize("count", [200, 20_000])
def test_a_limit_on_time_plans_for_less_work_however_many_rows(count, monkeypatch):
    """The processor's time counts, not the clock's, so that other work on the machine has no say."""
    import time

    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (count, 3))
    y = np.sin(3 * X[:, 0]) + X[:, 1] ** 2 * X[:, 2]
    palpate.fit(X[:100], y[:100], effort=0.02)  # compiles
    monkeypatch.setattr(time, "monotonic", time.process_time)
    began = time.process_time()
    found = palpate.fit(X, y + 0.01 * rng.normal(size=count), seconds=3.0)
    assert time.process_time() - began < 1.2 * 3.0 + 2.0
    assert found.heldout < 0.1


@pytest.fixture(scope="module")
def tabular():
    """A table with named columns and a network learnt from it."""
    rng = np.random.default_rng(0)
    table = pd.DataFrame({"depth": rng.uniform(0, 10, 60), "speed": rng.uniform(0, 1, 60)})
    return table, palpate.fit(table, 0.1 * table["depth"] + 5 * table["speed"] ** 2, effort=0.02)


@pytest.mark.full
def test_columns_of_a_table_are_matched_by_name(tabular, tmp_path):
    table, found = tabular
    straight, turned = found.predict(table), table[["speed", "depth"]]
    for again in (found, Fitted.load(found.save(tmp_path / "model.palpate"))):
        np.testing.assert_array_equal(again.predict(turned), straight)
        np.testing.assert_array_equal(again.network.predict(turned)[:, 0], straight)
        np.testing.assert_array_equal(again.trusted(turned), again.trusted(table))
        np.testing.assert_array_equal(again.interval(turned), again.interval(table))
        np.testing.assert_array_equal(again.deviation(turned), again.deviation(table.to_numpy()))
        with pytest.raises(UsageError, match="'speed' is missing, 'pace' is unknown"):
            again.predict(table.rename(columns={"speed": "pace"}))
        with pytest.raises(UsageError, match="'time' is unknown"):
            again.predict(table.assign(time=0.0))


@pytest.mark.full
def test_declared_inputs_are_matched_to_the_columns_of_their_name(tabular):
    table, found = tabular
    y = found.predict(table)
    ranges = [palpate.Range("speed", 0.0, 1.0, "m/s"), palpate.Range("depth", 0.0, 10.0, "mm")]
    named = palpate.fit(table, y, inputs=ranges, effort=0.02)
    np.testing.assert_array_equal(named.predict(table), named.predict(table[["speed", "depth"]].to_numpy()))
    bare = palpate.fit(table[["speed", "depth"]].to_numpy(), y, inputs=ranges, effort=0.02)
    np.testing.assert_array_equal(bare.predict(table), named.predict(table))
    other = [palpate.Range("d", 0.0, 10.0, "mm"), palpate.Range("v", 0.0, 1.0, "m/s")]
    renamed = palpate.fit(table, y, inputs=other, effort=0.02)
    np.testing.assert_array_equal(
        renamed.predict(table[["speed", "depth"]]), renamed.predict(table.to_numpy())
    )
    with pytest.raises(UsageError, match="'v' is missing, 'speed' is unknown"):
        palpate.fit(table.rename(columns={"depth": "d"}), y, inputs=other)


@pytest.mark.full
@pytest.mark.parametrize("missing", [None, np.nan, pd.NA])
def test_a_missing_value_names_its_row_and_column(tabular, missing):
    table = tabular[0].copy().assign(count=np.arange(60)).convert_dtypes()
    table.loc[3, "count"] = missing
    with pytest.raises(UsageError, match=r"1 of 60 samples .* first in row 3 \(column 'count'\)"):
        palpate.fit(table, np.arange(60.0))
    with pytest.raises(UsageError, match=r"first in row 3 \(column 'y0'\)"):
        palpate.fit(table[["depth"]], table["count"])


def test_the_default_is_quick_and_says_what_more_time_may_bring(fitted_240: Fitted):
    # one round of folds of one kind, and no more work than the default has
    assert 1 <= len(fitted_240.members) <= 5 or fitted_240.form == "kernel layer"
    assert fitted_240.heldout < 1.5 * 0.05 / quick_rows(240)[1].std()
    assert "time" in fitted_240.outlook
    assert fitted_240.outlook in str(fitted_240)
    noise = float(fitted_240.outlook.rpartition(" %")[0].rpartition(" ")[2]) / 100
    # the rows scatter by 0.05; no network can be nearer to rows that it has not seen
    assert noise == pytest.approx(0.05 / quick_rows(240)[1].std(), rel=0.3)


def test_few_rows_are_said_in_words():
    fitted = palpate.fit(*quick_rows(30))
    assert fitted.outlook.startswith("Only 30 rows")
    assert "More rows would help" in fitted.outlook


def test_the_score_is_that_of_scikit_learn(fitted_240: Fitted):
    X, y = quick_rows(240)
    left = ((y - fitted_240.predict(X)) ** 2).sum()
    assert fitted_240.score(X, y) == pytest.approx(1 - left / ((y - y.mean()) ** 2).sum(), rel=1e-12)
    with pytest.raises(UsageError, match="do not fit"):
        fitted_240.score(X, y[:-1])


def test_a_fit_plots_the_rows_that_judged(fitted_240: Fitted, tmp_path: Path):
    figure = fitted_240.plot(tmp_path / "fit.png")
    assert (tmp_path / "fit.png").stat().st_size > 1000
    points = figure.axes[0].lines[1]
    measured, answered = points.get_data()
    # the error that is stated is that of what is drawn
    y = quick_rows(240)[1]
    assert set(np.round(measured, 12)) <= set(np.round(y, 12))
    assert np.sqrt(((measured - answered) ** 2).mean()) / y.std() == pytest.approx(
        fitted_240.heldout, rel=0.05
    )
    loaded = Fitted.load(fitted_240.save(tmp_path / "fit.palpate"))
    with pytest.raises(UsageError, match="no rows"):
        loaded.plot()
    assert len(loaded.plot(X=quick_rows(20)[0], Y=quick_rows(20)[1]).axes) == 1


def test_a_fit_has_a_card_as_a_page(fitted_240: Fitted):
    page = fitted_240.to_html()
    assert fitted_240.card().kind in page
    assert page.startswith("<!doctype html>")
    assert fitted_240._repr_html_() in page
    assert (
        fitted_240.card().errors["error on samples held out, relative to the outputs' spread"]
        == fitted_240.heldout
    )


@pytest.fixture(scope="module")
def fitted_240() -> Fitted:
    return palpate.fit(*quick_rows(240))


def quick_rows(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of a smooth function of two inputs with noise of 0.05."""
    rng = np.random.default_rng(2)
    X = rng.uniform(-1, 1, (count, 2))
    return X, np.sin(3 * X[:, 0]) * (1 + X[:, 1]) + 0.05 * rng.normal(size=count)
