"""palpate: turn a nonlinear finite-element model into something you can touch.

    physics     what the body does                sweeps      asking it many questions
    dataset     keeping the answers               network     the thing learnt, as a frozen value
    learning    how it is learnt                  surrogates  networks with physics around them
    validation  is it true                        runtime     in the hand, at 1 kHz
    viewer      in the eye                        study       the whole pipeline as one record

The names below load when they are first used, so `import palpate` costs nothing.
"""

from typing import Any

import lazy_loader

from palpate.page_hook import register_page
from palpate.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


@register_page
def _page(body: Any) -> str:
    """Return a body as one HTML page; it is loaded by the first body that is shown."""
    from palpate.viewer.file_page import html_page

    return html_page(body)
