"""Shapes in USD that are no meshes, and what of their looks, and of prims in general, is left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade
from usd_files import colours_seen, loaded, looking_at_squares, write_png


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


MATT = {"roughness": 1.0, "specularColor": (0, 0, 0), "useSpecularWorkflow": 1}


def shape_of(stage: Usd.Stage, kind: str) -> Any:
    """That covers the middle of the picture, of two parts where it can have them."""
    prim = stage.DefinePrim("/shape", kind)
    if kind == "BasisCurves":
        curves = UsdGeom.BasisCurves(prim)
        curves.CreateTypeAttr("linear")
        curves.CreatePointsAttr([(-1, -0.3, 0), (1, -0.3, 0), (-1, 0.3, 0), (1, 0.3, 0)])
        curves.CreateCurveVertexCountsAttr([2, 2])
        curves.CreateWidthsAttr([0.8])
    elif kind == "Points":
        UsdGeom.Points(prim).CreatePointsAttr([(0, 0, 0)])
        UsdGeom.Points(prim).CreateWidthsAttr([1.0])
    return UsdGeom.Gprim(prim)


@pytest.mark.parametrize(("interpolation", "values"), [("uniform", [(0.8, 0, 0), (0, 0.4, 0)]),
                                                       ("vertex", [(0.8, 0, 0), (0.8, 0, 0), (0, 0.2, 0), (0, 0.6, 0)])])  # fmt: skip
def test_curves_have_a_colour_each(path: Path, interpolation: str, values: list[tuple[float, ...]]) -> None:
    """The lower one is red, the upper one green; along a curve it is the mean, which is said."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    shape = shape_of(stage, "BasisCurves")
    UsdGeom.PrimvarsAPI(shape).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, interpolation).Set(values)
    stage.Save()
    scene = loaded(path)
    assert np.allclose(colours_seen(scene, [(0.5, 0.65), (0.5, 0.35)]), [(0.8, 0, 0), (0, 0.4, 0)], atol=0.02)
    said = [f"{path}: /shape: its displayColor varies along curves, each of which has the mean"]
    assert scene.warnings == (said if interpolation == "vertex" else [])


@pytest.mark.parametrize("kind", ["Cone", "Sphere", "Cylinder"])
def test_colours_that_vary_have_their_mean(path: Path, kind: str) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    shape = shape_of(stage, kind)
    UsdGeom.PrimvarsAPI(shape).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "uniform").Set([(0.8, 0, 0), (0, 0.4, 0)])
    stage.Save()
    scene = loaded(path)
    assert scene.warnings == [f"{path}: /shape: its displayColor varies, of which the mean is used"]
    assert np.allclose(colours_seen(scene, [(0.5, 0.5)]), (0.4, 0.2, 0), atol=0.02)


def stage_with_quarters(path: Path) -> tuple[Usd.Stage, UsdShade.Material]:
    """And a material with an image of which three quarters are red; one is green, at (0, 0)."""
    pixels = np.tile([0.8, 0, 0], (8, 8, 1))
    pixels[4:, :4] = (0, 0.8, 0)
    write_png(path.parent / "image.png", pixels)
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/material", **MATT)
    usd.texture(shader, "diffuseColor", "rgb", "image.png", sourceColorSpace="raw")
    return stage, material


@pytest.mark.parametrize("kind", ["BasisCurves", "Points", "Sphere", "Cone", "Cube"])
def test_textures_of_what_has_no_coordinates_have_their_mean(path: Path, kind: str) -> None:
    """Round shapes have coordinates, as cubes do."""
    stage, material = stage_with_quarters(path)
    usd.bind(shape_of(stage, kind), material)
    stage.Save()
    scene = loaded(path)
    if kind not in ("BasisCurves", "Points"):
        assert scene.warnings == []
        return
    assert len(scene.warnings) == 1 and "/shape: shapes of its kind have no coordinates" in scene.warnings[0]
    assert np.allclose(colours_seen(scene, [(0.5, 0.55)]), (0.6, 0.2, 0), atol=0.02)


def test_coordinates_may_be_the_same_everywhere(path: Path) -> None:
    stage, material = stage_with_quarters(path)
    square = usd.square(stage, "/square")
    coordinates = UsdGeom.PrimvarsAPI(square).GetPrimvar("st")
    coordinates.SetInterpolation("constant")
    usd.bind(square, material)
    for at, expected in (((0.25, 0.25), (0, 0.8, 0)), ((0.75, 0.75), (0.8, 0, 0))):
        coordinates.Set([at])
        stage.Save()
        scene = loaded(path)
        assert scene.warnings == [] and np.allclose(colours_seen(scene, [(0.6, 0.6)]), expected, atol=0.02)


