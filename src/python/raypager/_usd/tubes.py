"""Curves as tubes of eight sides."""

from __future__ import annotations

import numpy as np

from .._arrays import Array
from .._polygons import unit
from .round import Tessellation

# Rows give the weights of four points for 1, t, t^2 and t^3; and how many points one segment is behind the other.
BASES: dict[str, tuple[Array | None, int]] = {
    "linear": (None, 1),
    "bezier": (np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], np.float64), 3),
    "bspline": (np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], np.float64) / 6, 1),
    "catmullRom": (np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]], np.float64) / 2, 1),
}
_SIDES = 8
_STEPS = 8  # of a cubic segment


def tubes(points: Array, counts: Array, widths: Array, basis: str, wrap: str, most_triangles: int) -> tuple[Tessellation, Array] | None:
    """Also the curve of each vertex, [n]. None if they would be too many.

    ``points``: [n, 3]. ``widths``: one for all, one each, one of each point, or of each end of a segment.
    """
    lines, owners, begin = [], [], 0
    sizes = _widths_of_points(points, counts, widths)
    triangles = 0
    for curve, count in enumerate(counts):
        line = _line(np.concatenate([points[begin : begin + count], sizes[begin : begin + count, None]], 1), basis, wrap)
        begin += count
        if len(line) < 2:
            continue
        triangles += 2 * _SIDES * (len(line) - 1)
        if triangles > most_triangles:
            return None
        lines.append(line)
        owners.append(curve)
    if not lines:
        return Tessellation(np.zeros((0, 3)), np.zeros((0, 3), np.int64)), np.zeros(0, np.int64)
    lengths = np.array([len(line) for line in lines])
    return _around(np.concatenate(lines), lengths), np.repeat(owners, lengths * _SIDES)


def _widths_of_points(points: Array, counts: Array, widths: Array) -> Array:
    if len(widths) == len(points):
        return widths
    if len(widths) == len(counts):
        return np.repeat(widths, counts)
    if len(widths) == 1:
        return np.full(len(points), widths[0])
    # Of the ends of segments: from the first to the last of each curve.
    share = np.concatenate([np.linspace(0, 1, c) if c else np.zeros(0) for c in counts])
    ends = np.linspace(0, len(widths) - 1, len(counts) + 1)
    low = np.repeat(ends[:-1], counts)
    sizes: Array = np.interp(low + share * np.repeat(np.diff(ends), counts), np.arange(len(widths)), widths)
    return sizes


def _line(points: Array, basis: str, wrap: str) -> Array:
    """[k, 4]: places along one curve, and widths."""
    weights, step = BASES[basis]
    if wrap == "periodic" and len(points) > 2:
        points = np.concatenate([points, points[: 1 if basis in ("linear", "bezier") else 3]])
    elif wrap == "pinned" and basis in ("bspline", "catmullRom") and len(points) > 1:
        points = np.concatenate([[2 * points[0] - points[1]], points, [2 * points[-1] - points[-2]]])
    if weights is None:
        return points
    first = np.arange(0, len(points) - 3, step)
    if len(first) == 0:
        return np.zeros((0, 4))
    t = np.arange(_STEPS) / _STEPS
    powers = np.stack([np.ones_like(t), t, t**2, t**3], 1) @ weights
    each = np.einsum("tk,skc->stc", powers, points[first[:, None] + np.arange(4)]).reshape(-1, 4)
    return np.concatenate([each, (weights.sum(0) @ points[first[-1] + np.arange(4)])[None]])


def _around(places: Array, counts: Array) -> Tessellation:
    ends = np.cumsum(counts) - 1
    is_last, is_first = np.zeros(len(places), bool), np.zeros(len(places), bool)
    is_last[ends], is_first[ends - counts + 1] = True, True
    step = np.diff(places[:, :3], axis=0, append=places[-1:, :3])
    step[is_last] = 0
    before = np.roll(step, 1, 0)
    tangent = unit(unit(step) + np.where(is_first[:, None], 0, unit(before)))
    tangent = np.where((np.abs(tangent).max(1) > 0)[:, None], tangent, (0, 0, 1))
    side = _sides(tangent, counts)
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    normals = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * np.cross(tangent, side)[:, None]
    positions = places[:, None, :3] + normals * places[:, None, 3:] / 2
    row = np.flatnonzero(~is_last)[:, None] * _SIDES
    a, b = row + np.arange(_SIDES), row + (np.arange(_SIDES) + 1) % _SIDES
    triangles = np.concatenate([np.stack([a, b, b + _SIDES], -1), np.stack([a, b + _SIDES, a + _SIDES], -1)]).reshape(-1, 3)
    return Tessellation(positions.reshape(-1, 3), triangles, normals.reshape(-1, 3))


def _sides(tangent: Array, counts: Array) -> Array:
    """Directions across curves that turn about them as little as can be: all curves go one step at a time."""
    starts = np.cumsum(counts) - counts
    side = np.zeros_like(tangent)
    axis = np.eye(3)[np.abs(tangent[starts]).argmin(1)]
    side[starts] = unit(np.cross(tangent[starts], axis))
    for step in range(1, int(counts.max())):
        here = starts[counts > step] + step
        carried = side[here - 1] - (side[here - 1] * tangent[here]).sum(1, keepdims=True) * tangent[here]
        lost = np.abs(carried).max(1) < 1e-6
        carried[lost] = np.cross(tangent[here[lost]], np.eye(3)[np.abs(tangent[here[lost]]).argmin(1)])
        side[here] = unit(carried)
    return side
