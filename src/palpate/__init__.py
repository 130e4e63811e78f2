"""palpate: turn a nonlinear finite-element model into something you can touch.

    physics     what the body does                sweeps      asking it many questions
    dataset     keeping the answers               network     the thing learnt, as a frozen value
    learning    how it is learnt                  surrogates  networks with physics around them
    validation  is it true                        runtime     in the hand, at 1 kHz
    viewer      in the eye                        study       the whole pipeline as one record

The names below load when they are first used, so `import palpate` costs nothing.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
