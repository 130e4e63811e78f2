"""The house keeps its shape: public names exist, start-up stays light, files stay short."""

from __future__ import annotations

import importlib
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import palpate

PACKAGE = Path(palpate.__file__).parent


def modules() -> list[str]:
    return [
        m.name
        for m in pkgutil.walk_packages([str(PACKAGE)], "palpate.")
        if not m.name.endswith(("__main__", ".client"))
    ]


@pytest.mark.parametrize("name", modules())
def test_every_public_name_exists(name):
    module = importlib.import_module(name)
    for public in getattr(module, "__all__", []):
        assert getattr(module, public) is not None


@pytest.mark.parametrize("stub", sorted(PACKAGE.rglob("__init__.pyi")), ids=lambda p: p.parent.name)
def test_a_stub_lists_what_its_package_offers(stub):
    """The `.pyi` file is the one list of a package whose names load late; a moved module is renamed there too."""
    package = importlib.import_module(".".join(["palpate", *stub.parent.relative_to(PACKAGE).parts]))
    listed = re.findall(r"^from \.\S* import (\w+) as (\w+)$", stub.read_text(encoding="utf-8"), re.MULTILINE)
    assert all(name == alias for name, alias in listed)
    assert sorted(name for name, _ in listed) == package.__all__ == sorted(set(package.__all__))
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = package.no_such_name


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import palpate", ("numpy",)),
        (
            "import palpate.cli",
            ("numpy", "numba", "ngsolve", "matplotlib", "distributed", "xarray", "pydantic"),
        ),
        ("import palpate.study", ("matplotlib", "distributed", "uvicorn")),
        ("import palpate.viewer", ("ngsolve", "matplotlib", "distributed", "xarray", "pydantic")),
    ],
)
def test_heavy_packages_wait_until_they_are_needed(code, absent):
    probe = f"{code}\nimport sys\nprint([m for m in {absent!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_files_stay_readable():
    long = {
        str(p.relative_to(PACKAGE)): n
        for p in PACKAGE.rglob("*.py")
        if (n := len(p.read_text(encoding="utf-8").splitlines())) > 500
    }
    assert long == {}


def test_the_package_is_typed_and_its_version_is_one():
    import tomllib

    assert (PACKAGE / "py.typed").exists()
    project = Path(__file__).parents[2] / "pyproject.toml"
    assert tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"] == palpate.__version__
