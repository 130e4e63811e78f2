"""Packed tables come back bit for bit, and damaged ones are refused."""

import numpy as np
import pytest

from palpate.network.packing import pack, unpack, whole_multiples

RNG = np.random.default_rng(0)
TABLES = {
    "arbitrary": RNG.normal(size=(5, 6, 7)),
    "multiples": 2.0**-27 * RNG.integers(-(2**24), 2**24, (5, 6, 7)),
    "the largest": 2.0**-3 * np.array([[2.0**31 - 1, 1 - 2.0**31], [1.0, 1 - 2.0**31]]),
    "too large": np.array([2.0**31, 1.0]),
    "subnormal": 5e-324 * np.arange(4.0),
    "minus zero": np.array([1.0, -0.0]),
    "not finite": np.array([np.nan, np.inf, 1.0]),
    "zeros": np.zeros((3, 3)),
    "none": np.zeros((0, 4)),
    "far apart": np.array([2.0**-1000, 1.0]),
}


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_tables_come_back_bit_for_bit(table):
    again = unpack(pack(table), table.shape)
    assert again.tobytes() == table.tobytes()
    multiples = whole_multiples(table)
    if multiples is not None:
        whole, exponent = multiples
        assert np.ldexp(whole.astype(float), exponent).tobytes() == table.tobytes()
        assert not whole.any() or (whole % 2).any()  # no larger power of two


def test_smooth_multiples_take_a_third_of_the_room():
    x = np.linspace(0.0, 1.0, 40)
    table = np.sqrt(1 + x[:, None, None] ** 2 + x[:, None] ** 2 + x**2)
    assert whole_multiples(table) is None
    rounded = 2.0**-24 * np.rint(2.0**24 * table)
    assert pack(rounded).nbytes < pack(table).nbytes / 3


@pytest.mark.parametrize("kind", ["arbitrary", "multiples"])
def test_damaged_tables_are_refused(kind):
    packed = pack(TABLES[kind])
    for wrong in (packed[:-3], np.append(packed[:4], packed)):
        with pytest.raises(ValueError, match="packed table"):
            unpack(wrong, (5, 6, 7))
    with pytest.raises(ValueError, match="are needed"):
        unpack(packed, (5, 6, 6))
    for few, shape in ((packed[:0], (5, 6, 7)), (packed, (5000, 6000, 7))):
        with pytest.raises(ValueError, match="promise"):
            unpack(few, shape)
