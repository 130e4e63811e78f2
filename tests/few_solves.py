"""A study file that solves little: six places of a body of 40 × 30 × 20 mm, of few elements."""

from __future__ import annotations

BLOCK = """\
name = "tiny"
[body]
kind = "block"
size = ["40 mm", "30 mm", "20 mm"]
element = "20 mm"
material = { young = "9 kPa" }
[interaction]
"""
"""Begins a study file, up to the table of the interaction."""

FEW_SOLVES = """
radius = "8 mm"
pad = 5e6
depth = ["0.3 mm", "2 mm"]
over = [["16 mm", "12 mm"], ["24 mm", "18 mm"]]
[sweep]
samples = 6
depths = 2
element = "12 mm"
workers = 1
[test]
samples = 2
depths = 2
[learning]
effort = 0.1
workers = 1
"""
"""Begins in the table of the interaction and ends in that of learning, where a study may go on."""
