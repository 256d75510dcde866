"""A USD file as a scene."""

from __future__ import annotations

import os
import re

import numpy as np
from pxr import Ar, Gf, Tf, Usd, UsdGeom, UsdSkel, UsdUtils

from .. import _raypager
from .._errors import Error
from .._scene import Scene
from .reading import Notes, Reading
from .stage import StageReader


def read(path: str, look: _raypager.BareLook, levels: int, camera: str | None) -> Scene:
    said = UsdUtils.CoalescingDiagnosticDelegate()  # instead of stderr
    stage = _opened(path)
    scene = Scene._loaded(_raypager.Scene(), path)
    scene._too_many_images = []
    reading = Reading(path, stage, _time_of(stage), levels, camera, scene, Notes(path))
    files = _files_of(stage, path)
    _pose(reading)
    scene._core.files = files
    # Of the other options how deep meshes are cut is in their names.
    scene._files = files
    with np.errstate(all="ignore"):  # numbers of damaged files are looked at where they matter
        has_camera, points = StageReader(reading).read()
    core = scene._core
    if not (scene._count or len(points)):
        raise Error(f"{path}: has no surface that can be seen")
    if reading.has_light and look.says_light:
        reading.notes.add("look", "lights", "it has lights of its own; --sky and --light are for what has none, and are left out")
    for name in scene._too_many_images:
        reading.notes.add("too many images", name, "its textures are more than a path can keep; their mid values are used")
    if not (has_camera and reading.has_light):
        z_up = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
        try:
            _raypager.complete_scene(core, look, has_camera, reading.has_light, bool(z_up), np.ascontiguousarray(points, np.float64))
        except Error as error:
            raise Error(f"{path}: {error}") from None
    for diagnostic in said.TakeUncoalescedDiagnostics():
        reading.notes.add("usd", "usd-core says", " ".join(diagnostic.commentary.split()))
    scene._core.warnings = [*core.warnings, *reading.notes.lines()]
    scene._too_many_images = None
    return scene


def _opened(path: str) -> Usd.Stage:
    try:
        stage = Usd.Stage.Open(path)
    except Tf.ErrorException as error:
        raise Error(f"{path}: cannot be read: {_first_line(error).removeprefix(path + ':')}") from None
    if not stage:
        raise Error(f"{path}: cannot be read")
    return stage


def _first_line(error: Tf.ErrorException) -> str:
    """What USD says of the first error, without where in its source."""
    try:
        text = str(error.args[0].commentary)
    except (AttributeError, IndexError):
        text = str(error).strip().splitlines()[-1] if str(error).strip() else "usd-core refuses it"
    return re.sub(r" matching pxrInternal\S*", "", " ".join(text.split()))


def _time_of(stage: Usd.Stage) -> Usd.TimeCode:
    """The first frame, where the stage says which that is."""
    return Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.EarliestTime()


def _pose(reading: Reading) -> None:
    """Meshes with a skeleton as it stands, in a layer that is not kept. Those of instances stay as they are."""
    stage, time = reading.stage, reading.time
    for prototype in stage.GetPrototypes():
        if any(prim.IsA(UsdSkel.Root) for prim in Usd.PrimRange(prototype)):
            reading.notes.add("placed skeleton", prototype.GetPath(), "skeletons in instanceable prims are left out")
    if not any(prim.IsA(UsdSkel.Root) for prim in stage.Traverse()):
        return
    stage.SetEditTarget(stage.GetSessionLayer())
    interval = Gf.Interval.GetFullInterval() if time.IsEarliestTime() else Gf.Interval(time.GetValue(), time.GetValue())
    if not UsdSkel.BakeSkinning(Usd.PrimRange(stage.GetPseudoRoot()), interval):
        reading.notes.add("skeleton", "skeletons", "cannot be posed; meshes are shown as they are without them")


def _files_of(stage: Usd.Stage, path: str) -> list[str]:
    """All layers, those in packages as the package."""
    files = {path}
    for layer in stage.GetUsedLayers():
        name = layer.realPath
        outer = Ar.SplitPackageRelativePathOuter(name)[0] if name else ""
        if outer and os.path.isfile(outer) and not os.path.samefile(outer, path):
            files.add(outer)
    return sorted(files)
