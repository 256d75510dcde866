"""A thousand trees that share one mesh: forest.py forest.png [trees]"""

import sys

import numpy as np
import raypager as rp

trees = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
rng = np.random.default_rng(1)
scene = rp.Scene(width=640, height=360, spp=64)

# A cone of 5000 leaves, each a triangle, on a trunk of balls.
middle = np.stack([rng.uniform(-1, 1, 5000), rng.uniform(0.3, 2, 5000), rng.uniform(-1, 1, 5000)], axis=1)
middle[:, [0, 2]] *= (2 - middle[:, 1:2]) / 3
leaves = (middle[:, None] + rng.normal(0, 0.04, (5000, 3, 3))).reshape(-1, 3)
tree = scene.object("tree")
tree.mesh(leaves, np.arange(15000).reshape(-1, 3), material=rp.translucent((0.1, 0.3, 0.05), (0.1, 0.2, 0.02)))
tree.points(np.stack([np.zeros(20), np.linspace(0, 1, 20), np.zeros(20)], axis=1), radius=0.06, material=rp.diffuse("#604020"))

places = np.zeros((trees, 3, 4))
size, turn = rng.uniform(0.6, 1.4, trees), rng.uniform(0, 2 * np.pi, trees)
places[:, 0, 0] = places[:, 2, 2] = size * np.cos(turn)
places[:, 0, 2], places[:, 2, 0] = size * np.sin(turn), -size * np.sin(turn)
places[:, 1, 1] = size
places[:, [0, 2], 3] = rng.uniform(-20, 20, (trees, 2))
scene.instances(tree, places, colors=rng.uniform(0.5, 1, (trees, 3)))

scene.mesh([[-50, 0, -50], [-50, 0, 50], [50, 0, 50], [50, 0, -50]], [[0, 1, 2], [0, 2, 3]], material=rp.diffuse("#807050"))
scene.infinite_light((0.4, 0.6, 0.9))
scene.distant_light((0.5, -1, -0.3), 3)
scene.camera(eye=(0, 6, 22), target=(0, 0, 0), fov=40)
scene.render().save(sys.argv[1])
