"""The package for Unity: compiled with Mono and stand-ins for Unity's types, a scene of it plays and presses."""

from __future__ import annotations

import json
import os
import re
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

import exported_bodies
import pressed
from palpate.errors import UsageError
from palpate.export.check_engine import CheckEngine, engine_library
from palpate.export.engine_scene import press_ends
from palpate.export.unity_export import export_unity
from system_programs import require_program

STANDINS = Path(__file__).parent / "unity_standins.cs"
MAIN = """
using System;
using UnityEngine;
using Palpate.Organ;
public static class Program
{
    static void Print(Vector3 v)
    {
        var c = System.Globalization.CultureInfo.InvariantCulture;
        Console.WriteLine(string.Format(c, "{0:R} {1:R} {2:R}", v.x, v.y, v.z));
    }
    public static void Main()
    {
        new GameObject("scene").AddComponent<PressSample>();
        GameObject.Send("Start");
        var soft = GameObject.All[2].GetComponent<SoftBody>();
        soft.transform.rotation = new Quaternion(0f, 0.6f, 0f, 0.8f);
        soft.tool.position = soft.transform.rotation * new Vector3(0.003f, 0.005f, -0.004f);
        var mover = soft.tool.gameObject.AddComponent<Rigidbody>();
        Time.fixedDeltaTime = 0f;
        GameObject.Send("FixedUpdate");
        GameObject.Send("LateUpdate");
        Print(Quaternion.Inverse(soft.transform.rotation) * soft.Force);
        Print(mover.pushed - soft.Force);
        foreach (var v in soft.GetComponent<MeshFilter>().sharedMesh.vertices) Print(v);
        Time.time = 2f;
        GameObject.Send("Update");
        GameObject.Send("FixedUpdate");
        GameObject.Send("OnGUI");
        Console.Error.WriteLine(GUI.Shown);
        soft.transform.localScale = new Vector3(1f, 2f, 1f);
        soft.tool.localScale = Vector3.one;
        soft.gameObject.SetActive(false);
        soft.gameObject.SetActive(true);
        foreach (var words in Debug.Warnings) Console.Error.WriteLine(words);
    }
}
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return export_unity(exported_bodies.body("relaxation"), tmp_path_factory.mktemp("unity") / "organ")


@pytest.fixture(scope="module")
def played(package, tmp_path_factory):
    """What the scene of the sample printed: numbers (N, 3), and words."""
    compiler, runtime = require_program("mcs"), require_program("mono")
    folder = tmp_path_factory.mktemp("played")
    (folder / "Program.cs").write_text(MAIN, "utf-8")
    sources = [str(f) for f in (STANDINS, folder / "Program.cs", *package.folder.rglob("*.cs"))]
    built = subprocess.run(
        [compiler, "-langversion:6", "-warnaserror", f"-out:{folder / 'scene.exe'}", *sources],
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    where = {
        "LD_LIBRARY_PATH": str(package.folder / "Runtime" / "Plugins"),
        "RESOURCES": str(package.folder / "Runtime" / "Resources"),
        "HOME": str(folder),
        "PATH": os.environ["PATH"],
    }
    command = [runtime, str(folder / "scene.exe")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=where)
    assert done.returncode == 0, done.stderr
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=float), done.stderr


def test_a_scene_feels_the_force_in_its_own_frame(played):
    (force, pushed, *moved), _ = played
    organ, place = exported_bodies.body("relaxation"), np.array([[0.003, -0.004, 0.005]])
    np.testing.assert_allclose(force[[0, 2, 1]], organ.energy.force(place)[0], rtol=1e-5)
    assert not pushed.any()
    field = organ.fields["displacement"]
    expected = field.points + field.values(place)[0]
    largest = np.abs(field.values(place)).max()
    np.testing.assert_allclose(np.array(moved)[:, [0, 2, 1]], expected, atol=2e-4 * largest)


def test_the_sample_presses_and_warnings_say_what_does_not_fit(played):
    _, words = played
    shown, *warnings = words.splitlines()
    assert re.fullmatch(r"\d+\.\d+ N, Contact, Trusted", shown)
    assert any("is scaled" in line for line in warnings)
    assert any("has a diameter of 1" in line for line in warnings)


def test_a_sample_leads_its_tool_from_the_air_into_the_trained_body():
    for name in ("contact", "relaxation", "closed"):
        organ = exported_bodies.body(name)
        away, deep = (
            np.append(end, [(r.low + r.high) / 2 for r in organ.parameters])[None]
            for end in press_ends(organ)
        )
        assert organ.energy.depth(away)[0] < 0.0 < organ.energy.depth(deep)[0]
        assert organ.energy.inside(deep)[0]


def test_every_file_has_its_meta_file_and_what_is_named_is_there(package):
    folder = package.folder
    manifest = json.loads((folder / "package.json").read_text("utf-8"))
    assert (folder / manifest["samples"][0]["path"] / "PressSample.cs").is_file()
    identities = [re.search(r"guid: ([0-9a-f]{32})", f.read_text("utf-8"))[1] for f in folder.rglob("*.meta")]
    assert len(set(identities)) == len(identities)
    for path in folder.rglob("*"):
        hidden = any(part.startswith(".") or part.endswith("~") for part in path.relative_to(folder).parts)
        assert hidden or path.suffix == ".meta" or path.with_name(path.name + ".meta").is_file(), path
    assert not list(folder.rglob("*.c"))
    first = (folder / "README.md").read_text("utf-8").splitlines()[0]
    assert first == "Tried with Mono and stand-ins for Unity's types, not in the Unity editor."


def test_the_mesh_is_outward_in_the_frame_of_unity(tmp_path):
    """Unity's normals are (b − a) × (c − a) of its own coordinates: on a face that is pressed from above they go up."""
    from palpate.export.unity_export import _mesh_bytes

    field = exported_bodies.body("relaxation").fields["displacement"]
    data = _mesh_bytes(field)
    nodes, count = struct.unpack("<2i", data[:8])
    places = np.frombuffer(data[8 : 8 + 12 * nodes], "<f4").reshape(-1, 3)
    a, b, c = places[np.frombuffer(data[8 + 12 * nodes :], "<i4").reshape(count, 3)].transpose(1, 0, 2)
    ours = np.cross(
        *(field.points[field.triangles[:, k]] - field.points[field.triangles[:, 0]] for k in (1, 2))
    )
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, [0, 2, 1]], ours, atol=1e-6 * np.abs(ours).max())


def test_a_package_is_written_again_and_what_is_changed_stays(package, tmp_path):
    organ, out = pressed.surrogate(), tmp_path / "slab"
    export_unity(organ, out, check=False)
    export_unity(organ, out, check=False)
    (out / "README.md").write_text("mine", "utf-8")
    with pytest.raises(UsageError, match="was changed"):
        export_unity(organ, out, check=False)
    export_unity(organ, out, check=False, overwrite=True)
    assert "mine" not in (out / "README.md").read_text("utf-8")
    other = tmp_path / "other"
    other.mkdir()
    (other / "README.md").write_text("mine", "utf-8")
    with pytest.raises(UsageError, match="did not write it"):
        export_unity(organ, other, overwrite=True)


def test_damaged_weights_are_refused(package):
    library = engine_library()
    if library is None:
        pytest.skip("there is no library for this machine")
    block = next(f for f in package.files if f.name.endswith("weights.bytes")).read_bytes()
    with pytest.raises(UsageError, match="fault 2"):
        CheckEngine(library, block[:-1] + bytes([block[-1] ^ 1]))
