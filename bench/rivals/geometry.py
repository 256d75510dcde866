"""Triangle meshes as binary PLY files, and vertices that triangles share."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

PROPERTIES = ("x", "y", "z", "nx", "ny", "nz")
FACE = np.dtype([("corners", "u1"), ("vertices", "<u4", 3)])
CHUNK = 1 << 22  # faces written at a time


class Mesh(NamedTuple):
    """vertices: [n, 3] float32 positions, or [n, 6] with normals; triangles: [m, 3] uint32, counter-clockwise from outside."""

    vertices: np.ndarray
    triangles: np.ndarray


def read_ply(path: Path) -> Mesh:
    """Of the kind that write_ply and `raypager bench export` write: little-endian, float vertices, triangles. ValueError for others."""
    with open(path, "rb") as file:
        lines = []
        while not lines or lines[-1] != "end_header":
            line = file.readline(200)
            if not line.endswith(b"\n") or len(lines) > 50:
                raise ValueError(f"{path}: the header has no end")
            lines.append(line.decode("ascii", "replace").strip())
        counts = {words[1]: int(words[2]) for words in map(str.split, lines) if words[:1] == ["element"]}
        floats = [words[2] for words in map(str.split, lines) if words[:2] == ["property", "float"]]
        lists = [line for line in lines if line.startswith("property list")]
        if "format binary_little_endian 1.0" not in lines or list(counts) != ["vertex", "face"] or tuple(floats) != PROPERTIES[: len(floats)]:
            raise ValueError(f"{path}: not a little-endian mesh of positions and normals")
        if len(floats) not in (3, 6) or lists not in [[f"property list uchar {t} vertex_indices"] for t in ("int", "uint")]:
            raise ValueError(f"{path}: not a mesh of positions, normals and triangles alone")
        vertices = np.fromfile(file, "<f4", counts["vertex"] * len(floats)).reshape(-1, len(floats))
        faces = np.fromfile(file, FACE, counts["face"])
    if len(vertices) != counts["vertex"] or len(faces) != counts["face"]:
        raise ValueError(f"{path}: ends too early")
    if (faces["corners"] != 3).any() or (len(faces) and faces["vertices"].max() >= len(vertices)):
        raise ValueError(f"{path}: has faces that are no triangles, or of vertices that it has not")
    return Mesh(vertices, np.ascontiguousarray(faces["vertices"]))


def write_ply(path: Path, mesh: Mesh) -> None:
    names = "".join(f"property float {name}\n" for name in PROPERTIES[: mesh.vertices.shape[1]])
    with open(path, "wb") as file:
        file.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n{names}element face {len(mesh.triangles)}\n"
            "property list uchar int vertex_indices\nend_header\n".encode()
        )
        np.ascontiguousarray(mesh.vertices, "<f4").tofile(file)
        for first in range(0, len(mesh.triangles), CHUNK):
            faces = np.empty(min(CHUNK, len(mesh.triangles) - first), FACE)
            faces["corners"] = 3
            faces["vertices"] = mesh.triangles[first : first + CHUNK]
            faces.tofile(file)


def share_vertices(mesh: Mesh) -> Mesh:
    """The same triangles, in the same order, with one vertex where several are equal to the bit. Vertices are numbered as they first occur."""
    bits = np.ascontiguousarray(mesh.vertices, "<f4").view("<u4")
    if len(bits) == 0:
        return mesh
    # Equal vertices have equal keys and so lie side by side. Others with the same key may come between them: these then stay apart, nothing else.
    keys = np.zeros(len(bits), np.uint64)
    for column in bits.T:
        keys = (keys ^ column) * np.uint64(0x9E3779B97F4A7C15)
        keys ^= keys >> np.uint64(29)
    order = np.argsort(keys, kind="stable")
    differs = np.ones(len(bits), bool)
    differs[1:] = (bits[order[1:]] != bits[order[:-1]]).any(axis=1)
    firsts = order[differs]  # stable: the first of each group is the one that occurs first
    rank = np.empty(len(firsts), np.uint32)
    rank[np.argsort(firsts)] = np.arange(len(firsts), dtype=np.uint32)
    shared = np.empty(len(bits), np.uint32)
    shared[order] = rank[np.cumsum(differs) - 1]
    return Mesh(mesh.vertices[np.sort(firsts)], shared[mesh.triangles])


def sphere(radius: float, subdivisions: int = 5) -> Mesh:
    """20 * 4^subdivisions triangles."""
    golden = (1 + 5**0.5) / 2
    corners = [(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)]
    points = np.array([np.roll(c, turn) for turn in range(3) for c in corners], float)
    # The faces of an icosahedron: corners that are 2 apart from each other.
    near = np.isclose(np.linalg.norm(points[:, None] - points, axis=2), 2)
    faces = [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]]
    triangles = points[np.array(faces)]
    outward = np.einsum("ij,ij->i", np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), triangles.sum(1)) > 0
    triangles[~outward] = triangles[~outward][:, ::-1]
    for _ in range(subdivisions):
        a, b, c = triangles.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        triangles = np.stack([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))], 1).reshape(-1, 3, 3)
    # Midpoints of two triangles are the same to the bit, since sums do not depend on the order; so is what follows from them.
    vertices = (radius * triangles / np.linalg.norm(triangles, axis=2, keepdims=True)).reshape(-1, 3).astype(np.float32)
    return share_vertices(Mesh(vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)))
