"""Shapes and instances on their way into a scene. An object must be whole before something places it, so they are gathered first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd

from .._arrays import Array
from .._scene import Scene
from .._shapes import Object, Shapes

_MOST_POINTS = 4096  # of a shape that are framed as they are; of more, the corners of a box
_AT_ONCE = 1 << 16  # instances


@dataclass
class Found:
    """What a prototype shows: an object, its box, [8, 3], and where it is in what is placed, [4, 4]; and lights without a surface."""

    object: Object | None
    box: Array
    inside: Array
    lights: list[tuple[Usd.Prim, Array]]

    def is_empty(self) -> bool:
        return self.object is None and not self.lights


@dataclass
class Content:
    """Of the world, or of an object. ``points``: some of what is seen, [n, 3] each, for framing it.
    ``children``: the predicate of prims that are looked at. ``lights``: those of an object that only the world can have.
    """

    in_object: bool
    children: Any
    shapes: list[tuple[str, Callable[[Shapes], None]]] = field(default_factory=list)
    places: dict[int, tuple[Object, Array, list[Array]]] = field(default_factory=dict)
    points: list[Array] = field(default_factory=list)
    lights: list[tuple[Usd.Prim, Array]] = field(default_factory=list)
    placed_lights: int = 0

    def add(self, label: str, put: Callable[[Shapes], None], points: Array, matrix: Array) -> None:
        """``points``: [n, 3], of the shape; ``matrix`` leads from there to here."""
        self.shapes.append((label, put))
        self.frame(points, matrix)

    def frame(self, points: Array, matrix: Array) -> None:
        if len(points):
            some = points if len(points) <= _MOST_POINTS else corners_of_box(points)
            self.points.append(transformed(some, matrix))

    def place(self, object: Object, box: Array, matrices: Array) -> None:
        """``box``: [8, 3], the corners of what the object shows. ``matrices``: [n, 4, 4]."""
        self.places.setdefault(id(object), (object, box, []))[2].append(np.ascontiguousarray(matrices[:, :3], np.float64))

    def put_into(self, scene: Scene, target: Shapes) -> None:
        for label, put in self.shapes:
            scene._label = label
            put(target)
        scene._label = ""
        for object, _, rows in self.places.values():
            target.instances(object, np.concatenate(rows))
        self.shapes, self.places = [], {}

    def is_empty(self) -> bool:
        return not self.shapes and not self.places

    def only_place(self) -> tuple[Object, Array, Array] | None:
        """If there is nothing but an object, once: that, its box, and [4, 4] where it is."""
        rows = [(object, box, some) for object, box, parts in self.places.values() for some in parts]
        if self.shapes or len(rows) != 1 or len(rows[0][2]) != 1:
            return None
        object, box, (row,) = rows[0]
        return object, box, np.concatenate([row, [[0, 0, 0, 1]]])

    def seen(self) -> Array:
        """[n, 3]: points to frame, those of objects in all their places included."""
        found = [*self.points]
        for _, box, rows in self.places.values():
            for some in rows:
                for begin in range(0, len(some) if len(box) else 0, _AT_ONCE):
                    piece = some[begin : begin + _AT_ONCE]
                    placed = (np.einsum("nij,pj->npi", piece[:, :, :3], box) + piece[:, None, :, 3]).reshape(-1, 3)
                    found.append(placed if len(piece) < _AT_ONCE else corners_of_box(placed))
        return np.concatenate(found) if found else np.zeros((0, 3))


def corners_of_box(points: Array) -> Array:
    with np.errstate(invalid="ignore"):
        finite = points[np.isfinite(points).all(1)]
    if len(finite) == 0:
        return np.zeros((0, 3))
    low, high = finite.min(0).astype(np.float64), finite.max(0).astype(np.float64)
    return np.array([[(low, high)[i >> a & 1][a] for a in range(3)] for i in range(8)])


def transformed(points: Array, matrix: Array) -> Array:
    return points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def is_similarity(matrix: Array) -> bool:
    """Whether it stretches alike in all directions."""
    gram = matrix[:3, :3].T @ matrix[:3, :3]
    size = gram.trace() / 3
    return bool(size > 0 and np.abs(gram - size * np.eye(3)).max() <= 1e-5 * size)
