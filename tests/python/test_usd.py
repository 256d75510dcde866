"""USD against USD itself (bounds, transforms, cameras), and against the same scenes built from arrays."""

from __future__ import annotations

import struct
import subprocess
import sys
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, UsdUtils, Vt

SIZE = (64, 36)


def loaded(path: Path, *, quiet: bool = True, **options: Any) -> rp.Scene:
    """What is warned of is in the scene's warnings, too."""
    with warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore", rp.RaypagerWarning)
        return rp.load(path, **options)


def film(scene: rp.Scene, **options: Any) -> np.ndarray:
    return scene.render(**({"width": SIZE[0], "height": SIZE[1], "spp": 4} | options)).film


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


# How far a cube of side 2 reaches after two levels: the middle of a side, among faces whose corners are at 5/9, 3/4, 1 and 3/4.
TWICE = ((5 / 9 + 3 / 4 + 1 + 3 / 4) / 4 + 2 * (1 + 3 / 4) / 2 + 1) / 4


# Geometry


def test_counts_and_bounds_are_those_of_usd(path: Path) -> None:
    """All kinds of shapes, moved and turned; what is not drawn is left out. The ground does not count: a camera and a light are there."""
    stage = usd.new_stage(path)
    usd.camera(stage, (0, 0, 30), (0, 0, 0))
    UsdLux.DomeLight.Define(stage, "/light")
    root = UsdGeom.Xform.Define(stage, "/root")
    UsdGeom.Xformable(root).AddRotateXYZOp().Set(Gf.Vec3f(20, 30, 40))
    usd.cube(stage, "/root/cube", at=(1, 2, 3))
    n_gon = usd.mesh(stage, "/root/polygon", [(np.cos(a), np.sin(a), 5) for a in np.arange(7)[::-1] * 0.897], [7], range(7))
    n_gon.CreateOrientationAttr("leftHanded")
    holes = usd.cube(stage, "/root/holes", at=(-4, 0, 0))
    holes.CreateHoleIndicesAttr([0, 1])
    UsdGeom.Cube.Define(stage, "/root/box").CreateSizeAttr(1.5)
    UsdGeom.Sphere.Define(stage, "/root/ball").CreateRadiusAttr(6.25)
    hidden = usd.cube(stage, "/root/hidden", at=(100, 0, 0))
    UsdGeom.Imageable(hidden).MakeInvisible()
    usd.cube(stage, "/root/guide", at=(0, 100, 0)).CreatePurposeAttr("guide")
    usd.cube(stage, "/root/proxy", at=(0, 100, 0)).CreatePurposeAttr("proxy")
    usd.cube(stage, "/root/render", at=(0, 0, -4)).CreatePurposeAttr("render")
    stage.OverridePrim("/root/inactive").SetActive(False)
    stage.Save()
    blocks = loaded(path).bake()
    assert (blocks.triangles, blocks.spheres) == (12 + 5 + 8 + 12 + 12, 1)
    for prim in (stage.GetPrimAtPath(f"/root/{name}") for name in ("hidden", "ball")):
        prim.SetActive(False)
    # A turned ball's box is larger in USD, which turns its box.
    inner = usd.bounds_of(stage)
    expected = np.array([np.minimum(inner[0], -6.25), np.maximum(inner[1], 6.25)])
    assert np.allclose(blocks.bounds, expected, atol=1e-4)


@pytest.mark.parametrize("kind", ["Cylinder", "Cone", "Capsule", "Plane", "Cube", "Cylinder_1", "Capsule_1"])
@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_round_shapes_have_the_bounds_of_usd(path: Path, kind: str, axis: str) -> None:
    stage = usd.new_stage(path)
    prim = stage.DefinePrim("/shape", kind)
    for name, value in {"axis": axis, "radius": 0.75, "height": 3.0, "width": 2.0, "length": 5.0, "radiusBottom": 0.5, "radiusTop": 1.0}.items():
        if prim.HasAttribute(name):
            prim.GetAttribute(name).Set(value)
    usd.camera(stage, (0, 0, 30), (0, 0, 0))
    UsdLux.DomeLight.Define(stage, "/light")
    # USD keeps the extent of shapes in the file, and computes it where that is not so.
    extent = np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), Usd.TimeCode.Default()))
    stage.Save()
    assert np.allclose(loaded(path).bake().bounds, extent, atol=2e-3)


