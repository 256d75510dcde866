"""Render a mesh file with a quarter of its geometry on the device: mesh_file.py bunny.ply bunny.png"""

import sys

import raypager as rp

scene = rp.load(sys.argv[1], material=rp.plastic("#c05030", roughness=0.1))
blocks = scene.bake(block_size="128K")
print(blocks)

picture = blocks.render(width=640, height=480, spp=64, geometry_limit="25%", progress=lambda p: print(f"{p.fraction:.0%}", end=" ", flush=True))
print(f"\n{picture.report['paging']['loads']} loads, {picture.report['seconds']['render']:.1f} s")
picture.save(sys.argv[2])
