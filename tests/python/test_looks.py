"""Materials, textures, lights and skies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import raypager as rp
from conftest import empty_scene, film, waves

MATERIALS = {
    "diffuse": lambda: rp.diffuse("#c08040"),
    "rough": lambda: rp.diffuse(0.5, sigma=30),
    "translucent": lambda: rp.translucent(0.3, (0.1, 0.5, 0.1)),
    "conductor": lambda: rp.conductor((0.2, 0.9, 1.1), (3.9, 2.4, 2.2), roughness=0.2),
    "gold": lambda: rp.metal("gold"),
    "red metal": lambda: rp.metal((0.9, 0.2, 0.2), roughness=0.3),
    "mirror": rp.mirror,
    "glass": rp.dielectric,
    "rough glass": lambda: rp.dielectric(1.4, roughness=0.2, refracted=(0.9, 1, 0.9)),
    "sheet": rp.thin_dielectric,
    "plastic": lambda: rp.plastic((0.1, 0.2, 0.8), roughness=0.05),
    "coated": lambda: rp.coated_conductor((0.2, 0.9, 1.1), (3.9, 2.4, 2.2)),
    "glossy": lambda: rp.glossy(0.4, 0.05, roughness=0.1),
    "clay": rp.clay,
    "black": rp.absorbing,
    "mix": lambda: rp.mix(rp.diffuse(0.9), rp.mix(rp.mirror(), rp.diffuse(0.1), 0.3), 0.5),
    "half there": lambda: rp.mix(None, rp.diffuse(0.2), 0.5),
}


def test_materials_differ() -> None:
    films = {}
    for name, make in MATERIALS.items():
        scene = empty_scene()
        scene.mesh(*waves(), material=make(), colors=None)
        scene.sphere((0, 0.3, 0), 0.3, material=make())
        scene.point_light((1, 1.5, 1), 2)
        films[film(scene)] = name
    assert len(films) == len(MATERIALS)


def image(channels: int, dtype: Any) -> np.ndarray:
    rng = np.random.default_rng(11)
    shape = (17, 30, channels) if channels else (17, 30)
    if np.dtype(dtype).kind == "f":
        return rng.uniform(0, 1, shape).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, shape, dtype)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize("channels", [0, 1, 3, 4])
def test_images_are_textures(channels: int, dtype: Any) -> None:
    positions, triangles = waves()
    scene, plain = empty_scene(), empty_scene()
    uvs = ((positions[:, [0, 2]] + 1) / 2).astype(np.float32)
    scene.mesh(positions, triangles, uvs=uvs, material=rp.diffuse(rp.Image(image(channels, dtype))))
    plain.mesh(positions, triangles)
    blocks = scene.bake()
    assert blocks.summary and blocks.summary["images"] == 1
    assert blocks.render().film.tobytes() != film(plain)


def test_an_image_of_one_colour_is_that_colour() -> None:
    positions, triangles = waves()
    uvs = ((positions[:, [0, 2]] + 1) / 2).astype(np.float32)
    linear = 0.25
    a, b = empty_scene(spp=16), empty_scene(spp=16)
    a.mesh(positions, triangles, uvs=uvs, material=rp.diffuse(rp.Image(np.full((8, 8), linear, np.float32))))
    b.mesh(positions, triangles, uvs=uvs, material=rp.diffuse(linear))
    assert np.allclose(a.render().film, b.render().film, rtol=1e-3)


def test_textured_roughness_cut_outs_and_spheres() -> None:
    positions, triangles = waves()
    uvs = ((positions[:, [0, 2]] + 1) / 2).astype(np.float32)
    checks = (np.indices((8, 8)).sum(0) % 2).astype(np.float32)
    films = set()
    for material in [
        rp.plastic(0.3, roughness=rp.Image(0.1 + 0.5 * checks)),
        rp.glossy(rp.Image(checks), rp.Image(0.04 + 0.1 * checks, repeat=(3, 2))),
        rp.mix(None, rp.diffuse(0.5), rp.Image(checks)),
        rp.metal(rp.Image(np.stack([checks, checks * 0.5, checks * 0.1], -1)), roughness=0.3),
        rp.translucent(rp.Image(checks), 0.4),
    ]:
        scene = empty_scene()
        scene.mesh(positions, triangles, uvs=uvs, material=material)
        scene.sphere((0, 0.3, 0), 0.3, material=material)
        films.add(film(scene))
    assert len(films) == 5


def test_lights_and_skies() -> None:
    def lit(light: Callable[[rp.Scene], None]) -> bytes:
        scene = rp.Scene(width=32, height=24, spp=4)
        scene.camera((0, 1, 2), (0, 0, 0))
        scene.mesh(*waves())
        light(scene)
        return film(scene)

    globe = np.zeros((16, 32, 3), np.float32)
    globe[2:4, 5:9] = 30
    films = {
        lit(lambda s: s.point_light((0, 1, 0), 3)),
        lit(lambda s: s.spot_light((0, 1, 0), (0, 0, 0), 3, angle=20)),
        lit(lambda s: s.spot_light((0, 1, 0), (0, 0, 0), 3, angle=20, full_angle=0)),
        lit(lambda s: s.distant_light((0.1, -1, 0), 3)),
        lit(lambda s: s.infinite_light((0.2, 0.3, 0.5))),
        lit(lambda s: s.sky(globe, axes=[[1, 0, 0], [0, 0, -1], [0, 1, 0]])),
        lit(lambda s: s.sky(globe)),
        lit(lambda s: s.sky(globe[:, :16])),
        lit(lambda s: s.sphere((0, 1, 0), 0.1, emission=30)),
    }
    assert len(films) == 9
