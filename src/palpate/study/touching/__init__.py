"""Studies of solid bodies that are pressed by a probe.

records    what such a study says              build    the objects that it means
presets    bodies that have a name             stages   how it is carried out
"""

from palpate.study.touching.records import TouchStudy

__all__ = ["TouchStudy"]
