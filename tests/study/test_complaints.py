"""Whatever stands in a key of a study, the answer is a sentence of ours that names the key and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic import BaseModel, ValidationError

from palpate.dataset.readers.mapping import ImportMapping, read_mapping
from palpate.errors import UsageError
from palpate.record_complaints import complaints
from palpate.study import read_study
from palpate.study.stage_records import SECTIONS
from palpate.study.study import Study

FOREIGN: tuple[Any, ...] = (
    *(
        "",
        "x",
        "1_0",
        "0,5,",
        "−5 mm",
        "5 kPa",
        "5 mm",
        "½",
        "a b",
        5,
        2.5,
        -1,
        -0.5,
        0,
        10**30,
        10**400,
        1e300,
    ),
    *(True, None, math.nan, math.inf, [], [1], ["x"], [1.5, "x", {}], [[1]], [[], []], {}, {"x": 1}),
    *({"kind": "x"}, [{"x": 1}], b"5", object()),
)
PYDANTIC = (
    "Input should",
    "Value error",
    "Field required",
    "Extra inputs",
    "should have at",
    "valid ",
    "function-",
)


def records(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the records in an annotation, and those in their fields."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from records(field.annotation)
    for part in get_args(annotation):
        yield from records(part)


RECORDS = {
    *records(Study),
    *records(ImportMapping),
    *(record for section in SECTIONS.values() for record in section.values()),
}


@pytest.mark.grid
@pytest.mark.parametrize("record", sorted(RECORDS, key=lambda r: r.__name__), ids=lambda r: r.__name__)
def test_every_mistake_in_a_key_is_a_sentence_of_ours(record):
    for name, field in record.model_fields.items():
        key = field.alias or name
        for value in FOREIGN:
            try:
                record.model_validate({key: value})
            except ValidationError as error:
                for line in complaints(error, record):
                    place, _, sentence = line.partition(": ")
                    assert len(sentence) > 10, line
                    assert not [words for words in PYDANTIC if words in line], line
                    assert place.partition(".")[0] in {*record.model_fields, "from", "study"}, line


@pytest.mark.parametrize("record", sorted(RECORDS, key=lambda r: r.__name__), ids=lambda r: r.__name__)
def test_a_range_is_told_by_both_of_its_ends(record):
    bounds = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
    for name, field in record.model_fields.items():
        limits = {k: getattr(part, k) for part in field.metadata for k in bounds if hasattr(part, k)}
        for bound, end in limits.items():
            beyond = end - 1 if bound in {"gt", "ge"} else end + 1
            with pytest.raises(ValidationError) as refusal:
                record.model_validate({name: beyond})
            (line,) = (text for text in complaints(refusal.value, record) if text.startswith(f"{name}:"))
            assert str(beyond) in line
            assert all(f"{bounds[k]} {limits[k]:.6g}" in line for k in limits), line


def the_complaints(**tables: Any) -> list[str]:
    with pytest.raises(ValidationError) as refusal:
        Study.model_validate({"body": {"kind": "block"}, "interaction": {"kind": "probe"}} | tables)
    return list(complaints(refusal.value, Study))


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        (
            {"body": {"kind": "block", "material": {"young": "10 kPa", "poisson": 0.7}}},
            "body.material.poisson: 0.7 is out of range; allowed is at least 0 and less than 0.5; for example 0.45",
        ),
        ({"body": {"kind": "block", "material": 5}}, "body.material: 5 is no text and no table"),
        ({"body": {"kind": "blok"}}, "did you mean 'block'?"),
        (
            {"interaction": {"kind": "probe", "radius": "-5 mm"}},
            "-0.005 m is out of range; allowed is more than 0 m",
        ),
        (
            {"interaction": {"kind": "probe", "radus": 1}},
            "radus: there is no such key; did you mean 'radius'?",
        ),
        (
            {"interaction": {"kind": "probe", "over": [["0", 1], [1, 2]]}},
            "interaction.over.0.0: '0' has no unit",
        ),
        ({"sweep": {"samples": "40"}}, "sweep.samples: '40' is no whole number"),
        (
            {"sweep": {"samples": 2}},
            "sweep.samples: 2 is out of range; allowed is at least 6; for example 40",
        ),
        ({"varied": [{"path": ""}]}, 'varied.0.low: this key is missing; for example "2 kPa"'),
    ],
)
def test_a_complaint_names_key_value_range_and_example(tables, line):
    (complaint,) = (text for text in the_complaints(**tables) if line in text)
    assert complaint


def test_numbers_as_text_are_those_that_the_text_says():
    body = {"kind": "block", "material": {"young": "10,5kPa", "poisson": "0,45"}}
    study = Study.model_validate(
        {"body": body, "interaction": {"kind": "probe"}, "runtime": {"max_force": "2,5 N"}}
    )
    assert study.body.material.young == 10500.0
    assert study.body.material.poisson == 0.45
    assert study.runtime.max_force == 2.5


def test_a_mapping_is_complained_of_in_the_same_words():
    with pytest.raises(UsageError) as refusal:
        read_mapping(
            {"inputs": [{"name": "F", "reduce": "maxx", "at": ["1,000 mm", 0]}], "name": 3, "joinn": "x"}
        )
    told = str(refusal.value)
    for words in (
        'inputs.0.reduce: "maxx" is none of',
        "did you mean 'max'",
        "1,000 may be",
        "name: 3 is no text",
    ):
        assert words in told
    assert "joinn: there is no such key; did you mean 'join'?" in told


def test_a_decimal_comma_without_quotes_is_named(tmp_path):
    (tmp_path / "study.toml").write_text("[body.material]\npoisson = 0,45\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"decimal point: 0\.45, not 0,45"):
        read_study(tmp_path / "study.toml")
