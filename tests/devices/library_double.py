"""The settings and counts of a vendor library's double, by name: `double.type = 60`, `double.saturations`."""

from __future__ import annotations

import ctypes
import math


class LibraryDouble:
    """A double in this process, as it was compiled; it starts as new."""

    def __init__(self, path, **settings):
        library = ctypes.CDLL(str(path))
        library.double_set.argtypes = (ctypes.c_char_p, ctypes.c_double)
        library.double_get.argtypes, library.double_get.restype = (ctypes.c_char_p,), ctypes.c_double
        library.double_reset()
        self.__dict__.update(library=library, path=path)
        for name, value in settings.items():
            setattr(self, name, value)

    def __setattr__(self, name, value):
        if self.library.double_set(name.encode(), float(value)):
            raise AttributeError(name)

    def __getattr__(self, name):
        value = self.library.double_get(name.encode())
        if math.isnan(value):
            raise AttributeError(name)
        return value
