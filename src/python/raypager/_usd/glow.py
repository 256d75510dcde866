"""Surfaces that shine by an image: lights have one colour each, so triangles that shine about alike become one."""

from __future__ import annotations

import numpy as np

from .. import _raypager
from .._arrays import Array, Triple
from .shading import FromImage

_MOST_GROUPS = 64
# Where a triangle is looked at, as shares of its corners.
_PLACES = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 0.1], [0.1, 2, 2], [2, 0.1, 2]])
_PLACES /= _PLACES.sum(1, keepdims=True)


def groups_of(glow: FromImage, pixels: Array, uvs: Array, triangles: Array) -> list[tuple[Triple, Array]]:
    """Radiances, and the triangles of each, [t] of bool."""
    colors = _means(glow, pixels, uvs, triangles)
    largest = colors.max(initial=0)
    if largest <= 0:
        return [((0.0, 0.0, 0.0), np.ones(len(triangles), bool))]
    for steps in (64, 32, 16, 8, 4, 2, 1):
        cells = np.round(np.sqrt(colors / largest) * steps).astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
        kinds, group = np.unique(cells, return_inverse=True)
        if len(kinds) <= _MOST_GROUPS:
            break
    found = []
    for number, kind in enumerate(kinds):
        chosen = group.reshape(-1) == number
        r, g, b = colors[chosen].mean(0) if kind else (0, 0, 0)
        found.append(((float(r), float(g), float(b)), chosen))
    return found


def _means(glow: FromImage, pixels: Array, uvs: Array, triangles: Array) -> Array:
    height, width = pixels.shape[:2]
    total = np.zeros((len(triangles), 3))
    matrix, scale, bias = np.array(glow.matrix), np.array(glow.scale[:3]), np.array(glow.bias[:3])
    corners = uvs[triangles].astype(np.float64)
    for place in _PLACES:
        at = np.einsum("k,tkc->tc", place, corners) @ matrix[:2, :2].T + matrix[:2, 2]
        at = np.nan_to_num(at, posinf=0, neginf=0)
        (x, seen_x), (y, seen_y) = _texel(at[:, 0], width, glow.wraps[0]), _texel(1 - at[:, 1], height, glow.wraps[1])
        texels = pixels[y, x].astype(np.float64) * (seen_x & seen_y)[:, None]
        if glow.channel:
            texels = np.repeat(texels[:, [min(glow.channel - 3, 2)]], 3, 1)
        total += np.clip(texels * scale + bias, 0, 1e9)
    return total / len(_PLACES)


def _texel(at: Array, size: int, wrap: int) -> tuple[Array, Array]:
    inside = (at >= 0) & (at <= 1)
    share = at - np.floor(at)
    if wrap == _raypager.WRAP_MIRROR:
        share = np.where(np.floor(at) % 2 == 1, 1 - share, share)
    if wrap in (_raypager.WRAP_CLAMP, _raypager.WRAP_BLACK):
        share = np.clip(at, 0, 1)
    return np.minimum((share * size).astype(np.int64), size - 1), inside | (wrap != _raypager.WRAP_BLACK)
