"""`palpate.load` gives back whatever a file holds; a body of 0.1.0 is refused with the command that learns it again."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from models import spring_beam
from palpate.errors import FileFormatError
from palpate.network import Archive, save_archive


@pytest.mark.full
def test_whatever_a_file_holds_comes_back_as_what_it_is(tmp_path):
    beam, x = spring_beam(), np.linspace(-1.0, 1.0, 30)[:, None]
    fitted = pp.fit(x, x**2, effort=0.05, workers=1)
    network = beam.energy.network
    for i, thing in enumerate((beam, fitted, network)):
        again = pp.load(thing.save(tmp_path / f"{i}.palpate"))
        assert type(again) is type(thing)
        if not isinstance(thing, pp.Fitted):  # what was tried is not kept
            assert str(again) == str(thing)
    np.testing.assert_array_equal(pp.load(tmp_path / "1.palpate").predict(x), fitted.predict(x))


@pytest.mark.parametrize("kind", ["touch", "held-body", "touched-body", "grasp-surrogate"])
def test_a_body_of_an_earlier_version_is_refused_with_the_command(tmp_path, kind):
    save_archive(tmp_path / "old.palpate", Archive({}, {}, {}, kind))
    with pytest.raises(FileFormatError) as caught:
        pp.load(tmp_path / "old.palpate")
    assert "palpate learn STUDY.toml" in caught.value.fix
