"""Shapes, and where they are put."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from . import _raypager
from ._arrays import Array, ArrayLike, Color, Vector, color, floats, indices, is_chunks, matrix, number, packed_colors, vector, whole
from ._errors import usage
from ._materials import Material

if TYPE_CHECKING:
    from ._scene import Scene

Chunk: TypeAlias = "Array | tuple[Any, ...] | dict[str, Any]"
Chunks: TypeAlias = "Iterable[Chunk] | Callable[[], Iterable[Chunk]]"


class Watch:
    """What a bake and the chunks that it reads tell each other."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self.faults: list[Exception] = []
        self.stopped = False

    def stop(self) -> None:
        self.stopped = True


class Shapes:
    """What a scene and an object share: shapes that are put into them."""

    _scene: Scene
    _where: int | None  # the object; None: the world
    _name: str

    def _shape(
        self, kind: str, material: Material | None, transform: ArrayLike | None, emission: Color | None, power: float, two_sided: bool
    ) -> _raypager.Shape:
        shape = _raypager.Shape()
        self._scene._count += 1
        shape.name = self._scene._label or f"{self._name}: {kind} {self._scene._count}"
        shape.to_world = matrix(transform, f"{kind}: transform")
        shape.material = self._scene._material(material or self._scene._default)
        if emission is not None:
            radiance = color(emission, f"{kind}: emission")
            shape.area_light = self._scene._core.add_area_light(radiance, two_sided, number(power, 0, 1e30, f"{kind}: power"))
        elif power or two_sided:
            raise usage(f"{kind}: power and two_sided are of shapes that shine; give emission, too")
        self._scene._changed()
        return shape

    def mesh(
        self,
        positions: ArrayLike,
        triangles: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        uvs: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        material: Material | None = None,
        transform: ArrayLike | None = None,
        emission: Color | None = None,
        power: float = 0,
        two_sided: bool = False,
        flip: bool = False,
        backdrop: bool = False,
    ) -> None:
        """Triangles.

        ``positions``: [n, 3] float32. ``triangles``: [m, 3] uint32, indices into them, counter-clockwise seen from outside.
        ``normals``: [n, 3] float32. ``uvs``: [n, 2] float32, coordinates of textures, v upwards.
        ``colors``: [n, 3], uint8 (sRGB) or floats (linear): in place of the colour of a diffuse material.
        ``transform``: [4, 4] or [3, 4] to the world, or to the object's space. ``flip``: turns the inside out.
        ``emission``: radiance that it shines with, on the outside or on both sides. ``power``: each triangle emits so much; emission is its colour.
        ``backdrop``: such as a ground; its bounds do not count as those of what the scene shows. It must come last.

        Arrays of these types in C order are not copied: they are read while the scene is baked, and must stay as they are until then. Others are
        converted. Triangles that no ray can hit are dropped, with a warning of the bake.
        """
        points = floats(positions, (None, 3), "mesh: positions")
        n = len(points)
        faces = indices(triangles, (None, 3), "mesh: triangles")
        shape = self._shape("mesh", material, transform, emission, power, two_sided)
        shape.reverse_orientation = flip
        shape.backdrop = backdrop
        self._scene._core.add_mesh(
            self._where,
            shape,
            points,
            faces,
            None if normals is None else floats(normals, (n, 3), "mesh: normals"),
            None if uvs is None else floats(uvs, (n, 2), "mesh: uvs"),
            None if colors is None else packed_colors(colors, n, "mesh: colors"),
            self._scene._take_files(),
        )

    def sphere(
        self,
        center: Vector = (0, 0, 0),
        radius: float = 1,
        *,
        material: Material | None = None,
        transform: ArrayLike | None = None,
        emission: Color | None = None,
        power: float = 0,
        flip: bool = False,
    ) -> None:
        """A sphere. A transform that stretches it makes it an error of the bake."""
        place, r = vector(center, "sphere: center"), number(radius, 1e-30, 1e30, "sphere: radius")
        shape = self._shape("sphere", material, transform, emission, power, False)
        shape.reverse_orientation = flip
        self._scene._core.add_sphere(self._where, shape, place, r)

    def points(
        self,
        positions: ArrayLike | Chunks,
        *,
        radius: float | ArrayLike | None = None,
        colors: ArrayLike | None = None,
        count: int | None = None,
        colored: bool | None = None,
        material: Material | None = None,
        transform: ArrayLike | None = None,
        radius_scale: float = 1,
        emission: Color | None = None,
        power: float = 0,
    ) -> None:
        """A cloud: every point a small ball.

        ``positions``: [n, 3] float32. ``colors``: [n, 3], uint8 (sRGB) or floats (linear).
        ``radius``: one for all, in the world; or [n] float32, each its own; ``None``: from the spacing of the points around each.

        Or ``positions`` are chunks: an iterable that can be gone through more than once, such as a list-like object that reads files, or a function
        that returns a new iterator each time, such as a generator function. A chunk is an array of positions, a tuple (positions, colors) or
        (positions, colors, radius), or a dictionary of these. Chunks are gone through when the scene is baked, more than once if it is large,
        and only one of them is in memory at a time. They must be the same each time. ``count``, how many points there are in all, and
        ``colored``, whether chunks have colours, save going through them once more to find out. The GIL is taken only while a chunk is fetched.
        """
        shape = self._shape("points", material, transform, emission, power, False)
        shape.radius_scale = number(radius_scale, 1e-30, 1e30, "points: radius_scale")
        each: ArrayLike | None = None
        if radius is not None and np.ndim(radius) == 0:
            shape.point_radius = number(radius, 1e-30, 1e30, "points: radius")  # type: ignore[arg-type]
        else:
            each = radius
        if is_chunks(positions):
            if colors is not None or each is not None:
                raise usage("points: with chunks, colours and radii come in them: yield (positions, colors, radius)")
            self._chunks(shape, positions, count, colored)  # type: ignore[arg-type]
            return
        rows = floats(positions, (None, 3), "points: positions")  # type: ignore[arg-type]
        n = len(rows)
        radii = None if each is None else floats(each, (n,), "points: radius")
        packed = None if colors is None else packed_colors(colors, n, "points: colors")
        self._scene._core.add_points(self._where, shape, rows, radii, packed, self._scene._take_files())

    def _chunks(self, shape: _raypager.Shape, source: Chunks, count: int | None, colored: bool | None) -> None:
        again: Callable[[], Iterable[Chunk]] = source if callable(source) else lambda: iter(source)
        if not callable(source) and iter(source) is source:
            raise usage("points: an iterator can be gone through only once; give the function that makes it, or something that can be iterated again")
        watch = self._scene._watch  # not the scene itself: it would keep itself alive, by way of the engine

        def columns() -> Iterator[tuple[Array, Array | None, Array | None]]:
            try:
                for chunk in again():
                    if watch.stopped:
                        raise InterruptedError("the bake was stopped")
                    yield _columns(chunk)
            except Exception as error:
                watch.faults.append(error)
                raise

        if count is None or colored is None:
            count, colored = 0, False
            for positions, _, packed in columns():
                count += len(positions)
                colored = colored or packed is not None
        whole(count, 0, 2**40, "points: count")
        self._scene._core.add_chunks(self._where, shape, columns, count, colored)

    def instances(
        self,
        object: Object,
        transforms: ArrayLike,
        *,
        materials: Material | Sequence[Material | None] | None = None,
        material_ids: ArrayLike | None = None,
        colors: ArrayLike | None = None,
    ) -> None:
        """Puts an object in many places, which share its geometry.

        ``transforms``: [n, 3, 4] float64, rows of affine transforms from the object's space. Not copied if they are of this type.
        ``materials``: in place of those of all its shapes: one for all, or one each, or some, of which ``material_ids``, [n] uint32, chooses.
        ``colors``: [n, 3] float32, linear, 0 to 1: diffuse colours are multiplied by them.
        """
        if object._scene is not self._scene:
            raise usage("instances: the object is one of another scene")
        assert object._where is not None
        places = floats(transforms, (None, 3, 4), "instances: transforms", np.float64)
        n = len(places)
        ids = self._ids(materials, material_ids, n)
        tints = None if colors is None else floats(colors, (n, 3), "instances: colors")
        self._scene._core.add_instances(self._where, object._where, f"{object._name} (instances)", places, ids, tints)
        self._scene._changed()

    def _ids(self, materials: Material | Sequence[Material | None] | None, chosen: ArrayLike | None, n: int) -> Array | None:
        if materials is None:
            if chosen is not None:
                raise usage("instances: material_ids choose among materials; give these, too")
            return None
        some = [materials] if isinstance(materials, Material) else list(materials)
        numbers = np.array([_raypager.NOTHING if m is None else self._scene._material(m) for m in some], np.uint32)
        if chosen is None:
            if len(numbers) not in (1, n):
                raise usage(f"instances: {len(numbers)} materials for {n} instances; give one, {n}, or material_ids")
            return numbers
        ids = indices(chosen, (n,), "instances: material_ids")
        if n and ids.max() >= len(numbers):
            raise usage(f"instances: material_ids choose number {ids.max()} of {len(numbers)} materials")
        return np.ascontiguousarray(numbers[ids])


