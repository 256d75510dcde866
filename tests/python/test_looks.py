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


def tilted_square(material: rp.Material, normal: tuple[float, float, float] | None = None) -> np.ndarray:
    """Seen from above under a sun that stands aslant."""
    scene = rp.Scene(width=16, height=16, spp=16)
    scene.distant_light((-1, -0.4, -1), 2)
    scene.camera((0, 0, 5), (0, 0, 0), fov=20)
    corners = np.array([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], np.float32)
    normals = None if normal is None else np.tile(np.array(normal, np.float32), (4, 1))
    uvs = (corners[:, :2] + 2) / 4
    scene.mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), uvs=uvs, normals=normals, material=material)
    return scene.render().film.mean((0, 1))


def test_normal_maps_are_like_normals() -> None:
    """Red is along u, green along v; also in the parts of a mix."""
    flat = tilted_square(rp.diffuse(0.8))
    for normal in ((0.6, 0, 0.8), (0, -0.6, 0.8), (-0.36, 0.48, 0.8)):
        image = rp.Image(np.tile(np.array(normal, np.float32) / 2 + 0.5, (8, 8, 1)), encoding="linear")
        expected = tilted_square(rp.diffuse(0.8), normal)
        assert np.abs(expected - flat).max() > 0.02
        assert np.allclose(tilted_square(rp.with_normals(rp.diffuse(0.8), image)), expected, atol=0.01)
        assert np.allclose(tilted_square(rp.with_normals(rp.mix(None, rp.diffuse(0.8), 1.0), image)), expected, atol=0.01)


def test_bumps_are_like_slopes() -> None:
    """Heights that rise by 1.2 over 4 units of u tilt the normal as such a slope does."""
    ramp = rp.Image(np.tile((np.arange(256, dtype=np.float32) + 0.5) / 256, (8, 1)))
    bumpy = rp.with_bumps(rp.diffuse(0.8), ramp, 1.2)
    slope = np.array([-1.2 / 4, 0, 1]) / np.hypot(1.2 / 4, 1)
    expected = tilted_square(rp.diffuse(0.8), tuple(slope.tolist()))
    assert np.allclose(tilted_square(bumpy), expected, rtol=0.03)
    assert not np.allclose(tilted_square(rp.with_bumps(rp.diffuse(0.8), ramp, 0)), expected, rtol=0.03)
    with pytest.raises(rp.Error, match="with_bumps: a raypager.Image is expected"):
        rp.with_bumps(rp.diffuse(0.8), 0.5)  # type: ignore[arg-type]
    with pytest.raises(rp.Error, match="with_normals: a raypager.Image is expected"):
        rp.with_normals(rp.diffuse(0.8), "a.png")  # type: ignore[arg-type]
