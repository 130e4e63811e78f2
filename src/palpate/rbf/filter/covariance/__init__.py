"""What the filter keeps of its uncertainty; which one is the update rule's choice.

full      one matrix over everything: (m p_t + h (m + p))² numbers
blocks    one block for the tail and one per unit: (m p_t)² + h (m + p)²
shared    one matrix over the regressors for all outputs, one over the units' shapes: (p_t + h)² + (h p)²
nothing   none, for the gradient rule
"""

from palpate.rbf.filter.covariance.blocks import Blocks
from palpate.rbf.filter.covariance.full import Full
from palpate.rbf.filter.covariance.nothing import Nothing
from palpate.rbf.filter.covariance.shared import Shared

__all__ = ["Blocks", "Covariance", "Full", "Nothing", "Shared"]

Covariance = Full | Blocks | Shared | Nothing
