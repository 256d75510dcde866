#!/usr/bin/env python3
"""Seconds to equal error: raypager against LuxCore, as the package pyluxcore has it.

The scene becomes one of LuxCore's: matte surfaces, area lights, sky and sun. Both trace paths of the same length at most; LuxCore does without
clamping and pixel filter. Its choice of lights, Sobol samples and roulette are as they come.
Seconds are from when its threads begin until it has all samples; those with building also hold its start, with the hierarchy and, for PATHOCL,
compiling.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from rivals import options  # noqa: E402

PACKAGES = ("pyluxcore==2.11.2", "numpy")


class LuxCore:
    """See rivals.tools.Renderer."""

    def __init__(self, scene, width, height, engine):
        import pyluxcore

        self.luxcore, self.engine, self.size, self.depth = pyluxcore, engine, (width, height), scene.depth
        pyluxcore.Init(lambda line: print(line, file=sys.stderr))
        self.version = f"LuxCore {pyluxcore.Version()}"
        self.device, self.kind = engine, "CPU" if engine == "PATHCPU" else "GPU"
        began = time.monotonic()
        self.scene = pyluxcore.Scene()
        properties = self.camera(scene) | self.lights(scene.lights)
        for index, shape in enumerate(scene.shapes):
            properties |= self.shape(f"shape{index}", shape)
        self.scene.Parse(self.properties(properties))
        read = time.monotonic() - began
        self.render(1, 0)  # for PATHOCL, compiles
        self.render(1, 0)
        self.build = read + self.started

    def properties(self, values):
        result = self.luxcore.Properties()
        for name, value in values.items():
            result.Set(self.luxcore.Property(name, [float(v) for v in value] if hasattr(value, "__len__") and not isinstance(value, str) else value))
        return result

    def camera(self, scene):
        reach = [side / min(self.size) for side in self.size]
        row = 2 / min(self.size)  # LuxCore counts rows from the bottom, and by one too few
        return {
            "scene.camera.type": "perspective",
            "scene.camera.lookat.orig": scene.eye,
            "scene.camera.lookat.target": scene.eye + scene.forward * scene.far * 1e-3,
            "scene.camera.up": scene.up,
            # Of the picture's part between -1 and 1.
            "scene.camera.fieldofview": scene.field_of_view,
            "scene.camera.screenwindow": (-reach[0], reach[0], -reach[1] - row, reach[1] - row),
            "scene.camera.cliphither": scene.near,
            "scene.camera.clipyon": scene.far,
            "scene.camera.lensradius": 0.0,
            "scene.camera.autofocus.enable": False,
        }

    def lights(self, lights):
        properties = {}
        for index, light in enumerate(lights):
            name = f"scene.lights.light{index}."
            if light.kind == "sky":
                properties |= {name + "type": "constantinfinite", name + "color": light.light}
            elif light.kind == "sun":
                properties |= {name + "type": "sharpdistant", name + "direction": light.place, name + "color": light.light}
            else:
                properties |= {name + "type": "point", name + "position": light.place, name + "color": light.light}
        return properties

    def shape(self, name, shape):
        properties = {
            f"scene.materials.{name}.type": "matte",
            f"scene.materials.{name}.kd": shape.color,
            f"scene.shapes.{name}.type": "mesh",
            f"scene.shapes.{name}.ply": str(shape.mesh),
            f"scene.objects.{name}.shape": name,
            f"scene.objects.{name}.material": name,
        }
        if shape.radiance is not None:
            properties[f"scene.materials.{name}.emission"] = shape.radiance
        return properties

    def render(self, samples, seed):
        import numpy as np

        width, height = self.size
        config = {
            "renderengine.type": self.engine,
            "renderengine.seed": seed + 1,
            "sampler.type": "SOBOL",
            "sampler.sobol.adaptive.strength": 0.0,
            "path.pathdepth.total": self.depth + 1,
            "path.pathdepth.diffuse": self.depth + 1,
            "path.clamping.variance.maxvalue": 0.0,
            "path.hybridbackforward.enable": False,
            "film.width": width,
            "film.height": height,
            "film.filter.type": "NONE",
            "film.imagepipelines.0.0.type": "NOP",
            "batch.haltspp": samples,
        }
        if self.engine == "PATHOCL":  # GPUs alone
            config |= {"opencl.cpu.use": False, "opencl.gpu.use": True, "opencl.native.threads.count": 0}
        session = self.luxcore.RenderSession(self.luxcore.RenderConfig(self.properties(config), self.scene))
        began = time.monotonic()
        session.Start()
        running = time.monotonic()
        self.started = running - began
        while not session.HasDone():
            time.sleep(0.02)
            session.UpdateStats()
        seconds = time.monotonic() - running
        stats = session.GetStats()
        used = stats.Get("stats.renderengine.pass").GetInt()
        session.Stop()
        picture = np.empty((height, width, 3), np.float32)
        session.GetFilm().GetOutputFloat(self.luxcore.FilmOutputType.RGB, picture)
        return picture[::-1], used, seconds


def main():
    made = options.parser("luxcore", __doc__)
    made.add_argument("--engine", choices=("PATHCPU", "PATHOCL"), default="PATHCPU", help="PATHOCL is for GPUs (default: PATHCPU)")
    chosen = options.enter(made, PACKAGES)
    from rivals.comparison import compare
    from rivals.tools import Rival

    # It looks for OpenCL devices whatever it renders with, and PoCL's libraries do not get along with its own.
    environment = {"OCL_ICD_VENDORS": "/nonexistent"} if chosen.engine == "PATHCPU" else {}

    def start(scene, work):
        return [("LuxCore", Rival("luxcore", [__file__, "--serve", scene, *chosen.size.split("x"), chosen.engine], work, environment), {})]

    sys.exit(compare(chosen, start))


def serve(scene, width, height, engine):
    from rivals import scenes, tools

    tools.serve(lambda: LuxCore(scenes.read(Path(scene)), int(width), int(height), engine))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
