"""`palpate export c|lib|fmu` on files: what is written, what is compared, and what is refused."""

from __future__ import annotations

import json

import pytest

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


def test_a_network_goes_out_as_c_alone(palpate, tmp_path):
    require_program("gcc")
    file = networks()[1].save(tmp_path / "map.palpate")
    answer = palpate("export", "c", file, "--out", tmp_path / "map", "--name", "map", "--compiler", "gcc")
    assert answer.code == 0, answer.err
    assert "derivatives" in answer.out
    for kind in ("lib", "fmu"):
        answer = palpate("export", kind, file, "--out", tmp_path / kind)
        assert answer.code == 2
        assert "holds a network alone" in answer.err
        assert not (tmp_path / kind).exists()


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
