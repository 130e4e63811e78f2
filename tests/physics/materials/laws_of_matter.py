"""Materials that several tests look at."""

from __future__ import annotations

import math

from palpate.physics.materials import (
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    StVenantKirchhoff,
    Yeoh,
)

MATRIX = NeoHookean.from_shear(8e3, poisson=0.49, form="isochoric")
FIBRES = tuple(
    FibreFamily((math.cos(a), math.sin(a), 0.1), k1=2e3, k2=0.8, dispersion=0.1)
    for a in (math.radians(35), math.radians(-50))
)

LAWS = (
    LinearElastic(9e3, 0.3),
    StVenantKirchhoff(9e3, 0.3),
    StVenantKirchhoff(9e3, -0.2),
    NeoHookean(9e3, 0.45),
    NeoHookean(9e3, -0.2),
    NeoHookean(9e3, 0.49, form="isochoric"),
    MooneyRivlin.with_poisson(0.49, c10=2e3, c01=1e3),
    Yeoh.with_poisson(0.49, c10=3e3, c20=-200.0, c30=60.0),
    Ogden.with_poisson(0.49, mu=(630.0, 1.2, -10.0), alpha=(1.3, 5.0, -2.0)),
    FibreReinforced(MATRIX, FIBRES),
)
IDS = [f"{i}-{law.law}" for i, law in enumerate(LAWS)]
