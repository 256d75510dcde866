"""Subdivision surfaces against what is known of them, and against a slow implementation that follows the papers vertex by vertex."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest
from raypager._polygons import Polygons, face_normals, smooth_normals, triangulate
from raypager._subdivision import Sharpness, refine

CORNERS = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
SIDES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [0, 4, 7, 3], [1, 2, 6, 5]]


def polygons(points: object, faces: list[list[int]], values: object = None) -> Polygons:
    corners = np.concatenate(faces)
    own = np.zeros((len(corners), 0)) if values is None else np.asarray(values, np.float64)
    return Polygons(np.array([len(f) for f in faces]), corners, np.asarray(points, np.float64), own, np.arange(len(faces)))


def sharpness(n: int, creases: dict[tuple[int, int], float] | None = None, corners: dict[int, float] | None = None) -> Sharpness:
    creases, vertices = creases or {}, np.zeros(n)
    for vertex, sharp in (corners or {}).items():
        vertices[vertex] = sharp
    return Sharpness(np.array(list(creases), np.int64).reshape(-1, 2), np.array(list(creases.values()), np.float64), vertices)


def grid(n: int) -> tuple[np.ndarray, list[list[int]]]:
    y, x = np.mgrid[0 : n + 1, 0 : n + 1]
    a = (y[:-1, :-1] * (n + 1) + x[:-1, :-1]).ravel()
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1), np.stack([a, a + 1, a + n + 2, a + n + 1], 1).tolist()


def below(sharp: float) -> float:
    """One level down."""
    return 10.0 if sharp >= 10 else max(sharp - 1, 0)


def naive_vertex(
    point: np.ndarray, others: list[np.ndarray], edge_sharp: list[float], own: float, middles: list[np.ndarray]
) -> tuple[int, np.ndarray]:
    """Where a vertex goes, and by which rule. ``others``: the other ends of its edges; ``middles``: of its faces."""
    creased = [other for other, sharp in zip(others, edge_sharp, strict=True) if sharp > 0]
    if own > 0 or len(creased) > 2:
        return 2, point
    if len(creased) == 2:
        return 1, 0.75 * point + 0.125 * (creased[0] + creased[1])
    n, halves = len(others), [(other + point) / 2 for other in others]
    return 0, (np.mean(middles, 0) + 2 * np.mean(halves, 0) + (n - 3) * point) / n


def naive_step(points: np.ndarray, faces: list[list[int]], creases: dict[tuple[int, int], float], corners: dict[int, float]) -> np.ndarray:
    """Points after one level, in the order of refine's: vertices, edges by their ends, faces. A semi-sharp rule mixes with that one level down."""
    middles = [points[f].mean(0) for f in faces]
    around = defaultdict(list)
    for number, face in enumerate(faces):
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            around[min(a, b), max(a, b)].append(number)
    sharp = {e: 10.0 if len(f) != 2 else creases.get(e, creases.get(e[::-1], 0.0)) for e, f in around.items()}
    new_edges = []
    for edge in sorted(around):
        middle = points[list(edge)].mean(0)
        smooth = (points[list(edge)].sum(0) + sum(middles[f] for f in around[edge])) / 4
        s = min(sharp[edge], 1)
        new_edges.append((1 - s) * smooth + s * middle)
    new_points = []
    for vertex, point in enumerate(points):
        edges = [e for e in around if vertex in e]
        touching = [middles[n] for n, f in enumerate(faces) if vertex in f]
        others, own = [points[e[0] + e[1] - vertex] for e in edges], 10.0 if len(touching) == 1 else corners.get(vertex, 0.0)
        kind, here = naive_vertex(point, others, [sharp[e] for e in edges], own, touching)
        kind_below, there = naive_vertex(point, others, [below(sharp[e]) for e in edges], below(own), touching)
        if kind != kind_below:
            ending = [sharp[e] for e in edges if sharp[e] > 0 and below(sharp[e]) <= 0] + ([own] if own > 0 and below(own) <= 0 else [])
            share = min(float(np.mean(ending)), 1.0)
            here = share * here + (1 - share) * there
        new_points.append(here)
    return np.array([*new_points, *new_edges, *middles])


