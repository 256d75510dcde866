"""What users hand over, as arrays that the engine reads: checked, and copied only where they are not in its layout already."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._errors import usage

Array: TypeAlias = npt.NDArray[Any]
ArrayLike: TypeAlias = npt.ArrayLike
Color: TypeAlias = "float | str | Sequence[float] | Array"
"""A grey, three linear numbers (red, green, blue), or ``"#rrggbb"`` in sRGB."""
Vector: TypeAlias = "Sequence[float] | Array"
Triple: TypeAlias = tuple[float, float, float]

_AT_ONCE = 1 << 20  # colours that are converted at a time


def _numbers(value: ArrayLike, what: str) -> Array:
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise usage(f"{what}: is no array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise usage(f"{what}: an array of numbers is expected, not of {array.dtype}")
    return array


def _shape(array: Array, shape: tuple[int | None, ...], what: str) -> None:
    if array.ndim == len(shape) and all(s is None or s == n for s, n in zip(shape, array.shape, strict=True)):
        return
    names = iter("nm")
    expected = ", ".join(next(names) if s is None else str(s) for s in shape)
    raise usage(f"{what}: an array of shape [{expected}] is expected, not {list(array.shape)}")


def floats(value: ArrayLike, shape: tuple[int | None, ...], what: str, dtype: type[np.floating[Any]] = np.float32) -> Array:
    """As the engine reads them: in rows, without a copy if they are so already."""
    array = _numbers(value, what)
    _shape(array, shape, what)
    return np.ascontiguousarray(array, dtype=dtype)


def indices(value: ArrayLike, shape: tuple[int | None, ...], what: str) -> npt.NDArray[np.uint32]:
    array = _numbers(value, what)
    _shape(array, shape, what)
    if array.dtype.kind == "f":
        raise usage(f"{what}: whole numbers are expected, not {array.dtype}")
    if array.dtype != np.uint32 and array.size and (array.min() < 0 or array.max() >= 2**32 - 1):
        raise usage(f"{what}: numbers from 0 to 2^32 - 2 are expected; there are some from {array.min()} to {array.max()}")
    return np.ascontiguousarray(array, dtype=np.uint32)


def _srgb_bytes(linear: Array) -> npt.NDArray[np.uint8]:
    c = np.clip(np.nan_to_num(linear.astype(np.float64)), 0, 1)
    return np.round(255 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)).astype(np.uint8)


def packed_colors(value: ArrayLike, count: int, what: str) -> npt.NDArray[np.uint32]:
    """[n] numbers, red | green << 8 | blue << 16 in sRGB, of [n, 3] bytes (sRGB) or floats (linear). A copy of 4 bytes each."""
    array = _numbers(value, what)
    if array.dtype == np.uint32 and array.ndim == 1:
        _shape(array, (count,), what)
        return np.ascontiguousarray(array, dtype=np.uint32)
    _shape(array, (count, 3), what)
    if array.dtype != np.uint8 and array.dtype.kind != "f":
        raise usage(f"{what}: uint8 (sRGB) or floats (linear, 0 to 1) are expected, not {array.dtype}")
    packed = np.empty(count, np.uint32)
    for begin in range(0, count, _AT_ONCE):
        rows = array[begin : begin + _AT_ONCE]
        rgb = (rows if array.dtype == np.uint8 else _srgb_bytes(rows)).astype(np.uint32)
        packed[begin : begin + _AT_ONCE] = rgb[:, 0] | rgb[:, 1] << 8 | rgb[:, 2] << 16
    return packed


def vector(value: Vector, what: str) -> Triple:
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError):
        raise usage(f"{what}: three numbers are expected, not {value!r}") from None
    if not np.isfinite([x, y, z]).all():
        raise usage(f"{what}: finite numbers are expected, not {value!r}")
    return x, y, z


def color(value: Color, what: str) -> Triple:
    if isinstance(value, str):
        try:
            digits = bytes.fromhex(value.removeprefix("#"))
        except ValueError:
            digits = b""
        if not value.startswith("#") or len(digits) != 3:
            raise usage(f"{what}: '{value}' is not a colour; give three numbers (linear), one for a grey, or '#rrggbb' (sRGB)")
        r, g, b = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in (d / 255 for d in digits))
        return r, g, b
    if isinstance(value, (int, float, np.number)):
        value = [float(value)] * 3
    rgb = vector(value, what)
    if min(rgb) < 0:
        raise usage(f"{what}: numbers from 0 on are expected, not {value!r}")
    return rgb


def number(value: float, low: float, high: float, what: str) -> float:
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise usage(f"{what}: a number is expected, not {value!r}") from None
    if not low <= result <= high:
        raise usage(f"{what}: a number from {low:g} to {high:g} is expected, not {value!r}")
    return result


def whole(value: int, low: int, high: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= int(value) <= high:
        raise usage(f"{what}: a whole number from {low} to {high} is expected, not {value!r}")
    return int(value)


def matrix(value: ArrayLike | None, what: str) -> list[list[float]]:
    """[4, 4], also of the first three rows."""
    if value is None:
        return np.eye(4).tolist()
    array = _numbers(value, what)
    rows = 3 if array.shape == (3, 4) else 4
    _shape(array, (rows, 4), what)
    if not np.isfinite(array).all():
        raise usage(f"{what}: is not finite")
    whole_matrix = np.eye(4)
    whole_matrix[:rows] = array
    return whole_matrix.tolist()


def is_chunks(value: object) -> bool:
    """Whether points come in chunks, rather than as one array."""
    if callable(value):
        return True
    return isinstance(value, Iterable) and not isinstance(value, (np.ndarray, list, tuple)) and not hasattr(value, "__array__")
