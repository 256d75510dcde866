"""UsdPreviewSurface as materials, in the way in which glTF's metallic and rough ones are made (import/gltf_materials.cpp)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from .. import _raypager
from .._arrays import Array, Color, Triple
from .._materials import Material, diffuse, mix
from .images import Images
from .reading import Reading
from .shading import ALPHA, Constant, FromImage, FromPrimvar, Network, Value

_SMOOTHEST = 1e-3  # GGX alpha that can be computed with
_COAT_IOR = 1.5
_STEEPNESS = 1024  # of a mask: nothing lies between the alphas of a picture of 8 bits
_PREVIEW = ("UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader")
Texture = _raypager.Texture
_Textures = tuple[tuple[int, Any], ...]


def _grey(value: float) -> Any:
    return Texture([value] * 3)


def _number(texture: Any) -> float:
    return float(np.mean(texture.mean))


@dataclass
class _Inputs:
    """Textures, of which those that are constant have only a mean."""

    base: Any
    metallic: Any
    alpha: Any
    straight: Any  # what is reflected of light that falls on it straight, of what is no metal
    opacity: Any
    coat: Any
    coat_alpha: Any
    normals: Any | None
    ior: float


class Surface:
    """A material of the stage; without a ``shader`` that is read, one for what has only colours."""

    def __init__(self, reading: Reading, images: Images, material: Usd.Prim | None, shader: UsdShade.Shader | None) -> None:
        self._reading, self._images = reading, images
        self.name = str(material.GetPath()) if material else "without a material"
        self._made: dict[Any, Material] = {}
        self.emission: Triple = (0.0, 0.0, 0.0)
        self.glow: FromImage | None = None
        self.uvs: str | None = None
        self.colors: str = "displayColor"  # the primvar
        self.reads_colors = True
        self.is_bare = shader is None
        if material is None or shader is None:
            return
        network = self._network = Network(reading, images, material)
        self._values = {
            name: network.input(shader, name, default)
            for name, default in {
                "diffuseColor": (0.18,) * 3,
                "emissiveColor": (0.0,) * 3,
                "specularColor": (0.0,) * 3,
                "useSpecularWorkflow": (0.0,),
                "metallic": (0.0,),
                "roughness": (0.5,),
                "clearcoat": (0.0,),
                "clearcoatRoughness": (0.01,),
                "opacity": (1.0,),
                "opacityThreshold": (0.0,),
                "ior": (1.5,),
                "normal": (0.0, 0.0, 1.0),
                "displacement": (0.0,),
            }.items()
        }
        mode = shader.GetInput("opacityMode")
        self._presence = bool(mode) and mode.Get() == "presence"
        images_read = [v for v in self._values.values() if isinstance(v, FromImage)]
        tiled = [np.array(v.matrix) for v in images_read if v.tiles]
        self.is_tiled = bool(tiled)
        if tiled:
            self.tile_matrix = tiled[0]
            if any((matrix != tiled[0]).any() for matrix in tiled):
                network.note("moved tiles", "its images in tiles (UDIM) are moved differently; the tiles are those of the first")
        self.uvs = images_read[0].uvs if images_read else None
        for name, value in self._values.items():
            self._values[name] = self._usable(name, value)
        self.has_normal_map = isinstance(self._values["normal"], FromImage)
        base = self._values["diffuseColor"]
        self.reads_colors = isinstance(base, FromPrimvar)
        if isinstance(base, FromPrimvar):
            self.colors = base.name
        self._read_emission()

    has_normal_map = is_tiled = False
    tile_matrix: Array = np.eye(3)  # moves coordinates to those of tiles
    # For which a material is being made: a tile, and whether images are their means.
    _tile: int | None = None
    _flat = False

    def _usable(self, name: str, value: Value) -> Value:
        if isinstance(value, FromPrimvar) and name != "diffuseColor":
            self._network.note(
                f"primvar {name}", f"its {name} is that of a primvar, {value.name}, which only diffuseColor can be; its fallback is used"
            )
            return Constant(value.fallback)
        if isinstance(value, FromImage) and value.uvs != self.uvs:
            self._network.note("uvs", f"its textures use different coordinates; that of {name}, by {value.uvs}, is left out: its mean is used")
            return Constant(self._mean(value)[: 3 if value.channel == 0 else 1])
        if name == "displacement" and value != Constant((0.0,)):
            self._network.note("displacement", "its displacement is left out; surfaces stay where they are")
        return value

    def _mean(self, value: FromImage) -> tuple[float, ...]:
        """Of all of the image, or its first tile; of alpha, which is not read here, about the middle."""
        pixels = self._images.pixels_of(value.image, self._network.material)
        if pixels is None or value.channel == ALPHA:
            return tuple(value.texture().mean)
        return value.seen(pixels.mean((0, 1), np.float64))

    def _read_emission(self) -> None:
        value = self._values["emissiveColor"]
        if isinstance(value, FromImage) and value.tiles:
            self._network.note("emission tiles", "shines by an image in tiles (UDIM), which is not supported; it does not shine")
        elif isinstance(value, FromImage):
            self.glow = value
        elif isinstance(value, Constant):
            r, g, b = (float(np.clip(v, 0, 1e9)) for v in value.value)
            self.emission = r, g, b

    def material(
        self,
        tint: Color | None = None,
        *,
        varied: bool = False,
        mirrored: bool = False,
        opacity: float = 1,
        shines: bool = False,
        tile: int | None = None,
        flat: bool = False,
    ) -> Material:
        """``tint``: the constant colour that it reads from a primvar; ``varied``: vertices have colours; ``mirrored``: u and v of the surface are.
        ``opacity``: of what has only colours. ``shines``: it is not cut out then. ``tile``: in which u and v are, of images in tiles.
        ``flat``: there are no u and v, so images are their means.
        """
        key = (tuple(np.ravel(np.asarray(tint, np.float64)).tolist()) if tint is not None else None, varied, mirrored, opacity, shines, tile, flat)
        self._tile, self._flat = tile, flat
        if key not in self._made:
            self._made[key] = self._bare(tint, varied, opacity) if self.is_bare else self._preview(tint, varied, mirrored, shines)
        return self._made[key]

    def _bare(self, tint: Color | None, varied: bool, opacity: float) -> Material:
        plain = self._reading.scene._default if tint is None and not varied else diffuse(0.5 if tint is None else np.clip(tint, 0, 1).tolist())
        return plain if opacity >= 1 else mix(None, plain, max(opacity, 0))

    def _preview(self, tint: Color | None, varied: bool, mirrored: bool, shines: bool) -> Material:
        inputs = self._inputs(tint, mirrored)
        if varied:
            if _number(inputs.metallic) > 0.5 or _number(inputs.coat) > 0:
                self._network.note("colors", f"colours of vertices ({self.colors}) are those of matt surfaces alone; it is matt")
            surface = self._added(_raypager.diffuse(inputs.base.mean), self._normals(inputs))
        else:
            surface = self._coated(inputs)
        return self._cut_out(inputs, surface, shines)

    def _texture(self, name: str, low: float = 0, high: float = 1) -> Any:
        value = self._values[name]
        if isinstance(value, FromImage):
            if not self._flat:
                return value.texture(tile=self._tile)
            numbers = self._mean(value)
        else:
            numbers = value.fallback if isinstance(value, FromPrimvar) else value.value
        clipped = np.clip(np.nan_to_num(numbers), low, high)
        return Texture((clipped if len(clipped) == 3 else np.repeat(clipped, 3)).tolist())

    def _inputs(self, tint: Color | None, mirrored: bool) -> _Inputs:
        base = Texture(np.clip(np.ravel(np.asarray(tint, np.float64)), 0, 1).tolist()) if tint is not None else self._texture("diffuseColor")
        ior = _number(self._texture("ior", 0, 100))
        root = (ior - 1) / (ior + 1) if ior >= 1 else 1 if ior == 0 else 0.2
        specular = _number(self._texture("useSpecularWorkflow")) >= 0.5
        rough, coat_rough = self._texture("roughness"), self._texture("clearcoatRoughness")
        return _Inputs(
            base=base,
            metallic=_grey(0) if specular else self._texture("metallic"),
            alpha=rough * rough,
            straight=self._texture("specularColor") if specular else _grey(root * root),
            opacity=self._texture("opacity"),
            coat=self._texture("clearcoat"),
            coat_alpha=coat_rough * coat_rough,
            normals=self._normal_map(mirrored),
            ior=ior,
        )

    def _normal_map(self, mirrored: bool) -> Any | None:
        """Green is towards the upper edge of the image; where coordinates are mirrored, that is the other way round."""
        value = self._values["normal"]
        if not isinstance(value, FromImage) or self._flat:
            return None
        if value.is_plain:
            self._network.note("normal scale", "its normal map has neither scale nor bias; it is read as if they were 2 and -1")
        normals = value.texture(tile=self._tile) if value.is_plain else value.texture(0.5, 0.5, self._tile)
        return _raypager.mixed(normals, _raypager.one_minus(normals), Texture([0, 1, 0])) if mirrored else normals

    def _normals(self, inputs: _Inputs) -> _Textures:
        return () if inputs.normals is None else ((_raypager.PARAMETER_NORMAL, inputs.normals),)

    def _added(self, core: Any, textures: _Textures) -> Material:
        return Material(self.name, core, tuple((parameter, texture) for parameter, texture in textures if not texture.is_constant))

    def _glossy(self, inputs: _Inputs) -> Material:
        """All of metals is in what they reflect straight."""
        color = inputs.base * _raypager.one_minus(inputs.metallic)
        straight = _raypager.mixed(inputs.straight, inputs.base, inputs.metallic)
        if self._is_sheet(inputs):
            refracted = _raypager.one_minus(inputs.opacity)
            core = _raypager.sheet((color * inputs.opacity).mean, straight.mean, _number(inputs.alpha), max(inputs.ior, 1), refracted.mean)
            color = color * inputs.opacity
        elif straight.is_constant and max(straight.mean) <= 0:
            return self._added(_raypager.diffuse(color.mean), ((_raypager.PARAMETER_COLOR, color), *self._normals(inputs)))
        elif inputs.alpha.is_constant and _number(inputs.alpha) < _SMOOTHEST and straight.is_constant and color.is_constant and max(color.mean) <= 0:
            return self._added(_raypager.conductor_of_reflectance(straight.mean, 0), self._normals(inputs))
        else:
            core = _raypager.glossy(color.mean, straight.mean, _number(inputs.alpha))
        textures = (_raypager.PARAMETER_COLOR, color), (_raypager.PARAMETER_SPECULAR, straight), (_raypager.PARAMETER_ALPHA, inputs.alpha)
        return self._added(core, (*textures, *self._normals(inputs)))

    def _coated(self, inputs: _Inputs) -> Material:
        bare = self._glossy(inputs)
        if inputs.coat.is_constant and _number(inputs.coat) <= 0:
            return bare
        if self._is_sheet(inputs):
            self._network.note("coated glass", "a clear coat over what light goes through is left out")
            return bare
        alpha = _number(inputs.coat_alpha)
        alpha = 0 if inputs.coat_alpha.is_constant and alpha < _SMOOTHEST else max(alpha, _SMOOTHEST)
        common = (_raypager.PARAMETER_ALPHA, inputs.coat_alpha), *self._normals(inputs)
        lacquer = self._added(_raypager.coated_diffuse(inputs.base.mean, _COAT_IOR, alpha), ((_raypager.PARAMETER_COLOR, inputs.base), *common))
        if inputs.metallic.is_constant and _number(inputs.metallic) <= 0:
            return _mixed(bare, lacquer, inputs.coat)
        if not inputs.base.is_constant:
            self._network.note("coated metal", "the texture of a metal under a clear coat is not supported; its mid value is used")
        eta, k = (1.0, 1.0, 1.0), tuple(_k_of(min(r, 0.9999)) for r in inputs.base.mean)
        core = _raypager.coated_conductor(eta, k, max(_number(inputs.alpha), _SMOOTHEST), _COAT_IOR, alpha)
        metal = self._added(core, ((_raypager.PARAMETER_BASE_ALPHA, inputs.alpha), *common))
        return _mixed(bare, _mixed(lacquer, metal, inputs.metallic), inputs.coat)

    def _threshold(self) -> float:
        return _number(self._texture("opacityThreshold"))

    def _is_sheet(self, inputs: _Inputs) -> bool:
        """One opacity for the whole surface, by which highlights stay: a sheet of glass. What an image says is there by chance."""
        see_through = inputs.opacity.is_constant and _number(inputs.opacity) < 1
        return see_through and not self._presence and self._threshold() <= 0

    def _cut_out(self, inputs: _Inputs, surface: Material, shines: bool) -> Material:
        opacity, threshold = inputs.opacity, self._threshold()
        if self._is_sheet(inputs) or (opacity.is_constant and _number(opacity) >= 1):
            return surface
        if threshold > 0 and opacity.is_constant:
            return surface if _number(opacity) >= threshold else mix(None, surface, 0)
        if shines:
            self._network.note("shining cut-out", "what shines is not cut out; its opacity is left out there")
            return surface
        if threshold > 0:
            begin = 0.5 - _STEEPNESS * (threshold - 0.5 / 255)
            opacity = _raypager.mixed(_grey(begin), _grey(begin + _STEEPNESS), opacity)
        return _mixed(None, surface, opacity)


def _k_of(reflectance: float) -> float:
    """Of the conductor of eta 1 that reflects this much straight on."""
    return float(2 * np.sqrt(max(reflectance, 0) / (1 - reflectance)))


def _mixed(first: Material | None, second: Material, amount: Any) -> Material:
    if amount.is_constant:
        share = _number(amount)
        return second if share >= 1 else mix(first, second, share) if first is None or share > 0 else first
    return Material("mix", None, ((_raypager.PARAMETER_AMOUNT, amount),), (first, second, float(np.clip(_number(amount), 0, 1))))


def _bound_for(prim: Usd.Prim, purpose: str) -> Usd.Prim | None:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
    return material.GetPrim() if material else None


class Surfaces:
    def __init__(self, reading: Reading, images: Images) -> None:
        self._reading, self._images = reading, images
        self._known: dict[Any, Surface] = {}
        self._shaders: dict[Any, tuple[UsdShade.Shader | None, str | None]] = {}

    def of(self, prim: Usd.Prim) -> Surface:
        """What is bound to a prim, or to a part of its faces."""
        material = self._bound(prim)
        key = None if material is None else material.GetPath()
        if key not in self._known:
            self._known[key] = self._read(material)
        return self._known[key]

    def _bound(self, prim: Usd.Prim) -> Usd.Prim | None:
        """What is bound for pictures; where that cannot be read, what is for previews."""
        full, preview = _bound_for(prim, UsdShade.Tokens.full), None
        if full is None or self._shader(full)[0] is None:
            preview = _bound_for(prim, UsdShade.Tokens.preview)
        if preview is None or preview == full or self._shader(preview)[0] is None:
            return full
        if full is not None:
            self._reading.notes.add("preview", full.GetPath(), f"has no UsdPreviewSurface; what is bound for previews, {preview.GetPath()}, is used")
        return preview

    def _shader(self, material: Usd.Prim) -> tuple[UsdShade.Shader | None, str | None]:
        """Its UsdPreviewSurface; None if it has none, and what it has instead."""
        path = material.GetPath()
        if path not in self._shaders:
            other = None
            for context in ("", "mtlx"):
                shader = UsdShade.Material(material).ComputeSurfaceSource(context)[0]
                kind = shader.GetIdAttr().Get() if shader else None
                if kind in _PREVIEW:
                    break
                other = kind or other
            else:
                shader = None
            self._shaders[path] = shader, other
        return self._shaders[path]

    def _read(self, material: Usd.Prim | None) -> Surface:
        if material is None:
            return Surface(self._reading, self._images, None, None)
        shader, kind = self._shader(material)
        if shader is not None:
            return Surface(self._reading, self._images, material, shader)
        self._reading.notes.add("material", material.GetPath(), f"has no UsdPreviewSurface{f', but a {kind}' if kind else ''}; its surfaces are matt")
        return Surface(self._reading, self._images, material, None)
