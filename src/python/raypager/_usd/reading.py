"""What the parts of the USD reader share: the file, the time, and notes about what could not be had."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd

from .._arrays import Array
from .._errors import Error
from .._scene import Scene


class Notes:
    """Warnings, one line for each kind, which names the first place and says how many more there are."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._found: dict[str, tuple[str, int]] = {}

    def add(self, kind: str, place: object, text: str) -> None:
        first, count = self._found.get(kind, (f"{self._path}: {place}: {text}", 0))
        self._found[kind] = first, count + 1

    def lines(self) -> list[str]:
        return [text if count == 1 else f"{text} (and {count - 1} more like it)" for text, count in self._found.values()]


@dataclass
class Reading:
    path: str
    stage: Usd.Stage
    time: Usd.TimeCode
    levels: int  # of subdivision
    camera: str | None  # that the user named
    scene: Scene
    notes: Notes
    has_light: bool = False

    def failed(self, prim: Usd.Prim, text: str) -> Error:
        return Error(f"{self.path}: {prim.GetPath()}: {text}")

    def get(self, attribute: Usd.Attribute) -> Any:
        """Its value; of what is animated, that of the time of the picture."""
        if attribute.ValueMightBeTimeVarying():
            self.notes.add("animation", attribute.GetPath(), f"is animated; the picture is that of {_words(self.time)}, without motion blur")
        return attribute.Get(self.time)

    def numbers(self, prim: Usd.Prim, attribute: Usd.Attribute, columns: int = 1) -> Array:
        """[n], or [n, columns]; empty if there are none. Not copied."""
        value = self.get(attribute) if attribute else None
        array = np.zeros((0, columns), np.float32) if value is None or len(value) == 0 else np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise self.failed(prim, f"its {attribute.GetName()} is no array of numbers; the file is damaged")
        return array.reshape(-1, columns) if columns > 1 else array.reshape(-1)


def _words(time: Usd.TimeCode) -> str:
    return "its first frame" if time.IsEarliestTime() or time.IsDefault() else f"frame {time.GetValue():g}"


def matrix_of(gf: Any) -> Array:
    """[4, 4] for column vectors; USD's are for rows."""
    return np.array(gf, np.float64).T
