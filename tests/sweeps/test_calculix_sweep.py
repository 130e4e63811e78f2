"""CalculiX run for real by `palpate sweep`: a heated and pulled bar, whose answers to four inputs are closed forms."""

from __future__ import annotations

import json

import numpy as np
import pytest

import palpate as pp
from dataset.readers.solved_by_ccx import row_of_bricks
from palpate.study.solver_study import read_solver_study
from palpate.study.solver_sweep import sweep_solver

CONDUCTIVITY, YOUNG, POISSON = 50.0, 200e9, 0.3  # W/m/K, Pa
AT_REST = 293.15  # K, temperature at which the bar is free of strain

# in N, mm, s and K: heat in mW, conductivity in mW/mm/K
DECK = """{mesh}
*NSET, NSET=ROOT
{root}
*NSET, NSET=SIDE
{side}
*NSET, NSET=UNDER
{under}
*MATERIAL, NAME=STEEL
*ELASTIC
200000., 0.3
*EXPANSION, ZERO=293.15
{{{{ expansion | 1/K }}}}
*CONDUCTIVITY
50.
*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL
*INITIAL CONDITIONS, TYPE=TEMPERATURE
ALL, 293.15
*STEP
*UNCOUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE
*BOUNDARY
{corner}, 1, 1
SIDE, 2, 2
UNDER, 3, 3
ROOT, 11, 11, {{{{ sink | K }}}}
*DFLUX
{last}, S4, {{{{ heat flux | mW/mm^2 }}}}
*DLOAD
{last}, P4, {{{{ pressure | MPa }}}}
1, P6, {{{{ pressure | MPa }}}}
*NODE FILE
U, NT
*END STEP
"""

STUDY = """
name = "bar"

[solver]
command = ["ccx", "-i", "{case}"]
results = ["{case}.frd"]
failure = ["*ERROR"]
limit = "1 min"

[[inputs]]
name = "heat flux"
range = ["10 kW/m^2", "50 kW/m^2"]

[[inputs]]
name = "sink"
range = ["0 degC", "40 degC"]

[[inputs]]
name = "pressure"
range = ["-50 MPa", "20 MPa"]

[[inputs]]
name = "expansion"
range = ["1e-5 1/K", "2e-5 1/K"]

[mapping.units]
length = "mm"
force = "N"

[[mapping.outputs]]
name = "temperature"
from = "NDTEMP.T"
unit = "K"

[[mapping.outputs]]
name = "displacement"
from = "DISP"

[sweep]
samples = 12

[test]
random = 3
"""


@pytest.fixture
def bar(ccx, tmp_path):
    """Study file of the bar, beside its templates."""
    numbers, mesh = row_of_bricks(4, (100.0, 10.0, 10.0))
    parts = {
        name: "\n".join(f"{number}," for place, number in numbers.items() if place[axis] == 0)
        for name, axis in (("root", 0), ("side", 1), ("under", 2))
    }
    (tmp_path / "templates").mkdir()
    deck = DECK.format(mesh="\n".join(mesh), last=4, corner=numbers[0, 0, 0], **parts)
    (tmp_path / "templates" / "{case}.inp").write_text(deck)
    (tmp_path / "bar.toml").write_text(STUDY)
    return tmp_path / "bar.toml"


def test_calculix_is_swept_and_agrees_with_closed_forms(bar):
    study = read_solver_study(bar)
    solves = sweep_solver(study, bar.parent, limit=60, progress=False, announce=[].append)
    assert solves.failures == []
    for data in (solves.data, solves.unseen):
        flux, sink, pressure, expansion = data.X.T[:, :, None]
        x, y, z = data.rest.T
        slope = flux / CONDUCTIVITY
        # six digits are printed
        np.testing.assert_allclose(data["temperature"], sink + slope * x, rtol=1e-5)
        # a temperature that is linear in x strains a bar that nothing hinders without stress; the pressure adds its own
        warm = expansion * (sink - AT_REST + slope * x)
        across = warm + POISSON * pressure / YOUNG
        along = expansion * ((sink - AT_REST) * x + slope * (x**2 - y**2 - z**2) / 2) - pressure / YOUNG * x
        moves = np.stack([along, across * y, across * z], axis=-1)
        np.testing.assert_allclose(data.displacement, moves, atol=2e-5 * np.abs(moves).max())
    assert solves.data["temperature"].shape == (12, len(solves.data.rest))
    assert len(solves.data.triangles)
    assert json.dumps(solves.data.provenance["problem"]["solver"]["command"]) == '["ccx", "-i", "{case}"]'
    assert isinstance(pp.Dataset.open(bar.parent / "bar-random.zarr"), pp.Dataset)
