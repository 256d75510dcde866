"""Shapes that are round, as triangles: 128 around, so that none is off by more than 1/3300 of the radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Array

AROUND = 128


@dataclass
class Tessellation:
    """[n, 3] positions and normals, [n, 2] uvs, [m, 3] triangles, counter-clockwise from outside. Without normals: flat."""

    positions: Array
    triangles: Array
    normals: Array | None = None
    uvs: Array | None = None


def swept(profile: Array, normals: Array) -> Tessellation:
    """A profile in the x-z plane, [k, 2] of x >= 0 and z upwards, turned about z. ``normals``: [k, 2]. A point that comes twice is an edge."""
    angle = 2 * np.pi * np.arange(AROUND + 1) / AROUND
    angle[-1] = 0  # the seam is closed to the bit
    c, s = np.cos(angle), np.sin(angle)

    def turned(values: Array) -> Array:
        return np.stack([np.outer(values[:, 0], c), np.outer(values[:, 0], s), np.repeat(values[:, 1:], AROUND + 1, 1)], -1).reshape(-1, 3)

    row, column = np.meshgrid(np.arange(len(profile) - 1), np.arange(AROUND), indexing="ij")
    a = (row * (AROUND + 1) + column).ravel()
    b, above = a + 1, AROUND + 1
    triangles = np.concatenate([np.stack([a, b, b + above], 1), np.stack([a, b + above, a + above], 1)])
    positions = turned(profile)
    corners = positions[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    u, v = np.meshgrid(np.arange(AROUND + 1) / AROUND, np.linspace(0, 1, len(profile)))
    return Tessellation(positions, triangles[area > 0], turned(normals), np.stack([u.ravel(), v.ravel()], 1))


def sphere(radius: float) -> Tessellation:
    angle = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 1)
    around = np.stack([np.cos(angle), np.sin(angle)], 1)
    around[[0, -1], 0] = 0
    return swept(radius * around, around)


def cylinder(bottom: float, top: float, height: float, *, caps: bool = True) -> Tessellation:
    """Between two radii, around the origin: a cone where one of them is 0."""
    low, high = (bottom, -height / 2), (top, height / 2)
    slope = np.array([height, bottom - top]) / max(np.hypot(height, bottom - top), 1e-30)
    profile, normals = [low, high], [slope, slope]
    if caps and bottom > 0:
        profile, normals = [(0, low[1]), low, *profile], [(0, -1), (0, -1), *normals]
    if caps and top > 0:
        profile, normals = [*profile, high, (0, high[1])], [*normals, (0, 1), (0, 1)]
    return swept(np.array(profile, np.float64), np.array(normals, np.float64))


def capsule(bottom: float, top: float, height: float) -> Tessellation:
    """A cylinder, or where the radii differ the side of a cone, with a part of a ball beyond each end, into which it passes without an edge."""
    slope = np.arctan2(bottom - top, max(height, 1e-3 * abs(bottom - top)))  # of the side's normal
    steps = np.linspace(0, 1, AROUND // 4 + 1)
    parts, normals = [], []
    for radius, end, angle in (
        (bottom, -height / 2, slope * steps - np.pi / 2 * (1 - steps)),
        (top, height / 2, slope * (1 - steps) + np.pi / 2 * steps),
    ):
        arc = np.stack([np.cos(angle), np.sin(angle)], 1)
        arc[np.abs(angle) == np.pi / 2, 0] = 0
        ball = radius / np.cos(slope)
        parts.append(ball * arc + (0, end - ball * np.sin(slope)))
        normals.append(arc)
    return swept(np.concatenate(parts), np.concatenate(normals))


def disk(radius: float) -> Tessellation:
    """In the x-y plane, seen from +z."""
    up = np.array([(0.0, 1.0), (0.0, 1.0)])
    return swept(np.array([(radius, 0.0), (0.0, 0.0)]), up)


def cube(size: float) -> Tessellation:
    corners = size * (np.array([[i >> a & 1 for a in range(3)] for i in range(8)]) - 0.5)
    quads = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])
    uvs = np.tile([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], (6, 1))
    first = 4 * np.arange(6)[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return Tessellation(corners[quads.ravel()], triangles, None, uvs)


def plane(width: float, length: float) -> Tessellation:
    """In the x-y plane, seen from +z."""
    uvs = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    positions = np.concatenate([(uvs - 0.5) * (width, length), np.zeros((4, 1))], 1)
    return Tessellation(positions, np.array([[0, 1, 2], [0, 2, 3]]), None, uvs)


def along(axis: str) -> Array:
    """[4, 4]: turns z towards this axis."""
    matrix = np.eye(4)
    # The axis is the last column; the others follow, so that nothing is mirrored.
    matrix[:3, :3] = np.eye(3)[:, {"X": [1, 2, 0], "Y": [2, 0, 1]}.get(axis, [0, 1, 2])]
    return matrix
