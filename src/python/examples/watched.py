"""A long render that shows itself, and goes on where it was stopped: watched.py scene.ply a.png [samples]; stop it with Ctrl-C, and run it again"""

import sys
import time
from pathlib import Path

import raypager as rp

picture, checkpoint = Path(sys.argv[2]), Path(sys.argv[2] + ".ckpt")
blocks_file = Path(sys.argv[2] + ".rpb")
blocks = rp.open(blocks_file) if blocks_file.exists() else rp.load(sys.argv[1]).bake(blocks_file)

shown = time.monotonic()
with rp.Render(blocks, width=320, height=240, spp=int(sys.argv[3]) if len(sys.argv) > 3 else 4096, checkpoint=checkpoint, resume=True) as render:
    try:
        for progress in render:
            print(f"{progress.spp:.0f} samples per pixel, {progress.rays_per_second / 1e6:.1f} million rays a second")
            if time.monotonic() - shown > 10:
                rp.save(picture, render.snapshot())
                shown = time.monotonic()
    except KeyboardInterrupt:
        print(f"stopped; run it again to go on from {checkpoint}")
    render.finish().save(picture)
