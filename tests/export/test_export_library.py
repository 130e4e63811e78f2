"""Wrappers of exported libraries: every function that they name is in the library, and frames turn as documented."""

from __future__ import annotations

import ctypes
import math
import re
import runpy
import subprocess
import sys

import numpy as np
import pytest

from exported_bodies import body
from palpate.export import export_lib
from palpate.surrogates.moving_rest import MovingRest
from system_programs import require_program


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    require_program("gcc")
    folder = tmp_path_factory.mktemp("organ")
    return export_lib(body("relaxation"), folder, compiler="gcc", check=False)


@pytest.mark.full
def test_every_function_of_every_wrapper_is_in_the_library(exported):
    library = ctypes.CDLL(str(exported.library))
    for file in exported.wrappers:
        names = set(re.findall(r"\borgan_[a-z_]+(?=\()", file.read_text("utf-8")))
        assert names or file.suffix in (".py", ".m")
        for name in names:
            assert getattr(library, name) is not None, (file, name)


def test_the_python_wrapper_needs_no_other_package(exported):
    code = f"import sys; sys.path.append({str(exported.library.parent)!r}); import organ; b = organ.Body()"
    code += "; print(b.force([0.0, 0.0, 0.005])[0], b.limits(), b.remembers)"
    command = [sys.executable, "-I", "-S", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "True" in done.stdout


@pytest.mark.full
def test_a_rod_that_is_let_go_lies_where_palpate_finds_it(tmp_path):
    require_program("gcc")
    rod, none = body("iwan"), np.zeros(0)
    done = export_lib(rod, tmp_path, compiler="gcc", check=False)
    out = runpy.run_path(str(tmp_path / "rod.py"))["Body"](str(done.library))
    evaluate, state = rod.energy.evaluator(), rod.memory.start()
    resting = MovingRest(evaluate, state, rod.energy.baseline.directions[0])
    stroke = 0.03 * np.sin(np.linspace(0.0, 4.0, 50))[:, None] * rod.energy.baseline.directions
    largest = 0.0
    for seconds in (0.0, 0.4):
        for place in stroke:
            evaluate(place, none)
            state.step(place, evaluate.amplitude, evaluate.slope, 0.01)
            largest = max(largest, np.abs(out.step(0.01, place)[0]).max())
        resting.lies[:] = stroke[-1]
        assert resting.release(seconds, none)
        place, flags = out.release(seconds, stroke[-1])
        size = np.linalg.norm(resting.lies)
        assert size > 1e-4
        assert not flags & 4
        np.testing.assert_allclose(place, resting.lies, rtol=0, atol=1e-9 * size)
        np.testing.assert_allclose(out.ledger[:2], [state.stored, state.lost], rtol=1e-9)
        np.testing.assert_allclose(out.step(0.0, place)[0], 0.0, atol=1e-9 * largest)
    assert out.release(math.nan, place)[1] & 4
    np.testing.assert_allclose(out.ledger[1], state.lost, rtol=1e-9)
    (tmp_path / "main.cpp").write_text('#include "rod_unreal.h"\nint main() { RodBody body; }\n', "utf-8")
    command = [require_program("g++", "clang++"), "-Wall", "-Werror", "-fsyntax-only", "main.cpp"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)


def test_the_wrapper_refuses_other_weights(exported, tmp_path):
    wrapper = (exported.library.parent / "organ.py").read_text("utf-8")
    (tmp_path / "organ.py").write_text(wrapper.replace(exported.sources.hash, "0" * 64), "utf-8")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import organ; organ.Body({str(exported.library)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "holds other weights" in done.stderr


def test_the_frame_of_unreal_is_left_handed_and_in_centimetres(exported, tmp_path):
    compiler = require_program("g++", "clang++")
    folder = exported.library.parent
    main = tmp_path / "main.cpp"
    main.write_text(
        """#include "organ_unreal.h"
        #include <cstdio>
        int main() {
          OrganBody body; int32_t flags;
          OrganBodyVector f = body.Force({0.3, 0.4, 0.5}, flags);
          OrganBodyVector g = body.Step({0.3, 0.4, 0.5}, 0.0, flags);
          std::printf("%.17g %.17g %.17g %.17g", f.X, f.Y, f.Z, g.Z);
        }""",
        "utf-8",
    )
    program = tmp_path / "unreal"
    command = [
        compiler,
        "-Wall",
        "-Werror",
        f"-I{folder}",
        str(main),
        str(exported.library),
        "-o",
        str(program),
    ]
    subprocess.run(command, check=True, capture_output=True)
    done = subprocess.run(
        [program], capture_output=True, text=True, check=True, env={"LD_LIBRARY_PATH": str(folder)}
    )
    x, y, z, stepped = map(float, done.stdout.split())
    force = body("relaxation").energy.force(np.array([[0.003, -0.004, 0.005]]))[0]
    np.testing.assert_allclose([x, -y, z], force, rtol=1e-12)
    assert stepped == pytest.approx(z, rel=1e-9)


UNITY = """
namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float a, float b, float c) { x = a; y = b; z = c; }
        public static Vector3 zero { get { return new Vector3(0, 0, 0); } }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
    }
}
"""  # as much of Unity as the file uses, with its meaning

UNITY_MAIN = """
using System;
using UnityEngine;
public static class Program
{
    static void Print(Vector3 v)
    {
        var c = System.Globalization.CultureInfo.InvariantCulture;
        Console.WriteLine(string.Format(c, "{0:R} {1:R} {2:R}", v.x, v.y, v.z));
    }
    public static void Main()
    {
        var body = new OrganBody();
        OrganBody.Flags flags;
        var place = new Vector3(0.003f, 0.005f, -0.004f);
        Print(body.Force(place, out flags));
        Print(body.Step(place, 0f, out flags));
        var moved = new Vector3[COUNT];
        body.Deform(place, new Vector3[COUNT], moved);
        foreach (var v in moved) Print(v);
    }
}
"""


def test_the_csharp_file_runs_with_the_frame_of_unity_and_deforms_vertices(exported, tmp_path):
    compiler, runtime = require_program("mcs"), require_program("mono")
    organ = body("relaxation")
    count = len(organ.fields["displacement"].points)
    (tmp_path / "Unity.cs").write_text(UNITY, "utf-8")
    (tmp_path / "Program.cs").write_text(UNITY_MAIN.replace("COUNT", str(count)), "utf-8")
    wrapper = exported.library.parent / "OrganBody.cs"
    sources = [str(f) for f in (tmp_path / "Unity.cs", tmp_path / "Program.cs", wrapper)]
    command = [compiler, "-warnaserror", f"-out:{tmp_path / 'unity.exe'}", *sources]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr
    where = {"LD_LIBRARY_PATH": str(exported.library.parent), "HOME": str(tmp_path)}
    done = subprocess.run(
        [runtime, str(tmp_path / "unity.exe")], capture_output=True, text=True, check=False, env=where
    )
    assert done.returncode == 0, done.stderr
    force, stepped, *moved = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    place = np.array([[0.003, -0.004, 0.005]])
    np.testing.assert_allclose(force[[0, 2, 1]], organ.energy.force(place)[0], rtol=1e-6)
    np.testing.assert_allclose(stepped, force, rtol=1e-6)
    expected = organ.fields["displacement"].values(place)[0]
    np.testing.assert_allclose(np.array(moved)[:, [0, 2, 1]], expected, atol=2e-4 * np.abs(expected).max())
