"""Polygons with any number of corners: what USD's meshes are made of, cut into triangles, and their normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ._arrays import Array

_MOST_CORNERS = 2000  # of polygons that are cut along their outline: it takes the square of their number


@dataclass
class Polygons:
    """``counts``: [f], corners of each face, 3 or more. ``corners``: [c], vertices of all corners, face by face.

    ``vertices``: [n, 3 + k] float64: positions, and what else belongs to vertices. ``values``: [c, m] float64, what belongs to corners.
    ``faces``: [f], which face of the mesh each is or lies in.
    """

    counts: Array
    corners: Array
    vertices: Array
    values: Array
    faces: Array

    def starts(self) -> Array:
        """[f]: the first corner of each face."""
        return np.cumsum(self.counts) - self.counts

    def owners(self) -> Array:
        """[c]: the face of each corner, by its place in ``counts``."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def following(self) -> Array:
        """[c]: the next corner of the face."""
        after = np.arange(1, len(self.corners) + 1)
        if len(after):
            starts = self.starts()
            after[starts + self.counts - 1] = starts
        return after

    def some(self, chosen: Array) -> Polygons:
        """Only these faces, [f] of bool."""
        if chosen.all():
            return self
        corners = np.repeat(chosen, self.counts)
        return Polygons(self.counts[chosen], self.corners[corners], self.vertices, self.values[corners], self.faces[chosen])


def scatter_sum(places: Array, values: Array, n: int) -> Array:
    """[n, k]: the sum of the rows of ``values``, [m, k], that go to each place."""
    return np.stack([np.bincount(places, values[:, k], n) for k in range(values.shape[1])], 1) if values.shape[1] else np.zeros((n, 0))


def cross(a: Array, b: Array) -> Array:
    """As numpy's of [n, 3], in a fraction of the time."""
    x, y, z = a.T
    u, v, w = b.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], 1)


def face_normals(polygons: Polygons) -> Array:
    """[f, 3]: after Newell, as long as twice the area."""
    counts, starts = polygons.counts, polygons.starts()
    normals = np.zeros((len(counts), 3))
    points = polygons.vertices[:, :3]
    for count in np.unique(counts):
        chosen = slice(None) if (counts == count).all() else np.flatnonzero(counts == count)
        corners = [polygons.corners[starts[chosen] + k] for k in range(min(count, 4))]
        if count == 3:
            normals[chosen] = cross(points[corners[1]] - points[corners[0]], points[corners[2]] - points[corners[0]])
        elif count == 4:
            normals[chosen] = cross(points[corners[2]] - points[corners[0]], points[corners[3]] - points[corners[1]])
        else:
            # About the face's first corner: far from the origin products would cancel.
            around = points[polygons.corners[starts[chosen, None] + np.arange(count)]]
            around = around - around[:, :1]
            normals[chosen] = np.cross(around, np.roll(around, -1, 1)).sum(1)
    return normals


def unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    units: Array = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return units


def smooth_normals(polygons: Polygons, sharp: Array) -> tuple[Array | None, Array | None]:
    """Normals of vertices, [n, 3], or, where there are sharp edges, of corners, [c, 3]. ``sharp``: [c] of bool, the edge from a corner to the next.

    The mean of the faces around, as far as no sharp edge lies between them, by area.
    """
    normals, owners, n = face_normals(polygons), polygons.owners(), len(polygons.vertices)
    if not sharp.any():
        return unit(scatter_sum(polygons.corners, normals[owners], n)), None
    group = _smooth_groups(polygons, sharp)
    return None, unit(scatter_sum(group, normals[owners], len(group)))[group]


def _smooth_groups(polygons: Polygons, sharp: Array) -> Array:
    """[c]: the same number for corners of one vertex that smooth edges join."""
    begin, after = polygons.corners, polygons.following()
    end = begin[after]
    key = np.minimum(begin, end) * (len(polygons.vertices) + 1) + np.maximum(begin, end)
    order = np.argsort(key, kind="stable")
    same = (key[order][1:] == key[order][:-1]) & ~sharp[order][1:]
    one, other = order[:-1][same], order[1:][same]
    # Of both faces along the edge, the corners at each of its ends.
    turned = begin[one] != begin[other]
    first = np.concatenate([one, after[one]])
    second = np.concatenate([np.where(turned, after[other], other), np.where(turned, other, after[other])])
    group = np.arange(len(begin))
    while True:
        least = np.minimum(group[first], group[second])
        changed = group.copy()
        np.minimum.at(changed, first, least)
        np.minimum.at(changed, second, least)
        if np.array_equal(changed, group):
            return group
        group = changed