def test_subdivision_is_the_default(path: Path) -> None:
    stage = usd.new_stage(path)
    usd.cube(stage, "/cube", None)
    stage.Save()
    for levels, faces in {0: 6, 1: 24, 2: 96, 3: 384}.items():
        blocks = loaded(path, subdivision=levels, ground=False).bake()
        assert blocks.triangles == 2 * faces
    # After one level the corners are at 5/9, and the middles of the sides where they were.
    assert np.allclose(loaded(path, subdivision=1, ground=False).bake().bounds, [[-1] * 3, [1] * 3])
    assert np.allclose(loaded(path, subdivision=2, ground=False).bake().bounds, [[-TWICE] * 3, [TWICE] * 3], atol=1e-5)
    with pytest.raises(rp.Error, match="subdivision"):
        rp.load(path, subdivision=7)


def test_a_sphere_is_a_sphere(path: Path) -> None:
    """One that is stretched becomes triangles, since engines know balls alone."""
    stage = usd.new_stage(path)
    usd.move(UsdGeom.Sphere.Define(stage, "/ball"), (0, 1, 0))
    stretched = UsdGeom.Sphere.Define(stage, "/stretched")
    UsdGeom.Xformable(stretched).AddScaleOp().Set(Gf.Vec3f(1, 2, 3))
    stage.Save()
    blocks = loaded(path, ground=False).bake()
    assert blocks.spheres == 1 and blocks.triangles > 10000
    assert np.allclose(blocks.bounds, [[-1, -2, -3], [1, 2, 3]], atol=1e-3)


def test_points_and_curves(path: Path) -> None:
    stage = usd.new_stage(path)
    points = UsdGeom.Points.Define(stage, "/points")
    points.CreatePointsAttr([(0, 0, 0), (4, 0, 0), (0, 4, 0)])
    points.CreateWidthsAttr([1.0, 1.0, 2.0])
    curves = UsdGeom.BasisCurves.Define(stage, "/curves")
    curves.CreateTypeAttr("linear")
    curves.CreatePointsAttr([(0, 0, 9), (0, 8, 9), (0, 8, 12), (3, 0, 9), (3, 3, 9)])
    curves.CreateCurveVertexCountsAttr([3, 2])
    curves.CreateWidthsAttr([0.5])
    bezier = UsdGeom.BasisCurves.Define(stage, "/bezier")
    bezier.CreatePointsAttr([(-3, 0, 0), (-3, 4, 0), (-3, 4, 4), (-3, 0, 4)])
    bezier.CreateCurveVertexCountsAttr([4])
    bezier.CreateWidthsAttr([0.5])
    stage.Save()
    blocks = loaded(path, ground=False).bake()
    assert blocks.spheres == 3 and blocks.triangles == 16 * (3 + 8)
    assert np.allclose(blocks.bounds, [[-3.25, -0.5, -1], [4.5, 8.25, 12]], atol=0.02)


def test_damaged_meshes_are_named(path: Path) -> None:
    for number, (points, counts, indices, what) in enumerate([
        (usd.CORNERS, [4], [0, 1, 2, 8], "/bad: a face uses point 8, but there are 8"),
        (usd.CORNERS, [4], [0, 1, -1, 3], "/bad: a face uses point -1"),
        (usd.CORNERS, [5], [0, 1, 2, 3], "/bad: its faces have 5 corners, but there are 4"),
        (usd.CORNERS, [-4], [0, 1, 2, 3], "/bad: its faces have -4 corners"),
    ]):  # fmt: skip
        bad = path.with_name(f"bad{number}.usda")
        stage = usd.new_stage(bad)
        usd.mesh(stage, "/bad", points, counts, indices)
        stage.Save()
        with pytest.raises(rp.Error, match=what) as found:
            rp.load(bad)
        assert str(found.value).startswith(str(bad)) and "\n" not in str(found.value)


