"""Datasets as values and as Zarr stores on disk."""

import json
import shutil

import numpy as np
import pytest

from palpate.dataset import Dataset, Layout, assemble
from palpate.errors import FileFormatError, UsageError
from palpate.units import Range

RANGES = (Range("P", 0.0, 5.0, "N"), Range("Q", -1.0, 1.0, "N"))
NODES = 4


def make(count=20, failed=(), seed=0):
    rng = np.random.default_rng(seed)
    layout = Layout(
        rest=np.column_stack([np.linspace(0, 1, NODES), np.zeros(NODES)]),
        of_interest=np.array([True, False, False, True]),
        load_nodes=(3, 2),
        load_directions=((0.0, -1.0), (1.0, 0.0)),
    )
    answers = {
        "displacement": rng.normal(size=(count, NODES, 3)),
        "root_reaction": rng.normal(size=(count, 3)),
        "strain_energy": rng.random(count),
        "potential_energy": -rng.random(count),
        "converged": np.ones(count, dtype=bool),
        "iterations": rng.integers(1, 9, count),
        "residual": 1e-12 * rng.random(count),
        "message": np.full(count, "converged", dtype=object),
        "solve_seconds": rng.random(count),
    }
    for row in failed:
        answers["converged"][row] = False
        answers["displacement"][row] = np.nan
        answers["message"][row] = "buckled – ε too large"
    inputs = rng.random((count, 2)) * (5, 2) - (0, 1)
    return assemble(RANGES, layout, inputs, answers, {"config_hash": "abc", "seed": seed})


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "answers.zarr"
    make(failed=(3,)).save(path)
    return path


def same(one, other):
    return one.hash == other.hash and one.data.identical(other.data)


def test_a_store_gives_back_what_was_saved(stored):
    original, opened = make(failed=(3,)), Dataset.open(stored)
    assert same(opened, original)
    assert opened.ranges == RANGES
    assert opened.provenance == original.provenance
    assert opened.data["message"].values[3] == "buckled – ε too large"
    np.testing.assert_array_equal(opened.displacement, original.displacement)
    np.testing.assert_array_equal(opened.nodes_of_interest, [0, 3])
    np.testing.assert_array_equal(opened.load_nodes, [3, 2])
    np.testing.assert_array_equal(opened.load_directions, [[0, -1], [1, 0]])


def test_others_can_read_the_store(stored):
    import xarray

    data = xarray.open_zarr(stored, consolidated=False, chunks=None)
    assert data["displacement"].dims == ("sample", "node", "component")
    assert data["displacement"].attrs["units"] == "m, m, rad"
    assert list(data["component"].values) == ["u_x", "u_y", "rotation"]
    assert float(data["inputs"].sel(input="P").max()) <= 5.0


def test_arrays_are_read_only_and_the_value_has_a_face():
    data = make(failed=(1, 2))
    for values in (data.X, data.displacement, data.rest):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 1
    text = str(data)
    assert "20 solves" in text
    assert "2 did not converge" in text
    assert "P 0 … 5 N" in text
    assert data.hash[:12] in text


def test_ok_take_and_every():
    data = make(failed=(0, 7))
    assert len(data.ok) == 18
    assert np.isfinite(data.ok.displacement).all()
    np.testing.assert_array_equal(data.take([4, 1]).X, data.X[[4, 1]])
    np.testing.assert_array_equal(data.every(2, 1).X, data.X[1::2])
    np.testing.assert_array_equal(data.every(3).data["sample"], np.arange(0, 20, 3))
    with pytest.raises(UsageError):
        data.take([20])
    with pytest.raises(UsageError):
        data.every(0)


@pytest.mark.parametrize("share", [0.01, 0.25, 0.5, 0.99])
def test_a_split_parts_the_converged_rows(share):
    data = make(failed=(5,))
    train, test = data.split(share, seed=3)
    rows = np.concatenate([train.data["sample"], test.data["sample"]])
    assert len(train) >= 1
    assert abs(len(test) - share * 19) <= 1
    np.testing.assert_array_equal(np.sort(rows), np.setdiff1d(np.arange(20), [5]))
    assert same(data.split(share, seed=3)[0], train)
    if 1 < len(test) < 18:
        assert not same(data.split(share, seed=4)[0], train)


@pytest.mark.parametrize("share", [0.0, 1.0, -1, 2])
def test_a_split_needs_a_share(share):
    with pytest.raises(UsageError):
        make().split(share)


def test_a_split_of_one_row_is_refused():
    with pytest.raises(UsageError):
        make().take([0]).split()


def test_the_hash_is_of_the_answers_not_of_the_timings():
    data = make()
    assert Dataset(data.data.assign(solve_seconds=data.data["solve_seconds"] * 2)).hash == data.hash
    assert Dataset(data.data.assign(displacement=data.data["displacement"] + 1e-16)).hash != data.hash
    assert make(seed=1).hash != data.hash


@pytest.mark.full
def test_saving_again_is_harmless_and_other_data_are_refused(stored):
    make(failed=(3,)).save(stored)
    with pytest.raises(UsageError, match="exists already"):
        make(seed=1).save(stored)
    assert same(Dataset.open(stored), make(failed=(3,)))
    make(seed=1).save(stored, overwrite=True)
    assert same(Dataset.open(stored), make(seed=1))
    assert [p.name for p in stored.parent.iterdir()] == [stored.name]


