"""Subdivision surfaces, refined evenly: Catmull and Clark's scheme (1978), Loop's (1987) and the bilinear one, with semi-sharp creases as Pixar's
OpenSubdiv has them (DeRose, Kass and Truong 1998). What belongs to corners, such as coordinates of textures, is interpolated linearly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ._arrays import Array
from ._polygons import Polygons, scatter_sum

Scheme = Literal["catmullClark", "loop", "bilinear"]
Boundary = Literal["edgeAndCorner", "edgeOnly", "none"]
INFINITE = 10.0  # as sharp as can be


@dataclass
class Sharpness:
    """``edges``: [e, 2] vertices, each as sharp as ``creases``, [e]. ``vertices``: [n]."""

    edges: Array
    creases: Array
    vertices: Array


@dataclass
class _Edges:
    """Of a mesh: ``ends``, [e, 2]; ``faces``, how many meet there, [e]; ``of``, the edge from each corner to the next, [c]; ``sharp``, [e]."""

    ends: Array
    faces: Array
    of: Array
    sharp: Array


def refine(polygons: Polygons, sharpness: Sharpness, levels: int, scheme: Scheme, boundary: Boundary) -> tuple[Polygons, Array]:
    """The mesh after so many levels, and which of the edges from its corners to the next are creases that stay sharp, [c] of bool.

    Loop's scheme takes triangles alone. With the boundary "none", faces at it are left out, as if they were holes.
    """
    edges = _edges_of(polygons, sharpness)
    if boundary == "none":
        at_boundary = np.zeros(len(polygons.vertices), bool)
        at_boundary[edges.ends[edges.faces == 1].ravel()] = True
        hidden = np.unique(polygons.owners()[at_boundary[polygons.corners]])
        hidden_faces = polygons.faces[hidden]
    for level in range(levels):
        edges = _edges_of(polygons, sharpness) if level else edges
        step = {"catmullClark": _catmull_clark, "loop": _loop, "bilinear": _bilinear}[scheme]
        vertices = step(polygons, edges, _vertex_sharpness(polygons, edges, sharpness, boundary))
        cut = _cut_triangles if scheme == "loop" else _cut_faces
        refined = cut(polygons, edges, vertices)
        sharpness = _sharpness_below(edges, sharpness, len(polygons.vertices), len(vertices))
        polygons = refined
    sharp = np.zeros(len(polygons.corners), bool)
    # Boundaries are at the end of a surface anyway.
    if scheme != "bilinear" and (len(sharpness.edges) or edges.faces.max(initial=0) > 2):
        edges = _edges_of(polygons, sharpness)
        sharp = (edges.sharp > 0)[edges.of]
    if boundary == "none":
        chosen = ~np.isin(polygons.faces, hidden_faces)
        sharp = sharp[np.repeat(chosen, polygons.counts)]
        polygons = polygons.some(chosen)
    return polygons, sharp


def _edges_of(polygons: Polygons, sharpness: Sharpness) -> _Edges:
    n = len(polygons.vertices)
    begin = polygons.corners.astype(np.int64)
    end = begin[polygons.following()]
    keys, of, faces = np.unique(np.minimum(begin, end) * n + np.maximum(begin, end), return_inverse=True, return_counts=True)
    sharp = np.zeros(len(keys))
    if len(sharpness.edges) and len(keys):
        wanted = np.sort(sharpness.edges.astype(np.int64), 1) @ np.array([n, 1])
        found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        there = keys[found] == wanted
        np.maximum.at(sharp, found[there], sharpness.creases[there])
    # Boundaries, and edges of more than two faces.
    sharp[faces != 2] = INFINITE
    return _Edges(np.stack([keys // n, keys % n], 1), faces, of.reshape(-1), np.minimum(sharp, INFINITE))


def _vertex_sharpness(polygons: Polygons, edges: _Edges, sharpness: Sharpness, boundary: Boundary) -> Array:
    sharp = np.minimum(sharpness.vertices, INFINITE)
    if boundary == "edgeAndCorner":
        n = len(polygons.vertices)
        at_boundary = np.bincount(edges.ends[edges.faces == 1].ravel(), minlength=n) > 0
        sharp = np.where(at_boundary & (np.bincount(polygons.corners, minlength=n) == 1), INFINITE, sharp)
    return sharp


def _below(sharp: Array) -> Array:
    """One level further down."""
    return np.where(sharp >= INFINITE, INFINITE, np.maximum(sharp - 1, 0))


def _sharpness_below(edges: _Edges, sharpness: Sharpness, n: int, refined: int) -> Sharpness:
    """Each edge becomes two, which meet at its own vertex; boundaries are found anew."""
    left = np.where(edges.faces == 2, _below(edges.sharp), 0)
    kept = np.flatnonzero(left > 0)
    halves = [np.stack([edges.ends[kept, k], n + kept], 1) for k in (0, 1)]
    vertices = np.zeros(refined)
    vertices[:n] = _below(sharpness.vertices)
    return Sharpness(np.concatenate(halves), np.tile(left[kept], 2), vertices)


def _face_means(polygons: Polygons, values: Array) -> Array:
    """[f, k], of values at corners."""
    means: Array = np.add.reduceat(values, polygons.starts()) / polygons.counts[:, None]
    return means


def _neighbour_sums(edges: _Edges, vertices: Array, chosen: Array | None = None) -> Array:
    """[n, k]: the sum over the other ends of a vertex's edges, or of some of them."""
    a, b = (edges.ends if chosen is None else edges.ends[chosen]).T
    return scatter_sum(np.concatenate([a, b]), vertices[np.concatenate([b, a])], len(vertices))


