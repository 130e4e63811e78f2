"""Numbers, curves and fields that no hand feels, in FMUs, C, libraries and ONNX, beside palpate's own answers."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import palpate as pp
from answering import RANGES, answering, rod_solves
from palpate.errors import UsageError
from palpate.export import Choice, WeightsBlock, export_c, export_fmu, export_lib
from palpate.export.answer_network import answer_network, answers_of
from palpate.export.check_fmu import open_instance
from palpate.export.check_library import _module
from palpate.export.fmu_export import VERSIONS
from palpate.export.onnx_export import export_onnx
from palpate.learning.arrays.input_bends import log_bend
from palpate.network import Network, Scaling, TrainedRegion
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates import LearntQuantities, Surrogate
from palpate.units import Quantity, bounds

RADIALS = ("gaussian", "inverse-multiquadric", "matern-5/2")
LOW, HIGH = bounds(RANGES)


def quantities(radial: str, seed: int, names: tuple[str, ...]) -> LearntQuantities:
    """Return numbers by a random network of rotated units and a bent input, in a region of random points."""
    rng = np.random.default_rng(seed)
    m, units = len(names), 11
    ends = Scaling.of(RANGES, np.zeros((1, m)), bends=np.array([log_bend(*np.array([LOW, HIGH])[:, 0]), 0.0]))
    outer = {"output_centre": rng.normal(size=m), "output_scale": 10.0 ** rng.uniform(-3, 3, m)}
    scaling = dataclasses.replace(ends, **outer)
    network = Network(
        RANGES,
        tuple(Quantity(name, "K") for name in names),
        rng.normal(size=(units, 2, 2)),
        rng.normal(size=(units, 2)),
        rng.normal(size=(m, units)),
        rng.normal(size=(m, 3)),
        scaling,
        radial=radial,
    )
    return LearntQuantities(network, region=TrainedRegion.of(rng.uniform(-1.0, 1.0, (60, 2))))


def mixed() -> Surrogate:
    """Return a surrogate whose five parts have three radial functions, and regions of their own."""
    made, fields = answering(), {}
    for seed, (name, shown) in enumerate(made.fields.items()):
        fields[name] = dataclasses.replace(shown, coefficients=quantities(RADIALS[seed], seed, ("a", "b")))
    numbers = {name: quantities(name, 7 + i, (f"q{i}", f"r{i}")) for i, name in enumerate(RADIALS)}
    return Surrogate(fields=fields, meta={"name": "mixed"}, quantities=numbers)


def places(count: int = 1000) -> np.ndarray:
    """Return inputs in and beside the ranges, and a few far outside, where a bent scale has ended."""
    span = HIGH - LOW
    X = np.random.default_rng(5).uniform(LOW - 0.3 * span, HIGH + 0.3 * span, (count, 2))
    X[: count // 50, 0] -= 2.0 * span[0]
    return X


def asked(path, X: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return each output of an FMU by its name at inputs X, and whether they are in the trained region."""
    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path))
    instance = open_instance(description, folder)
    variables = description.modelVariables
    inputs = [v.valueReference for v in variables if v.causality == "input"]
    outputs = {v.name: v.valueReference for v in variables if v.causality == "output" and v.name != "inside"}
    instance.begin()
    rows, inside = [], []
    for x in X.tolist():
        instance.write(inputs, x)
        rows.append(instance.read(list(outputs.values())))
        inside.append(instance.flags()[0])
    instance.close()
    shutil.rmtree(folder)
    return dict(zip(outputs, np.array(rows).T, strict=True)), np.array(inside)


def wanted_of(surrogate: Surrogate, X: np.ndarray) -> dict[str, np.ndarray]:
    """Return what palpate itself answers, by the names of an FMU's outputs."""
    wanted = dict(zip([q.name for q in surrogate.outputs], surrogate.predict(X).T, strict=True))
    rise = surrogate.fields["rise"].values(X)[:, :, 0]
    wanted |= {f"rise_{i}": column for i, column in enumerate(rise.T)}
    field = surrogate.fields["temperature"].values(X)[:, :, 0]
    wanted |= {"temperature_3": field[:, 3], "temperature_7": field[:, 7]}
    return wanted | {
        "temperature_mean": field.mean(axis=1),
        "temperature_max": field.max(axis=1),
        "temperature_min": field.min(axis=1),
    }


