"""Names of columns as testing machines write them, and names that mean something else."""

from __future__ import annotations

import pytest

from palpate.tables import NamedQuantity, named_quantity


@pytest.mark.parametrize(
    ("names", "kind", "measure", "direction"),
    [
        (
            "time|t|Time|Elapsed Time|Test time|Total Time|Running Time|Zeit|Prüfzeit|Temps|time_s",
            "time",
            "",
            "",
        ),
        (
            "force|F|Load|Axial Force|Load cell|Load Cell 1|Kraft|Standardkraft|Prüfkraft|Charge",
            "force",
            "",
            "",
        ),
        ("Force_N|Load (8800 (0,3):Load)|Force (Load cell 1)|Corrected Load", "force", "", ""),
        (
            "extension|Displacement|Crosshead|Crosshead position|Axial Displacement|Disp|Weg",
            "extension",
            "",
            "",
        ),
        (
            "Standardweg|Traversenweg|Längenänderung|Verlängerung|Allongement|Stroke|disp_mm",
            "extension",
            "",
            "",
        ),
        ("depth|Indentation|Indentation depth|Penetration Depth|Eindringtiefe", "depth", "", ""),
        ("Indentation force|Indentation load", "force", "", ""),
        ("strain|ε|eps|Dehnung|Strain 1|Axial strain|Strain (Strain 1)|Déformation", "strain", "", ""),
        ("Tensile strain|Tensile Strain (Strain 1)|Zugdehnung", "strain", "", "tensile"),
        ("Tensile extension", "extension", "", "tensile"),
        ("compressive strain|Stauchung|Strain (compression)", "strain", "", "compressive"),
        ("Compression|Compressive extension", "extension", "", "compressive"),
        ("Compressive load|Druckkraft|Compression force", "force", "", "compressive"),
        ("engineering strain|Eng. Strain|nominal_strain", "strain", "nominal", ""),
        (
            "true strain|log strain|Logarithmic Strain|Hencky strain|Strain (log)|wahre Dehnung",
            "strain",
            "true",
            "",
        ),
        ("stretch|λ|lambda|Stretch ratio|Extension ratio|stretch λ", "stretch", "", ""),
        ("stress|Spannung|Contrainte|Axial stress", "stress", "", ""),
        ("Tensile stress|Zugspannung", "stress", "", "tensile"),
        ("compressive stress|Druckspannung", "stress", "", "compressive"),
        ("nominal stress|Engineering stress|P|PK1|technische Spannung|Nennspannung", "stress", "nominal", ""),
        ("true stress|Cauchy stress|σ|sigma|wahre Spannung|Stress (True)", "stress", "true", ""),
        ("True compressive stress", "stress", "true", "compressive"),
    ],
)
def test_a_name_states_a_quantity(names, kind, measure, direction):
    for name in names.split("|"):
        assert named_quantity(name) == NamedQuantity(kind, measure, direction), name


@pytest.mark.parametrize(
    "name",
    [
        "strain rate",
        "Strain energy",
        "Stress at break",
        "Maximum load",
        "Load rate",
        "Green strain",
        "Shear stress",
        "True nominal stress",
        "Tensile compressive load",
        "Young's modulus",
        "Time of day",
        "load and extension",
        "Temperature",
        "Stress ratio",
        "Force x",
        "Point",
        "x",
        "",
        "()",
    ],
)
def test_a_name_that_may_mean_something_else_states_none(name):
    assert named_quantity(name) is None