def test_what_is_odd_is_warned_of(path: Path) -> None:
    """Faces of two corners, points that are not finite, creases and primvars that do not fit, a material that is none."""
    stage = usd.new_stage(path)
    usd.cube(stage, "/whole")
    odd = usd.mesh(stage, "/odd", [*usd.CORNERS, (np.nan, 0, 0)], [4, 2, 3], [0, 1, 2, 3, 0, 1, 0, 1, 8], None)
    odd.CreateCreaseIndicesAttr([0, 1])
    odd.CreateCreaseLengthsAttr([3])
    odd.CreateCreaseSharpnessesAttr([1.0])
    UsdGeom.PrimvarsAPI(odd).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex").Set([(1, 0, 0)] * 3)
    usd.bind(odd, UsdShade.Material.Define(stage, "/none"))
    nurbs = UsdGeom.NurbsPatch.Define(stage, "/nurbs")
    assert nurbs
    stage.Save()
    text = "\n".join(loaded(path).warnings)
    for what in ("/odd: has faces of fewer than three", "/odd: has points that are not finite", "/odd: its creases", "/odd: its displayColor",
                 "/none: has no UsdPreviewSurface", "/nurbs: a NurbsPatch is not read"):  # fmt: skip
        assert what in text
    assert loaded(path, subdivision=0, ground=False).bake().triangles == 12 + 2


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


def colours_seen(scene: rp.Scene, places: list[tuple[float, float]]) -> np.ndarray:
    """Of pixels, as shares of the picture from its top left."""
    layers = scene.render(width=SIZE[0], height=SIZE[1], spp=16, layers="albedo").layers
    return np.array([layers["albedo"][int(y * SIZE[1]), int(x * SIZE[0])] for x, y in places])


def looking_at_squares(stage: Usd.Stage) -> None:
    """The square from -1 to 1 fills the height of the picture."""
    camera = usd.camera(stage, (0, 0, 5), (0, 0, 0), horizontalAperture=160.0 / 9 * 2, verticalAperture=20.0)
    camera.CreateProjectionAttr("orthographic")
    UsdLux.DomeLight.Define(stage, "/light")


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


def write_png(path: Path, pixels: np.ndarray) -> None:
    """[height, width, 3 or 4] floats from 0 to 1, which are stored as they are, in 8 bits."""
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)  # each begins with its filter: none
    rows[:, 1:] = np.round(np.clip(pixels, 0, 1) * 255).reshape(height, -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b""))


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


# Lights


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


# Instances


def scattered(stage: Usd.Stage, count: int) -> np.ndarray:
    """A point instancer of two prototypes, of which some are hidden. [n, 4, 4], the transforms of what is shown, by USD's own rules by hand."""
    random = np.random.default_rng(7)
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    usd.move(instancer, (0, 1, 0))
    ico = usd.cube(stage, "/many/prototypes/cube")
    UsdGeom.Xformable(ico).AddScaleOp().Set(Gf.Vec3f(0.2, 0.2, 0.2))
    usd.cube(stage, "/many/prototypes/slab").AddScaleOp().Set(Gf.Vec3f(0.3, 0.1, 0.3))
    instancer.CreatePrototypesRel().SetTargets(["/many/prototypes/cube", "/many/prototypes/slab"])
    positions, scales = random.uniform(-3, 3, (count, 3)), random.uniform(0.5, 1.5, (count, 3))
    axes, angles = random.normal(size=(count, 3)), random.uniform(0, 180, count)
    rotations = [Gf.Rotation(Gf.Vec3d(*a), float(b)) for a, b in zip(axes.tolist(), angles, strict=True)]
    instancer.CreateProtoIndicesAttr([i % 2 for i in range(count)])
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(positions.astype(np.float32)))
    instancer.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(scales.astype(np.float32)))
    instancer.CreateOrientationsAttr([Gf.Quath(r.GetQuat()) for r in rotations])
    instancer.CreateInvisibleIdsAttr([1, 4])
    places = []
    for i in range(count):
        if i in (1, 4):
            continue
        turn = np.array(Gf.Matrix3d(Gf.Quatd(Gf.Quath(rotations[i].GetQuat())))).T
        place = np.eye(4)
        own = np.diag([0.2, 0.2, 0.2] if i % 2 == 0 else [0.3, 0.1, 0.3])
        place[:3, :3] = turn @ np.diag(scales[i].astype(np.float32)) @ own
        place[:3, 3] = positions[i].astype(np.float32) + (0, 1, 0)
        places.append(place)
    return np.array(places)


