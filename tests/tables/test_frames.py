"""Tables of other libraries as arrays: columns by name, and missing values as not-a-number."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

import numpy as np
import pandas as pd
import pytest

from palpate.errors import UsageError
from palpate.tables import column_names, columns_in_order, numbers_of

RECORDS = np.array([(1.0, 4), (2.0, 5)], dtype=[("depth", float), ("speed", int)])


@dataclass
class PolarsLike:
    """A frame as Polars has it: a list of names, a column by name, `to_numpy` without options."""

    values: dict[str, np.ndarray]

    @property
    def columns(self):
        return list(self.values)

    def __getitem__(self, name):
        return pd.Series(self.values[name]).array.__array__().view(NumpyColumn)


class NumpyColumn(np.ndarray):
    def to_numpy(self):
        return np.asarray(self)


def arrow(**columns):
    return pytest.importorskip("pyarrow").table(columns)


@pytest.mark.parametrize(
    "table",
    [
        pd.DataFrame({"depth": [1.0, 2.0], "speed": [4, 5]}),
        pd.DataFrame({"depth": [1.0, 2.0], "speed": [4, 5]}).convert_dtypes(),
        RECORDS,
        {"depth": [1.0, 2.0], "speed": np.array([4, 5])},
        PolarsLike({"depth": np.array([1.0, 2.0]), "speed": np.array([4, 5])}),
        arrow(depth=[1.0, 2.0], speed=[4, 5]),
    ],
    ids=["pandas", "nullable", "records", "mapping", "polars", "arrow"],
)
def test_columns_are_matched_by_name_whatever_holds_them(table):
    assert column_names(table) == ("depth", "speed")
    np.testing.assert_array_equal(numbers_of("Inputs X", table), [[1, 4], [2, 5]])
    np.testing.assert_array_equal(columns_in_order("Inputs X", table, ["speed", "depth"]), [[4, 1], [5, 2]])
    with pytest.raises(UsageError, match="'force' is missing, 'speed' is unknown"):
        columns_in_order("Inputs X", table, ["depth", "force"])
    with pytest.raises(UsageError, match="'speed' is unknown"):
        columns_in_order("Inputs X", table, ["depth"])


def test_arrays_and_names_that_say_nothing_are_taken_as_they_stand():
    table = pd.DataFrame({"a": [1.0], "b": [2.0]})
    np.testing.assert_array_equal(columns_in_order("Inputs X", table, ["x0", "x1"]), [[1, 2]])
    np.testing.assert_array_equal(columns_in_order("Inputs X", table.to_numpy(), ["b", "a"]), [[1, 2]])
    turned = pd.DataFrame({"x1": [1.0], "x0": [2.0]})
    np.testing.assert_array_equal(columns_in_order("Inputs X", turned, ["x0", "x1"]), [[2, 1]])
    numbered = pd.DataFrame([[1.0, 2.0]])
    np.testing.assert_array_equal(columns_in_order("Inputs X", numbered[[1, 0]], ["0", "1"]), [[1, 2]])
    twice = pd.DataFrame([[1.0, 2.0, 3.0]], columns=["a", "a", "b"])
    np.testing.assert_array_equal(numbers_of("Inputs X", twice), [[1, 2, 3]])
    with pytest.raises(UsageError, match="'a' is there twice"):
        columns_in_order("Inputs X", twice, ["a", "b"])


@pytest.mark.parametrize(
    "column",
    [
        pd.Series([1, None, 3], dtype="Int64"),
        pd.Series([1, None, 3], dtype="Float32"),
        pd.Series([True, None, True], dtype="boolean").astype("Int8") * pd.Series([1, 0, 3], dtype="Int8"),
        pd.Series([1, pd.NA, Decimal(3)], dtype=object),
        pd.Series([1.0, np.nan, 3.0]),
        pd.Series([1, None, 3], dtype="category"),
        np.ma.array([1.0, 7.0, 3.0], mask=[False, True, False]),
        [1, None, 3],
    ],
)
def test_a_missing_value_is_not_a_number_however_it_is_written(column):
    for given in (column, {"count": column}):
        np.testing.assert_array_equal(np.ravel(numbers_of("Inputs X", given)), [1, np.nan, 3])


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (
            pd.DataFrame({"a": [1, 2], "stage": ["up", "down"]}),
            "Column 'stage' of inputs x holds 'up' in row 0",
        ),
        (pd.DataFrame({"a": [1, "2,5"]}), "Column 'a' of inputs x holds '2,5' in row 1"),
        (
            pd.DataFrame({"when": pd.to_datetime(["2020-01-01"])}),
            "Column 'when' of inputs x is an array of dat",
        ),
        ({"a": [1, 2], "b": [1]}, "columns of different length"),
        ([[1, 2], [3, "4"]], "an array of <U"),
        (np.array([[1, 2], [3, 1j]], dtype=object), "hold 1j in row 1"),
        ([[1, 2], [3]], "no array of numbers"),
    ],
)
def test_what_is_no_number_is_named(table, said):
    with pytest.raises(UsageError, match=said):
        numbers_of("Inputs X", table)
