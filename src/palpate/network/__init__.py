"""The thing learnt, as a frozen value: evaluation, Jacobian and file format. Knows nothing of training."""

from palpate.network.file import Archive, load_archive, save_archive
from palpate.network.network import Evaluator, Network, Scaling

__all__ = ["Archive", "Evaluator", "Network", "Scaling", "load_archive", "save_archive"]