def triangulate(polygons: Polygons) -> tuple[Array, Array, int]:
    """Triangles as corners, [t, 3]; the face of each, by its place in ``counts``, [t]; and how many polygons were too long to look at.

    Quads that bend are cut where neither half turns over, other polygons along their outline if they are not convex.
    """
    counts, starts = polygons.counts, polygons.starts()
    if (counts == 3).all():
        return np.arange(3 * len(counts)).reshape(-1, 3), np.arange(len(counts)), 0
    points = polygons.vertices[:, :3]
    pieces, owners, too_long = [], [], 0
    for count in np.unique(counts):
        chosen = np.flatnonzero(counts == count)
        around = starts[chosen, None] + np.arange(count)
        fans = np.stack([np.broadcast_to(around[:, :1], (len(chosen), count - 2)), around[:, 1:-1], around[:, 2:]], -1)
        if count == 4:
            turned = _bends(*(points[polygons.corners[around[:, k]]] for k in range(4)))
            fans[turned] = around[turned][:, [[1, 2, 3], [1, 3, 0]]]
        elif count > 4:
            outlines, normals = points[polygons.corners[around]], face_normals(polygons.some(counts == count))
            for row in np.flatnonzero(_dents(outlines, normals).any(1)):
                if count > _MOST_CORNERS:
                    too_long += 1
                else:
                    fans[row] = around[row][_along_outline(outlines[row], normals[row])]
        pieces.append(fans.reshape(-1, 3))
        owners.append(np.repeat(chosen, count - 2))
    triangles, owner = np.concatenate(pieces), np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return triangles[order], owner[order], too_long


def _bends(a: Array, b: Array, c: Array, d: Array) -> Array:
    """[f]: the quads that must be cut from b to d, for cut from a to c one half would be turned over. Each [f, 3]."""
    one, other = cross(b - a, c - a), cross(c - a, d - a)
    whole = one + other
    least: Array = np.minimum((one * whole).sum(1), (other * whole).sum(1)) < -1e-9 * (whole * whole).sum(1)
    return least


def _dents(points: Array, normals: Array) -> Array:
    """[f, k]: the corners at which polygons of k corners turn inwards."""
    before, behind = points - np.roll(points, 1, 1), np.roll(points, -1, 1) - points
    turn = np.einsum("fki,fi->fk", np.cross(before, behind), normals)
    inwards: Array = turn < -1e-9 * np.einsum("fi,fi->f", normals, normals)[:, None]
    return inwards


def _along_outline(points: Array, normal: Array) -> Array:
    """[k - 2, 3]: ears are cut off one by one; what has none left, since it crosses itself, becomes a fan."""
    drop = int(np.argmax(np.abs(normal)))
    flat = points[:, [a for a in range(3) if a != drop]]
    if (normal[drop] < 0) != (drop == 1):
        flat = flat * (-1, 1)
    left, triangles = list(range(len(points))), []
    at = tries = 0
    while len(left) > 3 and tries < len(left):
        a, b, c = (left[(at + k) % len(left)] for k in range(3))
        if _is_ear(flat, left, a, b, c):
            triangles.append((a, b, c))
            left.pop((at + 1) % len(left))
            at, tries = at % len(left), 0
        else:
            at, tries = (at + 1) % len(left), tries + 1
    triangles += [(left[0], left[k], left[k + 1]) for k in range(1, len(left) - 1)]
    return np.array(triangles)


def _is_ear(flat: Array, left: list[int], a: int, b: int, c: int) -> bool:
    others = flat[[v for v in left if v not in (a, b, c)]]
    corners = flat[[a, b, c]]
    if _side(corners[0], corners[1], corners[2]) <= 0:
        return False
    inside = np.ones(len(others), bool)
    for k in range(3):
        inside &= _side(corners[k], corners[(k + 1) % 3], others.T) >= 0
    # Corners that lie on the ear's own ones do not count: outlines may touch themselves.
    inside &= ~(others[:, None] == corners[None]).all(2).any(1)
    return not inside.any()


def _side(a: Array, b: Array, p: Array) -> Array:
    """More than 0: p is at the left of the way from a to b."""
    area: Array = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    return area
