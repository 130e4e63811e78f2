"""Reports of Abaqus and data records of FEBio, in the layouts that their makers publish, and the script for an .odb."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import numpy as np
import pytest

import palpate as pp
from palpate.dataset.readers.abaqus_odb import SCRIPT
from palpate.errors import FileFormatError


def engineering(value: float) -> str:
    """A number as Abaqus prints it: 148.810E-12, 875., 0."""
    if value == 0:
        return "0."
    power = 3 * int(np.floor(np.log10(abs(value)) / 3))
    digits = f"{value / 10.0**power:.7g}"
    return (digits if "." in digits else f"{digits}.") + (f"E{power:+03d}" if power else "")


def field_report(frames, parts, names, *, where="nodes", keys=("Node",), statistics=True) -> str:
    """A field report of values[frame][part] = rows (id…, value…)."""
    lines = []
    for increment, (time, values) in enumerate(frames):
        lines += [
            "*" * 80,
            "Field Output Report, written Mon Mar  2 10:11:12 2026",
            "",
            "Source 1",
            "---------",
            "",
        ]
        lines += ["   ODB: C:/temp/plate.odb", "   Step: Step-1"]
        lines += [
            f"   Frame: Increment {increment:6d}: Step Time = {time:8.3f}",
            "",
            "Loc 1 : Nodal values from source 1",
        ]
        lines += ["", f'Output sorted by column "{keys[0]} Label".', ""]
        for part, rows in zip(parts, values, strict=True):
            lines += [f"Field Output reported at {where} for part: {part}", ""]
            lines.append("".join(f"{k:>16}" for k in keys[:1]) + "".join(f"{k:>8}" for k in keys[1:]))
            lines[-1] += "".join(f"{name:>17}" for name in names)
            lines.append(
                f"{'Label':>16}" + "".join(f"{'Pt':>8}" for _ in keys[1:]) + f"{'@Loc 1':>17}" * len(names)
            )
            lines.append("-" * len(lines[-1]))
            n = len(keys)
            for row in rows:
                lines.append(f"{row[0]:16d}" + "".join(f"{v:8d}" for v in row[1:n]))
                lines[-1] += "".join(f"{engineering(v):>17}" for v in row[n:])
            lines += ["", ""]
            if statistics:
                lines += [
                    f"{'Minimum':>16}{engineering(min(r[n] for r in rows)):>17}",
                    f"{'At Node':>16}{3:>17}",
                    "",
                ]
                lines += [f"{'Total':>16}{engineering(sum(r[n] for r in rows)):>17}", ""]
    return "\n".join(lines) + "\n"


def rows_of(time, count=4, start=1):
    return [(start + i, 1e-3 * time * i, -2.5e-10 * time * (i + 1), 1e6 + i) for i in range(count)]


def test_a_field_report_is_read_by_frame_and_part(tmp_path):
    path = tmp_path / "abaqus.rpt"
    frames = [(t, [rows_of(t), rows_of(t, 3, 11)]) for t in (0.5, 1.0)]
    path.write_text(field_report(frames, ["PLATE-1", "PUNCH-1"], ["U.U1", "S.Max. Prin", "S.Mises"]))
    results = pp.read_results(path)
    assert results.format == "Abaqus field report"
    assert results.cases == 2
    np.testing.assert_array_equal(results.columns["time"].values, [0.5, 1.0])
    assert results.places["nodes of PUNCH-1"].ids.tolist() == [11, 12, 13]
    for part, values in (("PLATE-1", 0), ("PUNCH-1", 1)):
        wanted = np.array([[row[1:] for row in frame[1][values]] for frame in frames])
        for i, name in enumerate(("U.U1", "S.Max. Prin", "S.Mises")):
            np.testing.assert_allclose(
                results.columns[f"{name} of {part}"].values, wanted[:, :, i], rtol=1e-6
            )


def test_integration_points_and_missing_values(tmp_path):
    rows = [(1, 1, 10.0), (1, 2, 20.0), (7, 1, 30.0)]
    text = field_report(
        [(1.0, [rows])], ["P"], ["S.Mises"], where="integration points", keys=("Element", "Int")
    )
    path = tmp_path / "a.rpt"
    path.write_text(text.replace("20.", "NoValue", 1) if "20." in text else text)
    results = pp.read_results(path)
    places = results.places["integration points"]
    assert not places.nodal
    assert places.ids.tolist() == [1001, 1002, 7001]
    assert results.columns["S.Mises"].values[0, [0, 2]].tolist() == [10.0, 30.0]


def test_coordinates_of_a_report_place_its_nodes(tmp_path):
    rows = [(i + 1, float(i), 2.0 * i, 0.0, 300.0 + i) for i in range(5)]
    path = tmp_path / "a.rpt"
    path.write_text(
        field_report([(1.0, [rows])], ["P"], ["COORD.COOR1", "COORD.COOR2", "COORD.COOR3", "NT11"])
    )
    results = pp.read_results(path)
    np.testing.assert_array_equal(results.places["nodes"].points()[:, 1], [0, 2, 4, 6, 8])
    assert list(results.columns) == ["time", "NT11"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda t: t.replace("Field Output Report", "Probe Values Report"),
            "Probe Values Report is not read",
        ),
        (
            lambda t: t[: t.index("E-12") - 4] if "E-12" in t else t[: len(t) // 2],
            "values stand where|no rows",
        ),
        (lambda t: t.replace("@Loc 1", "at one"), "no table"),
    ],
)
def test_reports_that_are_none_are_refused(tmp_path, change, said):
    path = tmp_path / "a.rpt"
    path.write_text(change(field_report([(1.0, [rows_of(1.0)])], ["P"], ["U.U1", "U.U2", "S.Mises"])))
    with pytest.raises(FileFormatError, match=said):
        pp.read_results(path)


def test_an_xy_report_gives_its_curves(tmp_path):
    head = (
        "\n"
        + f"{'X':>17}{'RF:RF2 PI: PART-1-1':>25}{'U:U2 PI:':>17}\n"
        + f"{'':>17}{'N: 117048':>25}{'PUNCH N: 3':>17}\n\n"
    )
    rows = "".join(
        f"{engineering(t):>17}{engineering(-120.5 * t):>25}{engineering(0.01 * t):>17}\n" for t in (0, 0.5, 1)
    )
    path = tmp_path / "xy.rpt"
    path.write_text(head + rows.replace("5.E-03", "NoValue") + "\n\n")
    results = pp.read_results(path)
    assert results.cases == 3
    assert list(results.columns) == ["X", "RF:RF2 PI: PART-1-1 N: 117048", "U:U2 PI: PUNCH N: 3"]
    np.testing.assert_allclose(results.columns["RF:RF2 PI: PART-1-1 N: 117048"].values, [0, -60.25, -120.5])
    assert np.isnan(results.columns["U:U2 PI: PUNCH N: 3"].values[1])


def test_an_odb_is_refused_with_the_way_to_read_it(tmp_path):
    path = tmp_path / "job.odb"
    path.write_bytes(b"\0\1odb" * 100)
    with pytest.raises(FileFormatError, match=r"abaqus python .*odb_to_npz\.py"):
        pp.read_results(path)


# what Abaqus's Python offers to a script, as its Scripting Reference has it: a stand-in of the few names that are used
ODB = """
NODAL, ELEMENT_NODAL = "NODAL", "ELEMENT_NODAL"
class Thing:
    def __init__(self, **k): self.__dict__.update(k)
