"""Networks that were learnt, as frozen values: evaluation, derivatives, files and publication to other processes.

    network                          the value, its scaling, and its evaluator of one point at a time
    radial, network_kernels          radial functions, and the compiled loops behind the evaluation
    archive, container, soundness    kept in a file, and read back with suspicion
    codec, kinds                     … and so is any frozen dataclass; which ones may stand for a base class
    publication, shared_memory       published to other processes, who never wait
    uncertainty, region              how far it may be off, and where it was trained

Nothing here knows of training.
"""

from palpate.network.archive import Archive, load_archive, save_archive
from palpate.network.codec import decode, encode, load_value, save_value
from palpate.network.kinds import register_kind
from palpate.network.network import Evaluator, Network, Scaling
from palpate.network.publication import Publisher, Subscriber
from palpate.network.region import TrainedRegion
from palpate.network.uncertainty import Uncertainty

__all__ = [
    "Archive",
    "Evaluator",
    "Network",
    "Publisher",
    "Scaling",
    "Subscriber",
    "TrainedRegion",
    "Uncertainty",
    "decode",
    "encode",
    "load_archive",
    "load_value",
    "register_kind",
    "save_archive",
    "save_value",
]