@pytest.mark.parametrize("version", VERSIONS)
def test_an_fmu_answers_numbers_curves_and_chosen_values_as_palpate_does(version, tmp_path):
    surrogate, X = mixed(), places()
    choice = Choice(nodes=(3, 7), means=("temperature",), extremes=("temperature",))
    done = export_fmu(surrogate, tmp_path / "mixed.fmu", fmi=version, choice=choice)
    assert done.comparison is not None
    got, inside = asked(done.path, X)
    wanted = wanted_of(surrogate, X)
    assert set(got) == set(wanted)
    for name, values in wanted.items():
        np.testing.assert_allclose(got[name], values, rtol=0, atol=1e-9 * np.abs(values).max(), err_msg=name)
    np.testing.assert_array_equal(inside, surrogate.trusted(X))
    assert validate_fmu(str(done.path)) == []


def test_without_a_choice_each_field_gives_mean_and_extremes(tmp_path):
    done = export_fmu(answering(), tmp_path / "rod.fmu", check=False)
    got, _ = asked(done.path, places(5))
    assert {"temperature_mean", "temperature_max", "temperature_min", "largest"} < set(got)
    assert not {"temperature_3", "rise_mean"} & set(got)


@pytest.mark.full
def test_an_fmu_of_a_fit_is_the_network(tmp_path):
    X = np.random.default_rng(0).uniform(0.0, 1.0, (60, 2))
    fit = pp.fit(X, np.column_stack([np.sin(3.0 * X[:, 0]) * X[:, 1], np.exp(X[:, 1])]))
    done = export_fmu(fit.surrogate("bracket"), tmp_path / "bracket.fmu")
    Z = np.random.default_rng(1).uniform(0.0, 1.0, (1000, 2))
    got, _ = asked(done.path, Z)
    wanted = fit.predict(Z)
    told = np.column_stack([values for name, values in got.items() if not name.endswith("_deviation")])
    np.testing.assert_allclose(told, wanted, atol=1e-9 * np.abs(wanted).max())


def test_its_directional_derivatives_are_those_of_the_networks(tmp_path):
    surrogate = mixed()
    done = export_fmu(surrogate, tmp_path / "mixed.fmu", check=False)
    description, folder = fmpy.read_model_description(str(done.path)), fmpy.extract(str(done.path))
    instance = open_instance(description, folder)
    instance.begin()
    middle = (LOW + HIGH) / 2
    instance.write([16, 17], middle.tolist())
    count = len(surrogate.outputs)
    got = np.array([instance.slopes([*range(1024, 1024 + count)], [r], [1.0]) for r in (16, 17)]).T
    instance.close()
    shutil.rmtree(folder)
    assert not any(v.name.endswith("_deviation") for v in description.modelVariables)
    wanted = np.concatenate([part.network.jacobian(middle) for part in surrogate.quantities.values()])
    scale = np.abs(wanted * (HIGH - LOW)).max(axis=1, keepdims=True)
    assert (np.abs((got - wanted) * (HIGH - LOW)) < 1e-7 * scale).all()  # central differences


@pytest.mark.full
@pytest.mark.parametrize("single", [False, True])
def test_c_answers_all_numbers_and_whole_fields(single, tmp_path):
    done = export_c(mixed(), tmp_path / "mixed", single=single)
    assert done.comparison is not None
    assert {"temperature_0", "rise_0", "q0", "derivatives", "inside"} <= set(done.comparison.parts)


@pytest.mark.full
def test_a_library_and_onnx_answer_as_palpate_does(tmp_path):
    surrogate = mixed()
    for comparison in (
        export_lib(surrogate, tmp_path / "mixed").comparison,
        export_onnx(surrogate, tmp_path / "mixed.onnx").comparison,
    ):
        assert comparison is not None
        assert comparison.passed
        assert max(part.relative for part in comparison.parts.values()) < 1e-9
    export_lib(surrogate, tmp_path / "mixed")  # replaces its own files


