"""Whether triangles meet, by rational arithmetic and the definitions: slow, plain, and right."""

from fractions import Fraction
from itertools import combinations, product


def exactly(point):
    return tuple(Fraction(float(x)) for x in point)


def minus(p, q):
    return tuple(a - b for a, b in zip(p, q, strict=True))


def cross(u, v):
    return (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])


def dot(u, v):
    return sum(a * b for a, b in zip(u, v, strict=True))


def orientation(a, b, c, d):
    value = dot(cross(minus(b, a), minus(c, a)), minus(d, a))
    return (value > 0) - (value < 0)


def has_area(triangle):
    a, b, c = triangle
    return any(cross(minus(b, a), minus(c, a)))


def holds(triangle, point):
    """Whether a point lies in a closed triangle with area."""
    a, b, c = triangle
    normal = cross(minus(b, a), minus(c, a))
    if dot(normal, minus(point, a)):
        return False
    return all(
        dot(cross(minus(end, start), minus(point, start)), normal) >= 0 for start, end in ((a, b), (b, c), (c, a))
    )


def common_points(first, second):
    """Points that span what two closed triangles have in common: none if they are disjoint.

    Corners of one in the other, sides of one through the plane of the other, sides crossing in a common plane.
    """
    found = set()
    for one, other in ((first, second), (second, first)):
        found |= {corner for corner in one if holds(other, corner)}
        normal = cross(minus(other[1], other[0]), minus(other[2], other[0]))
        for p, q in combinations(one, 2):
            over_p, over_q = dot(normal, minus(p, other[0])), dot(normal, minus(q, other[0]))
            if over_p != over_q:
                t = over_p / (over_p - over_q)
                point = tuple(x + t * (y - x) for x, y in zip(p, q, strict=True))
                if 0 <= t <= 1 and holds(other, point):
                    found.add(point)
    for (p, q), (r, s) in product(combinations(first, 2), combinations(second, 2)):
        u, v, w = minus(q, p), minus(s, r), minus(r, p)
        normal = cross(u, v)
        size = dot(normal, normal)
        if size and not dot(normal, w):
            t, k = dot(cross(w, v), normal) / size, dot(cross(w, u), normal) / size
            if 0 <= t <= 1 and 0 <= k <= 1:
                found.add(tuple(x + t * y for x, y in zip(p, u, strict=True)))
    return found


def meet_wrongly(first, second):
    """Whether triangles with area meet elsewhere than in common corners and the side between two of them."""
    shared = set(first) & set(second)
    if len(shared) == 3:
        return False
    points = common_points(first, second)
    if len(shared) < 2:
        return bool(points - shared)
    # all of it must lie on the line through the two
    p, q = shared
    return any(any(cross(minus(q, p), minus(point, p))) for point in points)


def self_intersections(points, faces):
    """The set of pairs of faces that meet wrongly, faces without area left out."""
    triangles = [tuple(exactly(points[corner]) for corner in face) for face in faces]
    sound = [index for index, triangle in enumerate(triangles) if has_area(triangle)]
    return {(i, j) for i, j in combinations(sound, 2) if meet_wrongly(triangles[i], triangles[j])}