@pytest.mark.parametrize("kind", ["BasisCurves", "Points"])
def test_widths_may_be_a_primvar(path: Path, kind: str) -> None:
    """Which counts before the attribute; of constant ones there is one."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    shape = shape_of(stage, kind)
    primvar = UsdGeom.PrimvarsAPI(shape).CreatePrimvar("widths", Sdf.ValueTypeNames.FloatArray, "constant")
    primvar.Set([4.0])
    stage.Save()
    scene = loaded(path)
    assert scene.warnings == [] and np.isclose(scene.bake().bounds[1, 2], 2, atol=0.01)
    primvar.Set([2.0, 9.0])
    stage.Save()
    scene = loaded(path)
    assert "its widths are 2, not 1 (constant); the first are used" in scene.warnings[0]
    assert np.isclose(scene.bake().bounds[1, 2], 1, atol=0.01)


def test_tiles_are_those_of_coordinates_once_they_are_moved(path: Path) -> None:
    for tile, color in {1001: (1, 0, 0), 1002: (0, 1, 0)}.items():
        write_png(path.parent / f"tile.{tile}.png", np.full((8, 8, 3), color, np.float64))
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    material, shader = usd.preview(stage, "/material", **MATT)
    usd.texture(shader, "diffuseColor", "rgb", "tile.<UDIM>.png", moved=(0.0, (1, 1), (1, 0)))
    usd.bind(usd.square(stage, "/square"), material)
    stage.Save()
    scene = loaded(path)
    assert scene.warnings == [] and np.allclose(colours_seen(scene, [(0.5, 0.5)]), (0, 1, 0), atol=0.02)


def test_what_renders_do_not_show(path: Path) -> None:
    """By renderVisibility, which what is of the purpose render inherits; other purposes do not mind."""
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    group = UsdGeom.Xform.Define(stage, "/group")
    UsdGeom.VisibilityAPI.Apply(group.GetPrim()).CreateRenderVisibilityAttr("invisible")
    for name, purpose in (("plain", "default"), ("hidden", "render"), ("shown", "render")):
        usd.cube(stage, f"/group/{name}").CreatePurposeAttr(purpose)
    UsdGeom.VisibilityAPI.Apply(stage.GetPrimAtPath("/group/shown")).CreateRenderVisibilityAttr("visible")
    stage.Save()
    assert loaded(path).bake().triangles == 24


def test_draw_modes_and_values_too_many_are_warned_of(path: Path) -> None:
    stage = usd.new_stage(path)
    looking_at_squares(stage)
    model = UsdGeom.Xform.Define(stage, "/model")
    Usd.ModelAPI(model.GetPrim()).SetKind("component")
    UsdGeom.ModelAPI.Apply(model.GetPrim()).CreateModelDrawModeAttr("bounds")
    square = usd.square(stage, "/model/square")
    UsdGeom.PrimvarsAPI(square).CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, "constant").Set([(0.8, 0, 0), (0, 0, 0.8)])
    stage.Save()
    scene = loaded(path)
    assert [text.split(": ", 1)[1] for text in scene.warnings] == [
        "/model: its draw mode bounds is left out; it is shown as it is",
        "/model/square: its displayColor are 2, not 1 (constant); the first are used",
    ]
    assert np.allclose(colours_seen(scene, [(0.5, 0.5)]), (0.8, 0, 0), atol=0.02)


def test_cameras_that_are_not_shown_can_be_named(path: Path) -> None:
    """Invisible ones, and those in instances, with where these are."""
    stage = usd.new_stage(path)
    usd.square(stage, "/square")
    UsdLux.DomeLight.Define(stage, "/light")
    UsdGeom.Imageable(usd.camera(stage, (0, 0, 7), (0, 0, 0), path="/hidden")).MakeInvisible()
    stage.CreateClassPrim("/source")
    usd.camera(stage, (0, 0, 5), (0, 0, 0), path="/source/inner")
    rig = UsdGeom.Xform.Define(stage, "/rig")
    rig.GetPrim().GetReferences().AddInternalReference("/source")
    rig.GetPrim().SetInstanceable(True)
    usd.move(rig, (1, 2, 3))
    stage.Save()
    for name, eye in (("hidden", [0, 0, 7]), ("/rig/inner", [1, 2, 8])):
        assert np.allclose(loaded(path, camera=name)._core.camera.eye, eye)
    assert any("/rig/inner: a camera in what instances place is only used where it is named" in text for text in loaded(path).warnings)
