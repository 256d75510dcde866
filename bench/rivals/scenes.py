"""Scenes that several renderers can draw alike: made or taken as they are, baked for raypager, and written down for the others."""

import re
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import geometry

KINDS = ("cornell", "terrain", "clutter")
GLASS = "0.8 0.8 0.8"  # what glass and water become where all is to be diffuse


class Light(NamedTuple):
    kind: str  # "sky", "sun" or "point"
    light: np.ndarray  # [3] radiance of a sky, irradiance of a sun, intensity of a point
    place: np.ndarray  # [3] where a sun's light goes, or where a point is


class Shape(NamedTuple):
    mesh: Path  # see geometry.read_ply
    color: np.ndarray  # [3] reflectance
    radiance: np.ndarray | None  # [3] if it shines, to the side from which its triangles are counter-clockwise


class Scene(NamedTuple):
    """What `raypager bench export` wrote, where everything is diffuse."""

    eye: np.ndarray  # [3]
    right: np.ndarray  # [3] unit vectors of the picture
    up: np.ndarray
    forward: np.ndarray
    field_of_view: float  # of the shorter side, degrees
    near: float
    far: float
    depth: int  # scattering events of a path at most
    lights: list[Light]
    shapes: list[Shape]


def numbers(text: str) -> np.ndarray:
    return np.array(text.split(), float)


def all_diffuse(scene: Path) -> None:
    """Rewrites a scene of `raypager make-scene` so that all renderers have its materials and shapes: metals become diffuse with the reflectance
    they have from in front, glass and water grey, and spheres triangles."""

    def diffuse(match: re.Match) -> str:
        name, kind, rest = match.groups()
        color = GLASS
        if kind == "conductor":
            eta, k = (numbers(re.search(rf'"rgb {name}" \[([^]]*)\]', rest)[1]) for name in ("eta", "k"))
            color = " ".join(f"{c:.6g}" for c in ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2))
        return f'MakeNamedMaterial "{name}" "string type" "diffuse" "rgb reflectance" [{color}]'

    def triangles(match: re.Match) -> str:
        path = Path("meshes") / f"sphere-{match[1]}.ply"
        geometry.write_ply(scene.parent / path, geometry.sphere(float(match[1])))
        return f'Shape "plymesh" "string filename" "{path.as_posix()}"'

    text = re.sub(r'MakeNamedMaterial "(\w+)" "string type" "(conductor|dielectric)"(.*)', diffuse, scene.read_text())
    text = re.sub(r'Shape "sphere" "float radius" ([0-9.]+)', triangles, text)
    scene.write_text(text)


def share_all_vertices(folder: Path) -> tuple[int, int]:
    """Of the meshes that `raypager bench export` wrote, three vertices a triangle: how many vertices and triangles there are then."""
    vertices = triangles = 0
    for path in sorted(folder.glob("mesh*.ply")):
        mesh = geometry.share_vertices(geometry.read_ply(path))
        geometry.write_ply(path, mesh)
        vertices, triangles = vertices + len(mesh.vertices), triangles + len(mesh.triangles)
    return vertices, triangles


def read(path: Path) -> Scene:
    """The scene.xml of `raypager bench export`. ValueError for what Scene has not: other materials, spheres, normals of
    vertices, mirrored cameras."""
    root = xml.parse(path).getroot()

    def value(element: xml.Element, tag: str, name: str) -> str:
        found = element.find(f"{tag}[@name='{name}']")
        if found is None:
            raise ValueError(f"{path}: a {element.get('type')} lacks its {name}")
        return found.get("value")

    def vector(element: xml.Element, tag: str) -> np.ndarray:
        return np.array([float(element.find(tag).get(axis)) for axis in "xyz"])

    def light(element: xml.Element) -> Light:
        kind = element.get("type")
        if kind == "constant":
            return Light("sky", numbers(value(element, "rgb", "radiance")), np.zeros(3))
        if kind == "directional":
            return Light("sun", numbers(value(element, "rgb", "irradiance")), vector(element, "vector"))
        return Light("point", numbers(value(element, "rgb", "intensity")), vector(element, "point"))

    colors = {}
    for material in root.findall("bsdf"):
        inside = material.find("bsdf[@type='diffuse']") if material.get("type") == "twosided" else material
        colors[material.get("id")] = numbers(value(inside, "rgb", "reflectance")) if inside is not None and inside.get("type") == "diffuse" else None

    def shape(element: xml.Element) -> Shape:
        color, emitter = colors[element.find("ref").get("id")], element.find("emitter")
        if element.get("type") != "ply" or value(element, "boolean", "face_normals") != "true":
            raise ValueError(f"{path}: it has spheres or normals of vertices, which not all renderers draw alike")
        if color is None:
            raise ValueError(f"{path}: it has other materials than diffuse ones, which not all renderers draw alike")
        return Shape(
            path.parent / value(element, "string", "filename"), color, None if emitter is None else numbers(value(emitter, "rgb", "radiance"))
        )

    sensor = root.find("sensor")
    matrix = numbers(sensor.find("transform/matrix").get("value")).reshape(4, 4)
    if np.linalg.det(matrix[:3, :3]) < 0:
        raise ValueError(f"{path}: its camera exchanges left and right, which other renderers cannot")
    return Scene(
        eye=matrix[:3, 3],
        right=-matrix[:3, 0],
        up=matrix[:3, 1],
        forward=matrix[:3, 2],
        field_of_view=float(value(sensor, "float", "fov")),
        near=float(value(sensor, "float", "near_clip")),
        far=float(value(sensor, "float", "far_clip")),
        depth=int(value(root.find("integrator"), "integer", "max_depth")) - 1,
        lights=[light(element) for element in root.findall("emitter")],
        shapes=[shape(element) for element in root.findall("shape")],
    )
