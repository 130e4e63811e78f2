"""A beam that CalculiX has bent goes the whole way: imported, learnt, validated and looked at."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import palpate as pp
from dataset.readers.solved_by_ccx import beam_deck, run
from palpate.errors import UsageError
from palpate.learning import Refinement
from palpate.runtime.touchable import load_touchable
from palpate.viewer.page_model import LineDrawing
from palpate.viewer.shown_body import body_of

LOAD = 40.0
MAPPING = """
name = "beam of another solver"
coordinates = ["x", "y"]

[units]
length = "mm"
force = "N"

[[inputs]]
name = "tip load"
from = "time"
times = "40 N"
load = { at = ["100 mm", "0 mm"], direction = [0, -1] }

[[outputs]]
name = "displacement"
from = "DISP"

[[outputs]]
name = "strain_energy"
from = "total internal energy"

[[outputs]]
name = "reaction"
from = "total force"

[nodes]
near = { y = "0 mm", z = "0 mm" }
sort = "x"
"""


@pytest.fixture(scope="module")
def beam(ccx, tmp_path_factory):
    """Folder with beam.frd, beam.dat and beam.toml."""
    folder = tmp_path_factory.mktemp("beam")
    run(ccx, folder, "beam", beam_deck(LOAD))
    (folder / "beam.toml").write_text(MAPPING)
    return folder


@pytest.fixture(scope="module")
def imported(beam):
    return pp.import_results([beam / "beam.frd", beam / "beam.dat"], beam / "beam.toml")


@pytest.mark.full
def test_statics_hold_in_what_was_imported(imported):
    data = imported.dataset
    assert len(data) == len(data.ok) == 20
    # the clamp carries the load
    np.testing.assert_allclose(data["reaction"][:, 1], data.X[:, 0], rtol=1e-5)
    # dΠ = -w dP, by differences of fourth order; CalculiX prints seven digits of the energy
    step = data.X[1, 0] - data.X[0, 0]
    weights = np.array([1, -8, 0, 8, -1]) / (12 * step)
    slope = np.convolve(data.potential_energy, weights[::-1], mode="valid")
    sag = -data.displacement[:, -1, 1]
    np.testing.assert_allclose(-slope, sag[2:-2], rtol=2e-4)
    assert not any("Warning" in note for note in imported.notes)


def test_energies_follow_from_the_deflections_alone(beam, imported):
    outputs = [{"name": "displacement", "from": "DISP"}]
    mapping = tomllib.loads(MAPPING) | {"outputs": outputs}
    data = pp.import_results(beam / "beam.frd", mapping).dataset
    np.testing.assert_allclose(data.potential_energy, imported.dataset.potential_energy, rtol=2e-4)


@pytest.fixture(scope="module")
def learnt(imported):
    """A body learnt from three quarters of the cases, and the others."""
    train, test = imported.dataset.split(0.25)
    body, _ = pp.learn(train, effort=0.05, passes=1, refinement=Refinement(units_max=3, starts=1), workers=1)
    return body, test


@pytest.mark.full
def test_an_imported_beam_is_learnt_and_validated(learnt):
    body, test = learnt
    validation = pp.validate(body, test)
    assert validation.passed, str(validation)
    inner = test.X[:, 0] < LOAD
    sag = -test.displacement[inner, -1, 1]
    force = np.array([np.linalg.norm(body.energy.force(np.array([[w]]))) for w in sag])
    np.testing.assert_allclose(force, test.X[inner, 0], rtol=0.01)


def test_a_page_shows_an_imported_beam(imported, learnt, tmp_path):
    body = load_touchable(learnt[0].save(tmp_path / "beam.palpate"))
    line = LineDrawing(body, body.line).line
    np.testing.assert_allclose(np.array(line.rest)[:, :2], imported.dataset.rest)
    assert line.touch_node == len(imported.dataset.rest) - 1


def test_loads_in_space_are_refused_with_the_remedy(beam):
    mapping = tomllib.loads(MAPPING) | {"coordinates": ["x", "y", "z"]}
    mapping["inputs"][0]["load"] = {"at": ["100 mm", 0, 0], "direction": [0, -1, 0]}
    data = pp.import_results([beam / "beam.frd", beam / "beam.dat"], mapping).dataset
    assert data.displacement.shape[2] == 3
    with pytest.raises(UsageError, match=r"coordinates = \['x', 'y'\]"):
        pp.learn(data)


def test_an_imported_solid_is_looked_at(beam):
    mapping = {
        "units": {"length": "mm"},
        "inputs": [{"name": "load factor", "from": "time", "unit": "1"}],
        "outputs": [
            {"name": "displacement", "from": "DISP"},
            {"name": "root_force", "from": "total force.fy", "unit": "N"},
        ],
    }
    data = pp.import_results([beam / "beam.frd", beam / "beam.dat"], mapping).dataset
    shown = body_of(data)
    assert len(shown.steps) == 20
    corners = np.asarray(shown.rest)[np.asarray(shown.triangles)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    assert np.einsum("ij,ij->", corners.mean(axis=1), normals) / 3 == pytest.approx(1e-5)
    np.testing.assert_allclose(data["root_force"], LOAD * data.X[:, 0], rtol=1e-5)
