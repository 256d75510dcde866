"""What surfaces are made of. Colours are linear sRGB from 0 to 1, or ``"#rrggbb"``; roughness is GGX alpha, 0 (smooth) to 1.

Where a colour or a roughness may be an :class:`Image`, the mesh needs ``uvs``.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from . import _raypager
from ._arrays import ArrayLike, Color, _numbers, color, number
from ._errors import usage

_Mapped: TypeAlias = "Color | Image"
_GREY = (0.5, 0.5, 0.5)


class Image:
    """An image for textures.

    ``pixels``: [height, width], or [height, width, 1, 3 or 4], uint8, uint16 or floats, rows from the top; or the path of a file, which is read when
    the scene is baked. Grey and four channels are not copied if they are uint8, uint16 or float16; three channels become four, other floats float16.
    ``encoding``: ``"srgb"`` or ``"linear"``; by default uint8 is sRGB, all else is linear, and files say it themselves. uint16 is always linear.
    ``repeat``: how often it is repeated from 0 to 1, along u and v. It repeats beyond.
    """

    def __init__(
        self,
        pixels: ArrayLike | str | os.PathLike[str],
        *,
        encoding: Literal["srgb", "linear"] | None = None,
        repeat: tuple[float, float] = (1, 1),
        name: str = "image",
    ) -> None:
        if encoding not in (None, "srgb", "linear"):
            raise usage(f"{name}: '{encoding}' is not an encoding; use srgb or linear")
        self.repeat = [number(r, -1e6, 1e6, f"{name}: repeat") for r in repeat]
        if isinstance(pixels, (str, os.PathLike)):
            self._core = _raypager.texture_file(os.fspath(pixels), encoding or "automatic")
            return
        array = _numbers(pixels, name)
        if array.ndim == 2:
            array = array[:, :, np.newaxis]
        if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or array.size == 0:
            raise usage(f"{name}: an image of shape [height, width] or [height, width, 1, 3 or 4] is expected, not {list(array.shape)}")
        if array.dtype not in (np.uint8, np.uint16, np.float16):
            if array.dtype.kind != "f":
                raise usage(f"{name}: pixels are uint8, uint16 or floats, not {array.dtype}")
            array = np.clip(np.nan_to_num(array), -65504, 65504).astype(np.float16)
        if encoding == "srgb" and array.dtype != np.uint8:
            raise usage(f"{name}: only uint8 can be sRGB, not {array.dtype}; linearise it, or give bytes")
        has_alpha = array.shape[2] == 4
        if array.shape[2] == 3:
            opaque = 1 if array.dtype == np.float16 else np.iinfo(array.dtype).max
            array = np.concatenate([array, np.full((*array.shape[:2], 1), opaque, array.dtype)], axis=2)
        array = np.ascontiguousarray(array)
        srgb = array.dtype == np.uint8 and encoding != "linear"
        height, width, channels = array.shape
        self._core = _raypager.texture_image(name, width, height, channels, array.dtype.name, srgb, has_alpha, array.reshape(-1).view(np.uint8))

    def _texture(self, scale: float = 1) -> _raypager.Texture:
        along_u, along_v = self.repeat
        repeat = (_raypager.WRAP_REPEAT, _raypager.WRAP_REPEAT)
        return _raypager.texture_of(self._core, (along_u, 0, 0, 0, -along_v, 1), (scale, scale, scale), 0, repeat)


@dataclass(frozen=True, eq=False)
class Material:
    """What a surface is made of; see the functions that make one, such as :func:`diffuse`."""

    name: str
    _core: _raypager.Material | None = field(repr=False)
    _images: tuple[tuple[int, Image | _raypager.Texture], ...] = field(default=(), repr=False)
    _parts: tuple[Material | None, Material, float] | None = field(default=None, repr=False)  # of a mix
    _height: tuple[Image, float] | None = field(default=None, repr=False)  # an image of heights, and how high 1 is


_Images: TypeAlias = dict[int, "Image | _raypager.Texture"]


def _mapped(value: _Mapped, parameter: int, images: _Images, what: str) -> tuple[float, float, float]:
    if not isinstance(value, Image):
        return color(value, what)
    images[parameter] = value
    return _GREY


def _roughness(value: float | Image, images: _Images, what: str) -> float:
    if not isinstance(value, Image):
        return number(value, 0, 1, f"{what}: roughness")
    images[_raypager.PARAMETER_ALPHA] = value
    return 0.5


def _made(name: str, core: _raypager.Material, images: _Images) -> Material:
    return Material(name, core, tuple(images.items()))


def diffuse(color: _Mapped = 0.5, *, sigma: float = 0) -> Material:
    """Scatters light alike in all directions. ``sigma``: standard deviation of its facets in degrees (Oren and Nayar 1994)."""
    images: _Images = {}
    rgb = _mapped(color, _raypager.PARAMETER_COLOR, images, "diffuse: color")
    angle = number(sigma, 0, 90, "diffuse: sigma")
    return _made("diffuse", _raypager.rough_diffuse(rgb, angle) if angle > 0 else _raypager.diffuse(rgb), images)


def translucent(color: _Mapped = 0.5, transmittance: _Mapped = 0.5) -> Material:
    """Diffuse reflection on the one side and transmission on the other, the same from both."""
    images: _Images = {}
    rgb = _mapped(color, _raypager.PARAMETER_COLOR, images, "translucent: color")
    through = _mapped(transmittance, _raypager.PARAMETER_TRANSMITTANCE, images, "translucent: transmittance")
    return _made("translucent", _raypager.translucent(rgb, through), images)


def conductor(eta: Color, k: Color, *, roughness: float | Image = 0) -> Material:
    """A metal of refractive index eta + i k, by channel."""
    images: _Images = {}
    alpha = _roughness(roughness, images, "conductor")
    return _made("conductor", _raypager.conductor(color(eta, "conductor: eta"), color(k, "conductor: k"), alpha), images)


def metal(color: str | _Mapped = "gold", *, roughness: float | Image = 0.1) -> Material:
    """gold, silver, copper, brass, aluminium or chrome; or one that reflects this share of light that falls on it straight."""
    images: _Images = {}
    alpha = _roughness(roughness, images, "metal")
    if isinstance(color, str) and not color.startswith("#"):
        named = _raypager.named_metal(color, alpha)
        if named is None:
            raise usage(f"metal: '{color}' is not known; use gold, silver, copper, brass, aluminium, chrome or a colour")
        return _made(color, named, images)
    return _made("metal", _raypager.conductor_of_reflectance(_mapped(color, _raypager.PARAMETER_METAL, images, "metal: color"), alpha), images)


def mirror() -> Material:
    """Reflects everything."""
    return Material("mirror", _raypager.conductor_of_reflectance((1, 1, 1), 0))


def dielectric(ior: float = 1.5, *, roughness: float = 0, reflected: Color = 1, refracted: Color = 1) -> Material:
    """Glass and the like; normals point outside. ``ior``: the index inside over that outside. Colours multiply what it reflects and refracts."""
    n = number(ior, 0.01, 100, "dielectric: ior")
    alpha, up, down = (
        number(roughness, 0, 1, "dielectric: roughness"),
        color(reflected, "dielectric: reflected"),
        color(refracted, "dielectric: refracted"),
    )
    if alpha == 0 and up == down == (1, 1, 1):
        return Material("dielectric", _raypager.dielectric(n))
    return Material("dielectric", _raypager.rough_dielectric(n, alpha, up, down))


def thin_dielectric(ior: float = 1.5) -> Material:
    """A sheet of glass: what passes goes straight on."""
    return Material("thin_dielectric", _raypager.thin_dielectric(number(ior, 0.01, 100, "thin_dielectric: ior")))


def plastic(color: _Mapped = 0.5, *, ior: float = 1.5, roughness: float | Image = 0.1) -> Material:
    """A diffuse base under a coat of index ``ior``, 1 or more."""
    images: _Images = {}
    rgb = _mapped(color, _raypager.PARAMETER_COLOR, images, "plastic: color")
    alpha = _roughness(roughness, images, "plastic")
    return _made("plastic", _raypager.coated_diffuse(rgb, number(ior, 1, 100, "plastic: ior"), alpha), images)


def coated_conductor(eta: Color, k: Color, *, base_roughness: float = 0.1, ior: float = 1.5, roughness: float = 0) -> Material:
    """A metal of roughness ``base_roughness``, more than 0, under a coat of index ``ior``."""
    core = _raypager.coated_conductor(
        color(eta, "coated_conductor: eta"),
        color(k, "coated_conductor: k"),
        number(base_roughness, 1e-4, 1, "coated_conductor: base_roughness"),
        number(ior, 1, 100, "coated_conductor: ior"),
        number(roughness, 0, 1, "coated_conductor: roughness"),
    )
    return Material("coated_conductor", core)


def glossy(color: _Mapped = 0.5, specular: _Mapped = 0.04, *, roughness: float | Image = 0.2) -> Material:
    """Diffuse and glossy, as glTF 2.0 has it. ``specular``: what is reflected of light that falls on it straight."""
    images: _Images = {}
    rgb = _mapped(color, _raypager.PARAMETER_COLOR, images, "glossy: color")
    straight = _mapped(specular, _raypager.PARAMETER_SPECULAR, images, "glossy: specular")
    return _made("glossy", _raypager.glossy(rgb, straight, _roughness(roughness, images, "glossy")), images)


def clay() -> Material:
    """Light, a little warm: what has no material of its own."""
    return Material("clay", _raypager.clay())


def absorbing() -> Material:
    """Reflects nothing: for what only shines."""
    return Material("absorbing", _raypager.absorbing())


def mix(first: Material | None, second: Material, amount: float | Image) -> Material:
    """``second`` as often as ``amount`` says, 0 to 1, else ``first``. ``None`` is nothing: light goes through, as through a cut-out leaf."""
    if isinstance(amount, Image):
        return Material("mix", None, ((_raypager.PARAMETER_AMOUNT, amount),), (first, second, 0.5))
    return Material("mix", None, (), (first, second, number(amount, 0, 1, "mix: amount")))


def with_normals(material: Material, normals: Image) -> Material:
    """The same, with shading normals from an image: red along u, green along v, blue out of the surface, each from 0 for -1 to 1 for 1. Give the
    image ``encoding="linear"``.
    """
    if not isinstance(normals, Image):
        raise usage(f"with_normals: a raypager.Image is expected, not {normals!r}")
    if material._parts is not None:
        first, second, amount = material._parts
        bent = (None if first is None else with_normals(first, normals), with_normals(second, normals), amount)
        return replace(material, _parts=bent)
    return replace(material, _images=(*material._images, (_raypager.PARAMETER_NORMAL, normals)))


def with_bumps(material: Material, heights: Image, height: float = 1) -> Material:
    """The same, shaded as if the surface were raised by what the image says times ``height``, in the world. The image is linear, as a rule."""
    if not isinstance(heights, Image):
        raise usage(f"with_bumps: a raypager.Image is expected, not {heights!r}")
    raised = number(height, -1e30, 1e30, "with_bumps: height")
    if material._parts is not None:
        first, second, amount = material._parts
        bumpy = (None if first is None else with_bumps(first, heights, raised), with_bumps(second, heights, raised), amount)
        return replace(material, _parts=bumpy)
    return replace(material, _height=(heights, raised))
