"""Lights in USD: where they are and how bright, against what the schemas say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux
from usd_files import SIZE, film, loaded, looking_at_squares, write_png


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


@pytest.mark.parametrize(("up", "turned"), [("Y", False), ("Y", True), ("Z", False)])
def test_the_dome_lies_as_usd_says(path: Path, up: str, turned: bool) -> None:
    """Of a map of a globe the middle is at +z, a quarter to the left of it +x, and the pole +y, whichever axis points up. One quarter is red."""
    pixels = np.full((32, 64, 3), 0.1, np.float32)
    pixels[8:24, 12:20] = (4, 0, 0)  # around u = 0.25, v = 0.5: +x
    pixels[:6] = (0, 3, 0)  # the pole
    rp.save(path.parent / "sky.exr", pixels)
    stage = usd.new_stage(path, up)
    dome = UsdLux.DomeLight.Define(stage, "/dome")
    dome.CreateTextureFileAttr("sky.exr")
    dome.CreateIntensityAttr(0.5)
    dome.CreateExposureAttr(1)
    if turned:
        UsdGeom.Xformable(dome).AddRotateYOp().Set(90.0)  # +x goes to -z
    usd.move(UsdGeom.Sphere.Define(stage, "/ball"), (0, -5, 0))
    for name, target, vertical in [("x", (1, 0, 0), (0, 1, 0)), ("y", (0, 1, 0), (0, 0, 1)), ("z", (0, 0, -1), (0, 1, 0))]:
        usd.camera(stage, (0, 0, 0), target, vertical, f"/{name}")
    stage.Save()
    seen = {name: film(loaded(path, camera=name))[SIZE[1] // 2, SIZE[0] // 2] for name in "xyz"}
    red = "z" if turned else "x"
    assert np.allclose(seen[red], (4, 0, 0), atol=0.1) and np.allclose(seen["y"], (0, 3, 0), atol=0.1)
    assert np.allclose(seen["x" if turned else "z"], 0.1, atol=0.05)


def irradiance(path: Path, stage: Usd.Stage) -> np.ndarray:
    """Of a white floor at the origin that faces +z."""
    usd.camera(stage, (0, 0, 3), (0, 0, 0), focalLength=400.0)
    floor = usd.square(stage, "/floor", 0.2)
    usd.bind(floor, usd.preview(stage, "/white", diffuseColor=(1, 1, 1), roughness=1.0, specularColor=(0, 0, 0), useSpecularWorkflow=1)[0])
    stage.Save()
    return np.pi * film(loaded(path), spp=256, width=16, height=9, max_depth=1).mean((0, 1))


@pytest.mark.parametrize("normalize", [False, True])
@pytest.mark.parametrize("kind", ["RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight", "spot"])
def test_lights_are_as_bright_as_the_schema_says(path: Path, kind: str, normalize: bool) -> None:
    """Against what a small light 4 above a floor gives it: radiance times area over distance^2, and an intensity of 2 is 4 with an exposure of 1."""
    stage = usd.new_stage(path)
    light = stage.DefinePrim("/light", "SphereLight" if kind == "spot" else kind)
    usd.move(UsdGeom.Xformable(light), (0, 0, 4))
    for name, value in {"intensity": 2.0, "exposure": 1.0, "normalize": normalize, "radius": 0.05, "width": 0.1, "height": 0.2, "length": 0.2,
                        "angle": 1.0}.items():  # fmt: skip
        if light.HasAttribute(f"inputs:{name}"):
            light.GetAttribute(f"inputs:{name}").Set(value)
    light.GetAttribute("inputs:color").Set(Gf.Vec3f(1, 0.5, 0.25))
    UsdGeom.Xformable(light).AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    # What is seen of it from below, and its surface.
    seen, surface = {
        "RectLight": (0.2 * 0.4, 0.2 * 0.4),
        "DiskLight": (np.pi * 0.01, np.pi * 0.01),
        "SphereLight": (np.pi * 0.01, 4 * np.pi * 0.01),
        "CylinderLight": (0.4 * 0.2, 0.4 * 2 * np.pi * 0.1),
        "spot": (np.pi * 0.01, 4 * np.pi * 0.01),
    }.get(kind, (0, 1))
    if kind == "spot":
        UsdLux.ShapingAPI.Apply(light).CreateShapingConeAngleAttr(30.0)
    expected = 4 * seen / 16 / (surface if normalize else 1)
    if kind == "DistantLight":
        expected = 4 if normalize else 4 * np.pi * np.sin(np.radians(0.5)) ** 2
    if kind == "DomeLight":
        expected = 4 * np.pi
    assert np.allclose(irradiance(path, stage), expected * np.array([1, 0.5, 0.25]), rtol=0.04)


def test_a_temperature_is_a_colour(path: Path) -> None:
    stage = usd.new_stage(path)
    light = UsdLux.DistantLight.Define(stage, "/sun")
    for name, value in {"intensity": 1.0, "angle": 0.0, "enableColorTemperature": True, "colorTemperature": 3000.0}.items():
        light.GetPrim().GetAttribute(f"inputs:{name}").Set(value)
    assert np.allclose(irradiance(path, stage), UsdLux.BlackbodyTemperatureAsRgb(3000), rtol=0.03)


def test_what_shines(path: Path) -> None:
    """Surfaces by their material, also by an image, and meshes that are lights."""
    pixels = np.zeros((8, 8, 3))
    pixels[:, :4], pixels[:, 4:] = (1, 0, 0), (0, 0, 1)
    write_png(path.parent / "glow.png", pixels)
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/glow", diffuseColor=(0, 0, 0), specularColor=(0, 0, 0), useSpecularWorkflow=1)
    usd.texture(shader, "emissiveColor", "rgb", "glow.png", scale=(3, 3, 3, 1))
    made = usd.mesh(stage, "/two", [(-1, -1, 0), (-1, 1, 0), (0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], [4, 4], [0, 2, 3, 1, 2, 4, 5, 3])
    uvs = UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    uvs.Set([(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)])
    usd.bind(made, material)
    lamp = usd.mesh(stage, "/lamp", [(1.2, -1, 0), (1.6, -1, 0), (1.6, 1, 0), (1.2, 1, 0)], [4], [0, 1, 2, 3])
    UsdLux.MeshLightAPI.Apply(lamp.GetPrim())
    lamp.GetPrim().GetAttribute("inputs:intensity").Set(5.0)
    stage.Save()
    scene = loaded(path)
    assert any("shines by an image" in text for text in scene.warnings)
    found = film(scene)[SIZE[1] // 2]
    left, lamp_at = round(SIZE[0] / 2 - SIZE[1] / 4), round(SIZE[0] / 2 + 1.4 * SIZE[1] / 2)
    assert np.allclose(found[left], (3, 0, 0), atol=0.1) and np.allclose(found[SIZE[0] - left], (0, 0, 3), atol=0.1)
    assert found[lamp_at].min() > 4.9


@pytest.mark.parametrize("kind", ["dark", "flat", "unknown"])
def test_lights_that_do_not_shine_do_not_keep_others_away(path: Path, kind: str) -> None:
    """A picture as without lights, and a word on it."""
    films = []
    for name in ("none", kind):
        path = path.with_name(f"{name}.usda")
        stage = usd.new_stage(path)
        usd.camera(stage, (0, 0, 5), (0, 0, 0))
        usd.square(stage, "/square")
        if name == "dark":
            UsdLux.DomeLight.Define(stage, "/light").CreateIntensityAttr(0.0)
        elif name == "flat":
            UsdLux.RectLight.Define(stage, "/light").CreateWidthAttr(0.0)
        elif name == "unknown":
            UsdLux.GeometryLight.Define(stage, "/light")
        stage.Save()
        scene = loaded(path)
        films.append(film(scene))
    said = {"dark": "no light shines", "flat": "has no surface", "unknown": "a GeometryLight is not read"}[kind]
    assert any(said in text for text in scene.warnings)
    assert films[0].max() > 0.1 and np.allclose(films[0], films[1])


@pytest.mark.parametrize("kind", ["mesh", "Sphere", "image"])
def test_shapes_that_are_lights_shine_in_the_colour_of_their_glow(path: Path, kind: str) -> None:
    """materialGlowTintsLight, the default; where the file says otherwise, as the light alone."""
    write_png(path.parent / "glow.png", np.tile([1.0, 0, 0], (8, 8, 1)))
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    shape = UsdGeom.Sphere.Define(stage, "/lamp") if kind == "Sphere" else usd.square(stage, "/lamp")
    api = UsdLux.LightAPI.Apply(shape.GetPrim()) if kind == "Sphere" else UsdLux.MeshLightAPI.Apply(shape.GetPrim())
    shape.GetPrim().GetAttribute("inputs:intensity").Set(2.0)
    black = {"diffuseColor": (0, 0, 0), "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
    dark, dark_shader = usd.preview(stage, "/dark", **black)
    red, shader = usd.preview(stage, "/red", **black, emissiveColor=(3, 0, 0))
    if kind == "image":
        usd.texture(shader, "emissiveColor", "rgb", "glow.png", scale=(3, 3, 3, 1))
    if kind == "Sphere":
        shape.GetPrim().CreateAttribute("light:materialSyncMode", Sdf.ValueTypeNames.Token).Set("materialGlowTintsLight")
    for material, mode, expected in ((dark, None, (2, 2, 2)), (red, None, (6, 0, 0)), (red, "independent", (2, 2, 2))):
        usd.bind(shape, material)
        if mode is not None:
            api.GetPrim().GetAttribute("light:materialSyncMode").Set(mode)
        stage.Save()
        scene = loaded(path)
        assert np.allclose(film(scene)[SIZE[1] // 2, SIZE[0] // 2], expected, atol=0.02)
        assert any("its materialSyncMode independent is not read" in text for text in scene.warnings) == (mode is not None)


def test_what_lights_cannot_do_is_warned_of(path: Path) -> None:
    rp.save(path.parent / "sky.exr", np.full((8, 16, 3), 3000, np.float32))
    stage = usd.new_stage(path)
    usd.square(stage, "/square")
    dome = UsdLux.DomeLight.Define(stage, "/dome")
    dome.CreateTextureFileAttr("sky.exr")
    dome.CreateIntensityAttr(100.0)
    UsdLux.LightAPI(UsdLux.RectLight.Define(stage, "/rect")).GetLightLinkCollectionAPI().CreateIncludeRootAttr(False)
    stage.Save()
    text = "\n".join(loaded(path).warnings)
    assert "/dome: 128 pixels of the sky are brighter than 65504" in text and "/rect: shines on everything" in text
