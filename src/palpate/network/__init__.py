"""The thing learnt, as a frozen value: evaluation, derivatives, file format and publication to other processes.

    network, scaling, description         the value and what is said about it
    radial                                 radial functions, in NumPy
    compiled, evaluate, evaluator          … evaluated one point at a time, without allocation
    radial_kernels, combine                the loops behind that
    archive, container, soundness          kept in a file, and read back with suspicion
    codec                                  … and so is any frozen dataclass
    shared, publication, seqlock, mapped   published to other processes, who never wait
    uncertainty, region                    how far it may be off, and where it was trained

Knows nothing of training.
"""

from palpate.network.archive import Archive, load_archive, save_archive
from palpate.network.codec import decode, encode, load_value, register_kind, save_value
from palpate.network.evaluator import Evaluator
from palpate.network.network import Network
from palpate.network.region import TrainedRegion
from palpate.network.scaling import Scaling
from palpate.network.shared import Publisher, Subscriber
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
