"""Shapes of USD that are no meshes: spheres and other round ones, clouds, and curves as tubes."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from .._arrays import Array
from .._shapes import Shapes
from . import round as round_shapes
from .content import Content, is_similarity
from .materials import Surface
from .mesh import Painter
from .primvars import find_primvar
from .reading import Reading
from .round import Tessellation
from .tubes import BASES, tubes

_MOST_TUBES = 1 << 24  # triangles of one prim


class GprimReader:
    def __init__(self, reading: Reading, painter: Painter) -> None:
        self._reading, self._painter = reading, painter

    def add(self, prim: Usd.Prim, matrix: Array, content: Content) -> bool:
        """False: it is none of these."""
        if prim.IsA(UsdGeom.Sphere):
            self._add_sphere(prim, matrix, content)
        elif prim.IsA(UsdGeom.Points):
            self._add_points(prim, matrix, content)
        elif prim.IsA(UsdGeom.BasisCurves):
            self._add_curves(prim, matrix, content)
        else:
            made = self._tessellated(prim)
            if made is None:
                return False
            shape, axis = made
            self._add_mesh(prim, shape, matrix @ round_shapes.along(axis), content)
        return True

    def _number(self, prim: Usd.Prim, name: str) -> float:
        value = self._reading.get(prim.GetAttribute(name))
        if value is None or not 0 <= value < 1e30:
            raise self._reading.failed(prim, f"its {name} is {value}; a number of 0 or more is expected")
        return float(value)

    def _tessellated(self, prim: Usd.Prim) -> tuple[Tessellation, str] | None:
        kind = prim.GetTypeName()

        def number(name: str) -> float:
            return self._number(prim, name)

        axis = str(prim.GetAttribute("axis").Get() or "Z") if prim.HasAttribute("axis") else "Z"
        if kind == "Cube":
            return round_shapes.cube(number("size")), "Z"
        if kind == "Plane":
            # Its width is along x, or z where that is the axis.
            sides = number("width"), number("length")
            return round_shapes.plane(*(sides if axis == "Z" else sides[::-1])), axis
        if kind == "Cylinder":
            return round_shapes.cylinder(number("radius"), number("radius"), number("height")), axis
        if kind == "Cylinder_1":
            return round_shapes.cylinder(number("radiusBottom"), number("radiusTop"), number("height")), axis
        if kind == "Cone":
            return round_shapes.cylinder(number("radius"), 0, number("height")), axis
        if kind == "Capsule":
            return round_shapes.capsule(number("radius"), number("radius"), number("height")), axis
        if kind == "Capsule_1":
            return round_shapes.capsule(number("radiusBottom"), number("radiusTop"), number("height")), axis
        return None

    def _look(self, prim: Usd.Prim, has_uvs: bool, *, has_colors: bool = False, varied: bool = False) -> tuple[Surface, Any, Any, bool]:
        """The surface, its material, what it shines with, and whether it does so on both sides.
        ``has_colors``: of points; ``varied``: of vertices; else it has one, the mean.
        """
        surface = self._painter.surface_of(prim)
        tint = None
        if not varied and surface.reads_colors and (colors := find_primvar(self._reading, prim, surface.colors, 3)):
            tint = colors.values.mean(0)
            if not has_colors and np.ptp(colors.values, axis=0).any():
                self._reading.notes.add("round colours", prim.GetPath(), f"its {surface.colors} varies, of which the mean is used")
        opacity = 1.0
        if surface.is_bare and (found := find_primvar(self._reading, prim, "displayOpacity", 1)):
            opacity = float(np.clip(found.values.mean(), 0, 1))
            if np.ptp(found.values):
                self._reading.notes.add("opacity", prim.GetPath(), "its displayOpacity varies, of which the mean is used")
        flat = surface.uvs is not None and not has_uvs
        if flat:
            text = f"shapes of its kind have no coordinates of textures here; those of {surface.name} are their means"
            self._reading.notes.add("round textures", prim.GetPath(), text)
        if surface.glow is not None:
            self._reading.notes.add("round glow", prim.GetPath(), "shines by an image, which only meshes can; it does not shine")
        emission, lamp = surface.emission, self._painter.light_of(prim)
        if lamp is not None:
            emission = lamp.over(emission)
        shines = max(emission) > 0
        self._reading.has_light |= max(emission) > 1 or (lamp is not None and shines)
        two_sided = shines and bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get())
        return surface, surface.material(tint, varied=varied, opacity=opacity, shines=shines, flat=flat), emission if shines else None, two_sided

    def _widths(self, prim: Usd.Prim, shape: UsdGeom.Points | UsdGeom.Curves) -> Array:
        """[n]; primvars:widths counts before widths."""
        primvar = find_primvar(self._reading, prim, "widths", 1)
        widths = self._reading.numbers(prim, shape.GetWidthsAttr()) if primvar is None else primvar.values[:, 0]
        if primvar is None and shape.GetWidthsInterpolation() == UsdGeom.Tokens.constant:
            widths = widths[:1]
        return np.clip(np.nan_to_num(widths.astype(np.float64)), 0, 1e30)

    def _label(self, prim: Usd.Prim) -> str:
        return f"{self._reading.path}: {prim.GetPath()}"

    def _add_mesh(self, prim: Usd.Prim, shape: Tessellation, matrix: Array, content: Content, colors: Array | None = None) -> None:
        if len(shape.triangles) == 0:
            return
        surface, material, emission, two_sided = self._look(prim, shape.uvs is not None, varied=colors is not None)
        uvs = shape.uvs if surface.uvs else None
        flip = UsdGeom.Gprim(prim).GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded

        def put(into: Shapes) -> None:
            into.mesh(
                shape.positions.astype(np.float32),
                shape.triangles.astype(np.uint32),
                normals=shape.normals,
                uvs=uvs,
                colors=colors,
                material=material,
                transform=matrix,
                emission=emission,
                two_sided=two_sided,
                flip=flip,
            )

        content.add(self._label(prim), put, shape.positions, matrix)

    def _add_sphere(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        radius = self._number(prim, "radius")
        surface, material, emission, _ = self._look(prim, has_uvs=True)
        if radius == 0:
            return
        # Those that shine must not be stretched by instances either.
        if not is_similarity(matrix) or surface.uvs or (content.in_object and emission is not None):
            self._add_mesh(prim, round_shapes.sphere(radius), matrix, content)
            return

        def put(into: Shapes) -> None:
            into.sphere(radius=radius, material=material, transform=matrix, emission=emission)

        corners = radius * np.array([[i >> a & 1 for a in range(3)] for i in range(8)]) * 2 - radius
        content.add(self._label(prim), put, corners, matrix)

    def _add_points(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        cloud = UsdGeom.Points(prim)
        positions = self._reading.numbers(prim, cloud.GetPointsAttr(), 3).astype(np.float32, copy=False)
        if len(positions) == 0:
            return
        widths = self._widths(prim, cloud).astype(np.float32)
        radius = None
        if len(widths) == len(positions):
            radius = widths / 2
        elif len(widths) >= 1:
            radius = np.full(len(positions), widths[0] / 2, np.float32)
        surface, material, emission, _ = self._look(prim, has_uvs=False, has_colors=True)
        primvar = find_primvar(self._reading, prim, surface.colors, 3) if surface.reads_colors else None
        colors = np.clip(primvar.values, 0, 1) if primvar is not None and primvar.interpolation != "constant" else None
        if colors is not None and len(colors) != len(positions):
            colors = None
        if emission is not None and content.in_object:
            self._reading.notes.add("points shine", prim.GetPath(), "points that shine in what instances place do not")
            emission = None

        def put(into: Shapes) -> None:
            into.points(positions, radius=radius, colors=colors, material=material, transform=matrix, emission=emission)

        content.add(self._label(prim), put, positions, matrix)

    def _add_curves(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        curves, reading = UsdGeom.BasisCurves(prim), self._reading
        points = reading.numbers(prim, curves.GetPointsAttr(), 3).astype(np.float64)
        counts = reading.numbers(prim, curves.GetCurveVertexCountsAttr()).astype(np.int64)
        if len(counts) == 0 or len(points) == 0:
            return
        if counts.min() < 0 or counts.sum() != len(points):
            raise reading.failed(prim, f"its curves have {counts.sum()} points, but there are {len(points)}; the file is damaged")
        widths = self._widths(prim, curves)
        if len(widths) == 0:
            reading.notes.add("curve width", prim.GetPath(), "its curves have no widths; they are left out")
            return
        if str(curves.GetTypeAttr().Get()) == "cubic":
            basis = str(curves.GetBasisAttr().Get() or "bezier")
        else:
            basis = "linear"
        if basis not in BASES:
            reading.notes.add("curve basis", prim.GetPath(), f"curves of the basis {basis} are not read; they are left out")
            return
        wrap = str(curves.GetWrapAttr().Get() or "nonperiodic")
        made = tubes(points, counts, widths, basis, wrap, _MOST_TUBES)
        if made is None:
            reading.notes.add("curves", prim.GetPath(), "its curves would be more than 16 million triangles; they are left out")
            return
        shape, owners = made
        colors = self._colors_of_curves(prim, counts)
        self._add_mesh(prim, shape, matrix, content, None if colors is None else colors[owners])

    def _colors_of_curves(self, prim: Usd.Prim, counts: Array) -> Array | None:
        """[n, 3], one for each curve; None: all have one."""
        surface = self._painter.surface_of(prim)
        found = find_primvar(self._reading, prim, surface.colors, 3) if surface.reads_colors else None
        if found is None or found.interpolation not in ("uniform", "vertex"):
            return None
        if found.interpolation == "uniform":
            return np.clip(found.values, 0, 1)
        self._reading.notes.add("round colours", prim.GetPath(), f"its {surface.colors} varies along curves, each of which has the mean")
        sums = np.concatenate([np.zeros((1, 3)), np.cumsum(found.values, 0, np.float64)])
        ends = np.cumsum(counts)
        means: Array = (sums[ends] - sums[ends - counts]) / np.maximum(counts, 1)[:, None]
        return np.clip(means, 0, 1).astype(np.float32)
