#!/usr/bin/env python3
"""Seconds to equal error: raypager against Cycles, Blender's renderer, as the package bpy has it.

The scene becomes one of Blender's: diffuse surfaces, area lights that shine to one side, sky and sun. Both trace paths of the same length at most;
Cycles does without clamping, adaptive sampling, denoising, pixel filter and light threshold. Its light tree, samples and roulette are as it comes.
Seconds are those of Cycles' own count, "render time without synchronization"; those with building also hold what Blender takes to get the scene
ready.
"""

import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from rivals import options  # noqa: E402

PACKAGES = ("bpy==5.0.1", "numpy<2")


class Cycles:
    """See rivals.tools.Renderer."""

    def __init__(self, scene, width, height, device, work):
        import bpy

        began = time.monotonic()
        self.bpy, self.picture = bpy, Path(work) / "cycles.exr"
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.scene = bpy.context.scene
        self.version = f"Cycles of Blender {bpy.app.version_string}"
        self.settings(width, height, scene.depth)
        self.kind = "CPU" if device == "CPU" else "GPU"
        self.device = self.choose(device)
        self.camera(scene, width >= height)
        self.lights(scene.lights)
        for index, shape in enumerate(scene.shapes):
            self.shape(f"shape{index}", shape)
        made = time.monotonic() - began
        self.render(1, 0)  # builds
        self.build = made + self.seconds_said("synchronization_time")
        self.render(2, 0)

    def settings(self, width, height, depth):
        render, cycles = self.scene.render, self.scene.cycles
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        render.use_persistent_data = True  # what is built stays for the next render
        render.filepath = str(self.picture)
        picture = render.image_settings
        picture.file_format, picture.color_mode, picture.color_depth, picture.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
        self.scene.view_settings.view_transform = "Raw"
        cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = cycles.use_fast_gi = cycles.use_auto_tile = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = cycles.blur_glossy = 0
        cycles.pixel_filter_type = "BOX"
        # The first event is no bounce.
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = depth - 1

    def choose(self, device):
        if device == "CPU":
            self.scene.cycles.device = "CPU"
            return "CPU"
        preferences = self.bpy.context.preferences.addons["cycles"].preferences
        preferences.compute_device_type = device
        preferences.get_devices()
        found = [d for d in preferences.devices if d.type == device]
        for each in preferences.devices:
            each.use = each in found[:1]  # one GPU alone, and no processor beside it
        if not found:
            sys.exit(f"Cycles finds no device of the kind {device}")
        self.scene.cycles.device = "GPU"
        return f"{found[0].name} ({device})"

    def camera(self, scene, landscape):
        import numpy as np
        from mathutils import Matrix

        data = self.bpy.data.cameras.new("camera")
        data.sensor_fit = "VERTICAL" if landscape else "HORIZONTAL"
        data.angle = scene.field_of_view * 3.14159265358979 / 180
        data.clip_start, data.clip_end = scene.near, scene.far
        camera = self.bpy.data.objects.new("camera", data)
        upper = np.column_stack([scene.right, scene.up, -scene.forward, scene.eye])
        camera.matrix_world = Matrix(np.vstack([upper, [0, 0, 0, 1]]).tolist())
        self.scene.collection.objects.link(camera)
        self.scene.camera = camera

    def lights(self, lights):
        from mathutils import Vector

        world = self.scene.world = self.bpy.data.worlds.new("world")
        world.use_nodes = True
        background = world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = (0, 0, 0, 1)
        for light in lights:
            if light.kind == "sky":
                background.inputs["Color"].default_value = (*light.light, 1)
                continue
            data = self.bpy.data.lights.new(light.kind, "SUN" if light.kind == "sun" else "POINT")
            strength = max(light.light)
            data.color = light.light / strength
            # Power of a point, in Blender's watts: pi times that of a sphere that reflects as much.
            data.energy = strength if light.kind == "sun" else 4 * 3.14159265358979**2 * strength
            if light.kind == "sun":
                data.angle = 0
            else:
                data.shadow_soft_size = 0
            lamp = self.bpy.data.objects.new(light.kind, data)
            if light.kind == "sun":
                lamp.rotation_mode = "QUATERNION"
                lamp.rotation_quaternion = Vector(light.place).to_track_quat("-Z", "Y")
            else:
                lamp.location = light.place
            self.scene.collection.objects.link(lamp)

    def shape(self, name, shape):
        import numpy as np
        from rivals import geometry

        vertices, triangles = geometry.read_ply(shape.mesh)
        mesh = self.bpy.data.meshes.new(name)
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.ravel())
        mesh.loops.add(triangles.size)
        mesh.loops.foreach_set("vertex_index", triangles.astype(np.int32).ravel())
        mesh.polygons.add(len(triangles))
        mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
        mesh.update(calc_edges=False)
        mesh.shade_flat()  # by itself Blender interpolates normals
        mesh.materials.append(self.material(name, shape))
        self.scene.collection.objects.link(self.bpy.data.objects.new(name, mesh))

    def material(self, name, shape):
        material = self.bpy.data.materials.new(name)
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        output, diffuse = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (*shape.color, 1)
        surface = diffuse.outputs[0]
        if shape.radiance is not None:  # in front; what reflects does so on both sides
            emission, sides = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeMixShader")
            dark, add, geometry = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeNewGeometry")
            strength = max(shape.radiance)
            emission.inputs["Color"].default_value = (*(shape.radiance / strength), 1)
            emission.inputs["Strength"].default_value = strength
            dark.inputs["Strength"].default_value = 0
            links.new(geometry.outputs["Backfacing"], sides.inputs[0])
            links.new(emission.outputs[0], sides.inputs[1])
            links.new(dark.outputs[0], sides.inputs[2])
            links.new(sides.outputs[0], add.inputs[0])
            links.new(surface, add.inputs[1])
            surface = add.outputs[0]
            material.cycles.emission_sampling = "FRONT"
        links.new(surface, output.inputs["Surface"])
        return material

    def render(self, samples, seed):
        import numpy as np

        self.scene.cycles.samples, self.scene.cycles.seed = samples, seed
        self.bpy.ops.render.render(write_still=True)
        image = self.bpy.data.images.load(str(self.picture))
        image.colorspace_settings.is_data = True
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        self.bpy.data.images.remove(image)
        return pixels.reshape(height, width, -1)[::-1, :, :3], samples, self.seconds_said("render_time")

    def seconds_said(self, name):
        """Cycles' own count, in the attributes of the picture: hours, minutes and seconds."""
        said = re.search(rb"cycles\.\w+\." + name.encode() + rb"\0string\0.{4}([0-9:.]+)", self.picture.read_bytes()[:65536], re.DOTALL)
        if not said:
            sys.exit("Cycles wrote no times into its picture")
        seconds = 0.0
        for part in said[1].decode().split(":"):
            seconds = 60 * seconds + float(part)
        return seconds


def main():
    made = options.parser("cycles", __doc__)
    made.add_argument("--device", choices=("CPU", "CUDA", "OPTIX"), default="CPU", help="what Cycles renders with (default: CPU)")
    chosen = options.enter(made, PACKAGES)
    from rivals.comparison import compare
    from rivals.tools import Rival

    def start(scene, work):
        return [("Cycles", Rival("cycles", [__file__, "--serve", scene, *chosen.size.split("x"), chosen.device, work], work), {})]

    sys.exit(compare(chosen, start))


def serve(scene, width, height, device, work):
    from rivals import scenes, tools

    tools.serve(lambda: Cycles(scenes.read(Path(scene)), int(width), int(height), device, work))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
