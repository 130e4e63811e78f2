"""Public names of `palpate.viewer`, each loaded when it is first used."""

from .ports import free_port as free_port
from .server import Viewer as Viewer
from .server import serve as serve
from .showing import BodyViewer as BodyViewer
from .showing import show as show
