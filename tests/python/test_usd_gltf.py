"""UsdPreviewSurface against glTF's materials of the same numbers, which another reader makes."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr")
import usd_files as usd
from pxr import Usd, UsdGeom, UsdLux
from usd_files import film, loaded, write_png


@pytest.fixture(name="path")
def fixture_path(tmp_path: Path) -> Path:
    return tmp_path / "a.usda"


def gltf_square(path: Path, material: dict[str, Any], **more: Any) -> Path:
    """A square from -1 to 1 in a glTF file, under the light and before the camera of :func:`before_a_sun`."""
    positions = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], "<f4")
    uvs = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], "<f4")
    indices = np.array([0, 1, 2, 0, 2, 3], "<u2")
    content = positions.tobytes() + uvs.tobytes() + indices.tobytes()
    views = [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in ((0, 48), (48, 32), (80, 12))]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
        {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
    ]
    half = float(np.sin(np.radians(-15))), float(np.cos(np.radians(-15)))
    nodes = [
        {"mesh": 0},
        {"camera": 0, "translation": [0, 0, 5]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [half[0], 0, 0, half[1]]},
    ]
    file = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 3.0}]}},
        "buffers": [{"byteLength": len(content), "uri": "data:application/octet-stream;base64," + base64.b64encode(content).decode()}],
        "bufferViews": views,
        "accessors": accessors,
        "materials": [material],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 2 * float(np.arctan(0.24)), "aspectRatio": 16 / 9, "znear": 0.1}}],
        "nodes": nodes,
        "scenes": [{"nodes": [0, 1, 2]}],
        "scene": 0,
    }
    path.write_text(json.dumps(file | more))
    return path


def before_a_sun(stage: Usd.Stage) -> None:
    usd.camera(stage, (0, 0, 5), (0, 0, 0), horizontalAperture=16.0, verticalAperture=9.0, focalLength=4.5 / 0.24)
    light = UsdLux.DistantLight.Define(stage, "/sun")
    UsdGeom.Xformable(light).AddRotateXOp().Set(-30.0)
    light.CreateIntensityAttr(3.0)
    light.CreateAngleAttr(0.0)


METALLIC = {"baseColorFactor": [0.7, 0.4, 0.2, 1], "metallicFactor": 0.0, "roughnessFactor": 0.4}
COAT = {"KHR_materials_clearcoat": {"clearcoatFactor": 0.7, "clearcoatRoughnessFactor": 0.3}}


@pytest.mark.parametrize(
    ("inputs", "material"),
    [
        ({}, {"pbrMetallicRoughness": METALLIC}),
        ({"metallic": 1.0}, {"pbrMetallicRoughness": METALLIC | {"metallicFactor": 1.0}}),
        ({"metallic": 0.4}, {"pbrMetallicRoughness": METALLIC | {"metallicFactor": 0.4}}),
        ({"ior": 1.8}, {"pbrMetallicRoughness": METALLIC, "extensions": {"KHR_materials_ior": {"ior": 1.8}}}),
        ({"clearcoat": 0.7, "clearcoatRoughness": 0.3}, {"pbrMetallicRoughness": METALLIC, "extensions": COAT}),
        (
            {"clearcoat": 0.7, "clearcoatRoughness": 0.3, "metallic": 0.4},
            {"pbrMetallicRoughness": METALLIC | {"metallicFactor": 0.4}, "extensions": COAT},
        ),
        (
            {"useSpecularWorkflow": 1, "specularColor": (0.3, 0.2, 0.1)},
            {
                "extensions": {
                    "KHR_materials_pbrSpecularGlossiness": {
                        "diffuseFactor": [0.7, 0.4, 0.2, 1],
                        "specularFactor": [0.3, 0.2, 0.1],
                        "glossinessFactor": 0.6,
                    }
                }
            },
        ),
    ],
)
def test_materials_are_like_those_of_gltf(path: Path, inputs: dict[str, Any], material: dict[str, Any]) -> None:
    """Which another reader makes, of the same numbers."""
    stage = usd.new_stage(path)
    before_a_sun(stage)
    usd.bind(usd.square(stage, "/square"), usd.preview(stage, "/m", **({"diffuseColor": (0.7, 0.4, 0.2), "roughness": 0.4} | inputs))[0])
    stage.Save()
    other = loaded(gltf_square(path.with_suffix(".gltf"), material))
    found, expected = film(loaded(path), spp=64), film(other, spp=64)
    seen = expected.max(2) > 0
    assert 0.3 < seen.mean() < 0.9 and expected[seen].min() > 0.01
    assert np.allclose(found, expected, rtol=2e-3, atol=1e-4)


def test_textures_of_metals_are_like_those_of_gltf(path: Path) -> None:
    """Roughness in green and metals in blue, of one image, beside one of colours: the same picture up to noise."""
    random = np.random.default_rng(5)
    for name in ("rough", "color"):
        write_png(path.parent / f"{name}.png", np.repeat(np.repeat(random.uniform(0.2, 0.9, (4, 4, 3)), 8, 0), 8, 1))
    stage = usd.new_stage(path)
    before_a_sun(stage)
    material, shader = usd.preview(stage, "/m")
    usd.texture(shader, "diffuseColor", "rgb", "color.png")
    usd.texture(shader, "roughness", "g", "rough.png", sourceColorSpace="raw")
    usd.texture(shader, "metallic", "b", "rough.png", sourceColorSpace="raw")
    usd.bind(usd.square(stage, "/square"), material)
    stage.Save()
    textures = {
        "images": [{"uri": "color.png"}, {"uri": "rough.png"}],
        "textures": [{"source": 0}, {"source": 1}],
    }
    pbr = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}}
    other = loaded(gltf_square(path.with_suffix(".gltf"), {"pbrMetallicRoughness": pbr}, **textures))
    found, expected = film(loaded(path), spp=256), film(other, spp=256)
    assert expected.std() > 0.02 and np.abs(found - expected).mean() < 0.01 * expected.mean()
