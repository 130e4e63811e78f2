"""What a shared library of Linux, Windows or macOS exports, read from its own tables: no such system is needed."""

from __future__ import annotations

import struct

__all__ = ["exported_names"]


def exported_names(content: bytes) -> set[str]:
    """Return the names of all functions that a 64-bit library exports; of a universal one those that all parts do."""
    if content[:4] == b"\x7fELF":
        return _of_elf(content)
    if content[:2] == b"MZ":
        return _of_windows(content)
    if content[:4] == b"\xca\xfe\xba\xbe":
        count = struct.unpack_from(">I", content, 4)[0]
        parts = [struct.unpack_from(">5I", content, 8 + 20 * i) for i in range(count)]
        return set.intersection(*(exported_names(content[at : at + size]) for _, _, at, size, _ in parts))
    assert struct.unpack_from("<I", content)[0] == 0xFEEDFACF
    return _of_macos(content)


def _text(content: bytes, at: int) -> str:
    return content[at : content.index(b"\0", at)].decode()


def _of_elf(content: bytes) -> set[str]:
    """Return the defined global symbols of the section of dynamic ones."""
    (first,), (size, count) = (
        struct.unpack_from("<Q", content, 0x28),
        struct.unpack_from("<HH", content, 0x3A),
    )
    sections = [struct.unpack_from("<IIQQQQII", content, first + size * i) for i in range(count)]
    names = set()
    for _, kind, _, _, at, length, link, _ in sections:
        if kind != 11:  # dynamic symbols
            continue
        for row in range(at, at + length, 24):
            name, binding, _, section = struct.unpack_from("<IBBH", content, row)
            if section and binding >> 4 == 1:
                names.add(_text(content, sections[link][4] + name))
    return names


def _of_windows(content: bytes) -> set[str]:
    """Return the names of the export directory, whose addresses are those of the library in memory."""
    head = struct.unpack_from("<I", content, 0x3C)[0]
    count, optional = (
        struct.unpack_from("<H", content, head + 6)[0],
        struct.unpack_from("<H", content, head + 20)[0],
    )
    assert struct.unpack_from("<H", content, head + 24)[0] == 0x20B
    rows = [struct.unpack_from("<4I", content, head + 24 + optional + 40 * i + 8) for i in range(count)]

    def place(address: int) -> int:
        return next(raw + address - there for size, there, _, raw in rows if there <= address < there + size)

    exports = place(struct.unpack_from("<I", content, head + 24 + 112)[0])
    many, names = (
        struct.unpack_from("<I", content, exports + 24)[0],
        struct.unpack_from("<I", content, exports + 32)[0],
    )
    return {
        _text(content, place(address)) for address in struct.unpack_from(f"<{many}I", content, place(names))
    }


def _of_macos(content: bytes) -> set[str]:
    """Return the names of the export trie, without the underscore that the system puts before them."""
    at, trie = 32, (0, 0)
    for _ in range(struct.unpack_from("<I", content, 16)[0]):
        command, size = struct.unpack_from("<II", content, at)
        if command == 0x80000033:  # the trie alone
            trie = struct.unpack_from("<II", content, at + 8)
        if command == 0x80000022:  # all that the loader needs, the trie last
            trie = struct.unpack_from("<II", content, at + 40)
        at += size
    table, names = content[trie[0] : trie[0] + trie[1]], set()

    def number(at: int) -> tuple[int, int]:
        value = shift = 0
        while True:
            value |= (table[at] & 0x7F) << shift
            shift, at = shift + 7, at + 1
            if not table[at - 1] & 0x80:
                return value, at

    def walk(at: int, begun: str) -> None:
        size, at = number(at)
        if size:
            names.add(begun.removeprefix("_"))
        at += size
        children, at = table[at], at + 1
        for _ in range(children):
            label = _text(table, at)
            child, at = number(at + len(label) + 1)
            walk(child, begun + label)

    walk(0, "")
    return names
