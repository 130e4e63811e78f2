"""Public names of `palpate.viewer`, each loaded when it is first used."""

from .body_viewer import BodyViewer as BodyViewer
from .body_viewer import show as show
from .part_page import PartPage as PartPage
from .part_page import Progress as Progress
from .part_page import serve_part as serve_part
from .server import Viewer as Viewer
from .server import serve as serve
from .web_server import free_port as free_port