def _edge_points(edges: _Edges, vertices: Array, smooth: Array) -> Array:
    middle = vertices[edges.ends].mean(1)
    share = np.clip(edges.sharp, 0, 1)[:, None]
    points: Array = (1 - share) * smooth + share * middle
    return points


def _vertex_points(edges: _Edges, vertices: Array, smooth: Array, sharp: Array) -> Array:
    """By the rule that holds here, the one that holds a level down, or, where creases end in between, something of both."""
    n = len(vertices)
    here, below = edges.sharp, _below(edges.sharp)

    def count(chosen: Array) -> Array:
        return np.bincount(edges.ends[chosen].ravel(), minlength=n)

    def rule(edge_sharp: Array, vertex_sharp: Array) -> tuple[Array, Array]:
        chosen = edge_sharp > 0
        creases = count(chosen)
        crease = (6 * vertices + _neighbour_sums(edges, vertices, chosen)) / 8
        kind = np.where((vertex_sharp > 0) | (creases > 2), 2, np.where(creases == 2, 1, 0))
        return kind, np.where(kind[:, None] == 2, vertices, np.where(kind[:, None] == 1, crease, smooth))

    kind, points = rule(here, sharp)
    if not ((here > 0) & (here < INFINITE)).any() and not ((sharp > 0) & (sharp < INFINITE)).any():
        return points
    kind_below, points_below = rule(below, _below(sharp))
    ending = (here > 0) & (below <= 0)
    ending_vertex = (sharp > 0) & (_below(sharp) <= 0)
    ends = edges.ends[ending].ravel()
    total = np.bincount(ends, np.repeat(here[ending], 2), n) + np.where(ending_vertex, sharp, 0)
    number = np.bincount(ends, minlength=n) + ending_vertex
    share = np.clip(np.divide(total, number, out=np.ones(n), where=number > 0), 0, 1)[:, None]
    return np.where((kind == kind_below)[:, None], points, (1 - share) * points_below + share * points)


def _catmull_clark(polygons: Polygons, edges: _Edges, sharp: Array) -> Array:
    vertices, owners = polygons.vertices, polygons.owners()
    means = _face_means(polygons, vertices[polygons.corners])
    smooth_edges = (vertices[edges.ends].sum(1) + scatter_sum(edges.of, means[owners], len(edges.ends))) / 4
    n = np.maximum(np.bincount(edges.ends.ravel(), minlength=len(vertices)), 1)[:, None]
    around = _neighbour_sums(edges, vertices) + scatter_sum(polygons.corners, means[owners], len(vertices))
    smooth = (n - 2) / n * vertices + around / n**2
    unused = np.bincount(polygons.corners, minlength=len(vertices)) == 0
    smooth[unused] = vertices[unused]
    return np.concatenate([_vertex_points(edges, vertices, smooth, sharp), _edge_points(edges, vertices, smooth_edges), means])


def _bilinear(polygons: Polygons, edges: _Edges, sharp: Array) -> Array:
    vertices = polygons.vertices
    return np.concatenate([vertices, vertices[edges.ends].mean(1), _face_means(polygons, vertices[polygons.corners])])


def _loop(polygons: Polygons, edges: _Edges, sharp: Array) -> Array:
    vertices = polygons.vertices
    opposite = polygons.corners[polygons.following()[polygons.following()]]
    smooth_edges = (3 * vertices[edges.ends].sum(1) + scatter_sum(edges.of, vertices[opposite], len(edges.ends))) / 8
    n = np.maximum(np.bincount(edges.ends.ravel(), minlength=len(vertices)), 1)[:, None]
    share = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
    smooth = (1 - n * share) * vertices + share * _neighbour_sums(edges, vertices)
    return np.concatenate([_vertex_points(edges, vertices, smooth, sharp), _edge_points(edges, vertices, smooth_edges)])


def _cut_faces(polygons: Polygons, edges: _Edges, vertices: Array) -> Polygons:
    """A quad for each corner: the vertex, the middle of the edge behind it, that of the face, and that of the edge before it."""
    n, e, owners, after = len(polygons.vertices), len(edges.ends), polygons.owners(), polygons.following()
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    corners = np.stack([polygons.corners, n + edges.of, n + e + owners, n + edges.of[before]], 1)
    own = polygons.values
    values = np.stack([own, (own + own[after]) / 2, _face_means(polygons, own)[owners], (own + own[before]) / 2], 1)
    return Polygons(np.full(len(corners), 4), corners.ravel(), vertices, values.reshape(corners.size, own.shape[1]), polygons.faces[owners])


def _cut_triangles(polygons: Polygons, edges: _Edges, vertices: Array) -> Polygons:
    """Four of each."""
    n, own = len(polygons.vertices), polygons.values.reshape(len(polygons.counts), 3, polygons.values.shape[1])
    v, m = polygons.corners.reshape(-1, 3), n + edges.of.reshape(-1, 3)
    corners = np.stack([v[:, 0], m[:, 0], m[:, 2], v[:, 1], m[:, 1], m[:, 0], v[:, 2], m[:, 2], m[:, 1], m[:, 0], m[:, 1], m[:, 2]], 1)
    middle = (own + np.roll(own, -1, 1)) / 2
    a, b, c, ab, bc, ca = own[:, 0], own[:, 1], own[:, 2], middle[:, 0], middle[:, 1], middle[:, 2]
    values = np.stack([a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca], 1)
    faces = np.repeat(polygons.faces, 4)
    return Polygons(np.full(len(faces), 3), corners.ravel(), vertices, values.reshape(corners.size, own.shape[2]), faces)
