"""USD: geometry and instances against USD's own bounds and transforms, and how files are read."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel, Vt
from usd_files import SIZE, film, loaded


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
    UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/many")).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "vertex").Set([(1, 0, 0)] * 20)
    stage.Save()
    assert loaded(path).warnings == [f"{path}: /many: its displayColor, one for each instance, is left out"]
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


@pytest.mark.filterwarnings("ignore::raypager.RaypagerWarning")
@pytest.mark.parametrize("seed", range(3))
def test_changed_numbers_are_errors_or_scenes(path: Path, seed: int) -> None:
    """Of a stage with something of everything: one clear line, or a picture of what is left."""
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    stage = usd.new_stage(path)
    scattered(stage, 6)
    usd.cube(stage, "/smooth", None).CreateCreaseIndicesAttr([0, 1])
    UsdGeom.Sphere.Define(stage, "/ball")
    curves = UsdGeom.BasisCurves.Define(stage, "/curves")
    curves.CreatePointsAttr([(0, 0, 0), (0, 4, 0), (0, 4, 4), (0, 0, 4)])
    curves.CreateCurveVertexCountsAttr([4])
    curves.CreateWidthsAttr([0.5])
    usd.bind(usd.square(stage, "/square"), usd.preview(stage, "/m", metallic=0.5, clearcoat=0.5, opacity=0.5, ior=1.4)[0])
    usd.camera(stage, (0, 0, 9), (0, 0, 0), fStop=2.0, focusDistance=3.0)
    UsdLux.RectLight.Define(stage, "/light").CreateIntensityAttr(3.0)
    text = stage.GetRootLayer().ExportToString()
    begin = text.index("def ")
    numbers = [(begin + m.start(), begin + m.end()) for m in re.finditer(r"(?<![\w.])-?\d+(\.\d+)?(e-?\d+)?", text[begin:])]
    others = ["-1", "0", "7", "1e38", "-1e38", "nan", "inf", "2147483647", "-2147483648", "1e-30"]
    outcomes = set()
    for count in range(40):
        start, end = numbers[random.integers(len(numbers))]
        name = path.with_name(f"changed{count}.usda")
        name.write_text(text[:start] + others[random.integers(len(others))] + text[end:])
        try:
            loaded(name).bake()
            outcomes.add("scene")
        except rp.Error as error:
            assert "\n" not in str(error)
            outcomes.add("error")
    assert outcomes == {"scene", "error"}


def test_what_is_missing_is_said(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stage = usd.new_stage(path)
    material, shader = usd.preview(stage, "/material")
    usd.texture(shader, "diffuseColor", "rgb", "none.png")
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
