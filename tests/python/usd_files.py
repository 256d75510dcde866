"""Stages that the tests of USD share, written with usd-core."""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp

pytest.importorskip("pxr")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

SIZE = (64, 36)  # of pictures
CORNERS = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
SIDES = [0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 3, 7, 6, 2, 0, 4, 7, 3, 1, 2, 6, 5]
_TYPES = {
    "diffuseColor": Sdf.ValueTypeNames.Color3f,
    "emissiveColor": Sdf.ValueTypeNames.Color3f,
    "specularColor": Sdf.ValueTypeNames.Color3f,
    "useSpecularWorkflow": Sdf.ValueTypeNames.Int,
    "normal": Sdf.ValueTypeNames.Normal3f,
    "file": Sdf.ValueTypeNames.Asset,
    "scale": Sdf.ValueTypeNames.Float4,
    "bias": Sdf.ValueTypeNames.Float4,
    "fallback": Sdf.ValueTypeNames.Float4,
    "varname": Sdf.ValueTypeNames.String,
}


def new_stage(path: Path, up: str = "Y") -> Usd.Stage:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up)
    return stage


def mesh(stage: Usd.Stage, path: str, points: Any, counts: Any, indices: Any, scheme: str | None = "none") -> UsdGeom.Mesh:
    """Without a scheme it is what USD has by default: a subdivision surface."""
    made = UsdGeom.Mesh.Define(stage, path)
    made.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(points, np.float32)))
    made.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.asarray(counts, np.int32)))
    made.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.asarray(indices, np.int32)))
    if scheme is not None:
        made.CreateSubdivisionSchemeAttr(scheme)
    return made


def cube(stage: Usd.Stage, path: str, scheme: str | None = "none", at: Any = (0, 0, 0)) -> UsdGeom.Mesh:
    made = mesh(stage, path, CORNERS, [4] * 6, SIDES, scheme)
    if any(at):
        move(made, at)
    return made


def move(prim: Any, at: Any) -> None:
    UsdGeom.Xformable(prim).AddTranslateOp().Set(Gf.Vec3d(*map(float, at)))


def turn(prim: Any, matrix: Any) -> None:
    """``matrix``: [4, 4] for column vectors."""
    UsdGeom.Xformable(prim).AddTransformOp().Set(Gf.Matrix4d(*np.asarray(matrix, np.float64).T.ravel().tolist()))


def camera(stage: Usd.Stage, eye: Any, target: Any, up: Any = (0, 1, 0), path: str = "/camera", **attributes: Any) -> UsdGeom.Camera:
    made = UsdGeom.Camera.Define(stage, path)
    view = Gf.Matrix4d().SetLookAt(*(Gf.Vec3d(*map(float, v)) for v in (eye, target, up)))
    UsdGeom.Xformable(made).AddTransformOp().Set(view.GetInverse())
    for name, value in attributes.items():
        made.GetPrim().GetAttribute(name).Set(value)
    return made


def preview(stage: Usd.Stage, path: str, **inputs: Any) -> tuple[UsdShade.Material, UsdShade.Shader]:
    material, shader = UsdShade.Material.Define(stage, path), UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for name, value in inputs.items():
        shader.CreateInput(name, _TYPES.get(name, Sdf.ValueTypeNames.Float)).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    return material, shader


def texture(shader: UsdShade.Shader, name: str, output: str, file: str, primvar: str = "st", **inputs: Any) -> UsdShade.Shader:
    """An image on an input of a surface; its coordinates come by way of a UsdTransform2d where that is named."""
    stage, path = shader.GetPrim().GetStage(), f"{shader.GetPath()}_{name}"
    moved = inputs.pop("moved", None)
    made, reader = UsdShade.Shader.Define(stage, path), UsdShade.Shader.Define(stage, f"{path}_st")
    made.CreateIdAttr("UsdUVTexture")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(primvar)
    made.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
    for key, value in inputs.items():
        made.CreateInput(key, _TYPES.get(key, Sdf.ValueTypeNames.Token)).Set(value)
    source = reader
    if moved is not None:
        source = UsdShade.Shader.Define(stage, f"{path}_moved")
        source.CreateIdAttr("UsdTransform2d")
        source.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(reader.ConnectableAPI(), "result")
        source.CreateInput("rotation", Sdf.ValueTypeNames.Float).Set(moved[0])
        source.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(moved[1])
        source.CreateInput("translation", Sdf.ValueTypeNames.Float2).Set(moved[2])
    made.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(source.ConnectableAPI(), "result")
    shader.CreateInput(name, _TYPES.get(name, Sdf.ValueTypeNames.Float)).ConnectToSource(made.ConnectableAPI(), output)
    return made


def bind(prim: Any, material: UsdShade.Material) -> None:
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)


def square(stage: Usd.Stage, path: str, size: float = 1, coordinates: str = "st") -> UsdGeom.Mesh:
    """In the x-y plane, seen from +z, with coordinates of corners from 0 to 1."""
    made = mesh(stage, path, [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)], [4], [0, 1, 2, 3])
    primvar = UsdGeom.PrimvarsAPI(made).CreatePrimvar(coordinates, Sdf.ValueTypeNames.TexCoord2fArray, "faceVarying")
    primvar.Set([(0, 0), (1, 0), (1, 1), (0, 1)])
    return made


def bounds_of(stage: Usd.Stage, *, purposes: Any = ("default", "render")) -> np.ndarray:
    """[2, 3], as USD itself counts them."""
    box = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), list(purposes)).ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    return np.array([box.GetMin(), box.GetMax()])


def loaded(path: Path, *, quiet: bool = True, **options: Any) -> rp.Scene:
    """What is warned of is in the scene's warnings, too."""
    with warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore", rp.RaypagerWarning)
        return rp.load(path, **options)


def film(scene: rp.Scene, **options: Any) -> np.ndarray:
    return scene.render(**({"width": SIZE[0], "height": SIZE[1], "spp": 4} | options)).film


def colours_seen(scene: rp.Scene, places: list[tuple[float, float]]) -> np.ndarray:
    """Of pixels, as shares of the picture from its top left."""
    layers = scene.render(width=SIZE[0], height=SIZE[1], spp=16, layers="albedo").layers
    return np.array([layers["albedo"][int(y * SIZE[1]), int(x * SIZE[0])] for x, y in places])


def looking_at_squares(stage: Usd.Stage) -> None:
    """The square from -1 to 1 fills the height of the picture."""
    made = camera(stage, (0, 0, 5), (0, 0, 0), horizontalAperture=160.0 / 9 * 2, verticalAperture=20.0)
    made.CreateProjectionAttr("orthographic")
    UsdLux.DomeLight.Define(stage, "/light")


def write_png(path: Path, pixels: np.ndarray, bits: int = 8) -> None:
    """[height, width, 1 to 4] floats from 0 to 1, which are stored as they are, in 8 or 16 bits."""
    height, width, channels = pixels.shape
    numbers = np.round(np.clip(pixels, 0, 1) * (2**bits - 1)).astype(f">u{bits // 8}").reshape(height, -1)
    rows = b"".join(b"\0" + row.tobytes() for row in numbers)  # each begins with its filter: none

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
