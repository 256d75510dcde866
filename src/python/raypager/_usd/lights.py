"""Lights of UsdLux: those with a surface are shapes that shine."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from .. import _raypager
from .._arrays import Array, Triple
from .._materials import absorbing
from .._shapes import Shapes
from . import round as round_shapes
from .content import Content, is_similarity
from .images import Images
from .reading import Reading
from .round import Tessellation

_MOST_RADIANCE = 1e12
_MOST_IN_SKY = 65504  # of a half
_WITHOUT_PLACE = ("DomeLight", "DomeLight_1", "DistantLight")
_WITH_SURFACE = ("SphereLight", "RectLight", "DiskLight", "CylinderLight")
# Of a map of a globe, whose pole is y and whose middle is +z (OpenEXR), the axes that raypager's has: x, y and z.
_GLOBE = np.array([[0, 0, -1], [1, 0, 0], [0, 1, 0]], np.float64)


@dataclass(frozen=True)
class Lamp:
    """A shape that is a light. ``is_tinted``: by what its material shines with."""

    radiance: Triple
    is_tinted: bool

    def over(self, glow: Triple, by_image: bool = False) -> Triple:
        """``glow``: what its material shines with. A material that does not shine at all tints nothing; the dark parts of an image do."""
        return _times(self.radiance, np.array(glow)) if self.is_tinted and (by_image or max(glow) > 0) else self.radiance


def is_light(prim: Usd.Prim) -> bool:
    return bool(prim.IsA(UsdLux.BoundableLightBase) or prim.IsA(UsdLux.NonboundableLightBase) or prim.HasAPI(UsdLux.LightAPI))


class LightReader:
    def __init__(self, reading: Reading, images: Images) -> None:
        self._reading, self._images = reading, images
        self._domes: list[tuple[Usd.Prim, Triple, Array | None, Array]] = []
        self._black = absorbing()
        self._dark: Usd.Prim | None = None

    def add(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        """Of lights that are no meshes. What an object cannot hold is left for who places it."""
        kind = str(prim.GetTypeName())
        if content.in_object and (kind in _WITHOUT_PLACE or (kind == "SphereLight" and self._is_spot(prim, kind))):
            content.lights.append((prim, matrix))
            return
        radiance = self.radiance(prim)
        if kind not in (*_WITHOUT_PLACE, *_WITH_SURFACE):
            self._note(prim, f"light {kind}", f"a {kind or 'light without a type'} is not read; it is left out")
        elif max(radiance) <= 0:
            self._dark = self._dark or prim
        elif kind == "DistantLight":
            self._add_distant(prim, radiance, matrix)
        elif kind in _WITHOUT_PLACE:
            self._add_dome(prim, radiance, matrix)
        else:
            self._add_surface(prim, kind, radiance, matrix, content)

    def of_shape(self, prim: Usd.Prim) -> Lamp | None:
        """What a mesh or another shape shines with that is a light (MeshLightAPI, or LightAPI alone)."""
        if not prim.HasAPI(UsdLux.LightAPI):
            return None
        if self._input(prim, "normalize", False):
            self._note(prim, "normalized mesh", "its normalize is not read: its intensity is its radiance")
        mode = prim.GetAttribute("light:materialSyncMode")
        tints = mode.Get() == UsdLux.Tokens.materialGlowTintsLight
        if not tints and mode.HasAuthoredValue():
            self._note(prim, "sync mode", f"its materialSyncMode {mode.Get()} is not read: it is seen as it shines, and reflects")
        radiance = self.radiance(prim)
        if max(radiance) <= 0:
            self._dark = self._dark or prim
        return Lamp(radiance, tints)

    def radiance(self, prim: Usd.Prim) -> Triple:
        """intensity 2^exposure color, times the color of its temperature."""
        strength = float(self._input(prim, "intensity", 1.0)) * 2.0 ** min(float(self._input(prim, "exposure", 0.0)), 100.0)
        color = np.array(self._input(prim, "color", (1.0, 1.0, 1.0)), np.float64)
        if self._input(prim, "enableColorTemperature", False):
            kelvin = float(np.clip(float(self._input(prim, "colorTemperature", 6500.0)), 1000, 10000))
            color = color * np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
        self._note_what_is_not_read(prim)
        r, g, b = np.clip(np.nan_to_num(color * strength, posinf=0), 0, _MOST_RADIANCE).tolist()
        return r, g, b

    def finish(self) -> None:
        """Skies are one: those of one colour are added to the first image."""
        if self._dark is not None and not self._reading.has_light:
            self._note(
                self._dark, "dark", "no light shines, since the intensity of this one is 0, or its colour black; it is lit as if there were none"
            )
        scene, plain, first = self._reading.scene, np.zeros(3), None
        for prim, radiance, pixels, axes in self._domes:
            if pixels is not None and first is None:
                first = pixels * np.array(radiance, np.float32), axes
            else:
                if pixels is not None:
                    self._note(prim, "skies", "of several domes with images the first is the sky; of others the mean is added")
                plain += np.array(radiance) * (1 if pixels is None else _mean_of_globe(pixels))
        if first is not None:
            image, axes = first
            whole = image + plain
            if clipped := int((whole > _MOST_IN_SKY).any(2).sum()):
                self._note(self._domes[0][0], "bright sky", f"{clipped} pixels of the sky are brighter than {_MOST_IN_SKY}, which is what they have")
            scene._core.set_sky(np.ascontiguousarray(np.minimum(whole, _MOST_IN_SKY), np.float32), axes.tolist(), True)
        elif plain.any():
            scene.infinite_light(plain.tolist())

    def _input(self, prim: Usd.Prim, name: str, default: Any) -> Any:
        attribute = prim.GetAttribute(f"inputs:{name}")
        value = self._reading.get(attribute) if attribute else None
        return default if value is None else value

    def _note(self, prim: Usd.Prim, kind: str, text: str) -> None:
        self._reading.notes.add(kind, prim.GetPath(), text)

    def _note_what_is_not_read(self, prim: Usd.Prim) -> None:
        if self._input(prim, "diffuse", 1.0) != 1 or self._input(prim, "specular", 1.0) != 1:
            self._note(prim, "multipliers", "its diffuse and specular, by which lights count more or less, are left out")
        if prim.GetRelationship("light:filters").GetTargets():
            self._note(prim, "filters", "its filters are left out")
        for link in ("lightLink", "shadowLink"):
            linked = any(prim.GetRelationship(f"collection:{link}:{side}").GetTargets() for side in ("includes", "excludes"))
            if linked or prim.GetAttribute(f"collection:{link}:includeRoot").Get() is False:
                self._note(prim, "links", "shines on everything: what it is linked to is left out")
        if self._input(prim, "shadow:enable", True) is False:
            self._note(prim, "shadows", "casts shadows, though it says otherwise")
        if any(prim.GetAttribute(f"inputs:shadow:{name}").HasAuthoredValue() for name in ("color", "distance", "falloff")):
            self._note(prim, "shadow look", "its shadows are plain: their colour, distance and falloff are left out")
        if self._input(prim, "shaping:ies:file", None) not in (None, Sdf.AssetPath()):
            self._note(prim, "ies", "its IES profile is left out")
        if self._input(prim, "shaping:focus", 0.0):
            self._note(prim, "focus", "its shaping:focus is left out")

    def _add_dome(self, prim: Usd.Prim, radiance: Triple, matrix: Array) -> None:
        pixels, asset = None, self._input(prim, "texture:file", None)
        layout = str(self._input(prim, "texture:format", "automatic"))
        if isinstance(asset, Sdf.AssetPath) and asset.path:
            if layout not in ("automatic", "latlong"):
                self._note(prim, "dome format", f"its image is in the format {layout}, which is not read; its colour alone is used")
            else:
                pixels = self._images.pixels(asset, prim)
        turn = _rotation(matrix)
        up = str(prim.GetAttribute("poleAxis").Get() or "scene") if prim.GetTypeName() == "DomeLight_1" else "Y"
        if up == "Z" or (up == "scene" and UsdGeom.GetStageUpAxis(self._reading.stage) == UsdGeom.Tokens.z):
            turn = turn @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        self._domes.append((prim, radiance, pixels, _GLOBE @ turn.T))
        self._reading.has_light = True

    def _add_distant(self, prim: Usd.Prim, radiance: Triple, matrix: Array) -> None:
        angle = np.radians(np.clip(float(self._input(prim, "angle", 0.53)), 0, 360) / 2)
        if angle > np.radians(1):
            self._note(prim, "angle", f"its angle of {2 * np.degrees(angle):g} degrees is 0 here: shadows are sharp")
        size = np.pi * np.sin(angle) ** 2 if angle <= np.pi / 2 else np.pi * (2 - np.sin(angle) ** 2)
        share = 1 if angle == 0 or self._input(prim, "normalize", False) else size
        direction = matrix[:3, :3] @ (0, 0, -1)
        if not np.any(direction):
            raise self._reading.failed(prim, "its light has no direction: its transform is flat")
        self._reading.scene.distant_light(direction.tolist(), [c * share for c in radiance])
        self._reading.has_light = True

    def _add_surface(self, prim: Usd.Prim, kind: str, radiance: Triple, matrix: Array, content: Content) -> None:
        size = {name: self._size(prim, name) for name in ("radius", "width", "height", "length") if prim.HasAttribute(f"inputs:{name}")}
        shape = _surface(kind, tuple(size.items()))
        positions = shape.positions @ matrix[:3, :3].T + matrix[:3, 3]
        corners = positions[shape.triangles]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
        normalize = bool(self._input(prim, "normalize", False))
        if self._is_spot(prim, kind):
            self._add_spot(prim, radiance, area if not normalize else 1, matrix)
            return
        if area <= 0:
            self._note(prim, "flat light", "has no surface, so it does not shine")
            return
        if normalize:
            radiance = _times(radiance, np.full(3, 1 / area))
        asset = self._input(prim, "texture:file", None)
        if isinstance(asset, Sdf.AssetPath) and asset.path and (pixels := self._images.pixels(asset, prim)) is not None:
            self._note(prim, "light texture", "the image on it becomes its mean colour")
            radiance = _times(radiance, pixels.mean((0, 1)))
        self._reading.has_light = True
        self._put(prim, kind, size, shape, radiance, matrix, content)

    def _put(self, prim: Usd.Prim, kind: str, size: dict[str, float], shape: Tessellation, radiance: Triple, matrix: Array, content: Content) -> None:
        exact = kind == "SphereLight" and is_similarity(matrix) and not content.in_object
        material = self._black

        def put(into: Shapes) -> None:
            if exact:
                into.sphere(radius=size["radius"], material=material, transform=matrix, emission=radiance)
            else:
                triangles = shape.triangles.astype(np.uint32)
                into.mesh(shape.positions.astype(np.float32), triangles, material=material, transform=matrix, emission=radiance)

        # Lamps are not what a picture is framed for.
        content.add(f"{self._reading.path}: {prim.GetPath()}", put, np.zeros((0, 3)), matrix)

    def _size(self, prim: Usd.Prim, name: str) -> float:
        value = float(self._input(prim, name, 1.0))
        if not 0 <= value < 1e30:
            raise self._reading.failed(prim, f"its {name} is {value:g}; a number of 0 or more is expected")
        return value

    def _cone(self, prim: Usd.Prim) -> tuple[float, float]:
        """Where its light ends, in degrees, and the share of that within which it fades."""
        angle = float(self._input(prim, "shaping:cone:angle", 90.0))
        return float(np.clip(angle, 1e-3, 180)), float(np.clip(float(self._input(prim, "shaping:cone:softness", 0.0)), 0, 1))

    def _is_spot(self, prim: Usd.Prim, kind: str) -> bool:
        coned = prim.HasAPI(UsdLux.ShapingAPI) and self._cone(prim)[0] < 90
        if kind == "SphereLight":
            return bool(coned or self._input_of_type(prim, "treatAsPoint"))
        if coned:
            self._note(prim, "cone", "shines to all sides in front of it: only SphereLight has a cone (shaping:cone:angle)")
        return False

    def _input_of_type(self, prim: Usd.Prim, name: str) -> bool:
        attribute = prim.GetAttribute(name)
        return bool(attribute and self._reading.get(attribute))

    def _add_spot(self, prim: Usd.Prim, radiance: Triple, area: float, matrix: Array) -> None:
        """A point that gives what the ball gives from afar: its radiance times the disk that is seen of it, a quarter of its surface."""
        if area <= 0:
            self._note(prim, "flat light", "has no surface, so it does not shine")
            return
        self._reading.has_light = True
        intensity = [c * area / 4 for c in radiance]
        place, axis = matrix[:3, 3], matrix[:3, :3] @ (0, 0, -1)
        angle, softness = self._cone(prim)
        scene = self._reading.scene
        if prim.HasAPI(UsdLux.ShapingAPI) and angle < 90 and np.any(axis):
            axis = axis / np.linalg.norm(axis)
            scene._light(_raypager.spot_light(place.tolist(), axis.tolist(), intensity, angle, angle * (1 - softness)))
        else:
            scene.point_light(place.tolist(), intensity)


def _times(color: Triple, by: Array) -> Triple:
    r, g, b = (c * float(f) for c, f in zip(color, by, strict=True))
    return r, g, b


@lru_cache(maxsize=16)  # of those that instances place again and again
def _surface(kind: str, sizes: tuple[tuple[str, float], ...]) -> Tessellation:
    size = dict(sizes)
    if kind == "SphereLight":
        return round_shapes.sphere(size["radius"])
    if kind == "CylinderLight":
        shape = round_shapes.cylinder(size["radius"], size["radius"], size["length"], caps=False)
        turn = round_shapes.along("X")[:3, :3]
        return Tessellation(shape.positions @ turn.T, shape.triangles)
    shape = round_shapes.disk(size["radius"]) if kind == "DiskLight" else round_shapes.plane(size["width"], size["height"])
    # They shine along -z.
    return Tessellation(shape.positions, shape.triangles[:, [0, 2, 1]])


def _rotation(matrix: Array) -> Array:
    """[3, 3], without scale and skew; mirrored if the matrix is."""
    u, _, v = np.linalg.svd(matrix[:3, :3])
    turn: Array = u @ v
    return turn


def _mean_of_globe(pixels: Array) -> Array:
    weights = np.sin(np.pi * (np.arange(len(pixels)) + 0.5) / len(pixels))
    return np.asarray((pixels.mean(1) * weights[:, None]).sum(0) / weights.sum(), np.float64)
