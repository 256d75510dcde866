"""A surface computed with numpy, under a sky computed with numpy: height_field.py waves.png"""

import sys

import numpy as np
import raypager as rp

n = 400
v, u = np.mgrid[-1 : 1 : (n + 1) * 1j, -1 : 1 : (n + 1) * 1j]
height = 0.08 * np.cos(20 * np.hypot(u, v)) * np.exp(-2 * (u**2 + v**2))
positions = np.stack([u, v, height], axis=-1, dtype=np.float32).reshape(-1, 3)
corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
triangles = np.concatenate([corner[:, None] + [0, 1, n + 1], corner[:, None] + [1, n + 2, n + 1]]).astype(np.uint32)

elevation = np.linspace(np.pi / 2, -np.pi / 2, 64)[:, None, None]
sky = np.clip(np.sin(elevation), 0.05, 1) * np.array([0.5, 0.7, 1.0]) * np.ones((1, 128, 1))
sky[20:23, 30:34] = 60  # the sun

scene = rp.Scene(width=640, height=360, spp=64)
scene.mesh(positions, triangles, material=rp.glossy((0.1, 0.3, 0.5), 0.08, roughness=0.1))
scene.sky(sky)
scene.camera(eye=(0, -2, 1), target=(0, 0, -0.1), up=(0, 0, 1), fov=40)
scene.render().save(sys.argv[1])