def test_joined_networks_answer_what_the_parts_do():
    surrogate, X = mixed(), places(50)
    answers = answers_of(surrogate)
    field = surrogate.fields["temperature"].values(X)[:, :, 0]
    wanted = np.hstack([surrogate.predict(X), field, surrogate.fields["rise"].values(X)[:, :, 0]])
    np.testing.assert_allclose(answers.predict(X), wanted, atol=1e-12 * np.abs(wanted).max())
    assert len(answers.networks) == 3
    assert answers_of(Surrogate.of(surrogate.quantities["gaussian"].network)).networks[0].units == 11


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (Choice(nodes=(99,)), "no place 99"),
        (Choice(means=("rise",)), "no field 'rise' over a mesh"),
        (Choice(extremes=("stress",)), "no field 'stress'"),
    ],
)
def test_a_choice_of_what_is_not_there_is_refused(choice, words, tmp_path):
    with pytest.raises(UsageError, match=words):
        export_fmu(answering(), tmp_path / "rod.fmu", choice=choice)
    assert not list(tmp_path.iterdir())


def test_nodes_of_a_surrogate_without_fields_are_refused(tmp_path):
    with pytest.raises(UsageError, match="no field"):
        export_fmu(answering(fields=False), tmp_path / "rod.fmu", choice=Choice(nodes=(1,)))


def test_a_block_whose_run_leaves_the_outputs_is_refused(tmp_path):
    """The binary checks what indexes memory: a run beyond the outputs, written with a sound checksum."""
    answers = answer_network(answering(), Choice())
    runs = tuple(dataclasses.replace(run, count=run.count + 10_000) for run in answers.runs)
    done = export_fmu(answering(), tmp_path / "rod.fmu", check=False)
    folder = fmpy.extract(str(done.path), unzipdir=str(tmp_path / "rod"))
    bad = WeightsBlock.of_answers(dataclasses.replace(answers, runs=runs))
    (tmp_path / "rod" / "resources" / "weights.bin").write_bytes(bad.to_bytes())
    description = fmpy.read_model_description(str(done.path))
    description.guid = bad.hash
    with pytest.raises(Exception, match=r"[Ii]nstantiate"):
        open_instance(description, folder)


@pytest.mark.full
def test_the_script_beside_an_fmu_runs_it_and_draws(tmp_path):
    done = export_fmu(answering(), tmp_path / "rod.fmu", check=False)
    command = [
        sys.executable,
        str(tmp_path / "run_fmu.py"),
        "heat=3e5",
        "conductivity=25",
        "--at-once",
        "--plot",
        "largest",
    ]
    told = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    value = answering().predict(np.array([[3e5, 25.0]]))[0, 0]
    assert told.stdout.startswith(f"largest = {value:.9g} K")
    assert done.path.with_suffix(".png").stat().st_size > 1000


def test_a_changed_script_stays(tmp_path):
    export_fmu(answering(), tmp_path / "rod.fmu", check=False)
    (tmp_path / "run_fmu.py").write_text("print('mine')\n")
    export_fmu(answering(), tmp_path / "rod.fmu", check=False)
    assert (tmp_path / "run_fmu.py").read_text() == "print('mine')\n"


def rod() -> Surrogate:
    """Return a number, a curve and a field learnt from few solves, which state their deviations."""
    return pp.learn(rod_solves(names=("largest", "temperature", "rise")), name="rod")[0]


def mean_of_networks(seed: int = 0) -> Surrogate:
    """Return numbers of members whose mean answers, and which disagree; made up, with a deviation."""
    rng, part = np.random.default_rng(seed), quantities("gaussian", seed, ("a", "b"))
    net, members = part.network, []
    for moved in 0.1 * rng.normal(size=(2, *net.weights.shape)):  # in pairs whose mean is the network
        members += [dataclasses.replace(net, weights=net.weights * (1.0 + s * moved)) for s in (1.0, -1.0)]
    c = 1 + len(net.inputs) + net.units
    root = rng.normal(size=(c, c)) / 10.0
    nothing = np.zeros((0, 0))
    sure = Uncertainty(
        net, np.array([1e-3, 2e-3]), root @ root.T, nothing, np.zeros((c, 0)), np.zeros((2, 0))
    )
    sure = dataclasses.replace(sure, pattern=np.zeros((2, 0), dtype=np.int64), factor=np.array([1.1, 1.2]))
    return Surrogate(
        meta={"name": "mean"},
        quantities={"mean": dataclasses.replace(part, uncertainty=sure, members=tuple(members))},
    )


