"""Files for other tools: a later export replaces its own, and nobody else's."""

from __future__ import annotations

import pytest

from palpate.errors import UsageError
from palpate.output_files import is_own, require_outputs, with_seal
from palpate.surrogates.model_card import card_of


@pytest.mark.parametrize(
    "name", ["a.h", "a.c", "a.py", "A.cs", "CMakeLists.txt", "a.m", "a.md", "a.html", "a.vtu"]
)
def test_a_text_is_its_own_until_a_letter_of_it_changes(tmp_path, name):
    file = tmp_path / name
    for text in ("some text", "some text\n", ""):
        file.write_text(with_seal(name, text), "utf-8", newline="\n")
        assert file.read_text("utf-8").startswith(text)
        assert is_own(file)
        require_outputs([file])
    written = with_seal(name, "some text\n")
    for changed in (
        "some text\n",
        written.replace("some", "same"),
        written + "more\n",
        "more\n" + written,
        "",
    ):
        file.write_text(changed, "utf-8", newline="\n")
        assert not is_own(file)
        with pytest.raises(UsageError, match="exists already"):
            require_outputs([file])
        require_outputs([file], overwrite=True)


@pytest.mark.parametrize(
    "name", ["a.glb", "a.onnx", "a.fmu", "liba.so", "a.json", "a.csv", "a.parquet", "a.nc"]
)
def test_somebody_elses_file_is_not_palpates(tmp_path, name):
    for content in (b"", b'{"name": "a"}', b"[1]", b"PK\x03\x04 palpate", b"a,b\n1,2\n"):
        (tmp_path / name).write_bytes(content)
        assert not is_own(tmp_path / name)


def test_a_card_is_known_by_its_format(tmp_path, body_card):
    (tmp_path / "card.json").write_text(body_card, "utf-8")
    assert is_own(tmp_path / "card.json")


@pytest.fixture
def body_card():
    from exported_bodies import body

    return card_of(body("pad")).to_json()


def test_names_that_can_not_be_written_to_are_refused(tmp_path):
    (tmp_path / "file.fmu").touch()
    (tmp_path / "folder.fmu").mkdir()
    for files, options, said in (
        (["a.onnx"], {"endings": (".fmu",)}, r"does not end in \.fmu"),
        (["folder.fmu"], {"endings": (".c",), "overwrite": True}, "is a folder"),
        (["missing/a.fmu"], {}, "missing does not exist"),
        (["file.fmu/a.c"], {"folder": "file.fmu"}, "is a file"),
        (["missing/out/a.c"], {"folder": "missing/out"}, "missing does not exist"),
    ):
        if "folder" in options:
            options |= {"folder": tmp_path / options["folder"]}
        with pytest.raises(UsageError, match=said):
            require_outputs([tmp_path / file for file in files], **options)
    require_outputs([tmp_path / "out" / "a.c"], folder=tmp_path / "out")
