"""Meshes of USD: polygons and subdivision surfaces, one shape for each material."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from .._arrays import Array
from .._polygons import Polygons, smooth_normals, triangulate, unit
from .._shapes import Shapes
from .._subdivision import INFINITE, Sharpness, refine
from .content import Content
from .glow import groups_of
from .materials import Surface
from .primvars import Primvar, find_primvar
from .reading import Reading

_MOST_FACES = 1 << 22  # of one mesh that subdivision makes


@dataclass
class Painter:
    """What shapes need of the rest of the reader: surfaces of prims, pixels of images, and the lights that they are themselves."""

    surface_of: Any
    pixels_of: Any
    light_of: Any


@dataclass
class _Attributes:
    """By name: normals, uvs and colours; each of vertices, [n, k], or of corners, [c, k]."""

    of_vertices: dict[str, Array]
    of_corners: dict[str, Array]


@dataclass
class _Part:
    surface: Surface
    triangles: Array  # corners, [t, 3]


class MeshReader:
    def __init__(self, reading: Reading, painter: Painter) -> None:
        self._reading, self._painter = reading, painter

    def add(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        mesh = UsdGeom.Mesh(prim)
        parts = self._parts_of(mesh)
        outline = self._outline(mesh)
        if outline is None:
            return
        polygons, holes = outline
        primvars = self._primvars(prim, {surface for surface, _ in parts})
        scheme = str(mesh.GetSubdivisionSchemeAttr().Get() or "catmullClark")
        levels = 0 if scheme == "none" else self._levels(prim, len(polygons.counts))
        polygons, attributes = self._shaped(mesh, polygons, primvars, scheme, levels)
        polygons, attributes = _without(holes, polygons, attributes)
        triangles, owners, too_long = triangulate(polygons)
        if too_long:
            self._reading.notes.add("polygon", prim.GetPath(), "a polygon of more than 2000 corners that is not convex is cut into a fan")
        if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
            triangles = triangles[:, [0, 2, 1]]
        label = f"{self._reading.path}: {prim.GetPath()}" + (f" (subdivided {levels} times)" if levels else "")
        faces = polygons.faces[owners]
        for number, (surface, chosen) in enumerate(parts):
            some = triangles if chosen is None else triangles[np.isin(faces, chosen)]
            if len(some):
                name = label if number == 0 else f"{label}, part {number}"
                self._add_part(prim, name, polygons, attributes, primvars, _Part(surface, some), matrix, content)

    def _parts_of(self, mesh: UsdGeom.Mesh) -> list[tuple[Surface, Array | None]]:
        """Surfaces, and the faces of each; None: all that there are. Faces of no subset have what is bound to the mesh."""
        prim = mesh.GetPrim()
        found: list[tuple[Surface, Array | None]] = []
        count = len(self._reading.get(mesh.GetFaceVertexCountsAttr()) or [])
        taken = np.zeros(count, bool)
        for subset in UsdGeom.Subset.GetGeomSubsets(mesh, UsdGeom.Tokens.face, "materialBind"):
            faces = self._reading.numbers(subset.GetPrim(), subset.GetIndicesAttr()).astype(np.int64)
            inside = (faces >= 0) & (faces < count)
            if not inside.all():
                self._reading.notes.add("subset", subset.GetPrim().GetPath(), "names faces that its mesh does not have; they are left out")
            faces = np.unique(faces[inside])
            faces = faces[~taken[faces]]
            taken[faces] = True
            found.append((self._painter.surface_of(subset.GetPrim()), faces))
        if not found:
            return [(self._painter.surface_of(prim), None)]
        if not taken.all():
            found.insert(0, (self._painter.surface_of(prim), np.flatnonzero(~taken)))
        return found

    def _outline(self, mesh: UsdGeom.Mesh) -> tuple[Polygons, Array] | None:
        """The polygons, and the faces that are holes; an error if the file is damaged."""
        prim, reading = mesh.GetPrim(), self._reading
        points = reading.numbers(prim, mesh.GetPointsAttr(), 3)
        counts = reading.numbers(prim, mesh.GetFaceVertexCountsAttr()).astype(np.int64)
        corners = reading.numbers(prim, mesh.GetFaceVertexIndicesAttr()).astype(np.int64)
        if len(counts) == 0 or len(points) == 0:
            reading.notes.add("empty mesh", prim.GetPath(), "has no faces; it is left out")
            return None
        if counts.min() < 0 or counts.sum() != len(corners):
            raise reading.failed(prim, f"its faces have {counts.sum()} corners, but there are {len(corners)}; the file is damaged")
        if len(corners) and (corners.min() < 0 or corners.max() >= len(points)):
            raise reading.failed(prim, f"a face uses point {_outside(corners, len(points))}, but there are {len(points)}; the file is damaged")
        holes = reading.numbers(prim, mesh.GetHoleIndicesAttr()).astype(np.int64)
        polygons = Polygons(counts, corners, points, np.arange(len(corners), dtype=np.int64)[:, None], np.arange(len(counts)))
        if counts.min() < 3:
            reading.notes.add("few corners", prim.GetPath(), "has faces of fewer than three corners; they are left out")
            polygons = polygons.some(counts >= 3)
        finite = np.isfinite(points).min(1)
        if not finite.all():
            reading.notes.add("not finite", prim.GetPath(), "has points that are not finite; faces that use them are left out")
            if len(polygons.counts):
                polygons = polygons.some(np.logical_and.reduceat(finite[polygons.corners], polygons.starts()))
            polygons.vertices = np.where(finite[:, None], points, 0)
        if len(polygons.counts) == 0:
            return None
        return polygons, holes

    def _primvars(self, prim: Usd.Prim, surfaces: set[Surface]) -> dict[str, Primvar]:
        """Coordinates and colours that the surfaces read, by name."""
        names = {s.uvs: 2 for s in surfaces if s.uvs} | {s.colors: 3 for s in surfaces if s.reads_colors}
        if any(s.is_bare for s in surfaces):
            names["displayOpacity"] = 1
        found = {name: find_primvar(self._reading, prim, name, columns) for name, columns in names.items()}
        return {name: primvar for name, primvar in found.items() if primvar is not None}

    def _levels(self, prim: Usd.Prim, faces: int) -> int:
        levels = self._reading.levels
        while levels > 0 and faces * 4**levels > _MOST_FACES:
            levels -= 1
        if levels < self._reading.levels:
            self._reading.notes.add("levels", prim.GetPath(), f"has {faces} faces; it is subdivided {levels} times, not {self._reading.levels}")
        return levels

    def _shaped(self, mesh: UsdGeom.Mesh, polygons: Polygons, primvars: dict[str, Primvar], scheme: str, levels: int) -> tuple[Polygons, _Attributes]:
        """Refined, with all that varies. The values of polygons are the mesh's own corners until then."""
        prim, original = mesh.GetPrim(), polygons.values[:, 0]
        attributes = _Attributes({}, {})
        # What is subdivided is smooth, even where there are too many faces to cut any.
        refines = scheme in ("catmullClark", "loop") or levels > 0
        vertex_columns, corner_columns = [], []
        for name, primvar in primvars.items():
            if primvar.interpolation == "constant":
                continue
            if primvar.interpolation == "vertex" or (primvar.of_points() and not refines):
                vertex_columns.append((name, primvar.values))
            else:
                corner_columns.append((name, primvar.at_corners(polygons.faces, polygons.counts, polygons.corners, original)))
        if not refines:
            attributes.of_vertices.update(vertex_columns)
            attributes.of_corners.update(corner_columns)
            self._add_normals(prim, mesh, polygons, original, attributes)
        else:
            columns = [polygons.vertices, *(values for _, values in vertex_columns)]
            polygons.vertices = np.concatenate(columns, 1, dtype=np.float64)
            polygons.values = np.concatenate([np.zeros((len(original), 0)), *(values for _, values in corner_columns)], 1, dtype=np.float64)
            polygons, sharp = self._refined(mesh, polygons, scheme, levels)
            attributes.of_vertices = _split(polygons.vertices[:, 3:], vertex_columns)
            attributes.of_corners = _split(polygons.values, corner_columns)
            polygons.vertices = polygons.vertices[:, :3]
            flip = -1 if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded else 1
            if scheme != "bilinear":
                of_vertices, of_corners = smooth_normals(polygons, sharp)
                if of_vertices is not None:
                    attributes.of_vertices["normals"] = flip * of_vertices
                if of_corners is not None:
                    attributes.of_corners["normals"] = flip * of_corners
        return polygons, attributes

    def _add_normals(self, prim: Usd.Prim, mesh: UsdGeom.Mesh, polygons: Polygons, original: Array, attributes: _Attributes) -> None:
        normals = find_primvar(self._reading, prim, "normals", 3)
        if normals is None:
            values = self._reading.numbers(prim, mesh.GetNormalsAttr(), 3)
            normals = Primvar.checked(self._reading, prim, "normals", values, str(mesh.GetNormalsInterpolation())) if len(values) else None
        if normals is None or normals.interpolation == "constant":
            return
        if normals.of_points():
            attributes.of_vertices["normals"] = unit(normals.values)
        else:
            attributes.of_corners["normals"] = unit(normals.at_corners(polygons.faces, polygons.counts, polygons.corners, original))

    def _refined(self, mesh: UsdGeom.Mesh, polygons: Polygons, scheme: str, levels: int) -> tuple[Polygons, Array]:
        prim, n = mesh.GetPrim(), len(polygons.vertices)
        if scheme == "loop" and (polygons.counts != 3).any():
            self._reading.notes.add("loop", prim.GetPath(), "Loop's scheme takes triangles alone; its other polygons are cut into them")
            triangles, owners, _ = triangulate(polygons)
            flat = triangles.ravel()
            polygons = Polygons(np.full(len(owners), 3), polygons.corners[flat], polygons.vertices, polygons.values[flat], polygons.faces[owners])
        if scheme not in ("catmullClark", "loop", "bilinear"):
            raise self._reading.failed(prim, f"its subdivisionScheme is {scheme}; catmullClark, loop, bilinear and none can be read")
        boundary = str(mesh.GetInterpolateBoundaryAttr().Get() or "edgeAndCorner")
        if boundary not in ("edgeAndCorner", "edgeOnly", "none"):
            boundary = "edgeAndCorner"
        if mesh.GetTriangleSubdivisionRuleAttr().Get() == "smooth":
            self._reading.notes.add("smooth triangles", prim.GetPath(), "its triangleSubdivisionRule smooth is read as catmullClark")
        return refine(polygons, self._sharpness(mesh, n), levels, scheme, boundary)  # type: ignore[arg-type]

    def _sharpness(self, mesh: UsdGeom.Mesh, n: int) -> Sharpness:
        prim, reading = mesh.GetPrim(), self._reading
        indices = reading.numbers(prim, mesh.GetCreaseIndicesAttr()).astype(np.int64)
        lengths = reading.numbers(prim, mesh.GetCreaseLengthsAttr()).astype(np.int64)
        creases = reading.numbers(prim, mesh.GetCreaseSharpnessesAttr()).astype(np.float64)
        corners = reading.numbers(prim, mesh.GetCornerIndicesAttr()).astype(np.int64)
        corner_sharp = reading.numbers(prim, mesh.GetCornerSharpnessesAttr()).astype(np.float64)
        sharpness = Sharpness(np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(n))
        usable = len(lengths) == 0 or (lengths.min() >= 2 and lengths.sum() == len(indices))
        usable = usable and len(creases) in (len(lengths), int((lengths - 1).sum()))
        usable = usable and (len(indices) == 0 or 0 <= indices.min() <= indices.max() < n)
        if not usable or len(corners) != len(corner_sharp) or (len(corners) and not 0 <= corners.min() <= corners.max() < n):
            reading.notes.add("creases", prim.GetPath(), "its creases or corners do not fit its points; they are left out")
            return sharpness
        if len(lengths):
            ends = np.cumsum(lengths)
            inner = np.ones(len(indices), bool)
            inner[ends - 1] = False
            at = np.flatnonzero(inner)
            sharpness.edges = np.stack([indices[at], indices[at + 1]], 1)
            # One for each crease, or for each of its edges.
            each = np.repeat(creases, lengths - 1) if len(creases) == len(lengths) else creases
            sharpness.creases = np.clip(np.nan_to_num(each), 0, INFINITE)
        np.maximum.at(sharpness.vertices, corners, np.clip(np.nan_to_num(corner_sharp), 0, INFINITE))
        return sharpness

    def _add_part(
        self,
        prim: Usd.Prim,
        label: str,
        polygons: Polygons,
        attributes: _Attributes,
        primvars: dict[str, Primvar],
        part: _Part,
        matrix: Array,
        content: Content,
    ) -> None:
        surface = part.surface
        colors = primvars.get(surface.colors) if surface.reads_colors else None
        varied = colors is not None and colors.interpolation != "constant"
        tint = colors.values[0] if colors is not None and not varied else None
        names = {"normals": "normals"}
        if surface.uvs:
            names["uvs"] = surface.uvs
        if surface.uvs and surface.uvs not in primvars:
            self._reading.notes.add("no uvs", prim.GetPath(), f"has no primvar {surface.uvs}, by which {surface.name} reads textures; it has (0, 0)")
        if varied:
            names["colors"] = surface.colors
        vertices, triangles = _joined(polygons, attributes, names, part.triangles)
        opacity = self._opacity(prim, primvars) if surface.is_bare else 1.0
        lamp = self._painter.light_of(prim)
        two_sided = bool(UsdGeom.Gprim(prim).GetDoubleSidedAttr().Get())
        positions = vertices.pop("positions")
        normals, uvs, vertex_colors = (vertices.get(name) for name in ("normals", "uvs", "colors"))
        if uvs is None and surface.uvs in primvars:  # the same everywhere
            uvs = np.tile(primvars[surface.uvs].values[:1], (len(positions), 1))
        glow = self._glow(prim, surface, uvs, triangles) if lamp is None or lamp.is_tinted else None
        for shine, lit in [(surface.emission, triangles)] if glow is None else [(shine, triangles[chosen]) for shine, chosen in glow]:
            emission = shine if lamp is None else lamp.over(shine, by_image=glow is not None)
            shines = max(emission) > 0
            self._reading.has_light |= max(emission) > 1 or (lamp is not None and shines)
            mirrors = bool(np.linalg.det(matrix[:3, :3]) < 0)
            pieces = [(m, tile, t) for m, whole in _by_handedness(surface, uvs, lit, mirrors) for tile, t in _by_tile(surface, uvs, whole)]
            for mirrored, tile, some in pieces:
                material = surface.material(tint, varied=varied, mirrored=mirrored, opacity=opacity, shines=shines, tile=tile)

                def put(
                    into: Shapes,
                    some: Array = some,
                    material: Any = material,
                    emission: Any = emission if shines else None,
                    turned: bool = shines and two_sided,
                ) -> None:
                    into.mesh(
                        positions,
                        some,
                        normals=normals,
                        uvs=uvs,
                        colors=vertex_colors,
                        material=material,
                        transform=matrix,
                        emission=emission,
                        two_sided=turned,
                    )

                content.add(label, put, positions, matrix)

    def _opacity(self, prim: Usd.Prim, primvars: dict[str, Primvar]) -> float:
        found = primvars.get("displayOpacity")
        if found is None:
            return 1.0
        if found.interpolation != "constant":
            self._reading.notes.add("opacity", prim.GetPath(), "its displayOpacity varies, of which the mean is used")
        return float(np.clip(found.values.mean(), 0, 1))

    def _glow(self, prim: Usd.Prim, surface: Surface, uvs: Array | None, triangles: Array) -> list[tuple[tuple[float, float, float], Array]] | None:
        """Of what shines by an image: groups of triangles that shine about alike."""
        if surface.glow is None:
            return None
        pixels = self._painter.pixels_of(surface.glow.image, prim)
        if pixels is None or uvs is None:
            return None
        self._reading.notes.add(
            "emission", prim.GetPath(), "shines by an image, which lights have not: each triangle shines evenly, in about the mean colour there"
        )
        return groups_of(surface.glow, pixels, uvs, triangles)