def test_a_point_instancer_is_like_copies(path: Path) -> None:
    stage = usd.new_stage(path)
    usd.camera(stage, (0, 2, 9), (0, 1, 0))
    UsdLux.DomeLight.Define(stage, "/light")
    places = scattered(stage, 20)
    stage.Save()
    copies = usd.new_stage(path.parent / "copies.usda")
    usd.camera(copies, (0, 2, 9), (0, 1, 0))
    UsdLux.DomeLight.Define(copies, "/light")
    for i, place in enumerate(places):
        usd.turn(usd.cube(copies, f"/cube{i}"), place)
    copies.Save()
    one, other = loaded(path).bake(), loaded(path.parent / "copies.usda").bake()
    assert one.summary is not None and one.summary["instances"] == 18 and one.summary["objects"] == 2
    assert other.summary is not None and other.triangles == 18 * 12
    assert one.triangles < other.triangles
    assert np.allclose(one.bounds, other.bounds, atol=1e-4)
    pictures = [b.render(width=SIZE[0], height=SIZE[1], spp=16).film for b in (one, other)]
    assert np.abs(pictures[0] - pictures[1]).mean() < 0.02 * pictures[1].mean()


def test_scene_graph_instances_share_geometry(path: Path) -> None:
    """A hundred references to one asset, which holds an instance of another; a look that is inherited makes another object."""
    asset = usd.new_stage(path.parent / "asset.usda")
    asset.SetDefaultPrim(UsdGeom.Xform.Define(asset, "/asset").GetPrim())
    usd.cube(asset, "/asset/cube", None)
    asset.Save()
    stage = usd.new_stage(path)
    paint, _ = usd.preview(stage, "/paint", diffuseColor=(1, 0, 0))
    for i in range(100):
        prim = UsdGeom.Xform.Define(stage, f"/group/at{i}")
        usd.move(prim, (4 * (i % 10), 0, 4 * (i // 10)))
        prim.GetPrim().GetReferences().AddReference("asset.usda")
        prim.GetPrim().SetInstanceable(True)
        if i >= 90:
            usd.bind(prim, paint)
    stage.Save()
    blocks = loaded(path, ground=False).bake()
    assert blocks.summary is not None
    assert (blocks.summary["objects"], blocks.summary["instances"], blocks.triangles) == (2, 100, 2 * 192)
    assert np.allclose(blocks.bounds[1] - blocks.bounds[0], np.array([36, 0, 36]) + 2 * TWICE, atol=1e-4)


def test_nested_instancers(path: Path) -> None:
    """Ten rows of ten: as many as copies would be, from one cube."""
    stage = usd.new_stage(path)
    outer, inner = UsdGeom.PointInstancer.Define(stage, "/outer"), UsdGeom.PointInstancer.Define(stage, "/outer/p/inner")
    usd.cube(stage, "/outer/p/inner/p/cube", None)
    for made, target, step in [(outer, "/outer/p/inner", (0, 0, 3)), (inner, "/outer/p/inner/p/cube", (3, 0, 0))]:
        made.CreatePrototypesRel().SetTargets([target])
        made.CreateProtoIndicesAttr([0] * 10)
        made.CreatePositionsAttr([tuple(i * s for s in step) for i in range(10)])
    stage.Save()
    blocks = loaded(path, ground=False).bake()
    assert np.allclose(blocks.bounds[1] - blocks.bounds[0], np.array([27, 0, 27]) + 2 * TWICE, atol=1e-4)
    assert blocks.triangles == 192 and film(loaded(path)).std() > 0
    # One that places itself is an error.
    inner.GetPrototypesRel().SetTargets(["/outer/p"])
    stage.Save()
    with pytest.raises(rp.Error, match="places itself"):
        rp.load(path)


def test_damaged_instancers_are_named(path: Path) -> None:
    stage = usd.new_stage(path)
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    usd.cube(stage, "/many/cube")
    instancer.CreatePrototypesRel().SetTargets(["/many/cube"])
    instancer.CreateProtoIndicesAttr([0, 1])
    instancer.CreatePositionsAttr([(0, 0, 0), (1, 0, 0)])
    stage.Save()
    with pytest.raises(rp.Error, match="/many: its protoIndices go from 0 to 1, but it has 1 proto"):
        rp.load(path)
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    stage.Save()
    with pytest.raises(rp.Error, match="/many: has 3 protoIndices, but not as many positions"):
        rp.load(path)


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


# Files


def test_the_command_line_takes_it_and_keeps_what_it_baked(path: Path, tmp_path: Path) -> None:
    stage = usd.new_stage(path)
    usd.cube(stage, "/cube", None)
    usd.camera(stage, (0, 3, 9), (0, 0, 0))
    stage.Save()
    output = tmp_path / "a.pfm"
    arguments = [sys.executable, "-m", "raypager", "render", str(path), "-o", str(output), "--size", "64x36", "--spp", "4", "--subdivision", "1"]

    def run() -> str:
        done = subprocess.run(arguments, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stderr

    assert "baked 48 triangles" in run()
    assert np.array_equal(rp.read_image(output), film(loaded(path, subdivision=1)))
    assert "baked already" in run()
    arguments[-1] = "2"
    assert "baked 192 triangles" in run()
    usd.cube(stage, "/more")
    stage.Save()
    assert "baked 204 triangles" in run()
    arguments[-1] = "x"
    done = subprocess.run(arguments, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (2, "raypager: --subdivision: a whole number from 0 to 6 is expected, not 'x'\n")


def test_layers_and_variants_are_composed(path: Path) -> None:
    layer = usd.new_stage(path.parent / "layer.usda")
    usd.cube(layer, "/under")
    layer.Save()
    stage = usd.new_stage(path)
    stage.GetRootLayer().subLayerPaths.append("layer.usda")
    choice = stage.DefinePrim("/choice", "Xform").GetVariantSets().AddVariantSet("size")
    for name, at in (("near", (9, 0, 0)), ("far", (90, 0, 0))):
        choice.AddVariant(name)
        choice.SetVariantSelection(name)
        with choice.GetVariantEditContext():
            usd.cube(stage, "/choice/cube", at=at)
    choice.SetVariantSelection("near")
    stage.Save()
    scene = loaded(path, ground=False)
    assert np.allclose(scene.bake().bounds, [[-1, -1, -1], [10, 1, 1]])
    assert [Path(f).name for f in scene._core.files] == ["a.usda", "layer.usda"]


def test_animation_is_taken_at_its_first_frame(path: Path) -> None:
    stage = usd.new_stage(path)
    stage.SetStartTimeCode(5)
    stage.SetEndTimeCode(9)
    op = UsdGeom.Xformable(usd.cube(stage, "/cube")).AddTranslateOp()
    for frame in (1, 5, 9):
        op.Set(Gf.Vec3d(frame, 0, 0), frame)
    stage.Save()
    scene = loaded(path, ground=False)
    assert any("is animated; the picture is that of frame 5" in text for text in scene.warnings)
    assert np.allclose(scene.bake().bounds[:, 0], [4, 6])


@pytest.mark.parametrize("animated", [False, True])
def test_skeletons_stand_as_they_are_posed(path: Path, animated: bool) -> None:
    """A cube whose upper half goes with a joint that is 2 above its place, at the first frame."""
    stage = usd.new_stage(path)
    UsdSkel.Root.Define(stage, "/root")
    skeleton, animation = UsdSkel.Skeleton.Define(stage, "/root/skeleton"), UsdSkel.Animation.Define(stage, "/root/animation")
    rest = [Gf.Matrix4d(1), Gf.Matrix4d().SetTranslate((0, 1, 0))]
    for made in (skeleton, animation):
        made.CreateJointsAttr(["a", "a/b"])
    skeleton.CreateBindTransformsAttr(rest)
    skeleton.CreateRestTransformsAttr(rest)
    animation.CreateRotationsAttr([Gf.Quatf(1)] * 2)
    animation.CreateScalesAttr([Gf.Vec3h(1)] * 2)
    places = animation.CreateTranslationsAttr([(0, 0, 0), (0, 3, 0)])
    if animated:
        places.Set([(0, 0, 0), (0, 3, 0)], 1)
        places.Set([(0, 0, 0), (0, 9, 0)], 2)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(["/root/animation"])
    binding = UsdSkel.BindingAPI.Apply(usd.cube(stage, "/root/cube").GetPrim())
    binding.CreateSkeletonRel().SetTargets(["/root/skeleton"])
    binding.CreateJointIndicesPrimvar(False, 1).Set([int(y > 0) for _, y, _ in usd.CORNERS])
    binding.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 8)
    stage.Save()
    assert np.allclose(loaded(path, ground=False).bake().bounds, [[-1, -1, -1], [1, 3, 1]])


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usd"])
def test_damaged_files_are_errors(path: Path, ending: str) -> None:
    stage = usd.new_stage(path)
    usd.cube(stage, "/cube")
    stage.GetRootLayer().Export(str(path.with_name(f"b{ending}")))
    whole = path.with_name(f"b{ending}").read_bytes()
    for size in (0, 7, len(whole) // 2, len(whole) - 9):
        damaged = path.with_name(f"damaged{size}{ending}")
        damaged.write_bytes(whole[:size])
        with pytest.raises(rp.Error, match=f"damaged{size}{ending}: ") as found:
            rp.load(damaged)
        assert "\n" not in str(found.value)


def test_what_is_missing_is_said(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = usd.new_stage(path)
    material, shader = usd.preview(stage, "/material")
    usd.texture(shader, "diffuseColor", "rgb", "none.png", fallback="x")
    usd.bind(usd.square(stage, "/square"), material)
    stage.DefinePrim("/gone", "Xform").GetReferences().AddReference("gone.usda")
    stage.Save()
    text = "\n".join(loaded(path).warnings)
    assert "none.png: no such file" in text and "gone.usda" in text
    with pytest.raises(rp.Error, match="nowhere.usda: no such file"):
        rp.load(path.with_name("nowhere.usda"))
    with pytest.raises(rp.Error, match="a scene stands alone"):
        rp.load(path, path)
    empty = usd.new_stage(path.with_name("empty.usda"))
    empty.Save()
    with pytest.raises(rp.Error, match="empty.usda: has no surface that can be seen"):
        rp.load(path.with_name("empty.usda"))
    monkeypatch.setitem(sys.modules, "pxr.Usd", None)
    with pytest.raises(rp.Error, match="pip install 'raypager\\[usd\\]'"):
        rp.load(path)


def test_the_program_says_where_usd_is_read(path: Path, program: Path) -> None:
    usd.new_stage(path).Save()
    done = subprocess.run([program, "render", path, "-o", path.with_suffix(".pfm")], capture_output=True, text=True)
    assert done.returncode == 1 and "python -m raypager render" in done.stderr and done.stderr.count("\n") == 1