@pytest.mark.parametrize("made", [rod, mean_of_networks])
def test_deviations_and_trust_leave_with_the_answers(made, tmp_path):
    """Of few samples, and of members that disagree: in an FMU and in the compiled C, as palpate has them."""
    surrogate, X = made(), places(300)
    done = export_fmu(surrogate, tmp_path / "made.fmu", choice=Choice(nodes=(3, 7)) if made is rod else None)
    got, inside = asked(done.path, X)
    wanted = dict(zip([q.name for q in surrogate.outputs], _deviations(surrogate, X).T, strict=True))
    if made is rod:
        wanted |= {f"temperature_{i}": surrogate.fields["temperature"].deviation(X)[:, i, 0] for i in (3, 7)}
    trusted = surrogate.trusted(X)
    near = np.zeros(len(X), bool)
    for doubt in answers_of(surrogate).doubts:
        near |= doubt.is_close(X)
    np.testing.assert_array_equal(inside[~near], trusted[~near])
    assert 0 < trusted.sum() < len(X)
    for name, values in wanted.items():
        # small beside the terms that it is the difference of
        np.testing.assert_allclose(got[f"{name}_deviation"], values, rtol=0.02, err_msg=name)
    (wrapper,) = [path for path in export_lib(surrogate, tmp_path / "made").wrappers if path.suffix == ".py"]
    model = _module(wrapper).Model()
    for x, values in zip(X[:20].tolist(), _deviations(surrogate, X[:20]), strict=True):
        np.testing.assert_allclose(model.deviation(x)[: len(values)], values, rtol=0.02)


def test_deviations_have_the_derivatives_that_the_description_promises(tmp_path):
    surrogate = mean_of_networks()
    done = export_fmu(surrogate, tmp_path / "mean.fmu", check=False)
    description, folder = fmpy.read_model_description(str(done.path)), fmpy.extract(str(done.path))
    told = [v.valueReference for v in description.modelVariables if v.name in {"a_deviation", "b_deviation"}]
    middle, steps = (LOW + HIGH) / 2, 1e-3 * (HIGH - LOW)
    instance = open_instance(description, folder)
    instance.begin()
    instance.write([16, 17], middle.tolist())
    got = np.array([instance.slopes(told, [r], [1.0]) for r in (16, 17)]) * steps[:, None]
    instance.close()
    shutil.rmtree(folder)
    part = surrogate.quantities["mean"]
    ends = [part.deviation(np.array([middle + d, middle - d])) for d in np.diag(steps)]
    wanted = np.array([(after - before) / 2 for after, before in ends])
    np.testing.assert_allclose(got, wanted, rtol=0.02, atol=0.02 * np.abs(wanted).max())


def test_a_fit_without_a_basis_of_its_deviations_leaves():
    """As of a fit of very many samples, whose noise alone is stated."""
    net, c = quantities("gaussian", 0, ("a", "b")).network, np.zeros((0, 0))
    sure = Uncertainty(net, np.array([1e-3, 2e-3]), c, c, c, np.zeros((2, 0)))
    sure = dataclasses.replace(sure, pattern=np.zeros((2, 0), dtype=np.int64), factor=np.ones(2))
    part = dataclasses.replace(quantities("gaussian", 0, ("a", "b")), uncertainty=sure)
    whole = answers_of(Surrogate(meta={"name": "many"}, quantities={"many": part}))
    X = places(5)
    np.testing.assert_allclose(whole.doubts[0].deviation(X), part.deviation(X), rtol=1e-12)


def test_the_deviation_of_an_extreme_is_that_of_its_place(tmp_path):
    surrogate, X = rod(), places(50)
    got, _ = asked(
        export_fmu(surrogate, tmp_path / "rod.fmu", choice=Choice(extremes=("temperature",))).path, X
    )
    shown = surrogate.fields["temperature"]
    values, deviation = shown.values(X)[..., 0], shown.deviation(X)[..., 0]
    wanted = deviation[np.arange(len(X)), values.argmax(axis=1)]
    np.testing.assert_allclose(got["temperature_max_deviation"], wanted, rtol=0.02)


def _deviations(surrogate: Surrogate, X: np.ndarray) -> np.ndarray:
    return np.hstack([part.deviation(X) for part in surrogate.quantities.values()])