def test_a_cube_by_hand() -> None:
    """A corner of a cube of side 2: three faces, whose middles are 1 along an axis each, and three edges."""
    once, _ = refine(polygons(CORNERS, SIDES), sharpness(8), 1, "catmullClark", "edgeAndCorner")
    assert once.vertices.shape == (8 + 12 + 6, 3) and len(once.counts) == 24
    # (F + 2 R + 0 P) / 3, F = 1/3 and R = 2/3 along each axis.
    assert np.allclose(np.abs(once.vertices[:8]), 5 / 9)
    assert np.allclose(np.sort(np.abs(once.vertices[8:20]), 1), [0, 0.75, 0.75])
    assert np.allclose(np.sort(np.abs(once.vertices[20:]), 1), [0, 0, 1])


def test_it_converges() -> None:
    """To the limit of a vertex of valence 3: (9 P + 4 sum of neighbours + sum of the corners across) / 24."""
    start = polygons(CORNERS, SIDES)
    point, near, across = np.array(CORNERS[6]), np.array([CORNERS[2], CORNERS[5], CORNERS[7]]), np.array([CORNERS[1], CORNERS[3], CORNERS[4]])
    limit = (9 * point + 4 * near.sum(0) + across.sum(0)) / 24
    errors = [np.abs(refine(start, sharpness(8), n, "catmullClark", "edgeAndCorner")[0].vertices[6] - limit).max() for n in range(1, 6)]
    assert errors[4] < 1e-3 and all(b < a / 2 for a, b in zip(errors, errors[1:], strict=False))
    fine, _ = refine(start, sharpness(8), 4, "catmullClark", "edgeAndCorner")
    size = np.linalg.norm(fine.vertices, axis=1)
    assert size.max() / size.min() < 1.15  # about a ball


@pytest.mark.parametrize("seed", range(4))
def test_like_the_naive_one(seed: int) -> None:
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    points, faces = grid(3)
    points = points + random.uniform(-0.3, 0.3, points.shape)
    # A pentagon and a triangle among the quads.
    faces[4:5] = [[faces[4][0], faces[4][1], faces[4][2]], [faces[4][0], faces[4][2], faces[4][3]]]
    creases = {(faces[0][1], faces[0][2]): 2.5, (faces[3][0], faces[3][1]): 0.4, (5, 6): 10.0, (6, 10): 1.0, (6, 7): float(random.uniform(0, 3))}
    corners = {10: float(random.uniform(0, 2)), 9: 10.0}
    once, _ = refine(polygons(points, faces), sharpness(len(points), creases, corners), 1, "catmullClark", "edgeAndCorner")
    assert np.allclose(once.vertices, naive_step(points, faces, creases, corners), atol=1e-12)
    # The second level is one of the first, with creases one less sharp.
    twice, _ = refine(polygons(points, faces), sharpness(len(points), creases, corners), 2, "catmullClark", "edgeAndCorner")
    n = len(points)
    between = sorted({(min(a, b), max(a, b)) for f in faces for a, b in zip(f, f[1:] + f[:1], strict=True)})
    left = {}
    for number, edge in enumerate(between):
        s = below(creases.get(edge, creases.get(edge[::-1], 0.0)))
        left |= {(edge[0], n + number): s, (edge[1], n + number): s}
    corners = {v: below(s) for v, s in corners.items()}
    quads = once.corners.reshape(-1, 4).tolist()
    assert np.allclose(twice.vertices, naive_step(once.vertices, quads, left, corners), atol=1e-12)


