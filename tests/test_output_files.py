"""Files for other tools: a later export replaces its own, and nobody else's."""

from __future__ import annotations

import os

import pytest

from palpate.errors import UsageError
from palpate.files import write_file
from palpate.output_files import free_path, is_own, require_outputs, with_seal
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
    for changed in (written.replace("some", "same"), written + "more\n", "more\n" + written):
        file.write_text(changed, "utf-8", newline="\n")
        assert not is_own(file)
        with pytest.raises(UsageError, match="exists already"):
            require_outputs([file])
        require_outputs([file], overwrite=True)


FOREIGN = {
    **dict.fromkeys(("a.h", "a.md", "a.html", "a.toml", "a.vtu"), b"some text\n"),
    "a.glb": b"glTF\x02\0\0\0" + b'{"asset":{"generator":"a scanner"}}',
    "a.stl": b"a scan".ljust(84, b"\0"),
    "a.touch": b"some text\n",
    "a.svg": b"<svg/>",
    "a.fmu": b"PK",
}


@pytest.mark.parametrize("name", FOREIGN)
def test_nobody_elses_file_is_replaced_even_where_that_is_asked(tmp_path, name):
    file = tmp_path / name
    file.write_bytes(FOREIGN[name])
    with pytest.raises(UsageError, match="palpate did not write it"):
        require_outputs([file], overwrite=True)
    assert free_path(file) == tmp_path / f"a-2{file.suffix}"


def test_a_table_is_replaced_where_that_is_asked_unless_it_is_read(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("x,y\n1,2\n", "utf-8")
    with pytest.raises(UsageError, match="exists already"):
        require_outputs([table])
    require_outputs([table], overwrite=True)
    with pytest.raises(UsageError, match="is read here"):
        require_outputs([table], inputs=[table], overwrite=True)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_stays_a_pipe_and_the_target_of_a_link_stays(tmp_path):
    pipe, target, link = tmp_path / "pipe.csv", tmp_path / "target.csv", tmp_path / "link.csv"
    os.mkfifo(pipe)
    for attempt in (lambda: require_outputs([pipe], overwrite=True), lambda: write_file(pipe, "text")):
        with pytest.raises(UsageError, match="a device, a pipe or a socket"):
            attempt()
    assert pipe.is_fifo()
    target.write_text("mine", "utf-8")
    link.symlink_to(target)
    write_file(link, "text")
    assert target.read_text("utf-8") == "mine"


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