def _outside(indices: Array, n: int) -> int:
    return int(indices[(indices < 0) | (indices >= n)][0])


def _split(columns: Array, names: list[tuple[str, Array]]) -> dict[str, Array]:
    ends = np.cumsum([values.shape[1] for _, values in names])
    return {name: columns[:, end - values.shape[1] : end] for (name, values), end in zip(names, ends, strict=True)}


def _without(holes: Array, polygons: Polygons, attributes: _Attributes) -> tuple[Polygons, _Attributes]:
    if len(holes) == 0:
        return polygons, attributes
    chosen = ~np.isin(polygons.faces, holes)
    corners = np.repeat(chosen, polygons.counts)
    return polygons.some(chosen), _Attributes(attributes.of_vertices, {name: values[corners] for name, values in attributes.of_corners.items()})


def _joined(polygons: Polygons, attributes: _Attributes, names: dict[str, str], triangles: Array) -> tuple[dict[str, Array], Array]:
    """Arrays of vertices, and triangles of these, [t, 3] uint32: corners that have all in common are one vertex."""
    of_corners = {to: attributes.of_corners[name] for to, name in names.items() if name in attributes.of_corners}
    of_vertices = {to: attributes.of_vertices[name] for to, name in names.items() if name in attributes.of_vertices}
    corners = polygons.corners
    if not of_corners:
        indices = corners[triangles]
        whole = {"positions": polygons.vertices, **of_vertices}
        if len(triangles) * 2 > len(polygons.vertices):
            return {name: np.ascontiguousarray(values, np.float32) for name, values in whole.items()}, indices.astype(np.uint32)
        used, indices = np.unique(indices, return_inverse=True)
        return {name: values[used].astype(np.float32) for name, values in whole.items()}, indices.reshape(-1, 3).astype(np.uint32)
    used, indices = np.unique(triangles, return_inverse=True)
    parts = [np.ascontiguousarray(values[used], np.float32) for values in of_corners.values()]
    rows = np.concatenate([corners[used, None].astype(np.uint32), *(values.view(np.uint32) for values in parts)], 1)
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    _, first, of = np.unique(keys, return_index=True, return_inverse=True)
    chosen = used[first]
    arrays = {"positions": polygons.vertices[corners[chosen]]}
    arrays |= {name: values[corners[chosen]] for name, values in of_vertices.items()}
    arrays |= {name: values[chosen] for name, values in of_corners.items()}
    joined = of.reshape(-1)[indices.reshape(-1)].reshape(-1, 3)
    return {name: values.astype(np.float32) for name, values in arrays.items()}, joined.astype(np.uint32)


def _by_handedness(surface: Surface, uvs: Array | None, triangles: Array, mirrors: bool) -> list[tuple[bool, Array]]:
    """For normal maps: triangles on which u and v are mirrored, and others."""
    if not surface.has_normal_map or uvs is None:
        return [(False, triangles)]
    a, b, c = (uvs[triangles[:, k]].astype(np.float64) for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    turned = (area < 0) != mirrors
    return [(bool(side), triangles[turned == side]) for side in (False, True) if (turned == side).any()]


def _by_tile(surface: Surface, uvs: Array | None, triangles: Array) -> list[tuple[int | None, Array]]:
    """For images in tiles (UDIM): triangles by the tile in which their middle is, once coordinates are moved."""
    if not surface.is_tiled or uvs is None:
        return [(None, triangles)]
    middles = uvs[triangles].mean(1).astype(np.float64) @ surface.tile_matrix[:2, :2].T + surface.tile_matrix[:2, 2]
    column, row = np.floor(np.clip(np.nan_to_num(middles), -1, 1e4)).astype(np.int64).T
    number = np.where((column >= 0) & (column < 10) & (row >= 0), 1001 + column + 10 * row, 0)
    return [(int(tile), triangles[number == tile]) for tile in np.unique(number)]