def values(position, pairs):
    return [Thing(nodeLabel=n, data=v, precision="SINGLE_PRECISION") for n, v in pairs]
class Field:
    def __init__(self, position, labels, pairs):
        self.locations, self.componentLabels, self.pairs = [Thing(position=position)], labels, pairs
        self.values = values(position, pairs)
    def getSubset(self, region=None, position=None): return self
    def close(self): pass
nodes = [Thing(label=10 + i, coordinates=(float(i), 0.0, 0.0)) for i in range(3)]
def frame(t):
    u = Field(NODAL, ("U1", "U2", "U3"), [(10 + i, (t * i, 0.0, -t)) for i in range(3)])
    nt = Field(NODAL, (), [(10 + i, 300.0 + t * i) for i in range(3)])
    stresses = [(n, (t, 2 * t, x, 0.0)) for n, x in ((10, 1.0), (11, 2.0), (11, 4.0))]
    s = Field(ELEMENT_NODAL, ("S11", "S22", "S33", "S12"), stresses)
    return Thing(frameValue=t, fieldOutputs={"U": u, "NT11": nt, "S": s})
def openOdb(path, readOnly):
    steps = {"Step-1": Thing(totalTime=0.0, frames=[frame(0.0), frame(1.0)])}
    return Thing(rootAssembly=Thing(instances={"PLATE-1": Thing(nodes=nodes)}), steps=steps, close=lambda: None)
