"""Polygons of OBJ files that are not convex, cut into triangles; trimesh joins all corners with the first one.

Ears are cut off one by one: a corner that bends to the left and whose triangle holds no other corner (Meisters 1975,
Polygons have ears, Am. Math. Monthly 82, 648-651).
"""

from __future__ import annotations

__all__ = ["split_concave_polygons"]

MOST = 256  # corners of a polygon: the work grows with their third power
Point = tuple[float, float]


def split_concave_polygons(content: bytes) -> bytes:
    """Return the text of an OBJ file with triangles in place of the polygons that are not convex.

    ValueError or IndexError if a coordinate or the number of a corner is none, or such a polygon has more corners than
    `MOST`.
    """
    places: list[tuple[float, ...]] = []
    lines = content.split(b"\n")
    for row, line in enumerate(lines):
        if line[:2] in (b"v ", b"v\t"):
            places.append(tuple(map(float, line.split()[1:4])))
        elif line[:1] == b"f" and len(words := line.split()) > 4:
            numbers = [int(word.partition(b"/")[0]) for word in words[1:]]
            flat = _flatten([places[n if n < 0 else n - 1] for n in numbers])
            if any(
                _turn(*three) < 0
                for three in zip(flat, flat[1:] + flat[:1], flat[2:] + flat[:2], strict=True)
            ):
                if len(flat) > MOST:
                    raise ValueError(
                        f"a polygon of {len(flat):,} corners is not convex; export it as triangles"
                    )
                ears = [b" ".join([b"f", *(words[1 + k] for k in ear)]) for ear in _ears(flat)]
                lines[row] = b"\n".join(ears)
    return b"\n".join(lines)


def _flatten(corners: list[tuple[float, ...]]) -> list[Point]:
    """Return the corners in the plane of two axes in which the polygon is largest, anticlockwise."""
    areas = []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        pairs = zip(corners, corners[1:] + corners[:1], strict=True)
        areas.append((sum(a[i] * b[j] - b[i] * a[j] for a, b in pairs), i, j))
    area, i, j = max(areas, key=lambda each: abs(each[0]))
    return [(c[i], c[j]) if area > 0 else (c[j], c[i]) for c in corners]


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return twice the area of a triangle, negative where its corners run clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _ears(flat: list[Point]) -> list[tuple[int, int, int]]:
    """Return triangles, by the indices of their corners, that fill a polygon."""
    left, ears = list(range(len(flat))), list[tuple[int, int, int]]()
    while len(left) > 3:
        for place in range(len(left)):
            ear = (left[place - 1], left[place], left[(place + 1) % len(left)])
            a, b, c = (flat[k] for k in ear)
            others = (flat[k] for k in left if k not in ear)
            if _turn(a, b, c) > 0 and not any(
                min(_turn(a, b, p), _turn(b, c, p), _turn(c, a, p)) >= 0 for p in others
            ):
                break
        else:  # it cuts itself, or its last corners lie on a line: what is left is judged with the surface
            place, ear = 1, (left[0], left[1], left[2])
        ears.append(ear)
        del left[place]
    return [*ears, (left[0], left[1], left[2])]
