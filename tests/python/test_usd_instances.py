"""Instances in USD: which prototypes are shown, what they share, and what reaches them from outside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, UsdSkel
from usd_files import SIZE, colours_seen, film, loaded, looking_at_squares


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


MATT = {"roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}
LEFT, RIGHT = 0.5 - 0.25 * SIZE[1] / SIZE[0], 0.5 + 0.25 * SIZE[1] / SIZE[0]  # of halves of the picture of looking_at_squares


def instancer(stage: Usd.Stage, path: str, prototypes: list[str], positions: Any) -> UsdGeom.PointInstancer:
    made = UsdGeom.PointInstancer.Define(stage, path)
    made.CreatePrototypesRel().SetTargets(prototypes)
    made.CreateProtoIndicesAttr([i % len(prototypes) for i in range(len(positions))])
    made.CreatePositionsAttr(positions)
    return made


def placed(stage: Usd.Stage, path: str, source: str, at: Any = (0, 0, 0), kind: str = "Xform") -> Usd.Prim:
    """An instanceable prim that refers to another of the stage."""
    prim = stage.DefinePrim(path, kind) if kind else stage.OverridePrim(path)
    prim.SetSpecifier(Sdf.SpecifierDef)
    prim.GetReferences().AddInternalReference(source)
    prim.SetInstanceable(True)
    UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(*map(float, at)))
    return prim


def test_prototypes_may_lie_under_an_over(path: Path) -> None:
    """Where nothing but their instancer shows them. Inactive ones are not shown, and one that shows nothing is warned of."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    stage.OverridePrim("/many/hidden")
    usd.square(stage, "/many/hidden/group/square")
    UsdGeom.Xform.Define(stage, "/many/hidden/empty")
    usd.square(stage, "/many/hidden/off", 50).GetPrim().SetActive(False)
    usd.square(stage, "/many/gone/inner", 50)
    stage.GetPrimAtPath("/many/gone").SetActive(False)
    for name in ("hidden", "hidden/group"):
        stage.GetPrimAtPath(f"/many/{name}").SetSpecifier(Sdf.SpecifierOver)
    prototypes = [f"/many/{name}" for name in ("hidden/group", "hidden/off", "hidden/empty", "gone/inner")]
    instancer(stage, "/many", prototypes, [(3, 0, 0), (6, 0, 0), (9, 0, 0), (12, 0, 0)])
    stage.Save()
    scene = loaded(path)
    assert scene.warnings == [f"{path}: /many: its prototype /many/hidden/empty shows nothing"]
    assert np.allclose(scene.bake().bounds, [[2, -1, 0], [4, 1, 0]], atol=1e-3)


def test_an_instancer_may_be_an_instance(path: Path) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    source = instancer(stage, "/source", ["/source/square"], [(3, 0, 0), (6, 0, 0)])
    usd.square(stage, "/source/square")
    source.GetPrim().SetSpecifier(Sdf.SpecifierClass)
    placed(stage, "/one", "/source", kind="")
    placed(stage, "/two", "/source", (0, 5, 0), kind="")
    more = placed(stage, "/three", "/source", (0, 9, 0), kind="")
    UsdGeom.PointInstancer(more).GetPositionsAttr().Set([(0, 0, 0), (20, 0, 0)])
    stage.Save()
    assert np.allclose(loaded(path).bake().bounds, [[-1, -1, 0], [21, 10, 0]], atol=1e-3)