"""


def test_the_script_for_abaqus_writes_what_is_imported(tmp_path):
    (tmp_path / "odbAccess.py").write_text(textwrap.dedent(ODB))
    (tmp_path / "abaqusConstants.py").write_text("from odbAccess import NODAL, ELEMENT_NODAL\n")
    run = subprocess.run(
        [sys.executable, SCRIPT, "job.odb", "U", "NT11", "S"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stdout.strip() == "job.npz", run.stderr
    results = pp.read_results(tmp_path / "job.npz")
    np.testing.assert_array_equal(results.columns["time"].values, [0.0, 1.0])
    np.testing.assert_array_equal(results.columns["U.x"].values, [[0, 0, 0], [0, 1, 2]])
    np.testing.assert_array_equal(results.columns["NT11"].values[1], [300, 301, 302])
    # the node where two elements meet has their mean, one that no element has, none
    np.testing.assert_array_equal(results.columns["S.33"].values[0], [1.0, 3.0, np.nan])
    np.testing.assert_array_equal(results.places["nodes"].points()[:, 0], [0, 1, 2])


def records(steps, data="x;y;z;ux;uy;uz", *, star="*", number=None) -> str:
    lines = []
    for step, (time, rows) in enumerate(steps, 1):
        lines += [] if number is None else ["", f"Data Record #{number}", "=" * 75]
        lines += [f"{star}Step  = {step}", f"{star}Time  = {time:.9g}", f"{star}Data  = {data}"]
        lines += [" ".join(f"{v:.12g}" for v in row) for row in rows]
    return "\n".join(lines) + "\n"


def moved(time):
    return [(i + 1, i + 0.1 * time * i, 2.0, 0.0, 0.1 * time * i, 0.0, 0.0) for i in range(4)]


def test_a_data_record_of_febio_is_placed_at_rest(tmp_path):
    path = tmp_path / "nodes.txt"
    path.write_text(records([(t, moved(t)) for t in (0.5, 1.0)]))
    results = pp.read_results(path)
    assert results.format == "FEBio data record"
    np.testing.assert_allclose(results.places["nodes"].points(), [(i, 2, 0) for i in range(4)], atol=1e-12)
    np.testing.assert_allclose(
        results.columns["ux"].values, [[0.05 * i for i in range(4)], [0.1 * i for i in range(4)]]
    )


def test_a_log_of_febio_holds_several_records(tmp_path):
    log = " F E B i o \n\nReading file test.feb ...SUCCESS!\n"
    for step, time in enumerate((0.5, 1.0), 1):
        nodes = records([(time, moved(time))], star="", number=1).replace("Step  = 1", f"Step  = {step}")
        body = records([(time, [(2, 0.0, 0.0, -7.5 * time)])], "Fx;Fy;Fz", star="", number=2)
        log += (
            f"\n===== beginning time step {step} : {time} =====\n\n Nonlinear solution status: time= {time}\n"
        )
        log += nodes + body.replace("Step  = 1", f"Step  = {step}") + "\n------- converged at time : 1\n"
    path = tmp_path / "job.log"
    path.write_text(log + "\n N O R M A L   T E R M I N A T I O N\n")
    results = pp.read_results(path)
    assert results.cases == 2
    # a rigid body is one number for each case
    np.testing.assert_allclose(results.columns["Fz of record 2"].values, [-3.75, -7.5])
    np.testing.assert_allclose(results.columns["ux of record 1"].values[:, 3], [0.15, 0.3])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t[:-25], "values stand where|differs from step to step"),
        (lambda t: "\n".join(t.splitlines()[:-1]), "differs from step to step"),
        (lambda t: t.replace("*Data", "*Date"), "no data record"),
    ],
)
def test_half_a_record_is_refused(tmp_path, change, said):
    path = tmp_path / "nodes.txt"
    path.write_text(change(records([(t, moved(t)) for t in (0.5, 1.0)])))
    with pytest.raises(FileFormatError, match=said):
        pp.read_results(path)
