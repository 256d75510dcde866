"""Images of a stage: files of their own, and those packed in a .usdz, which are read from memory."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from .. import _raypager
from .._arrays import Array
from .._errors import Error
from .reading import Reading

_SPACES = {"raw": "linear", "sRGB": "srgb", "auto": "automatic"}
_PNG, _PNG_HEAD = b"\x89PNG", 26  # bytes, of which the last two are bits and kind of colour
# How files begin whose pixels, as they are read, have been decoded from sRGB, and those that have floats.
_DECODED, _FLOATS = (_PNG, b"\xff\xd8"), (b"\x76\x2f\x31\x01", b"#?")


class Images:
    def __init__(self, reading: Reading) -> None:
        self._reading = reading
        self._textures: dict[tuple[str, str], Any] = {}
        self._bytes: dict[str, bytes] = {}
        self._pixels: dict[tuple[str, str], Array | None] = {}
        self._keys: dict[int, tuple[str, str]] = {}

    def texture(self, asset: Sdf.AssetPath, space: str, place: Usd.Prim) -> Any:
        """For materials; None if it cannot be had, which is noted. ``space``: the sourceColorSpace."""
        name = self._found(asset, place)
        if name is None:
            return None
        key = name, self._encoding(name, space)
        if key not in self._textures:
            self._textures[key] = self._opened(*key, place)
        return self._textures[key]

    def tiles(self, asset: Sdf.AssetPath, space: str, attribute: Usd.Attribute) -> tuple[tuple[int, Any], ...]:
        """Those of an image in tiles (UDIM), by their numbers; none if they cannot be had, which is noted."""
        prim, stack = attribute.GetPrim(), attribute.GetPropertyStack(self._reading.time)
        found = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, stack[0].layer) if stack else []
        if not found:
            self._reading.notes.add("missing image", prim.GetPath(), f"{asset.path}: there is no tile of it; its fallback is used")
        opened = [(int(number), self.texture(Sdf.AssetPath(path, path), space, prim)) for path, number in found]
        return tuple((number, image) for number, image in opened if image is not None)

    def pixels(self, asset: Sdf.AssetPath, place: Usd.Prim) -> Array | None:
        """[height, width, 3] float32, linear; None if it cannot be had, which is noted."""
        name = self._found(asset, place)
        return None if name is None else self._read((name, self._encoding(name, "auto")), place)

    def pixels_of(self, image: Any, place: Usd.Prim) -> Array | None:
        """Those of what :meth:`texture` gave. What is made of a mesh depends on the file then."""
        key = self._keys[id(image)]
        if key not in self._pixels and os.path.isfile(key[0]):
            self._reading.scene._files.append(key[0])
        return self._read(key, place)

    def _found(self, asset: Sdf.AssetPath, place: Usd.Prim) -> str | None:
        name = asset.resolvedPath or str(Ar.GetResolver().Resolve(asset.path))
        if not name:
            self._reading.notes.add("missing image", place.GetPath(), f"{asset.path}: no such file; its fallback is used")
            return None
        return name

    def _encoding(self, name: str, space: str) -> str:
        """By sourceColorSpace; auto is linear for PNG of 16 bits or without colours. What has one channel or two is found out once it is open."""
        encoding = _SPACES.get(space, "automatic")
        head = self._head(name) if encoding == "automatic" else b""
        if head.startswith(_PNG) and len(head) == _PNG_HEAD and (head[-2] == 16 or head[-1] in (0, 4)):
            return "linear"
        return encoding

    def _head(self, name: str) -> bytes:
        try:
            if not os.path.isfile(name):
                return self._packed(name)[:_PNG_HEAD]
            with open(name, "rb") as file:
                return file.read(_PNG_HEAD)
        except OSError:  # which whoever reads the image says
            return b""

    def _opened(self, name: str, encoding: str, place: Usd.Prim) -> Any:
        try:
            image = self._source(name, encoding)
            if encoding == "automatic" and _raypager.image_shape(image)[2] <= 2:
                image = self._source(name, "linear")
            _raypager.image_shape(image)
        except (Error, OSError) as error:
            self._reading.notes.add("image", place.GetPath(), f"{error}; its fallback is used")
            return None
        self._keys[id(image)] = name, encoding
        return image

    def _source(self, name: str, encoding: str) -> Any:
        if os.path.isfile(name):
            return _raypager.texture_file(name, encoding)
        return _raypager.texture_bytes(name, _ending(name), self._packed(name), encoding)

    def _packed(self, name: str) -> bytes:
        if name not in self._bytes:
            asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(name))
            if not asset:
                raise OSError(f"{name}: cannot be opened")
            with asset as opened:
                self._bytes[name] = bytes(opened.GetBuffer())
        return self._bytes[name]

    def _read(self, key: tuple[str, str], place: Usd.Prim) -> Array | None:
        if key not in self._pixels:
            name, encoding = key
            try:
                self._pixels[key] = self._in_space(name, encoding, _three_channels(self._read_file(name)))
            except (Error, OSError) as error:
                self._reading.notes.add("image", place.GetPath(), f"{error}; the image is left out")
                self._pixels[key] = None
        return self._pixels[key]

    def _in_space(self, name: str, encoding: str, pixels: Array) -> Array:
        """Reading decodes as files say; a stage may say otherwise."""
        head = self._head(name)
        if encoding == "linear" and head.startswith(_DECODED):
            return np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 0.0031308) ** (1 / 2.4) - 0.055).astype(np.float32)
        if encoding == "srgb" and head.startswith(_FLOATS):
            return np.where(pixels <= 0.04045, pixels / 12.92, ((np.maximum(pixels, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
        return pixels

    def _read_file(self, name: str) -> Array:
        if os.path.isfile(name):
            return _raypager.read_image(name)
        with tempfile.TemporaryDirectory(prefix="raypager-") as folder:
            copy = Path(folder) / f"image{_ending(name)}"
            copy.write_bytes(self._packed(name))
            return _raypager.read_image(str(copy))


def _ending(name: str) -> str:
    """Of "a.usdz[textures/b.png]" ".png"."""
    return Path(name.rstrip("]")).suffix.lower()


def _three_channels(pixels: Array) -> Array:
    rgb = pixels[:, :, :3] if pixels.shape[2] >= 3 else np.repeat(pixels[:, :, :1], 3, 2)
    return np.ascontiguousarray(np.clip(np.nan_to_num(rgb, posinf=65504), 0, None), np.float32)