def _columns(chunk: Chunk) -> tuple[Array, Array | None, Array | None]:
    """Positions, radii and colours, as the engine takes them."""
    if isinstance(chunk, dict):
        unknown = set(chunk) - {"positions", "colors", "radius"}
        if unknown or "positions" not in chunk:
            raise usage(f"points: a chunk has positions, colors and radius, not {', '.join(sorted(map(str, chunk)))}")
        positions, colors, radius = chunk["positions"], chunk.get("colors"), chunk.get("radius")
    elif isinstance(chunk, tuple):
        if not 1 <= len(chunk) <= 3:
            raise usage("points: a chunk is (positions, colors, radius), or less of it")
        positions, colors, radius = (*chunk, None, None)[:3]
    else:
        positions, colors, radius = chunk, None, None
    rows = floats(positions, (None, 3), "points: positions of a chunk")
    packed = None if colors is None else packed_colors(colors, len(rows), "points: colors of a chunk")
    radii = None if radius is None else floats(radius, (len(rows),), "points: radius of a chunk")
    return rows, radii, packed


class Object(Shapes):
    """Shapes that instances put into the world, or into other objects; made by :meth:`Scene.object`."""

    def __init__(self, scene: Scene, where: int, name: str) -> None:
        self._scene, self._where, self._name = scene, where, name
