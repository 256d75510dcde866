"""Baked scenes: geometry in blocks, textures in pages."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
import numpy.typing as npt

from . import _raypager
from ._arrays import number, whole
from ._errors import Error, RaypagerWarning, usage
from ._scene import Scene
from ._sizes import size

if TYPE_CHECKING:
    from ._options import RenderOptions
    from ._raypager import Progress
    from ._render import Picture


class Blocks:
    """A baked scene, in memory or in a block file; made by :func:`bake` or :func:`open`. Any number of renders may share it."""

    def __init__(self, core: _raypager.Blocks, summary: dict[str, Any] | None = None) -> None:
        self._core = core
        self.summary: dict[str, Any] | None = summary
        """What the bake made, and in how many seconds; None if the blocks were opened."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the scene's picture, in pixels."""
        return self._core.width, self._core.height

    @property
    def spp(self) -> int:
        """Samples per pixel, where a render says nothing else."""
        return self._core.spp

    @property
    def camera(self) -> _raypager.Camera:
        """The scene's own."""
        return self._core.camera

    @property
    def triangles(self) -> int:
        return self._core.triangles

    @property
    def spheres(self) -> int:
        """And points."""
        return self._core.spheres

    @property
    def bounds(self) -> npt.NDArray[np.float32]:
        """[2, 3]: the lowest and the highest corner of all geometry, in world space; zeros for an empty scene."""
        return np.array([self._core.lower, self._core.upper], np.float32)

    @property
    def bytes(self) -> int:
        """Of all blocks and pages, as they are stored and as GPUs have them."""
        return self._core.stored_bytes

    def __len__(self) -> int:
        """Of blocks."""
        return self._core.count

    def __repr__(self) -> str:
        return f"Blocks({len(self)} blocks, {self.triangles} triangles, {self.spheres} spheres and points, {self.bytes} bytes)"

    def render(self, *, progress: Callable[[Progress], object] | None = None, **options: Unpack[RenderOptions]) -> Picture:
        """See :func:`raypager.render`."""
        from ._render import render

        return render(self, progress=progress, **options)


def open(path: str | os.PathLike[str]) -> Blocks:
    """Opens a block file (.rpb). It stays open as long as the blocks are in use; blocks are read and checked when renders need them."""
    return Blocks(_raypager.open(os.fspath(path)))


def bake(
    scene: Scene,
    path: str | os.PathLike[str] | None = None,
    *,
    progress: Callable[[str, float], object] | None = None,
    block_size: int | str | None = None,
    sub_boxes: int = 64,
    host_limit: int | str | None = None,
    position_error: float = 0,
    point_radius: float | Literal["auto"] | None = None,
    point_scale: float = 1,
    cull_to_camera: bool = False,
    cull_margin: float = 0.1,
    filter_to_image: bool = False,
) -> Blocks:
    """Cuts a scene into blocks and builds their hierarchies: in memory, or in the block file ``path``.

    ``progress``: called with the name of a stage and how much of it is done, 0 to 1, on the thread that called this. ``block_size``: bytes per
    block at most, 16K to 32M; by default for about a thousand blocks. ``sub_boxes``: boxes per block in the top tree, 1 to 64. ``host_limit``:
    main memory for the work, besides the scene's own arrays; what does not fit goes over the disk. ``position_error``: vertices may move by so
    much onto a grid, for fewer bytes. ``point_radius``: of all points, or from their spacing ("auto"); ``point_scale``: times that.
    ``cull_to_camera``, ``cull_margin``: leave points out that the camera does not see. ``filter_to_image``: keep about one point a pixel.

    Ctrl-C ends it; a file that was there stays as it was.
    """
    options = _raypager.BakeOptions()
    options.block_bytes = size(block_size, "bake: block_size")
    if options.block_bytes and not 16 << 10 <= options.block_bytes <= 32 << 20:
        raise usage(f"bake: block_size: {block_size!r} is not between 16K and 32M")
    options.block_entries = whole(sub_boxes, 1, 64, "bake: sub_boxes")
    options.host_limit = size(host_limit, "bake: host_limit")
    options.position_error = 0 if position_error == 0 else number(position_error, 1e-20, 1e12, "bake: position_error")
    points = _raypager.PointOptions()
    points.radius_from_spacing = point_radius == "auto"
    if point_radius is not None and point_radius != "auto":
        points.radius = number(point_radius, 1e-30, 1e30, "bake: point_radius")
    points.radius_scale = number(point_scale, 1e-30, 1e30, "bake: point_scale")
    points.cull_to_camera = cull_to_camera
    points.cull_margin = number(cull_margin, 0, 1e6, "bake: cull_margin")
    points.filter_to_image = filter_to_image
    options.points = points
    watch = scene._watch
    watch.begin()
    try:
        core, summary, issues = _raypager.bake(scene._core.copy_for_bake(), options, None if path is None else os.fspath(path), progress, watch.stop)
    except Error as error:
        # What a user's chunks raised is where it comes from.
        faults = watch.faults
        watch.begin()
        if faults:
            raise error from faults[0]
        raise
    for text in issues:
        warnings.warn(text, RaypagerWarning, stacklevel=2)
    return Blocks(core, summary)
