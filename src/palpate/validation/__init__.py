"""Validation: a model against solves it has never seen, and the report that shows the result.

validate        `validate` and its result, made of figures    figures/   one figure a file
verdict         the sentences on it that a person reads first
subject         a model and the solves that judge it          limits     limits, and the reasons for them
unseen_solves   solves and functions of place as values       worst      worst cases, and the outer part of the range
report/         one self-contained page with pictures and tables

Names are loaded when they are first used: Matplotlib and Jinja2 cost time that only a report needs.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
