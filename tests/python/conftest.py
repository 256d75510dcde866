"""Small scenes that the tests share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp


def waves(n: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """A wavy square of side 2, of 2 n^2 triangles."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1]
    u, v = 2 * x / n - 1, 2 * y / n - 1
    positions = np.stack([u, 0.05 * np.sin(20 * u) * np.cos(20 * v), v], -1).reshape(-1, 3).astype(np.float32)
    a = (y[:-1, :-1] * (n + 1) + x[:-1, :-1]).ravel()
    b = a + n + 1
    triangles = np.concatenate([np.stack([a, b, a + 1], 1), np.stack([a + 1, b, b + 1], 1)]).astype(np.uint32)
    return positions, triangles


def write_ply(path: Path, positions: np.ndarray, triangles: np.ndarray) -> None:
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {len(triangles)}\nproperty list uchar uint vertex_indices\nend_header\n"
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("i", "<u4", 3)])
    faces["n"], faces["i"] = 3, triangles
    path.write_bytes(header.encode() + positions.astype("<f4").tobytes() + faces.tobytes())


def empty_scene(width: int = 32, height: int = 24, spp: int = 4) -> rp.Scene:
    """With light and a camera, but nothing in it."""
    scene = rp.Scene(width=width, height=height, spp=spp)
    scene.infinite_light(1)
    scene.camera((0, 1, 2), (0, 0, 0))
    return scene


def film(scene: rp.Scene, **options: Any) -> bytes:
    return bytes(scene.render(**options).film.tobytes())


@pytest.fixture
def scene() -> rp.Scene:
    scene = empty_scene()
    scene.mesh(*waves(), material=rp.diffuse((0.8, 0.6, 0.4)))
    return scene


@pytest.fixture
def mesh_file(tmp_path: Path) -> Path:
    write_ply(tmp_path / "waves.ply", *waves())
    return tmp_path / "waves.ply"


@pytest.fixture(scope="session")
def program() -> Path:
    """The command line's."""
    path = os.environ.get("RAYPAGER_PROGRAM")
    if not path:
        pytest.skip("RAYPAGER_PROGRAM does not name the command line's program")
    return Path(path)