@pytest.mark.parametrize("scheme", ["catmullClark", "bilinear"])
def test_a_grid_stays_what_it_is(scheme: str) -> None:
    points, faces = grid(4)
    corners = np.concatenate(faces)
    mesh = polygons(points, faces, points[corners, :2] / 4)
    fine, sharp = refine(mesh, sharpness(len(points)), 2, scheme, "edgeAndCorner")  # type: ignore[arg-type]
    assert np.abs(fine.vertices[:, 2]).max() == 0
    assert np.allclose([fine.vertices.min(0), fine.vertices.max(0)], [[0, 0, 0], [4, 4, 0]])
    assert np.allclose(face_normals(fine)[:, 2].sum(), 2 * 16)  # twice the area
    assert len(fine.counts) == 16 * 16
    # Coordinates of textures are linear, so inside they are where the points are.
    assert np.allclose(fine.values * 4, fine.vertices[fine.corners, :2], atol=0.2)
    of_vertices, of_corners = smooth_normals(fine, sharp)
    normals = of_vertices if of_corners is None else of_corners
    assert normals is not None and np.allclose(normals, (0, 0, 1))


def test_boundaries() -> None:
    points, faces = grid(3)
    round_corners, _ = refine(polygons(points, faces), sharpness(len(points)), 3, "catmullClark", "edgeOnly")
    sharp_corners, _ = refine(polygons(points, faces), sharpness(len(points)), 3, "catmullClark", "edgeAndCorner")
    assert np.array_equal(sharp_corners.vertices[0], points[0]) and np.linalg.norm(round_corners.vertices[0] - points[0]) > 0.1
    inner, _ = refine(polygons(points, faces), sharpness(len(points)), 3, "catmullClark", "none")
    assert set(inner.faces) == {4} and len(inner.counts) == 64


def test_infinite_creases_keep_the_cube() -> None:
    creases = {(a, b): 10.0 for f in SIDES for a, b in zip(f, f[1:] + f[:1], strict=True)}
    fine, sharp = refine(polygons(CORNERS, SIDES), sharpness(8, creases), 3, "catmullClark", "edgeAndCorner")
    assert np.allclose(np.abs(fine.vertices).max(1), 1) and np.isclose(np.abs(face_normals(fine)).sum() / 2, 24)
    _, normals = smooth_normals(fine, sharp)
    assert normals is not None and np.allclose(np.sort(np.abs(normals), 1), (0, 0, 1))


def test_loop() -> None:
    """An octahedron: beta of valence 4 is (5/8 - (3/8)^2) / 4."""
    points = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    once, _ = refine(polygons(points, faces), sharpness(6), 1, "loop", "edgeAndCorner")
    assert np.allclose(np.abs(once.vertices[:6]).max(1), 1 - (5 / 8 - 9 / 64))
    # 3/8 of both ends; those opposite cancel out.
    assert np.allclose(np.sort(np.abs(once.vertices[6:]), 1), [0, 3 / 8, 3 / 8])
    fine, _ = refine(polygons(points, faces), sharpness(6), 4, "loop", "edgeAndCorner")
    assert len(fine.counts) == 8 * 4**4
    outside = (face_normals(fine) * fine.vertices[fine.corners].reshape(-1, 3, 3).mean(1)).sum(1)
    assert (outside > 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_polygons_are_cut_along_their_outline(seed: int) -> None:
    """Stars of many corners, in planes that lie askew: the triangles have the outline's area, and none is turned over."""
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    points, faces = [], []
    for corners in (3, 4, 4, 5, 7, 12, 40):
        angle = np.sort(random.uniform(0, 2 * np.pi, corners)) if corners > 4 else 2 * np.pi * np.arange(corners) / corners
        flat = random.uniform(0.3, 1, corners)[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        if np.diff(angle, append=angle[0] + 2 * np.pi).max() > 3:
            continue  # not a star about the middle
        axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
        faces.append(list(range(len(points), len(points) + corners)))
        points += list(flat @ axes[:, :2].T + 1000)
    mesh = polygons(points, faces)
    triangles, owners, too_long = triangulate(mesh)
    assert len(triangles) == (mesh.counts - 2).sum() and too_long == 0
    p = mesh.vertices[mesh.corners[triangles]]
    each = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    whole = face_normals(mesh)
    assert ((each * whole[owners]).sum(1) > -1e-9).all()
    area = np.bincount(owners, np.linalg.norm(each, axis=1))
    assert np.allclose(area, np.linalg.norm(whole, axis=1), rtol=1e-6)
