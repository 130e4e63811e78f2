"""What a unit may look like: which entries of its factor A are free, and which numbers they are made of.

    φ = g(‖A x − b‖²),   A (r, n),   b (r,)

form      the contract
centred   a centre and widths: isotropic, axis-aligned, rotated
oblique   rank r: the unit varies along r oblique directions only
"""

from palpate.rbf.units.forms.centred import Centred
from palpate.rbf.units.forms.form import Form, Widths, form
from palpate.rbf.units.forms.oblique import Oblique

__all__ = ["Centred", "Form", "Oblique", "Widths", "form"]
