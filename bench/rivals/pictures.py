"""Pictures as [height, width, 3] float32 arrays, linear, first row on top; how far two are apart; what an error is worth in seconds."""

import math
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np


def read_pfm(path: Path) -> np.ndarray:
    """A colour picture. ValueError if it is none."""
    with open(path, "rb") as file:
        kind, size, scale = (file.readline(100).split() for _ in range(3))
        if kind != [b"PF"] or len(size) != 2 or len(scale) != 1:
            raise ValueError(f"{path}: not a PFM picture with colours")
        width, height = map(int, size)
        pixels = np.fromfile(file, "<f4" if float(scale[0]) < 0 else ">f4", 3 * width * height)
    if pixels.size != 3 * width * height:
        raise ValueError(f"{path}: ends too early")
    return np.ascontiguousarray(pixels.reshape(height, width, 3)[::-1], np.float32)


def write_png(path: Path, picture: np.ndarray) -> None:
    """8 bits a channel, in sRGB, for eyes alone."""
    light = np.clip(picture, 0, 1)
    shown = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    rows = (shown * 255 + 0.5).astype(np.uint8).reshape(len(picture), -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", picture.shape[1], picture.shape[0], 8, 2, 0, 0, 0)
    content = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b""))


def mean_square(difference: np.ndarray) -> float:
    return float(np.square(difference, dtype=np.float64).mean())


class Twice(NamedTuple):
    """Two pictures of one tool that differ in their seed alone: together the picture, apart its noise."""

    first: np.ndarray
    second: np.ndarray

    @property
    def picture(self) -> np.ndarray:
        return (self.first + self.second) / 2

    @property
    def noise(self) -> float:
        """Mean square error of `picture`."""
        return mean_square(self.first - self.second) / 4

    @property
    def mean_noise(self) -> np.ndarray:
        """Standard error of each channel's mean in `picture`, [3], where the noise of pixels is independent."""
        pixels = self.first.shape[0] * self.first.shape[1]
        return np.sqrt(np.square(self.first - self.second, dtype=np.float64).mean((0, 1)) / 4 / pixels)


TILE = 8  # pixels a side


def tiles(picture: np.ndarray) -> np.ndarray:
    """Their means; what is left at the border is left out."""
    height, width = (side // TILE for side in picture.shape[:2])
    return picture[: height * TILE, : width * TILE].reshape(height, TILE, width, TILE, 3).mean((1, 3))


class Agreement(NamedTuple):
    """How far a picture is from a reference; all but `rmse` are shares of the reference's mean.

    rmse and relative contain the noise of both; bias has `bias_error` of it (standard error); `unexplained` is the root mean square difference
    that is left when the noise is taken off: of pixels, which tells edges apart, or of tiles, which have less noise, whichever is more."""

    rmse: float
    relative: float  # mean of the absolute differences
    bias: tuple[float, float, float]
    bias_error: tuple[float, float, float]
    unexplained: float

    def within(self, bias: float, unexplained: float) -> bool:
        """The bias of each channel may lie outside of its bound by two standard errors."""
        sure = all(abs(b) <= bias + 2 * e for b, e in zip(self.bias, self.bias_error, strict=True))
        return sure and self.unexplained <= unexplained and math.isfinite(self.rmse)


def agreement(picture: Twice, reference: Twice) -> Agreement:
    """ValueError if the pictures differ in size, or one has no light."""
    if picture.first.shape != reference.first.shape:
        raise ValueError(f"pictures of {picture.first.shape[1::-1]} and {reference.first.shape[1::-1]} pixels cannot be compared")
    means = reference.picture.mean((0, 1), dtype=np.float64)
    if not (means > 0).all():
        raise ValueError("the reference is black, or not a number, in one channel")
    difference = (picture.picture - reference.picture).astype(np.float64)
    without_noise = [mean_square(difference) - picture.noise - reference.noise]
    if min(difference.shape[:2]) >= TILE:
        coarse = [Twice(tiles(p.first), tiles(p.second)).noise for p in (picture, reference)]
        without_noise.append(mean_square(tiles(difference)) - sum(coarse))
    bias = difference.mean((0, 1)) / means
    error = np.hypot(picture.mean_noise, reference.mean_noise) / means
    return Agreement(
        rmse=math.sqrt(mean_square(difference)),
        relative=float(np.abs(difference).mean() / means.mean()),
        bias=tuple(bias.tolist()),
        bias_error=tuple(error.tolist()),
        unexplained=math.sqrt(max(0.0, *without_noise)) / float(means.mean()),
    )


def error_to(picture: np.ndarray, reference: np.ndarray, reference_noise: float) -> float:
    """Root mean square error of a picture to the truth: that to the reference, without the reference's own (its mean square)."""
    return math.sqrt(max(0.0, mean_square(picture - reference) - reference_noise))


def seconds_to(seconds: float, error: float, target: float) -> float:
    """To reach another error: mean square errors fall with one over the time."""
    return seconds * (error / target) ** 2


def samples_to(samples: int, error: float, target: float) -> int:
    return max(1, round(samples * (error / target) ** 2))
