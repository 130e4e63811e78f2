"""The pages of benchmarks are made from the tables of record, and stay short enough to be read."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from benchmarks.records import DOCS, RECORDS, Record, pages, renewed

pytestmark = pytest.mark.full  # the house's own rules, not what palpate does

WORDS = 4_000
NAMES = sorted(path.stem for path in RECORDS.glob("*.json"))
OVERVIEWS = [DOCS / "benchmarks.md", *sorted((DOCS / "benchmarks").glob("*.md"))]


@pytest.mark.parametrize("page", list(pages()), ids=lambda page: page.name)
def test_blocks_are_those_of_the_records(page):
    text = page.read_text(encoding="utf-8")
    assert renewed(text) == text, "run python -m benchmarks.records"


def test_a_changed_record_changes_the_page_and_nothing_else(tmp_path):
    name = "latency"
    record = Record.read(name)
    replace(record, rows=(("another", *record.rows[0][1:]), *record.rows[1:])).write(name, tmp_path)
    block = f"before\n{record.block(name)}\nafter\n"
    assert renewed(block) == block
    assert renewed(block, tmp_path) == block.replace(record.rows[0][0], "another", 1)


def test_a_bound_that_is_missed_stands_on_the_page():
    record = replace(Record.read("latency"), claims=("met: a: 1 (wanted ≤ 2)", "MISSED: b: 3 (wanted ≤ 2)"))
    text = record.block("latency")
    assert "1 of 2 bounds" in text
    assert "MISSED: b: 3" in text
    assert all(claim in record.markdown() for claim in record.claims)


def test_every_record_is_on_a_page_or_named_like_one_that_is():
    shown = set(re.findall(r"<!-- benchmark (\S+): begin", "".join(p.read_text("utf-8") for p in pages())))
    curves = {name.removesuffix("-curve") for name in shown}
    hidden = {name for name in NAMES if name not in shown and name.removesuffix("-rivals") not in curves}
    assert hidden == set()


@pytest.mark.parametrize("page", OVERVIEWS, ids=lambda page: page.name)
def test_pages_stay_short(page):
    words = [word for word in page.read_text(encoding="utf-8").split() if re.search(r"\w", word)]
    assert len(words) <= WORDS
