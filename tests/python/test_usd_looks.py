"""Looks in USD: materials, lights and cameras, against what the schemas say and against the same scenes from arrays."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdUtils, Vt
from usd_files import SIZE, colours_seen, film, loaded, looking_at_squares, write_png


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


# Pictures


def test_the_film_is_that_of_the_same_scene_from_arrays(path: Path) -> None:
    """Up to rounding: a mesh with normals, a material, a camera and a light."""
    stage = usd.new_stage(path)
    usd.camera(stage, (0, 0, 5), (0, 0, 0), horizontalAperture=16.0, verticalAperture=9.0, focalLength=18.0)
    light = UsdLux.DistantLight.Define(stage, "/sun")
    light.CreateIntensityAttr(2.0)
    light.CreateAngleAttr(0.0)
    light.CreateColorAttr((1, 0.5, 0.25))
    red, _ = usd.preview(stage, "/red", diffuseColor=(0.8, 0.1, 0.1), roughness=0.6)
    plate = usd.square(stage, "/plate", 1.5)
    usd.bind(plate, red)
    UsdGeom.PrimvarsAPI(plate).CreatePrimvar("normals", Sdf.ValueTypeNames.Normal3fArray, "vertex").Set([(0.3, 0, 1)] * 4)
    stage.Save()
    scene = rp.Scene(width=1280, height=720)
    scene.distant_light((0, 0, -1), (2, 1, 0.5))
    n = np.array([0.3, 0, 1], np.float32)
    scene.mesh(
        [(-1.5, -1.5, 0), (1.5, -1.5, 0), (1.5, 1.5, 0), (-1.5, 1.5, 0)],
        [[0, 1, 2], [0, 2, 3]],
        normals=np.tile(n / np.linalg.norm(n), (4, 1)),
        material=rp.glossy((0.8, 0.1, 0.1), 0.04, roughness=0.36),
    )
    scene.camera((0, 0, 5), (0, 0, 0), fov=float(2 * np.degrees(np.arctan(9 / 36))))
    from_usd = loaded(path)
    assert from_usd.size == (1280, 720) and from_usd.warnings == []
    expected, found = film(scene), film(from_usd)
    assert expected.max() > 0.1 and np.abs(found - expected).max() < 1e-4 * expected.max()


def test_colours_by_point_face_and_corner(path: Path) -> None:
    """Two squares side by side, of a mesh; reds, greens and blues that USD would show there."""
    for interpolation, values, expected in [
        ("constant", [(0.2, 0.4, 0.6)], [(0.2, 0.4, 0.6), (0.2, 0.4, 0.6)]),
        ("uniform", [(0.8, 0, 0), (0, 0, 0.8)], [(0.8, 0, 0), (0, 0, 0.8)]),
        ("vertex", [(1, 0, 0)] * 2 + [(0, 1, 0)] * 2 + [(1, 0, 0)] * 2, [(0.75, 0.25, 0), (0.75, 0.25, 0)]),
        ("faceVarying", [(0, 0.5, 0)] * 4 + [(0.5, 0, 0)] * 4, [(0, 0.5, 0), (0.5, 0, 0)]),
    ]:
        path = path.with_name(f"{interpolation}.usda")
        stage = usd.new_stage(path)
        looking_at_squares(stage)
        made = usd.mesh(stage, "/two", [(-1, -1, 0), (-1, 1, 0), (0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], [4, 4], [0, 2, 3, 1, 2, 4, 5, 3])
        if interpolation == "vertex":
            values = [(1, 0, 0), (1, 0, 0), (0.5, 0.5, 0), (0.5, 0.5, 0), (1, 0, 0), (1, 0, 0)]
        UsdGeom.PrimvarsAPI(made).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation).Set(values)
        stage.Save()
        left = 0.5 - 0.25 * SIZE[1] / SIZE[0]
        found = colours_seen(loaded(path), [(left, 0.5), (1 - left, 0.5)])
        assert np.allclose(found, expected, atol=0.03), interpolation


def quarters(path: Path) -> None:
    """An image whose quarters are red (top left), green, blue (bottom left) and white. Linear numbers are 0 and 1 in sRGB, too."""
    pixels = np.zeros((16, 16, 3))
    pixels[:8, :8], pixels[:8, 8:], pixels[8:, :8], pixels[8:, 8:] = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)
    write_png(path, pixels)


PLACES = [(0.5 - 0.25 * SIZE[1] / SIZE[0], 0.25), (0.5 + 0.25 * SIZE[1] / SIZE[0], 0.25), (0.5 - 0.25 * SIZE[1] / SIZE[0], 0.75),
          (0.5 + 0.25 * SIZE[1] / SIZE[0], 0.75)]  # fmt: skip


@pytest.mark.parametrize("packed", [False, True])
def test_images_lie_as_usd_says(path: Path, packed: bool) -> None:
    """v points upwards; the same from a package."""
    quarters(path.parent / "quarters.png")
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/material", roughness=1.0, specularColor=(0, 0, 0), useSpecularWorkflow=1)
    usd.texture(shader, "diffuseColor", "rgb", "quarters.png", primvar="uv0")
    usd.bind(usd.square(stage, "/square", coordinates="uv0"), material)
    stage.Save()
    if packed:
        UsdUtils.CreateNewUsdzPackage(str(path), str(path.with_suffix(".usdz")))
        (path.parent / "quarters.png").unlink()
    scene = loaded(path.with_suffix(".usdz") if packed else path)
    assert scene.warnings == []
    assert np.allclose(colours_seen(scene, PLACES), [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], atol=0.02)


def test_images_are_moved_scaled_and_shifted(path: Path) -> None:
    """A quarter turn counter-clockwise of the coordinates, about their origin and back; then half as bright, and a little red."""
    quarters(path.parent / "quarters.png")
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/material", roughness=1.0, specularColor=(0, 0, 0), useSpecularWorkflow=1)
    turned = (90.0, (1, 1), (1, 0))  # (u, v) becomes (1 - v, u)
    usd.texture(shader, "diffuseColor", "rgb", "quarters.png", moved=turned, scale=(0.5, 0.5, 0.5, 1), bias=(0.25, 0, 0, 0))
    usd.bind(usd.square(stage, "/square"), material)
    stage.Save()
    # The top left, (0.25, 0.75), looks up (0.25, 0.25), which is blue.
    expected = 0.5 * np.array([(0, 0, 1), (1, 0, 0), (1, 1, 1), (0, 1, 0)]) + (0.25, 0, 0)
    assert np.allclose(colours_seen(loaded(path), PLACES), expected, atol=0.02)


def test_images_in_tiles(path: Path) -> None:
    """Two squares side by side lie in the tiles 1001 and 1012; a third is in one that there is not."""
    for tile, color in {1001: (1, 0, 0), 1012: (0, 1, 0)}.items():
        write_png(path.parent / f"tile.{tile}.png", np.full((8, 8, 3), color, np.float64))
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    plain = {"roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
    material, shader = usd.preview(stage, "/material", **plain)
    usd.texture(shader, "diffuseColor", "rgb", "tile.<UDIM>.png", fallback=(0.1, 0.2, 0.3, 1))
    made = usd.mesh(stage, "/two", [(-1, -1, 0), (-1, 1, 0), (0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], [4, 4], [0, 2, 3, 1, 2, 4, 5, 3])
    uvs = UsdGeom.PrimvarsAPI(made).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    uvs.Set(np.concatenate([corners, corners + (1, 1)]).tolist())
    usd.bind(made, material)
    third = usd.mesh(stage, "/third", [(-1, 1.2, 0), (1, 1.2, 0), (1, 2, 0)], [3], [0, 1, 2])
    UsdGeom.PrimvarsAPI(third).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex").Set([(5, 0), (5.5, 0), (5.5, 1)])
    usd.bind(third, material)
    stage.Save()
    scene = loaded(path)
    left = 0.5 - 0.25 * SIZE[1] / SIZE[0]
    assert np.allclose(colours_seen(scene, [(left, 0.5), (1 - left, 0.5)]), [(1, 0, 0), (0, 1, 0)], atol=0.02)
    assert scene.warnings == [] and scene.bake().triangles == 5
    usd.texture(shader, "diffuseColor", "rgb", "none.<UDIM>.png")
    stage.Save()
    assert any("none.<UDIM>.png: there is no tile of it" in text for text in loaded(path).warnings)


@pytest.mark.parametrize(("channels", "bits"), [(1, 8), (2, 8), (3, 8), (4, 8), (1, 16), (2, 16), (3, 16), (4, 16)])
def test_colour_spaces_are_those_of_usd(path: Path, channels: int, bits: int) -> None:
    """auto is sRGB for 8 bits and three or four channels alone; for what is reflected, and for what shines."""
    pixels = np.full((8, 8, channels), 0.5)
    if channels % 2 == 0:
        pixels[:, :, -1] = 1
    write_png(path.parent / "half.png", pixels, bits)
    for space, is_linear in (("raw", True), ("sRGB", False), ("auto", bits == 16 or channels < 3)):
        stage = usd.new_stage(path.with_name(f"{space}.usda"))
        looking_at_squares(stage)
        stage.GetPrimAtPath("/light").GetAttribute("inputs:intensity").Set(1e-6)
        material, shader = usd.preview(stage, "/material", roughness=1.0, specularColor=(0, 0, 0), useSpecularWorkflow=1)
        for name in ("diffuseColor", "emissiveColor"):
            usd.texture(shader, name, "rgb", "half.png", sourceColorSpace=space)
        usd.bind(usd.square(stage, "/square"), material)
        stage.Save()
        scene, expected = loaded(path.with_name(f"{space}.usda")), 0.5 if is_linear else 0.214
        assert np.allclose(colours_seen(scene, [(0.5, 0.5)]), expected, atol=0.01), space
        assert np.allclose(film(scene)[SIZE[1] // 2, SIZE[0] // 2], expected, atol=0.01), space


def test_cut_outs_and_channels(path: Path) -> None:
    """Opacity is the alpha of an image, half of which is clear; roughness, one of its channels, makes no difference there."""
    pixels = np.ones((16, 16, 4))
    pixels[:, 8:, 3] = 0.2
    write_png(path.parent / "leaf.png", pixels)
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(
        stage, "/material", opacityThreshold=0.5, diffuseColor=(0.6, 0.6, 0.6), specularColor=(0, 0, 0), useSpecularWorkflow=1
    )
    usd.texture(shader, "opacity", "a", "leaf.png")
    usd.bind(usd.square(stage, "/square"), material)
    stage.Save()
    found = colours_seen(loaded(path), PLACES)
    assert np.allclose(found[[0, 2]], 0.6, atol=0.02)
    depth = loaded(path).render(width=SIZE[0], height=SIZE[1], spp=4, layers="depth").layers["depth"]
    seen = [depth[int(y * SIZE[1]), int(x * SIZE[0])] for x, y in PLACES]
    assert np.isclose(seen[0], 5, atol=0.01) and np.isclose(seen[2], 5, atol=0.01) and not np.isclose(seen[1], 5, atol=0.01)


def test_materials_of_subsets(path: Path) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    made = usd.mesh(stage, "/two", [(-1, -1, 0), (-1, 1, 0), (0, -1, 0), (0, 1, 0), (1, -1, 0), (1, 1, 0)], [4, 4], [0, 2, 3, 1, 2, 4, 5, 3])
    plain = {"roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
    usd.bind(made, usd.preview(stage, "/all", diffuseColor=(0.1, 0.2, 0.3), **plain)[0])
    subset = UsdGeom.Subset.CreateGeomSubset(made, "right", UsdGeom.Tokens.face, Vt.IntArray([1]), "materialBind")
    usd.bind(subset, usd.preview(stage, "/some", diffuseColor=(0.7, 0.6, 0.5), **plain)[0])
    stage.Save()
    left = 0.5 - 0.25 * SIZE[1] / SIZE[0]
    found = colours_seen(loaded(path), [(left, 0.5), (1 - left, 0.5)])
    assert np.allclose(found, [(0.1, 0.2, 0.3), (0.7, 0.6, 0.5)], atol=0.02)


def test_what_is_bound_for_previews_is_used_where_nothing_else_can_be_read(path: Path) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    plain = {"roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
    red, green = (usd.preview(stage, f"/{name}", diffuseColor=c, **plain)[0] for name, c in (("red", (0.8, 0.1, 0.1)), ("green", (0.1, 0.8, 0.1))))
    other, shader = UsdShade.Material.Define(stage, "/other"), UsdShade.Shader.Define(stage, "/other/surface")
    shader.CreateIdAttr("PxrSurface")
    other.CreateSurfaceOutput("ri").ConnectToSource(shader.ConnectableAPI(), "out")
    binding = UsdShade.MaterialBindingAPI.Apply(usd.square(stage, "/square").GetPrim())
    binding.Bind(red, materialPurpose="preview")
    for full, expected, words in ((None, (0.8, 0.1, 0.1), None), (other, (0.8, 0.1, 0.1), "/other: .*for previews"), (green, (0.1, 0.8, 0.1), None)):
        if full is not None:
            binding.Bind(full, materialPurpose="full")
        stage.Save()
        scene = loaded(path)
        assert np.allclose(colours_seen(scene, [(0.5, 0.5)]), [expected], atol=0.02)
        assert scene.warnings == [] if words is None else re.search(words, "\n".join(scene.warnings))


def lit_from_the_side(stage: Usd.Stage, path: Path) -> np.ndarray:
    """Four parts of a square, in rows from the top left, under a sun at the upper right."""
    light = UsdLux.DistantLight.Define(stage, "/sun")
    UsdGeom.Xformable(light).AddRotateXYZOp().Set(Gf.Vec3f(-20, 35, 0))
    light.CreateIntensityAttr(2.0)
    light.CreateAngleAttr(0.0)
    stage.RemovePrim("/light")
    stage.Save()
    picture = film(loaded(path), spp=16, max_depth=1)
    return np.array([picture[int(y * SIZE[1]), int(x * SIZE[0]), 0] for x, y in PLACES])


@pytest.mark.parametrize("mirrored", [False, True])
def test_normal_maps_turn_normals_as_usd_says(path: Path, mirrored: bool) -> None:
    """Towards +u where red is above a half, towards +v where green is: the same as normals of vertices. Also where u runs from right to left."""
    pixels = np.zeros((16, 16, 3))
    tilted = np.array([(-0.48, 0.36, 0.8), (0.48, 0.36, 0.8), (-0.48, -0.36, 0.8), (0.48, -0.36, 0.8)])
    for (rows, columns), normal in zip([(r, c) for r in (slice(8), slice(8, 16)) for c in (slice(8), slice(8, 16))], tilted, strict=True):
        pixels[rows, columns] = normal / 2 + 0.5
    write_png(path.parent / "normals.png", pixels)
    matt = {"diffuseColor": (0.8, 0.8, 0.8), "roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/material", **matt)
    usd.texture(shader, "normal", "rgb", "normals.png", sourceColorSpace="raw", scale=(2, 2, 2, 1), bias=(-1, -1, -1, 0))
    made = usd.square(stage, "/square")
    if mirrored:
        UsdGeom.PrimvarsAPI(made).GetPrimvar("st").Set([(1, 0), (0, 0), (0, 1), (1, 1)])
    usd.bind(made, material)
    found = lit_from_the_side(stage, path)
    expected = []
    for number, normal in enumerate(tilted):
        other = usd.new_stage(path.with_name(f"vertices{number}.usda"))
        looking_at_squares(other)
        made = usd.square(other, "/square")
        made.CreateNormalsAttr([tuple(normal.tolist())] * 4)
        usd.bind(made, usd.preview(other, "/material", **matt)[0])
        expected.append(lit_from_the_side(other, path.with_name(f"vertices{number}.usda"))[number])
    assert np.ptp(expected) > 0.2 and np.allclose(found, expected, atol=0.02)


@pytest.mark.parametrize("scheme", ["none", "catmullClark"])
def test_the_left_hand_and_mirrors_change_nothing(path: Path, scheme: str) -> None:
    """A shape that shines outside and is dark inside: as it is, with all its faces the other way round and leftHanded, and mirrored."""
    films = []
    for kind in ("plain", "left", "mirrored"):
        stage = usd.new_stage(path.with_name(f"{kind}.usda"))
        usd.camera(stage, (2, 3, 6), (0, 0, 0))
        material, _ = usd.preview(stage, "/m", emissiveColor=(0.8, 0.4, 0.2), diffuseColor=(0.5, 0.5, 0.5))
        sides = usd.SIDES if kind == "plain" else [side for at in range(0, 24, 4) for side in usd.SIDES[at : at + 4][::-1]]
        made = usd.mesh(stage, "/cube", usd.CORNERS, [4] * 6, sides if kind == "left" else usd.SIDES, scheme)
        if kind == "left":
            made.CreateOrientationAttr("leftHanded")
        if kind == "mirrored":
            UsdGeom.Xformable(made).AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
        usd.bind(made, material)
        UsdLux.DistantLight.Define(stage, "/sun").CreateAngleAttr(0.0)
        stage.GetPrimAtPath("/sun").GetAttribute("inputs:intensity").Set(1.0)
        stage.Save()
        films.append(film(loaded(path.with_name(f"{kind}.usda")), spp=64))
    assert films[0].max() > 0.7
    for other in films[1:]:
        assert np.abs(other - films[0]).mean() < 0.01 * films[0].mean()


# Cameras


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_camera_sees_what_usd_says(path: Path, projection: str) -> None:
    """Small balls where USD's own frustum has places of the picture."""
    stage = usd.new_stage(path, "Z")
    camera = usd.camera(
        stage, (3, -7, 4), (0, 0, 1), (0, 0, 1), horizontalAperture=30.0, verticalAperture=30.0 * 9 / 16, focalLength=28.0,
        horizontalApertureOffset=4.0, verticalApertureOffset=-3.0,
    )  # fmt: skip
    camera.CreateProjectionAttr(projection)
    UsdLux.DomeLight.Define(stage, "/dome").CreateIntensityAttr(1e-6)
    frustum = camera.GetCamera(Usd.TimeCode.Default()).frustum
    places = [(0.0, 0.0), (-0.75, 0.5), (0.5, -0.75), (0.75, 0.75)]
    material, _ = usd.preview(stage, "/glow", emissiveColor=(1, 1, 1), diffuseColor=(0, 0, 0))
    for i, (x, y) in enumerate(places):
        ray = frustum.ComputePickRay(Gf.Vec2d(x, y))
        ball = UsdGeom.Sphere.Define(stage, f"/ball{i}")
        ball.CreateRadiusAttr(0.05)
        usd.move(ball, ray.GetPoint(6 / ray.direction.GetLength()))
        usd.bind(ball, material)
    stage.Save()
    width, height = 160, 90
    picture = film(loaded(path), width=width, height=height, spp=16)[:, :, 0]
    assert picture.max() > 0.9 or projection == "orthographic"
    for x, y in places:
        at = int((1 - y) / 2 * height), int((x + 1) / 2 * width)
        assert picture[at[0] - 1 : at[0] + 2, at[1] - 1 : at[1] + 2].max() > 0.2, (x, y)


