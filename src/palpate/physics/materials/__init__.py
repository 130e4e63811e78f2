"""What a body is made of: energies and their constants."""

from palpate.physics.materials.linear import MATERIALS, LinearElastic, named_material

__all__ = ["MATERIALS", "LinearElastic", "named_material"]
