"""A cloud that is made, or read, piece by piece, and baked into a file: chunks_of_points.py cloud.rpb cloud.png [points]"""

import sys
from collections.abc import Iterator

import numpy as np
import raypager as rp

count = int(sys.argv[3]) if len(sys.argv) > 3 else 10_000_000
at_once = 1_000_000


def chunks() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Called anew for each pass over the cloud; only one chunk is in memory at a time."""
    for begin in range(0, count, at_once):
        rng = np.random.default_rng(begin)
        points = rng.normal(size=(min(at_once, count - begin), 3)).astype(np.float32)
        points /= 1 + np.linalg.norm(points, axis=1, keepdims=True)
        yield points, np.clip(128 + 128 * points, 0, 255).astype(np.uint8)


scene = rp.Scene(width=640, height=480, spp=32)
scene.points(chunks, count=count, colored=True, radius=0.3 / count ** (1 / 3))
scene.infinite_light(0.8)
scene.camera(eye=(1.5, 1, 2), target=(0, 0, 0), fov=35)
blocks = scene.bake(sys.argv[1], host_limit="1G", progress=lambda stage, share: print(f"{stage}: {share:.0%}"))
blocks.render(geometry_limit="50%").save(sys.argv[2])