def test_cameras_can_be_chosen_and_have_lenses(path: Path) -> None:
    stage = usd.new_stage(path)
    usd.cube(stage, "/cube")
    usd.camera(stage, (0, 0, 9), (0, 0, 0), path="/b")
    usd.camera(stage, (0, 9, 1), (0, 0, 0), path="/a", fStop=2.0, focusDistance=8.0, focalLength=40.0)
    stage.Save()
    first, second = loaded(path), loaded(path, camera="/b")
    assert first._core.camera.eye == [0, 9, 1] and second._core.camera.eye == [0, 0, 9]
    assert np.isclose(first._core.camera.lens_radius, 1.0) and np.isclose(first._core.camera.focal_distance, 8)
    assert any("of 2 cameras, this one is used" in text for text in first.warnings)
    with pytest.raises(rp.Error, match="has no camera c; there are /a, /b"):
        rp.load(path, camera="c")


def test_without_a_camera_it_is_framed(path: Path) -> None:
    for up in "YZ":
        path = path.with_name(f"{up}.usda")
        stage = usd.new_stage(path, up)
        usd.cube(stage, "/cube", at=(0, 0, 5))
        stage.Save()
        scene = loaded(path, size=(80, 60))
        assert scene.size == (80, 60)
        eye = np.array(scene._core.camera.eye)
        assert eye["XYZ".index(up)] > (5 if up == "Z" else 0) and film(scene).std() > 0.02