def test_overwriting_spares_what_is_no_store(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("…", encoding="utf-8")
    with pytest.raises(UsageError):
        make().save(tmp_path / "thesis", overwrite=True)
    # a Zarr store of another program
    (tmp_path / "thesis" / "zarr.json").write_text(
        '{"zarr_format": 3, "node_type": "group"}', encoding="utf-8"
    )
    with pytest.raises(UsageError, match="no dataset of palpate"):
        make().save(tmp_path / "thesis", overwrite=True)
    assert (tmp_path / "thesis" / "chapter1.tex").exists()
    assert len(list(tmp_path.iterdir())) == 1


def chunk_of(path, name="displacement"):
    return next(file for file in sorted((path / name / "c").rglob("*")) if file.is_file())


def truncate(path):
    file = chunk_of(path)
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def garble(path):
    file = chunk_of(path)
    content = bytearray(file.read_bytes())
    content[len(content) // 2 : len(content) // 2 + 8] = b"\xff" * 8
    file.write_bytes(content)


def flip_one_bit_of_the_text(path):
    file = chunk_of(path, "iterations")
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)


def empty_a_chunk(path):
    chunk_of(path).write_bytes(b"")


def lose_a_chunk(path):
    chunk_of(path).unlink()


def lose_a_variable(path):
    shutil.rmtree(path / "inputs")


def garble_metadata(path):
    (path / "displacement" / "zarr.json").write_text("{", encoding="utf-8")


def garble_root(path):
    (path / "zarr.json").write_bytes(b"\x00\xff\x13")


def edit_metadata(path, change):
    file = path / "zarr.json"
    metadata = json.loads(file.read_text(encoding="utf-8"))
    change(metadata)
    file.write_text(json.dumps(metadata), encoding="utf-8")


def drop_attributes(path):
    edit_metadata(path, lambda metadata: metadata.pop("attributes"))


def strange_attributes(path):
    edit_metadata(path, lambda metadata: metadata.update(attributes=[1]))


def rewrite_history(path):
    edit_metadata(path, lambda metadata: metadata["attributes"].update(provenance='{"seed": 7}'))


def lose_the_checksum(path):
    edit_metadata(path, lambda metadata: metadata["attributes"].pop("checksum"))


DAMAGES = [
    truncate,
    garble,
    flip_one_bit_of_the_text,
    empty_a_chunk,
    lose_a_chunk,
    lose_a_variable,
    garble_metadata,
    garble_root,
    drop_attributes,
    strange_attributes,
    rewrite_history,
    lose_the_checksum,
]


@pytest.mark.grid
@pytest.mark.parametrize("damage", DAMAGES)
def test_every_damage_is_noticed_and_named(stored, damage):
    damage(stored)
    with pytest.raises(FileFormatError, match="corrupt") as caught:
        Dataset.open(stored)
    assert "answers.zarr" in str(caught.value)


def test_what_a_file_manager_leaves_behind_is_no_damage(stored):
    (stored / ".DS_Store").write_bytes(b"Bud1")
    (stored / "desktop.ini").write_text("[.ShellClassInfo]")
    (stored / ".ipynb_checkpoints").mkdir()
    assert same(Dataset.open(stored), make(failed=(3,)))


def test_a_variable_without_metadata_is_damage(stored):
    (stored / "displacement" / "zarr.json").unlink()
    with pytest.raises(FileFormatError, match=r"displacement has no zarr\.json"):
        Dataset.open(stored)


def test_a_missing_store_is_named(tmp_path):
    with pytest.raises(FileFormatError, match=r"nothing\.zarr"):
        Dataset.open(tmp_path / "nothing.zarr")


def test_foreign_things_are_refused(tmp_path):
    (tmp_path / "a.txt").write_text("hello", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    import zarr

    zarr.create_group(tmp_path / "foreign.zarr")
    for name in ("a.txt", "folder", "foreign.zarr"):
        with pytest.raises(FileFormatError, match="no dataset of palpate"):
            Dataset.open(tmp_path / name)


def test_the_largest_strain_is_kept_and_told(tmp_path):
    plain = make()
    strained = Dataset(plain.data.assign(largest_strain=("sample", np.linspace(0, 0.012, 20))))
    strained.save(tmp_path / "a.zarr")
    opened = Dataset.open(tmp_path / "a.zarr")
    np.testing.assert_array_equal(opened.largest_strain, np.linspace(0, 0.012, 20))
    assert "largest fibre strain 1.2 %" in str(opened)


def test_a_dataset_without_strains_is_read_and_joined(stored):
    there = Dataset.open(stored)
    plain = Dataset(there.data.assign_attrs(provenance=json.dumps({"problem": {}})))
    assert np.isnan(plain.largest_strain).all()
    assert "fibre strain" not in str(plain)
    strained = Dataset(plain.data.assign(largest_strain=("sample", np.full(20, 0.01))))
    for parts, known in (((plain, strained), slice(20, 40)), ((strained, plain), slice(0, 20))):
        found = Dataset.concat(parts).largest_strain
        np.testing.assert_array_equal(np.flatnonzero(np.isfinite(found)), np.arange(40)[known])


@pytest.mark.grid
@pytest.mark.parametrize("version", [4, 99, "1", None])
def test_a_later_format_asks_for_a_newer_palpate(stored, version):
    edit_metadata(stored, lambda metadata: metadata["attributes"].update(format_version=version))
    with pytest.raises(FileFormatError, match="format version") as caught:
        Dataset.open(stored)
    assert "newer" in caught.value.fix
