"""Sizes of memory, as the command line takes them."""

from __future__ import annotations

import numpy as np

from . import _raypager
from ._errors import Error, usage


def size(value: int | str | None, what: str) -> int:
    """Bytes: a number, or text such as "8G", "1.5 GiB" or "512MB" (all binary). None: 0, which leaves it to the engine."""
    if value is None:
        return 0
    if isinstance(value, str):
        try:
            return _raypager.parse_size(value)
        except Error as error:
            raise usage(f"{what}: {error}") from None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 < int(value) <= 2**60:
        raise usage(f"{what}: {value!r} is not a size; give bytes, or text such as '8G'")
    return int(value)


def size_or_percent(value: int | str | None, what: str) -> tuple[int, float]:
    """Bytes and percent, one of which is 0; text may end in a percent sign, such as "25%"."""
    if not isinstance(value, str):
        return size(value, what), 0.0
    try:
        return _raypager.parse_size_or_percent(value)
    except Error as error:
        raise usage(f"{what}: {error}") from None
