"""The camera of a stage."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from .. import _raypager
from .._arrays import Array
from .._errors import Error, usage
from .reading import Reading, matrix_of

_MOST_NAMED = 4
_TENTH = 0.1  # focal length and aperture are in tenths of the stage's units


class CameraReader:
    def __init__(self, reading: Reading) -> None:
        self._reading = reading
        self._found: list[tuple[Usd.Prim, Array]] = []

    def add(self, prim: Usd.Prim, matrix: Array) -> None:
        self._found.append((prim, matrix))

    def finish(self) -> bool:
        """Sets the camera that was asked for, or the first by path; False: there is none."""
        reading, wanted = self._reading, self._reading.camera
        found = sorted(self._found, key=lambda each: str(each[0].GetPath()))
        if wanted is not None:
            chosen = [each for each in found if _is_called(each[0], wanted)] or self._hidden(wanted)
            if not chosen:
                names = ", ".join(str(prim.GetPath()) for prim, _ in found[:_MOST_NAMED]) or "none"
                raise usage(f"{reading.path}: has no camera {wanted}; there are {names}")
            found = chosen
        if not found:
            return False
        prim, matrix = found[0]
        if len(found) > 1 and wanted is None:
            others = ", ".join(str(each.GetPath()) for each, _ in found[1 : 1 + _MOST_NAMED])
            more = f" and {len(found) - 1 - _MOST_NAMED} more" if len(found) - 1 > _MOST_NAMED else ""
            reading.notes.add("cameras", prim.GetPath(), f"of {len(found)} cameras, this one is used; others are {others}{more}")
        self._take(prim, matrix)
        return True

    def _hidden(self, wanted: str) -> list[tuple[Usd.Prim, Array]]:
        """Those in instances, and invisible ones."""
        everything = Usd.PrimRange(self._reading.stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
        found = [prim for prim in everything if prim.IsA(UsdGeom.Camera) and _is_called(prim, wanted)]
        return [(prim, matrix_of(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(self._reading.time))) for prim in found]

    def _take(self, prim: Usd.Prim, matrix: Array) -> None:
        """It looks along -z, with +y up and +x to the right; scales do not count."""
        reading, camera = self._reading, UsdGeom.Camera(prim)
        back, up = matrix[:3, 2], matrix[:3, 1]
        right = np.cross(-back, up)
        if not np.linalg.norm(right) > 0 or not np.isfinite(matrix).all():
            raise reading.failed(prim, "its camera looks nowhere: its transform is flat")
        forward, right = -back / np.linalg.norm(back), right / np.linalg.norm(right)
        up = np.cross(right, forward)

        width, height = self._positive(prim, "horizontalAperture"), self._positive(prim, "verticalAperture")
        shift = [float(reading.get(prim.GetAttribute(f"{side}ApertureOffset")) or 0) for side in ("horizontal", "vertical")]
        core = reading.scene._core
        _shape_picture(width / height, core)
        out = core.camera
        perspective = str(camera.GetProjectionAttr().Get() or "perspective") != "orthographic"
        length = self._positive(prim, "focalLength")
        # Per unit of the way ahead, or as it is.
        scale = 1 / length if perspective else _TENTH
        half, middle = np.array([width, height]) / 2 * scale, np.array(shift) * scale
        eye = matrix[:3, 3]
        if perspective:
            forward = forward + middle[0] * right + middle[1] * up
        else:
            eye = eye + middle[0] * right + middle[1] * up
        # The sides follow the picture, which has whole pixels.
        half[0] = half[1] * core.width / core.height
        out.projection = 0 if perspective else 1
        out.eye, out.forward = eye.tolist(), forward.tolist()
        out.right, out.up = (half[0] * right).tolist(), (half[1] * up).tolist()
        stop, focus = (float(reading.get(prim.GetAttribute(name)) or 0) for name in ("fStop", "focusDistance"))
        if stop > 0 and focus > 0 and np.isfinite([stop, focus]).all():
            out.lens_radius = length * _TENTH / (2 * stop)
            out.focal_distance = focus
        core.camera = out
        exposure = float(camera.ComputeLinearExposureScale(reading.time))
        if np.isfinite(exposure) and exposure > 0:
            core.exposure = exposure

    def _positive(self, prim: Usd.Prim, name: str) -> float:
        value = self._reading.get(prim.GetAttribute(name))
        if value is None or not 0 < float(value) < 1e30:
            raise Error(f"{self._reading.path}: {prim.GetPath()}: its {name} is {value}; a number of more than 0 is expected")
        return float(value)


def _is_called(prim: Usd.Prim, wanted: str) -> bool:
    return wanted in (str(prim.GetPath()), prim.GetName())


def _shape_picture(aspect: float, core: _raypager.Scene) -> None:
    """Pictures that a file says the shape of fit into the usual size."""

    def pixels(size: float) -> int:
        return int(np.clip(round(size), 1, 65535))

    if aspect > core.width / core.height:
        core.height = pixels(core.width / aspect)
    else:
        core.width = pixels(core.height * aspect)
