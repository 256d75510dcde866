"""Renders."""

from __future__ import annotations

import json
import os
import tempfile
import time as clock
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TypeAlias, Unpack

import numpy as np
import numpy.typing as npt

from . import _blocks, _raypager
from ._arrays import Array, Color, color, number, whole
from ._errors import Error, RaypagerWarning, usage
from ._options import RenderOptions
from ._raypager import Progress
from ._scene import Scene, load
from ._sizes import size, size_or_percent

Source: TypeAlias = "Scene | _blocks.Blocks | str | os.PathLike[str]"


def _device_text(device: int | str | Sequence[int | str] | None) -> str:
    if device is None or isinstance(device, (int, str)):
        return "" if device is None else str(device)
    if len(device) == 0:
        raise usage("render: device: the list is empty; leave it out for the default device")
    return ",".join(map(str, device))


class Picture:
    """What a render made."""

    film: npt.NDArray[np.float32]
    """[height, width, 3], or 4 with a transparent background (alpha last, colours premultiplied): linear sRGB, rows from the top."""
    report: dict[str, Any]
    """All figures, in the keys of the command line's ``--report``: bytes, seconds, counts."""
    layers: dict[str, npt.NDArray[np.float32]]
    """Those that the render was asked for, by their names: [height, width, 3] for albedo, normal and position, else [height, width, 1]."""

    def __init__(self, film: Array, report: dict[str, Any], layers: dict[str, npt.NDArray[np.float32]] | None = None) -> None:
        self.film = film
        self.report = report
        self.layers = layers or {}

    @property
    def complete(self) -> bool:
        """False if the render ended before its time: then pixels may have different numbers of samples."""
        return bool(self.report["image"]["complete"])

    def save(self, path: str | os.PathLike[str], *, exposure: float = 0) -> None:
        """Writes .exr, with layers, .png or .pfm. The picture is multiplied by 2 to the power of ``exposure``."""
        save(path, self.film, exposure=exposure, layers=self.layers if _raypager.holds_layers(os.fspath(path)) else None)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.film, dtype=dtype) if copy else np.asarray(self.film, dtype=dtype)

    def __repr__(self) -> str:
        height, width, channels = self.film.shape
        return f"Picture({width}x{height}, {channels} channels, {self.report['image']['average_spp']:g} samples per pixel)"

    def _repr_png_(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            self.save(path)
            return path.read_bytes()


def save(path: str | os.PathLike[str], film: npt.ArrayLike, *, exposure: float = 0, layers: Mapping[str, npt.ArrayLike] | None = None) -> None:
    """Writes a picture, [height, width, 1, 3 or 4], linear: .exr, .png or .pfm. The file appears whole or not at all. ``layers``: of .exr files, as
    :class:`Picture` has them.
    """
    pixels = np.ascontiguousarray(film, dtype=np.float32)
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or pixels.size == 0:
        raise usage(f"save: a picture of shape [height, width, 1, 3 or 4] is expected, not {list(pixels.shape)}")
    kept = [(name, _pixels(values, f"save: layer '{name}'")) for name, values in (layers or {}).items()]
    for name, values in kept:
        if values.shape[:2] != pixels.shape[:2] or values.shape[2] != _channels_of_layer(name):
            expected = [*pixels.shape[:2], _channels_of_layer(name)]
            raise usage(f"save: layer '{name}': shape {expected} is expected, not {list(values.shape)}")
    _raypager.write_image(os.fspath(path), pixels, number(exposure, -64, 64, "save: exposure"), kept)


def _pixels(values: npt.ArrayLike, what: str) -> npt.NDArray[np.float32]:
    pixels = np.ascontiguousarray(values, dtype=np.float32)
    if pixels.ndim != 3 or pixels.size == 0:
        raise usage(f"{what}: an array of shape [height, width, channels] is expected, not {list(pixels.shape)}")
    return pixels


def _channels_of_layer(name: str) -> int:
    return 3 if name in ("albedo", "normal", "position") else 1


def read_image(path: str | os.PathLike[str]) -> npt.NDArray[np.float32]:
    """A picture file, [height, width, channels] float32, linear."""
    return _raypager.read_image(os.fspath(path))


def _baked(scene: Source, host_limit: int) -> _blocks.Blocks:
    if isinstance(scene, (str, os.PathLike)):
        if os.fspath(scene).endswith(".rpb"):
            return _blocks.open(scene)
        scene = load(scene, host_limit=host_limit or None)
    if isinstance(scene, _blocks.Blocks):
        return scene
    if not isinstance(scene, Scene):
        raise usage(f"render: a scene, blocks or a path is expected, not {scene!r}")
    if scene._baked is None:
        scene._baked = _blocks.bake(scene, host_limit=max(host_limit, _raypager.smallest_bake_limit()) if host_limit else None)
    return scene._baked


class Render:
    """A render that its owner drives: iterate over it, and it goes on; stop, and it waits.

    ::

        with rp.Render(scene, spp=256) as render:
            for progress in render:
                print(f"{progress.fraction:.0%}")
            picture = render.finish()

    Arguments are those of :func:`render`. ``interval``: seconds between two steps of the iteration. Everything that takes long releases the GIL.
    Other threads may call :meth:`cancel` at any time. Ctrl-C is answered within a round of the wavefront, and leaves the checkpoint, where there
    is one, with all that was rendered; :meth:`finish` still gives the picture so far.
    """

    def __init__(
        self,
        scene: Source,
        *,
        width: int | None = None,
        height: int | None = None,
        spp: int | None = None,
        time: float | None = None,
        max_depth: int | None = None,
        seed: int = 0,
        adaptive: float | None = None,
        layers: str | Iterable[str] | None = None,
        camera: _raypager.Camera | str | None = None,
        background: Color | Literal["transparent"] | None = None,
        device: int | str | Sequence[int | str] | None = None,
        allow_different: bool = False,
        memory_limit: int | str | None = None,
        geometry_limit: int | str | None = None,
        host_limit: int | str | None = None,
        checkpoint: str | os.PathLike[str] | None = None,
        checkpoint_every: float = 60,
        resume: bool = False,
        connection: Literal["queue", "roulette"] = "queue",
        policy: str = "aged-wants",
        traversal: Literal["auto", "ray", "stream"] = "auto",
        paths: int | None = None,
        interval: float = 0.25,
    ) -> None:
        self._begin = clock.perf_counter()
        self._interval = number(interval, 0, 1e9, "render: interval")
        self._picture: Picture | None = None
        self._session: _raypager.Session | None = None
        self._last: Progress | None = None
        options = _raypager.RenderOptions()
        options.host_limit = size(host_limit, "render: host_limit")
        options.memory_limit = size(memory_limit, "render: memory_limit")
        options.geometry_limit, options.geometry_limit_percent = size_or_percent(geometry_limit, "render: geometry_limit")
        if options.memory_limit and options.geometry_limit > options.memory_limit:
            raise usage("render: geometry_limit: is more than memory_limit, which covers all device memory; make it smaller")
        options.device = _device_text(device)
        options.allow_different = allow_different
        options.time_seconds = 0 if time is None else number(time, 1e-6, 1e9, "render: time")
        options.seed = whole(seed, 0, 2**32 - 1, "render: seed")
        options.adaptive_error = 0 if adaptive is None else number(adaptive, 1e-4, 10, "render: adaptive")
        if layers is not None:
            options.set_layers(layers if isinstance(layers, str) else ",".join(layers))
        options.max_depth = None if max_depth is None else whole(max_depth, 0, 60000, "render: max_depth")
        _set_checkpoint(options, checkpoint, checkpoint_every, resume)
        if connection not in ("queue", "roulette"):
            raise usage(f"render: '{connection}' is not a kind of connection; use queue or roulette")
        options.roulette_connection = connection == "roulette"
        tuning = options.tuning
        tuning.policy, tuning.traversal = policy, traversal
        tuning.paths = 0 if paths is None else whole(paths, 1, 2**30, "render: paths")
        if isinstance(background, str) and background == "transparent":
            options.set_transparent()
        elif background is not None:
            options.set_background(color(background, "render: background"))
        if camera is not None and not isinstance(camera, (_raypager.Camera, str)):
            raise usage(f"render: camera: one of raypager's is expected, such as look_at() makes, not {camera!r}")
        sides = (
            None if width is None else whole(width, 1, 2**20, "render: width"),
            None if height is None else whole(height, 1, 2**20, "render: height"),
        )
        samples = None if spp is None else whole(spp, 1, 65535, "render: spp")
        blocks = _baked(scene, options.host_limit)
        self._set_view(options, blocks, sides, samples, camera)
        self._bake_seconds = float(blocks.summary["seconds"]) if blocks.summary else 0.0
        self._session = _raypager.Session(blocks._core, options)
        self._size = options.width, options.height

    @staticmethod
    def _set_view(
        options: _raypager.RenderOptions,
        blocks: _blocks.Blocks,
        sides: tuple[int | None, int | None],
        spp: int | None,
        camera: _raypager.Camera | str | None,
    ) -> None:
        old_width, old_height = blocks.size
        width, height = sides
        if width is None and height is None:
            width, height = old_width, old_height
        elif height is None:
            assert width is not None
            height = max(1, round(width * old_height / old_width))
        elif width is None:
            width = max(1, round(height * old_width / old_height))
        options.width, options.height = width, height
        options.spp = spp or (65535 if options.time_seconds > 0 else blocks.spp)
        if isinstance(camera, str):
            camera = _raypager.camera_of_text(camera, width, height)
        options.camera = camera or _raypager.fit_camera(blocks.camera, old_width, old_height, width, height)

    def _running(self) -> _raypager.Session:
        if self._session is None:
            raise usage("render: has ended; begin another")
        return self._session

    def _warn(self) -> None:
        if self._session is not None:
            for text in self._session.warnings():
                warnings.warn(text, RaypagerWarning, stacklevel=3)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, in pixels."""
        return self._size

    @property
    def done(self) -> bool:
        """Whether the picture is finished, or the render was cancelled."""
        return self._session is None or self._session.done

    @property
    def progress(self) -> Progress:
        """How far it is."""
        if self._session is not None:
            self._last = self._session.progress
        if self._last is None:
            raise usage("render: ended before its first step; begin another")
        return self._last

    def step(self, seconds: float) -> Progress:
        """Goes on for about so many seconds, at least one round, unless it is done."""
        try:
            self._running().step(number(seconds, 0, 1e9, "step: seconds"))
        except KeyboardInterrupt:
            self._keep()
            raise
        self._warn()
        return self.progress

    def __iter__(self) -> Iterator[Progress]:
        return self

    def __next__(self) -> Progress:
        if self.done:
            raise StopIteration
        return self.step(self._interval)

    def snapshot(self) -> npt.NDArray[np.float32]:
        """The picture so far, [height, width, 3 or 4]: pixels without a sample show what is around them. The render goes on unchanged."""
        return self._running().snapshot()

    def checkpoint(self) -> None:
        """Writes the checkpoint now."""
        self._running().checkpoint()

    def _keep(self) -> None:
        if self._session is not None:
            self._session.keep()

    def cancel(self) -> None:
        """From any thread: steps return soon, after at most one round. What has been rendered stays."""
        session = self._session
        if session is not None:
            session.cancel()

    def finish(self) -> Picture:
        """Ends the render, wherever it is, with a last checkpoint if there are any: the picture, and what was done. Frees the device's memory."""
        if self._picture is None:
            session = self._running()
            self._last = session.progress
            film, report, layers = session.finish(clock.perf_counter() - self._begin, self._bake_seconds)
            self._warn()
            self._session = None
            self._picture = Picture(film, json.loads(report), dict(layers))
        return self._picture

    def close(self) -> None:
        """Ends the render, with a last checkpoint if there are any, and leaves the picture."""
        if self._session is not None:
            session, self._session = self._session, None
            session.cancel()
            session.close()

    def __enter__(self) -> Render:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self.close()
        except Error as lost:
            if error is None:
                raise
            warnings.warn(str(lost), RaypagerWarning, stacklevel=2)


def _set_checkpoint(options: _raypager.RenderOptions, path: str | os.PathLike[str] | None, every: float, resume: bool) -> None:
    if path is None:
        if resume:
            raise usage("render: resume: from which file? Name it with checkpoint")
        return
    # Found now, not after hours.
    folder = Path(path).absolute().parent
    if not os.access(folder, os.W_OK):
        raise Error(f"{os.fspath(path)}: cannot be written: its folder {'is not writable' if folder.is_dir() else 'does not exist'}")
    checkpoint = options.checkpoint
    checkpoint.file = os.fspath(path)
    checkpoint.every_seconds = number(every, 1e-6, 1e9, "render: checkpoint_every")
    checkpoint.resume = resume


def render(scene: Source, *, progress: Callable[[Progress], object] | None = None, **options: Unpack[RenderOptions]) -> Picture:
    """Renders a scene, blocks, or a file, which is loaded and baked in memory if it is no block file (.rpb).

    ``width``, ``height``, ``spp``, ``max_depth``: of the picture, in pixels, samples per pixel and scattering events; by default as the scene
    says. Of width and height alone, the other follows. ``time``: stops after about so many seconds. ``seed``: of the random numbers. ``adaptive``:
    pixels stop, with ``spp`` samples at most, when their error is below this share of the picture's mean brightness, 0.0001 to 10. ``layers``: names
    of what the film keeps beside the picture, or "all": albedo, normal, depth, position, object, instance, material, samples, variance, waits
    (:attr:`Picture.layers`). ``camera``:
    see :func:`look_at`; or text as the command line takes it, and as reports have it. ``background``: what the camera sees where nothing is, a
    colour or "transparent".

    ``device``: a number or part of a name, see :func:`devices`; several as a list, or "all" for those like the default one. They share the work, and
    the picture is the same; with ``allow_different`` they may be of different kinds, and then its last bits depend on chance. ``memory_limit``:
    of each device's memory, for all of the render: bytes, or text such as "8G". ``geometry_limit``: of it, for blocks and pages: bytes, or a share
    of the scene such as "25%". ``host_limit``: of main memory, for blocks that are read, and for the bake. The picture is the same to the bit
    whatever the limits are; one that is too small is an error that says what would do.

    ``checkpoint``: a file that keeps all work, every ``checkpoint_every`` seconds and at the end; ``resume``: goes on from it. ``connection``,
    ``policy``, ``traversal``, ``paths``: as the command line's. ``progress``: called a few times a second.

    Ctrl-C ends it within a round, with the checkpoint written. To keep the picture then, use :class:`Render`.
    """
    with Render(scene, **options) as job:
        for step in job:
            if progress is not None:
                progress(step)
        return job.finish()


__all__ = ["Picture", "Progress", "Render", "Source", "read_image", "render", "save"]
