"""Networks with physics around them: what a hand, an eye or a program can ask of a learnt body."""

from palpate.surrogates.touch import TouchEvaluator, TouchModel

__all__ = ["TouchEvaluator", "TouchModel"]
