"""Primvars: what varies over a mesh, and how."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .._arrays import Array
from .reading import Reading


@dataclass
class Primvar:
    """``values``: [n, k] float32, as many as ``interpolation`` says of faces, points or corners."""

    values: Array
    interpolation: str

    def of_points(self) -> bool:
        return self.interpolation in ("vertex", "varying")

    def at_corners(self, faces: Array, counts: Array, corners: Array, original: Array) -> Array:
        """[c, k]. ``faces``: of the mesh, which are left; ``original``: the mesh's corner of each corner that is left."""
        each = np.repeat(faces, counts) if self.interpolation == "uniform" else corners if self.of_points() else original
        values: Array = self.values[each]
        return values

    @staticmethod
    def checked(reading: Reading, prim: Usd.Prim, name: str, values: Array, interpolation: str) -> Primvar | None:
        """None if there are fewer than the prim needs, which is noted."""
        count = _count(reading, prim, interpolation)
        wanted = len(values) if count is None else count
        if len(values) > wanted:
            text = f"its {name} are {len(values)}, not {wanted} ({interpolation}); the first are used"
            reading.notes.add(f"primvar {name}", prim.GetPath(), text)
        if len(values) < wanted:
            reading.notes.add(f"primvar {name}", prim.GetPath(), f"its {name} are {len(values)}, not {wanted} ({interpolation}); they are left out")
            return None
        if not np.isfinite(values).all():
            reading.notes.add(f"finite {name}", prim.GetPath(), f"its {name} are not all finite; those are 0")
            values = np.nan_to_num(values, posinf=0, neginf=0)
        return Primvar(values[:wanted], interpolation)


def find_primvar(reading: Reading, prim: Usd.Prim, name: str, columns: int) -> Primvar | None:
    """The prim's own, or a constant one of what it lies in. Of more columns the first are taken; one becomes as many as are wanted."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    reading.get(primvar.GetAttr())  # notes what is animated
    try:
        value = primvar.ComputeFlattened(reading.time)
        array = np.asarray(value if value is not None else [], np.float32)
    except (TypeError, ValueError, RuntimeError):
        array = np.zeros(0, np.float32)
    if array.size == 0:
        reading.notes.add(f"primvar {name}", prim.GetPath(), f"its {name} cannot be read; they are left out")
        return None
    own = array.shape[-1] if array.ndim > 1 else 1 if primvar.GetTypeName().isArray else array.size
    array = array.reshape(-1, own)
    if own < columns:
        if own != 1:
            reading.notes.add(f"primvar {name}", prim.GetPath(), f"its {name} have {own} numbers each, not {columns}; they are left out")
            return None
        array = np.repeat(array, columns, 1)
    return Primvar.checked(reading, prim, name, array[:, :columns], str(primvar.GetInterpolation()))


def _count(reading: Reading, prim: Usd.Prim, interpolation: str) -> int | None:
    """How many values there must be; None: any number."""
    if interpolation == "constant":
        return 1
    if prim.IsA(UsdGeom.Mesh):
        mesh = UsdGeom.Mesh(prim)
        attribute = {"uniform": mesh.GetFaceVertexCountsAttr(), "faceVarying": mesh.GetFaceVertexIndicesAttr()}.get(
            interpolation, mesh.GetPointsAttr()
        )
        return len(reading.get(attribute) or [])
    if prim.IsA(UsdGeom.Points):
        return len(reading.get(UsdGeom.Points(prim).GetPointsAttr()) or [])
    if prim.IsA(UsdGeom.BasisCurves) and interpolation in ("uniform", "vertex"):
        curves = UsdGeom.BasisCurves(prim)
        return len(reading.get(curves.GetPointsAttr() if interpolation == "vertex" else curves.GetCurveVertexCountsAttr()) or [])
    return None
