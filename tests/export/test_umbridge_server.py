"""Learnt files served to the client of the `umbridge` package, and its server's models swept."""

from __future__ import annotations

import contextlib
import json
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from pathlib import Path

import numpy as np
import pytest

import exported_bodies
import palpate as pp
from answering import answering
from palpate.cli import main
from palpate.errors import ResourceError, StudyError, UsageError
from palpate.export.umbridge_server import UMBridgeServer, served_models
from palpate.study.solver_study import read_solver_study
from palpate.study.solver_sweep import sweep_solver
from palpate.sweeps import umbridge_problem
from palpate.units import Range
from system_programs import require_package
from waiting import wait_for

SPRING = Path(__file__).parents[1] / "data" / "solver_case" / "umbridge_spring.py"


@contextlib.contextmanager
def serving(models, port=0):
    server = UMBridgeServer(models, port)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture(scope="module")
def umbridge():
    return require_package("umbridge", "test")


@pytest.fixture(scope="module")
def touched():
    body = exported_bodies.body("contact")
    with serving(served_models(body)) as server:
        yield body, server


def places(body, count=5):
    low = np.array([r.low for r in body.inputs])
    high = np.array([r.high for r in body.inputs])
    return np.random.default_rng(1).uniform(low, high, (count, len(low)))


def vectors_of(body, x):
    """Input vectors of a place: the felt coordinates, then the further inputs, if there are any."""
    k = len(body.energy.baseline.directions)
    return [x[:k].tolist()] + ([x[k:].tolist()] if len(x) > k else [])


def test_the_clients_answers_are_those_of_the_body_with_its_slopes(umbridge, touched):
    body, server = touched
    model = umbridge.HTTPModel(server.url, "energy")
    assert umbridge.supported_models(server.url) == ["energy", "force"]
    assert sum(model.get_input_sizes()) == len(body.inputs)
    assert model.get_output_sizes() == [1]
    k, rng = model.get_input_sizes()[0], np.random.default_rng(2)
    for x in places(body):
        vectors = vectors_of(body, x)
        assert model(vectors)[0][0] == body.energy.energy(x[None])[0]
        force = body.energy.force(x[None])[0]
        np.testing.assert_array_equal(model.gradient(0, 0, vectors, [2.0]), -2.0 * force)
        v = rng.normal(size=k)
        np.testing.assert_allclose(model.apply_jacobian(0, 0, vectors, v.tolist()), [-force @ v], rtol=1e-12)
        stiff = body.energy.stiffness(x[None])[0]
        np.testing.assert_allclose(
            model.apply_hessian(0, 0, 0, vectors, [3.0], v.tolist()), -3.0 * stiff @ v, rtol=1e-9
        )
        other = umbridge.HTTPModel(server.url, "force")
        np.testing.assert_array_equal(other(vectors)[0], force)
        np.testing.assert_allclose(other.apply_jacobian(0, 0, vectors, v.tolist()), stiff @ v, rtol=1e-9)


def test_slopes_are_those_of_the_values(umbridge):
    """A network, by central differences of what is served."""
    network = exported_bodies.random_network((Range("a", 0, 1, "m"), Range("b", -1, 1, "N")), seed=3)
    with serving(served_models(pp.Surrogate.of(network))) as server:
        model = umbridge.HTTPModel(server.url, "outputs")
        x, m = np.array([0.4, 0.2]), model.get_output_sizes()[0]
        sens, vec, step = np.linspace(1, 2, m), np.array([0.7, -0.4]), 1e-5

        def value(place):
            return np.array(model([place.tolist()])[0])

        def slope(place):
            return np.array(model.gradient(0, 0, [place.tolist()], sens.tolist()))

        along = (value(x + step * vec) - value(x - step * vec)) / (2 * step)
        np.testing.assert_allclose(model.apply_jacobian(0, 0, [x.tolist()], vec.tolist()), along, rtol=1e-6)
        np.testing.assert_allclose(slope(x) @ vec, sens @ along, rtol=1e-6)
        curved = (slope(x + step * vec) - slope(x - step * vec)) / (2 * step)
        hessian = model.apply_hessian(0, 0, 0, [x.tolist()], sens.tolist(), vec.tolist())
        np.testing.assert_allclose(hessian, curved, rtol=1e-5, atol=1e-7)


