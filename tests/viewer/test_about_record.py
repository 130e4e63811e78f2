"""The record that a page shows of a body: nothing empty, nothing internal, at any depth."""

from __future__ import annotations

import math

from palpate.surrogates.model_card import NOT_STATED
from palpate.viewer.about_record import INTERNAL, about_record

RECORD = {
    "name": "kidney",
    "solves": 12,
    "samples": 96,
    "loo": 0.01,
    "radial": "matern-5/2",
    "author": NOT_STATED,
    "learning_curve": [],
    "left_out": {"median": 0.0019, "p95": 0.0067, "hash": "0"},
    "validation": {"force error, median": 0.012, "limits kept": True, "ratio": math.nan},
    "dataset": {
        "hash": "19d3",
        "provenance": {"words": "solid of kidney.stl", "created": "2026-11-26T15:20:03+00:00", "seed": 0},
    },
    "notes": {"empty": "", "none": None, "settings": {"noise": 1e-8}},
}


def test_a_record_is_left_with_what_a_person_reads():
    assert about_record(RECORD) == {
        "name": "kidney",
        "solves to learn from": 12,
        "errors of solves left out of learning in turn": {
            "force error, median": "0.19 %",
            "force error, 95th percentile": "0.67 %",
        },
        "validation": {
            "force error, median": "1.2 %",
            "limits kept": True,
        },
        "learnt from": "solid of kidney.stl",
        "solved": "2026-11-26T15:20:03+00:00",
    }
    bent = RECORD | {"solves": 25, "filter": {"samples": 251, "passes": 5}}
    assert about_record(bent)["solves to learn from"] == 251, "as `palpate learn` says"
    assert not INTERNAL & set(about_record(dict.fromkeys(INTERNAL, "x")))