def test_roots_of_instances_have_values_of_their_own(path: Path) -> None:
    """Balls of two sizes; of two lamps one is brighter; those that say the same are one object."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    UsdGeom.Sphere.Define(stage, "/ball").GetPrim().SetSpecifier(Sdf.SpecifierClass)
    for i in range(3):
        prim = placed(stage, f"/ball{i}", "/ball", (10 * i, 0, 0), kind="")
        if i == 2:
            UsdGeom.Sphere(prim).GetRadiusAttr().Set(3.0)
    stage.Save()
    blocks = loaded(path).bake()
    assert blocks.spheres == 2 and np.allclose(blocks.bounds, [[-1, -3, -3], [23, 3, 3]], atol=1e-3)
    stage = usd.new_stage(path.with_name("lamps.usda"))
    looking_at_squares(stage)
    UsdLux.RectLight.Define(stage, "/lamp").GetPrim().SetSpecifier(Sdf.SpecifierClass)
    for i, strength in enumerate((3.0, 5.0)):
        prim = placed(stage, f"/lamp{i}", "/lamp", (2 * i - 1, 0, 0), kind="")
        UsdGeom.Xformable(prim).AddRotateYOp().Set(180.0)
        UsdLux.RectLight(prim).GetIntensityAttr().Set(strength)
    stage.Save()
    seen = film(loaded(path.with_name("lamps.usda")))[SIZE[1] // 2, [SIZE[0] // 2 - SIZE[1] // 2, SIZE[0] // 2 + SIZE[1] // 2 - 1]]
    assert np.allclose(seen, [[3] * 3, [5] * 3])


def two_squares(stage: Usd.Stage) -> list[Usd.Prim]:
    """Instances of one square, that of the left half and that of the right, in /group."""
    looking_at_squares(stage)
    usd.square(stage, "/source/square", 0.5)
    stage.GetPrimAtPath("/source").SetSpecifier(Sdf.SpecifierClass)
    UsdGeom.Xform.Define(stage, "/group")
    return [placed(stage, f"/group/{name}", "/source", (x, 0, 0)) for name, x in (("left", -0.5), ("right", 0.5))]


def test_bindings_reach_instances_by_their_strength(path: Path) -> None:
    """A material within the asset is stronger than one outside, unless that says otherwise."""
    stage = usd.new_stage(path)
    prims = two_squares(stage)
    usd.bind(stage.GetPrimAtPath("/source/square"), usd.preview(stage, "/source/green", diffuseColor=(0.1, 0.8, 0.1), **MATT)[0])
    red, _ = usd.preview(stage, "/red", diffuseColor=(0.8, 0.1, 0.1), **MATT)
    for prim, strength in zip(prims, (UsdShade.Tokens.weakerThanDescendants, UsdShade.Tokens.strongerThanDescendants), strict=True):
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(red, strength)
    stage.Save()
    assert np.allclose(colours_seen(loaded(path), [(LEFT, 0.5), (RIGHT, 0.5)]), [(0.1, 0.8, 0.1), (0.8, 0.1, 0.1)], atol=0.02)


@pytest.mark.parametrize("part", ["", "/square"])
def test_bindings_by_collections_reach_instances(path: Path, part: str) -> None:
    stage = usd.new_stage(path)
    prims, group = two_squares(stage), stage.GetPrimAtPath("/group")
    binding, colors = UsdShade.MaterialBindingAPI.Apply(group), [(0.8, 0.1, 0.1), (0.1, 0.1, 0.8)]
    for i, prim in enumerate(prims):
        collection = Usd.CollectionAPI.Apply(group, f"part{i}")
        collection.CreateIncludesRel().SetTargets([f"{prim.GetPath()}{part}"])
        binding.Bind(collection, usd.preview(stage, f"/paint{i}", diffuseColor=colors[i], **MATT)[0], f"binding{i}")
    stage.Save()
    assert np.allclose(colours_seen(loaded(path), [(LEFT, 0.5), (RIGHT, 0.5)]), colors, atol=0.02)


def test_indexed_primvars_reach_instances(path: Path) -> None:
    stage = usd.new_stage(path)
    for i, prim in enumerate(two_squares(stage)):
        primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant")
        primvar.Set([(0.8, 0, 0), (0, 0, 0.8)])
        primvar.SetIndices([i])
    stage.Save()
    assert np.allclose(colours_seen(loaded(path), [(LEFT, 0.5), (RIGHT, 0.5)]), [(0.8, 0, 0), (0, 0, 0.8)], atol=0.02)


@pytest.mark.parametrize("kind", ["DomeLight", "DistantLight", "SphereLight"])
def test_lights_of_instances_are_those_of_the_world(path: Path, kind: str) -> None:
    """A rig of one light, turned, within another and placed twice, is as bright as two lights where they are."""
    films = []
    for nested in (False, True):
        path = path.with_name(f"{nested}.usda")
        stage = usd.new_stage(path)
        usd.camera(stage, (0, 0, 5), (0, 0, 0))
        usd.square(stage, "/square")
        stage.CreateClassPrim("/rig")
        for name in ["/rig/inner/light"] if nested else ["/a/inner/light", "/b/inner/light"]:
            light = stage.DefinePrim(name, kind)
            light.GetAttribute("inputs:intensity").Set(30000.0 if kind == "DistantLight" else 3.0)
            if kind == "SphereLight":
                light.GetAttribute("treatAsPoint").Set(True)
            usd.move(UsdGeom.Xformable(light), (0, 0, 3))
            UsdGeom.Xformable(UsdGeom.Xform.Define(stage, str(light.GetParent().GetPath()))).AddRotateXOp().Set(-20.0)
        for name, x in (("/a", 1), ("/b", -1)):
            if nested:
                placed(stage, name, "/rig", (x, 0, 0))
            else:
                usd.move(UsdGeom.Xform.Define(stage, name), (x, 0, 0))
        stage.Save()
        scene = loaded(path)
        assert scene.warnings == []
        films.append(film(scene, spp=16))
    assert films[0].max() > 0.1 and np.allclose(films[0], films[1], rtol=1e-3, atol=1e-5)


def test_lights_of_instances_are_not_without_end(path: Path) -> None:
    """A hundred of a hundred of a hundred lamps."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    usd.square(stage, "/square")
    UsdLux.SphereLight.Define(stage, "/a/b/c/lamp").CreateTreatAsPointAttr(True)
    for name in ("/a", "/a/b", "/a/b/c"):
        inner = {"/a": "/a/b", "/a/b": "/a/b/c", "/a/b/c": "/a/b/c/lamp"}[name]
        instancer(stage, name, [inner], [(i, 0, 0) for i in range(100)])
    stage.Save()
    assert any("/a/b/c/lamp: instances place more than 1024 lights without a surface" in text for text in loaded(path).warnings)


def test_skeletons_of_instances_are_warned_of(path: Path) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    stage.CreateClassPrim("/source")
    UsdSkel.Root.Define(stage, "/source/root")
    usd.square(stage, "/source/root/square")
    placed(stage, "/one", "/source")
    stage.Save()
    assert any("skeletons in instanceable prims are left out" in text for text in loaded(path).warnings)


def test_what_places_itself_by_instances_is_an_error(path: Path) -> None:
    stage = usd.new_stage(path)
    instancer(stage, "/many", ["/many"], [(0, 0, 0)])
    stage.Save()
    with pytest.raises(rp.Error, match="/many: it places itself|deep"):
        rp.load(path)
