"""`palpate export c|lib|fmu` on files: what is written, what is compared, and what is refused."""

from __future__ import annotations

import json
import shutil
import subprocess

import pytest

from answering import answering
from exported_bodies import body, networks
from system_programs import require_program


@pytest.fixture(scope="module")
def pad(tmp_path_factory):
    return body("pad").save(tmp_path_factory.mktemp("pad") / "pad.palpate")


@pytest.mark.parametrize("words", [("c",), ("lib",), ("fmu",), ("fmu", "--fmi", "3.0")])
def test_a_body_goes_out_and_is_compared(words, palpate, pad, tmp_path):
    require_program("gcc")
    out = tmp_path / ("pad.fmu" if words[0] == "fmu" else "out")
    answer = palpate("export", *words, pad, "--out", out, "--json")
    assert answer.code == 0, answer.err
    said = json.loads(answer.out)
    assert out.exists()
    assert set(said["compared"]) >= {"energy", "force", "stiffness", "flags"}
    assert len(said["hash"]) == 64
    assert said.get("fmi") == {("fmu",): "2.0", ("fmu", "--fmi", "3.0"): "3.0"}.get(words)


def test_a_memory_without_model_exchange_is_named(palpate, tmp_path):
    file = body("indentation").save(tmp_path / "clay.palpate")
    answer = palpate("export", "fmu", file, "--out", tmp_path / "clay.fmu", "--no-check")
    assert answer.code == 0, answer.err
    assert "co-simulation alone because of the memory 'indentation'" in answer.out


@pytest.mark.full
def test_a_network_goes_out_as_c_library_and_fmu(palpate, tmp_path):
    require_program("gcc")
    file = networks()[1].save(tmp_path / "map.palpate")
    answer = palpate("export", "c", file, "--out", tmp_path / "map", "--name", "map", "--compiler", "gcc")
    assert answer.code == 0, answer.err
    assert "derivatives" in answer.out
    line = answer.err.splitlines()[-1].removeprefix("Next: ").replace("cc ", "gcc ", 1)
    subprocess.run(
        line, shell=True, check=True, cwd=tmp_path
    )  # the line that is printed compiles and runs it
    for kind, place in (("lib", "lib"), ("fmu", "map.fmu")):
        answer = palpate("export", kind, file, "--out", tmp_path / place)
        assert answer.code == 0, answer.err
        assert "largest relative differences" in answer.out
        assert (tmp_path / place).exists()


def test_a_model_without_touch_goes_out_as_a_page(palpate, tmp_path):
    file = answering(fields=False).save(tmp_path / "rod.palpate")
    answer = palpate("export", "html", file)
    assert answer.code == 0, answer.err
    assert "largest relative differences" in answer.out, "it was compared with palpate"
    assert 'data-mode="answers"' in (tmp_path / "rod-page.html").read_text(encoding="utf-8")


def test_bad_names_and_fields_are_refused(palpate, pad, tmp_path):
    for words, said in (
        (("--name", "7pads"), "begin the names"),
        (("--field", "stress"), "no field 'stress'"),
    ):
        answer = palpate("export", "c", pad, "--out", tmp_path / "out", *words)
        assert answer.code == 2
        assert said in answer.err
    assert not (tmp_path / "out").exists()


def test_nothing_is_compared_where_that_is_not_asked(palpate, pad, tmp_path):
    answer = palpate("export", "c", pad, "--out", tmp_path / "out", "--no-check", "--float", "--no-deviation")
    assert answer.code == 0, answer.err
    assert "not compared with palpate: not asked for" in answer.err
    assert "typedef float pad_real;" in (tmp_path / "out" / "pad.h").read_text("utf-8")


def test_names_are_those_of_the_file_and_lie_beside_it(palpate, pad, tmp_path):
    file = shutil.copy(pad, tmp_path / "my-liver.palpate")
    for kind in ("c", "fmu", "html"):
        answer = palpate("export", kind, file, "--no-check")
        assert answer.code == 0, answer.err
    assert (tmp_path / "my-liver" / "my_liver.h").exists()
    assert {f.name for f in tmp_path.iterdir()} == {
        "my-liver.palpate",
        "my-liver",
        "my-liver.fmu",
        "run_fmu.py",
        "my-liver-page.html",
    }


@pytest.mark.full
def test_an_export_replaces_its_own_files_and_no_others(palpate, pad, tmp_path):
    require_program("gcc")
    file = shutil.copy(pad, tmp_path / "pad.palpate")
    report = tmp_path / "pad.html"
    report.write_text("<html>the report of palpate validate</html>")
    for kind, written in (
        ("c", "pad/example.c"),
        ("lib", "pad/pad.py"),
        ("fmu", "pad.fmu"),
        ("onnx", "pad.onnx"),
        ("html", "pad-page.html"),
    ):
        for _ in range(2):  # the second one replaces the files of the first
            answer = palpate("export", kind, file, "--no-check")
            assert answer.code == 0, answer.err
        own = tmp_path / written
        if own.suffix not in {".fmu", ".onnx"}:  # of a text it is known that somebody changed it
            own.write_bytes(own.read_bytes() + b"my own work")
            answer = palpate("export", kind, file, "--no-check")
            assert answer.code == 2
            assert "replace it with --force" in answer.err
            answer = palpate("export", kind, file, "--no-check", "--force")
            assert answer.code == 0, answer.err
            assert b"my own work" not in own.read_bytes()
        own.write_text("my own work")
        for more in ((), ("--force",)):
            answer = palpate("export", kind, file, "--no-check", *more)
            assert answer.code == 2
            assert "exists already, and palpate did not write it" in answer.err
            assert own.read_text() == "my own work"
        own.unlink()
    assert "palpate validate" in report.read_text()


@pytest.mark.full
def test_wrong_places_endings_and_compilers_are_refused(palpate, pad, tmp_path):
    (tmp_path / "file").touch()
    for words, said in (
        (("c", "--out", tmp_path / "file"), "is a file"),
        (("c", "--out", tmp_path / "no" / "folder"), "does not exist"),
        (("c", "--out", tmp_path / "out", "--compiler", "nosuchcc"), "no compiler 'nosuchcc'"),
        (("lib", "--out", tmp_path / "out", "--compiler", "nosuchcc"), "no compiler 'nosuchcc'"),
        (("fmu", "--out", tmp_path / "pad.onnx"), "does not end in .fmu"),
        (("onnx", "--out", tmp_path / "pad.fmu"), "does not end in .onnx"),
        (("html", "--out", tmp_path / "no" / "pad.html"), "does not exist"),
        (("html", "--out", tmp_path), "is a folder"),
    ):
        answer = palpate("export", *words[:1], pad, *words[1:])
        assert answer.code == 2, words
        assert said in answer.err
    assert [f.name for f in tmp_path.iterdir()] == ["file"]
