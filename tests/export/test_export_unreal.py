"""The plugin for Unreal: compiled with g++ and stand-ins for Unreal's types, its component ticks and presses."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from exported_bodies import body
from palpate.export.unreal_export import export_unreal
from system_programs import require_program

STANDINS = Path(__file__).parent / "unreal_standins.h"
HEADERS = (
    "CoreMinimal.h",
    "ProceduralMeshComponent.h",
    "GameFramework/Actor.h",
    "Components/PrimitiveComponent.h",
    "Modules/ModuleManager.h",
    "Math/Vector.h",
)
MAIN = """
#include "{module}Component.h"
static void print(const FVector& v) {{ std::printf("%.17g %.17g %.17g\\n", v.X, v.Y, v.Z); }}
int main()
{{
    static U{module}Component component;
    AActor tool;
    component.Frame.Shift = FVector(5, 6, 7);
    component.BeginPlay(); /* without a tool */
    component.Tool = &tool;
    component.BeginPlay();
    tool.Place = component.Frame.TransformVectorNoScale(FVector(0.3, 0.4, 0.5)) + component.Frame.Shift;
    component.TickComponent(0.0f, LEVELTICK_All, nullptr);
    print(component.Force);
    print(tool.Root.Pushed);
    for (const FVector& v : component.Vertices) print(v);
    for (const FVector& v : component.Directions) print(v);
}}
"""
RULES = """
namespace UnrealBuildTool
{
    public class ReadOnlyTargetRules { }
    public class ModuleRules
    {
        public enum PCHUsageMode { UseExplicitOrSharedPCHs }
        public PCHUsageMode PCHUsage;
        public bool bUseUnity;
        public readonly System.Collections.Generic.List<string> PublicDependencyModuleNames =
            new System.Collections.Generic.List<string>();
        public ModuleRules(ReadOnlyTargetRules target) { }
    }
}
"""


def ticked(plugin: Path, module: str, folder: Path) -> np.ndarray:
    """Compile the plugin without a warning, and return what its component told (N, 3)."""
    compiler, c = require_program("g++", "clang++"), require_program("gcc", "clang")
    for name in (*HEADERS, f"{module}Component.generated.h"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f'#include "{STANDINS}"\n', "utf-8")
    (folder / "main.cpp").write_text(MAIN.format(module=module), "utf-8")
    source = plugin / "Source" / module
    places = [f"-I{folder}", f"-I{source / 'Public'}", f"-I{source / 'Private'}"]
    words = ["-Wall", "-Wextra", "-Werror", "-O1", *places, f"-D{module.upper()}_API="]
    objects = []
    for file in sorted(source.rglob("*.c")):
        objects.append(str(folder / f"{file.stem}.o"))
        subprocess.run(
            [c, "-std=c99", *words, "-c", str(file), "-o", objects[-1]], check=True, capture_output=True
        )
    sources = [str(f) for f in (folder / "main.cpp", *sorted(source.rglob("*.cpp")))]
    command = [
        compiler,
        "-std=c++20",
        "-D__UNREAL__=1",
        *words,
        *sources,
        *objects,
        "-o",
        str(folder / "level"),
    ]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([folder / "level"], capture_output=True, text=True, check=True)
    assert "has no tool" in done.stderr
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=float)


def test_a_component_feels_the_force_and_shows_the_shape_in_its_own_frame(tmp_path):
    organ = body("relaxation")
    done = export_unreal(organ, tmp_path / "plugin")
    force, pushed, *shown = ticked(done.folder, "PalpateOrgan", tmp_path / "build")
    place = np.array([[0.003, -0.004, 0.005]])
    expected = organ.energy.force(place)[0] * [1, -1, 1]
    turned = np.array([-expected[1], expected[0], expected[2]])
    np.testing.assert_allclose(force, turned, rtol=1e-9)
    np.testing.assert_allclose(pushed, 100.0 * turned, rtol=1e-9)  # kg cm/s²
    field, count = organ.fields["displacement"], len(organ.fields["displacement"].points)
    moved, normals = np.array(shown[:count]), np.array(shown[count:])
    u = field.values(place)[0]
    places = 100.0 * (field.points + u) * [1, -1, 1]
    np.testing.assert_allclose(moved, places, atol=0.02 * np.abs(u).max())  # 2e-4 of it, in cm
    corners = (field.points + u)[field.triangles]
    slopes = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.zeros_like(u)
    for k in range(3):
        np.add.at(outward, field.triangles[:, k], slopes)
    used = np.unique(field.triangles)
    outward = outward[used] / np.linalg.norm(outward[used], axis=1, keepdims=True)
    assert ((normals[used] * [1, -1, 1] * outward).sum(axis=1) > 0.99).all()


@pytest.mark.full
@pytest.mark.parametrize(("name", "module"), [("closed", "PalpateEgg"), ("iwan", "PalpateRod")])
def test_bodies_without_a_shape_or_with_a_moving_rest_compile_too(name, module, tmp_path):
    done = export_unreal(body(name), tmp_path / "plugin", check=False)
    assert len(ticked(done.folder, module, tmp_path / "build")) == 2


def test_the_descriptor_names_the_module_and_its_rules_compile(tmp_path):
    done = export_unreal(body("contact"), tmp_path / "plugin", check=False)
    described = json.loads((done.folder / "PalpateBlock.uplugin").read_text("utf-8"))
    (module,) = (m["Name"] for m in described["Modules"])
    rules = done.folder / "Source" / module / f"{module}.Build.cs"
    (tmp_path / "rules.cs").write_text(RULES, "utf-8")
    command = [require_program("mcs"), "-target:library", f"-out:{tmp_path / 'rules.dll'}"]
    built = subprocess.run(
        [*command, str(tmp_path / "rules.cs"), str(rules)], capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stdout
    first = (done.folder / "README.md").read_text("utf-8").splitlines()[0]
    assert first == "Compiled with g++ and stand-ins for Unreal's types, not in the Unreal editor."