def test_quantities_are_served_by_the_name_of_their_group(umbridge):
    surrogate = answering()
    (name, part), *_ = surrogate.quantities.items()
    with serving(served_models(surrogate)) as server:
        model = umbridge.HTTPModel(server.url, name)
        x = np.array([(r.low + r.high) / 2 for r in surrogate.inputs])
        np.testing.assert_array_equal(model([x.tolist()])[0], part.predict(x[None])[0])


def post(url, path, content, **headers):
    data = content if isinstance(content, bytes) else json.dumps(content).encode()
    request = urllib.request.Request(f"{url}/{path}", data, headers)
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(request, timeout=10) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, json.load(error)


@pytest.mark.parametrize(
    ("path", "content", "status", "kind"),
    [
        ("ModelInfo", {"name": "nothing"}, 400, "ModelNotFound"),
        ("Evaluate", {"name": "energy", "input": [[1.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "energy", "input": [["a", 0, 0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "energy", "input": {"0": 1}}, 400, "InvalidInput"),
        ("Evaluate", b"{", 400, "InvalidInput"),
        ("Evaluate", b"[" * 100_000, 400, "InvalidInput"),
        ("Evaluate", [1], 400, "InvalidInput"),
        ("ApplyHessian", {"name": "force", "input": [[0, 0, 0]]}, 400, "UnsupportedFeature"),
        ("EvaluateShMem", {"name": "energy"}, 404, "UnsupportedFeature"),
        ("Gradient", {"name": "energy", "input": "any", "inWrt": 1}, 400, "UnsupportedFeature"),
        ("Gradient", {"name": "energy", "input": "any", "sens": [1, 2]}, 400, "InvalidInput"),
    ],
)
def test_what_is_no_question_is_refused_in_the_protocols_words(touched, path, content, status, kind):
    body, server = touched
    if isinstance(content, dict) and content.get("input") == "any":
        content = content | {"input": vectors_of(body, places(body, 1)[0])}
    code, answer = post(server.url, path, content)
    assert (code, answer["error"]["type"]) == (status, kind)


def test_only_this_machine_is_answered(touched):
    _, server = touched
    assert server.server_address[0] == "127.0.0.1"
    code, answer = post(server.url, "InputSizes", {"name": "energy"}, host="evil.example:80")
    assert code == 403
    assert "127.0.0.1" in answer["error"]["message"]


def test_answers_outside_the_trained_region_are_marked(touched):
    body, server = touched
    deep = places(body, 20)
    deep[:, 2] -= np.linspace(0.0, 0.05, 20)  # on the way through its whole height
    for x, inside in zip(deep, body.energy.inside(deep), strict=True):
        question = {"name": "energy", "input": vectors_of(body, x)}
        assert post(server.url, "Evaluate", question)[1]["inside"] is bool(inside)
    assert not body.energy.inside(deep).all()


def test_the_command_serves_a_file_and_says_where_not(tmp_path, capsys):
    exported_bodies.body("contact").save(tmp_path / "pressed.palpate")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(SystemExit) as stop:
            main(["serve-umbridge", str(tmp_path / "pressed.palpate"), "--port", str(taken.getsockname()[1])])
    assert stop.value.code
    assert "can't be taken" in capsys.readouterr().err


STUDY = """
name = "served"

[solver]
url = "{url}"
model = "spring"

[[inputs]]
name = "stretch"
range = ["0 mm", "10 mm"]
unit = "mm"

[[inputs]]
name = "share"
range = [0, 1]

[[mapping.outputs]]
name = "energy"
from = "output0"
unit = "mJ"

[[mapping.outputs]]
name = "pair"
from = ["output1.0", "output1.1"]
unit = "N"

[sweep]
samples = 8

[test]
random = 0
"""


ROD = """
name = "rod"

[solver]
url = "{url}"
model = "largest"

[[inputs]]
name = "heat"
range = ["1e5 W/m^3", "5e5 W/m^3"]
unit = "W/m^3"

[[inputs]]
name = "conductivity"
range = ["10 W/(m K)", "40 W/(m K)"]
unit = "W/(m K)"

[[mapping.outputs]]
name = "largest"
from = "output"
unit = "K"
"""


@pytest.fixture(scope="module")
def spring(umbridge):
    """Address of a server of the `umbridge` package, in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}"
    command = [sys.executable, SPRING, url.rpartition(":")[2]]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            wait_for(lambda: answers(url), pause=0.1)
            yield url
        finally:
            process.kill()


def answers(url):
    with contextlib.suppress(OSError):
        return post(url, "ModelInfo", {"name": "spring"})[0] == 200
    return False


def test_a_model_of_the_package_is_swept(spring, tmp_path):
    path = tmp_path / "served.toml"
    path.write_text(STUDY.format(url=spring))
    study = read_solver_study(path)
    problem = study.problem(tmp_path, 30.0)
    problem.check()
    solver = problem.open()
    answer = solver.solve(np.array([0.005, 0.25]))
    # ½ k x² with k = 2000 N/m, and the shares of k x
    np.testing.assert_allclose(answer.energy, 0.5 * 2000 * 0.005**2)
    np.testing.assert_allclose(answer.pair, [2.5, 7.5])
    refused = solver.solve(np.array([0.0095, 0.5]))
    assert not refused.converged
    assert "refuses Evaluate" in refused.message
    lies = solver.solve(np.array([0.0005, 0.5]))
    assert not lies.converged
    assert "Evaluate" in lies.message or "number" in lies.message


@pytest.mark.parametrize("returns", [True, False])
def test_an_outage_of_the_server_costs_nothing_where_it_is_short_else_the_case(
    returns, tmp_path, monkeypatch
):
    monkeypatch.setattr(umbridge_problem, "_PAUSES", (0.3,) * (100 if returns else 2))
    models, x = served_models(answering()), np.array([3e5, 20.0])
    path = tmp_path / "served.toml"
    with serving(models) as server:
        path.write_text(ROD.format(url=server.url))
        problem = read_solver_study(path).problem(tmp_path, 30.0)
        problem.check()
        solver = problem.open()
        assert solver.solve(x).largest == answering().predict(x[None])[0, 0]
    with contextlib.ExitStack() as stack:
        ends = threading.Event()

        def serve_again():
            with serving(models, server.server_address[1]):
                ends.wait()

        again = threading.Timer(0.1, serve_again)
        stack.callback(again.cancel)
        stack.callback(ends.set)
        if returns:
            again.start()
        answer = solver.solve(x)
    assert answer.converged is returns
    if not returns:
        assert "does not answer Evaluate" in answer.message
        assert "Start it again" in answer.message


@pytest.mark.full
def test_a_sweep_of_a_model_of_the_package_is_a_dataset(spring, tmp_path):
    path = tmp_path / "served.toml"
    path.write_text(STUDY.format(url=spring).replace('"0 mm", "10 mm"', '"2 mm", "8 mm"'))
    said = []
    data = sweep_solver(
        read_solver_study(path), tmp_path, limit=30, progress=False, announce=said.append
    ).data
    assert data.converged.all()
    np.testing.assert_allclose(data["energy"], 1000 * data.X[:, 0] ** 2)
    assert spring in said[0]


@pytest.mark.parametrize(
    ("old", "new", "kind", "said"),
    [
        ('unit = "mm"\n', "", UsageError, "The unit of the input 'stretch' is missing"),
        ('unit = "mm"\n', 'unit = "N"\n', UsageError, "its `unit` is N"),
        ('"spring"', '"string"', UsageError, "no model 'string'"),
        (
            '[[inputs]]\nname = "share"\nrange = [0, 1]\n',
            "",
            UsageError,
            "takes 2 numbers, and the study has 1",
        ),
        ('from = "output0"', 'from = "out"', UsageError, "no column 'out'"),
        ("url =", 'command = ["x"]\nurl =', StudyError, "command"),
        ("http://127.0.0.1:", "http://127.0.0.1:1", ResourceError, "does not answer"),
    ],
)
def test_studies_that_do_not_fit_the_model_are_refused(spring, tmp_path, old, new, kind, said):
    path = tmp_path / "served.toml"
    text = STUDY.format(url="http://127.0.0.1:9" if kind is ResourceError else spring)
    path.write_text(text.replace(old, new))
    with pytest.raises(kind, match=said):
        read_solver_study(path).problem(tmp_path, 5.0).check()
