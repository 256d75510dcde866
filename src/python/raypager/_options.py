"""The options of bakes and renders, for type checkers: what they mean, :func:`raypager.bake` and :func:`raypager.render` say."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Literal, TypedDict

from . import _raypager
from ._arrays import Color


class BakeOptions(TypedDict, total=False):
    block_size: int | str | None
    sub_boxes: int
    host_limit: int | str | None
    position_error: float
    point_radius: float | Literal["auto"] | None
    point_scale: float
    cull_to_camera: bool
    cull_margin: float
    filter_to_image: bool


class RenderOptions(TypedDict, total=False):
    width: int | None
    height: int | None
    spp: int | None
    time: float | None
    max_depth: int | None
    seed: int
    adaptive: float | None
    layers: str | Iterable[str] | None
    camera: _raypager.Camera | str | None
    background: Color | Literal["transparent"] | None
    device: int | str | Sequence[int | str] | None
    allow_different: bool
    memory_limit: int | str | None
    geometry_limit: int | str | None
    host_limit: int | str | None
    checkpoint: str | os.PathLike[str] | None
    checkpoint_every: float
    resume: bool
    connection: Literal["queue", "roulette"]
    policy: str
    traversal: Literal["auto", "ray", "stream"]
    paths: int | None
    interval: float
