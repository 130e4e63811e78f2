"""The size of a study's elements, chosen by touches on two meshes, and the touches that tell the mesh's part."""

from __future__ import annotations

from pathlib import Path

import pytest

from few_solves import BLOCK, FEW_SOLVES
from palpate.study import read_study
from palpate.study.mesh_check import load_finer, mesh_part, refine_study, solve_finer
from palpate.study.run import Paths
from palpate.sweeps import local_cluster, sweep


@pytest.mark.full
@pytest.mark.timeout(300)
def test_elements_become_smaller_where_the_mesh_errs_too_much(tmp_path: Path) -> None:
    """Elements of 12 mm don't feel a ball of 8 mm; the study's file says the new size, and keeps all else."""
    file = tmp_path / "tiny.toml"
    file.write_text(BLOCK + FEW_SOLVES, encoding="utf-8")
    study, words = read_study(file), []
    with local_cluster(1) as cluster:
        finer = refine_study(study, file, cluster=cluster, progress=False, log=words.append)
    assert finer.sweep.element == pytest.approx(0.006)
    assert "the mesh's part is" in words[-1]
    assert read_study(file) == finer
    assert finer.model_copy(update={"sweep": study.sweep}) == study


@pytest.mark.full
@pytest.mark.timeout(300)
def test_finer_solves_are_kept_beside_the_study_until_it_changes(tmp_path: Path) -> None:
    file = tmp_path / "tiny.toml"
    file.write_text(BLOCK + FEW_SOLVES, encoding="utf-8")
    study, paths, words = read_study(file), Paths(tmp_path, "tiny"), []
    with local_cluster(1) as cluster:
        options = {"cluster": cluster, "progress": False}
        unseen = sweep(study.problem(), points=study.test.arguments(study.problem())["points"], **options)
        first = solve_finer(study, paths, unseen, log=words.append, **options)
        again = solve_finer(study, paths, unseen, log=words.append, **options)
    assert len(words) == 1
    assert first.hash == again.hash
    assert mesh_part(unseen, again) > 0.1
    none = study.model_copy(update={"test": study.test.model_copy(update={"finer": 0})})
    assert solve_finer(none, paths, unseen) is None
    stiffer = study.model_copy(update={"interaction": study.interaction.model_copy(update={"pad": 1e7})})
    assert load_finer(stiffer, paths) is None


def test_elements_of_a_sweep_that_has_begun_stay(tmp_path):
    paths = Paths(tmp_path, "block")
    assert not paths.is_begun
    for ending in ("", ".parts", ".batch"):  # done, cut off in a design, cut off in a chosen batch
        (tmp_path / f"block.zarr{ending}").mkdir()
        assert paths.is_begun
        (tmp_path / f"block.zarr{ending}").rmdir()
