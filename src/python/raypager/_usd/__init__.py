"""Scenes in USD (usd-core): .usd, .usda, .usdc and .usdz."""

from __future__ import annotations

import importlib
import os
from typing import Any

import numpy as np

from .. import _raypager
from .._errors import Error, usage

ENDINGS = (".usd", ".usda", ".usdc", ".usdz")
LEVELS = 2  # of subdivision
MOST_LEVELS = 6


def is_usd(path: str | os.PathLike[str]) -> bool:
    return os.fspath(path).lower().endswith(ENDINGS)


def read_usd(path: str, look: _raypager.BareLook, levels: int = LEVELS, camera: str | None = None) -> Any:
    """A :class:`Scene`. ``look``: for what has no light or no camera."""
    if not os.path.isfile(path):
        raise Error(f"{path}: no such file")
    try:
        importlib.import_module("pxr.Usd")
    except ImportError as missing:
        raise Error(f"{path}: to read it takes the package usd-core: pip install 'raypager[usd]', or pip install usd-core") from missing
    reader = importlib.import_module("raypager._usd.file")
    try:
        return reader.read(path, look, levels, camera)
    except (Error, KeyboardInterrupt, MemoryError):
        raise
    except Exception as error:  # whatever the library makes of damaged files
        raise Error(f"{path}: cannot be read: {' '.join(str(error).split()) or type(error).__name__}") from error


def levels_of(value: Any, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= int(value) <= MOST_LEVELS:
        raise usage(f"{what}: a whole number from 0 to {MOST_LEVELS} is expected, not {value!r}")
    return int(value)
