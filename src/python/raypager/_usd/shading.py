"""Networks of UsdShade: what an input of UsdPreviewSurface is, a value, an image or a primvar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdShade

from .. import _raypager
from .._arrays import Array
from .images import Images
from .reading import Reading

_CHANNELS = {"r": 3, "g": 4, "b": 5, "a": 6}
ALPHA = _CHANNELS["a"]
_WRAPS = {"repeat": _raypager.WRAP_REPEAT, "clamp": _raypager.WRAP_CLAMP, "mirror": _raypager.WRAP_MIRROR, "black": _raypager.WRAP_BLACK}
_TOP_LEFT = np.array([[1, 0, 0], [0, -1, 1], [0, 0, 1]], np.float64)  # from v upwards to rows from the top
_DEEPEST = 32  # shaders behind each other


@dataclass(frozen=True)
class Constant:
    value: tuple[float, ...]


@dataclass(frozen=True)
class FromPrimvar:
    name: str
    fallback: tuple[float, ...]


@dataclass(frozen=True)
class FromImage:
    """texel * scale + bias, at the primvar's coordinates times ``matrix``, [3, 3]. ``channel``: 0, the colour, or 3 to 6."""

    image: Any
    channel: int
    scale: tuple[float, float, float, float]
    bias: tuple[float, float, float, float]
    wraps: tuple[int, int]
    uvs: str
    matrix: tuple[tuple[float, ...], ...]
    is_plain: bool  # the file says neither scale nor bias
    tiles: tuple[tuple[int, Any], ...] = ()  # of an image in tiles (UDIM), numbers from 1001 on; ``image`` is the first
    fallback: tuple[float, ...] = (0.0, 0.0, 0.0)  # of a tile that there is not

    def seen(self, texel: Array) -> tuple[float, ...]:
        """What a texel, [3], comes to."""
        if self.channel:
            one = self.channel - 3
            return (float(texel[one] * self.scale[one] + self.bias[one]),) * 3
        return tuple((texel * self.scale[:3] + self.bias[:3]).tolist())

    def texture(self, factor: float = 1, offset: float = 0, tile: int | None = None) -> _raypager.Texture:
        """(texel * scale + bias) * factor + offset."""
        one = self.channel - 3 if self.channel else None
        image, corner = self.image, np.eye(3)
        if self.tiles:
            number = self.tiles[0][0] if tile is None else tile
            image = dict(self.tiles).get(number)
            if image is None:
                return _raypager.Texture((np.resize(self.fallback, 3) * factor + offset).tolist())
            corner[:2, 2] = -((number - 1001) % 10), -((number - 1001) // 10)
        scale = self.scale[:3] if one is None else (self.scale[one],) * 3
        bias = np.array(self.bias[:3] if one is None else (self.bias[one],) * 3) * factor + offset
        place = _TOP_LEFT @ corner @ np.array(self.matrix)
        times = tuple(s * factor for s in scale)
        texture = _raypager.texture_of(image, tuple(place[:2].ravel().tolist()), times, self.channel, self.wraps)
        if not bias.any():
            return texture
        return _raypager.mixed(_raypager.Texture(bias.tolist()), _raypager.Texture((bias + 1).tolist()), texture)


Value: TypeAlias = "Constant | FromPrimvar | FromImage"


class Network:
    """Of one material."""

    def __init__(self, reading: Reading, images: Images, material: Usd.Prim) -> None:
        self._reading, self._images, self.material = reading, images, material

    def note(self, kind: str, text: str) -> None:
        self._reading.notes.add(kind, self.material.GetPath(), text)

    def input(self, shader: UsdShade.Shader, name: str, default: tuple[float, ...]) -> Value:
        """What an input of a shader is; numbers have one component, colours have three."""
        wanted = shader.GetInput(name)
        if not wanted:
            return Constant(default)
        source = _producer(wanted)
        if source is None:
            return Constant(default)
        if UsdShade.Output.IsOutput(source):
            return self._output(source, name, default, 0)
        return Constant(_fitting(self._reading.get(source), default))

    def _output(self, source: Usd.Attribute, name: str, default: tuple[float, ...], depth: int) -> Value:
        shader, output = UsdShade.Shader(source.GetPrim()), UsdShade.Output(source).GetBaseName()
        kind = shader.GetIdAttr().Get() if shader else None
        if kind == "UsdUVTexture" and depth < _DEEPEST:
            return self._image(shader, output, default)
        if isinstance(kind, str) and kind.startswith("UsdPrimvarReader_"):
            fallback = _value(self._reading, shader, "fallback")
            return FromPrimvar(self._varname(shader, ""), _fitting(fallback, default if fallback is None else (0.0,) * len(default)))
        self.note(f"node {kind}", f"its {name} comes from a {kind or 'shader without an id'}, which is not read; its default is used")
        return Constant(default)

    def _image(self, shader: UsdShade.Shader, output: str, default: tuple[float, ...]) -> Value:
        fallback = _four(_value(self._reading, shader, "fallback"), (0.0, 0.0, 0.0, 1.0))
        channel = _CHANNELS.get(output, 0)
        otherwise = Constant(fallback[: len(default)] if channel == 0 else (fallback[channel - 3],) * len(default))
        asset = _value(self._reading, shader, "file")
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            self.note("no file", f"{shader.GetPath()} names no file; its fallback is used")
            return otherwise
        space = str(_value(self._reading, shader, "sourceColorSpace") or "auto")
        tiles: tuple[tuple[int, Any], ...] = ()
        if "<UDIM>" in asset.path:
            tiles = self._images.tiles(asset, space, _producer(shader.GetInput("file")))
            image = tiles[0][1] if tiles else None
        else:
            image = self._images.texture(asset, space, shader.GetPrim())
        if image is None:
            return otherwise
        uvs, matrix = self._coordinates(shader.GetInput("st"), 0)
        scale, bias = _value(self._reading, shader, "scale"), _value(self._reading, shader, "bias")
        return FromImage(
            image,
            channel,
            _four(scale, (1.0, 1.0, 1.0, 1.0)),
            _four(bias, (0.0, 0.0, 0.0, 0.0)),
            (self._wrap(shader, "wrapS"), self._wrap(shader, "wrapT")),
            uvs,
            tuple(map(tuple, matrix.tolist())),
            scale is None and bias is None,
            tiles,
            otherwise.value,
        )

    def _wrap(self, shader: UsdShade.Shader, name: str) -> int:
        # What the file's own metadata say is not looked at; without them, the specification has black, and Pixar's viewer repeats.
        return _WRAPS.get(str(_value(self._reading, shader, name)), _raypager.WRAP_REPEAT)

    def _coordinates(self, wanted: UsdShade.Input | None, depth: int) -> tuple[str, Array]:
        source = _producer(wanted) if wanted else None
        if source is None or not UsdShade.Output.IsOutput(source) or depth >= _DEEPEST:
            return "st", np.eye(3)
        shader = UsdShade.Shader(source.GetPrim())
        kind = shader.GetIdAttr().Get() if shader else None
        if kind == "UsdTransform2d":
            uvs, before = self._coordinates(shader.GetInput("in"), depth + 1)
            return uvs, self._transform(shader) @ before
        if kind == "UsdPrimvarReader_float2":
            return self._varname(shader, "st"), np.eye(3)
        self.note(f"coordinates {kind}", f"coordinates of a texture come from a {kind}, which is not read; the primvar st is used")
        return "st", np.eye(3)

    def _transform(self, shader: UsdShade.Shader) -> Array:
        angle = np.radians(_fitting(_value(self._reading, shader, "rotation"), (0.0,))[0])
        sx, sy = _fitting(_value(self._reading, shader, "scale"), (1.0, 1.0))
        tx, ty = _fitting(_value(self._reading, shader, "translation"), (0.0, 0.0))
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty], [0, 0, 1]])

    def _varname(self, shader: UsdShade.Shader, otherwise: str) -> str:
        return str(_value(self._reading, shader, "varname") or otherwise)


def _producer(wanted: UsdShade.Input) -> Usd.Attribute | None:
    """The attribute that has the value, or the shader's output that makes it; through the interfaces of materials and node graphs."""
    found = UsdShade.Utils.GetValueProducingAttributes(wanted)
    return found[0] if found else None


def _value(reading: Reading, shader: UsdShade.Shader, name: str) -> Any:
    wanted = shader.GetInput(name)
    source = _producer(wanted) if wanted else None
    return None if source is None or UsdShade.Output.IsOutput(source) else reading.get(source)


def _fitting(value: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """As many finite numbers as the default has."""
    if value is None or isinstance(value, (str, Sdf.AssetPath)):
        return default
    try:
        numbers = [float(v) for v in np.ravel(np.asarray(value, np.float64))]
    except (TypeError, ValueError):
        return default
    if len(numbers) == 1:
        numbers *= len(default)
    if len(numbers) < len(default) or not np.isfinite(numbers).all():
        return default
    return tuple(numbers[: len(default)])


def _four(value: Any, default: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    a, b, c, d = _fitting(value, default)
    return a, b, c, d
