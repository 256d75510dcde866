"""Scenes: loaded from files, or built from numpy arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, Unpack

import numpy as np

from . import _raypager
from ._arrays import Array, ArrayLike, Color, Vector, color, floats, indices, is_chunks, matrix, number, packed_colors, vector, whole
from ._errors import RaypagerWarning, usage
from ._materials import Image, Material, clay

if TYPE_CHECKING:
    from ._blocks import Blocks
    from ._options import BakeOptions, RenderOptions
    from ._raypager import Progress
    from ._render import Picture

Chunk: TypeAlias = "Array | tuple[Any, ...] | dict[str, Any]"
Chunks: TypeAlias = "Iterable[Chunk] | Callable[[], Iterable[Chunk]]"

_PROJECTIONS = {"perspective": 0, "orthographic": 1, "equirectangular": 2, "equal-area": 3}


class _Watch:
    """What a bake and the chunks that it reads tell each other."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self.faults: list[Exception] = []
        self.stopped = False

    def stop(self) -> None:
        self.stopped = True


class _Shapes:
    """What a scene and an object share: shapes that are put into them."""

    _scene: Scene
    _where: int | None  # the object; None: the world
    _name: str

    def _shape(
        self, kind: str, material: Material | None, transform: ArrayLike | None, emission: Color | None, power: float, two_sided: bool
    ) -> _raypager.Shape:
        shape = _raypager.Shape()
        self._scene._count += 1
        shape.name = f"{self._name}: {kind} {self._scene._count}"
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
        (positions, colors, radius), or a dictionary of these. Chunks are gone through when the scene is baked, more than once if it is large, and only
        one of them is in memory at a time. They must be the same each time. ``count``, how many points there are in all, and ``colored``, whether
        chunks have colours, save going through them once more to find out. The GIL is taken only while a chunk is fetched.
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
        self._scene._core.add_points(self._where, shape, rows, radii, packed)

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


class Object(_Shapes):
    """Shapes that instances put into the world, or into other objects; made by :meth:`Scene.object`."""

    def __init__(self, scene: Scene, where: int, name: str) -> None:
        self._scene, self._where, self._name = scene, where, name


class Scene(_Shapes):
    """What there is to see: shapes, lights, and a camera. Empty at first.

    ``width``, ``height``: of the picture, in pixels. ``spp``: samples per pixel. ``max_depth``: scattering events of a path. Renders may say otherwise.
    """

    def __init__(self, *, width: int = 1280, height: int = 720, spp: int = 64, max_depth: int = 5) -> None:
        self._core = _raypager.Scene()
        self._core.width = whole(width, 1, 65535, "scene: width")
        self._core.height = whole(height, 1, 65535, "scene: height")
        self._core.spp = whole(spp, 1, 65535, "scene: spp")
        self._core.max_depth = whole(max_depth, 0, 60000, "scene: max_depth")
        self._prepare("scene")

    def _prepare(self, name: str) -> None:
        self._scene, self._where, self._name, self._count = self, None, name, 0
        self._numbers: dict[int, tuple[Material, int]] = {}
        self._watch = _Watch()
        self._default = clay()
        self._baked: Blocks | None = None

    @classmethod
    def _loaded(cls, core: _raypager.Scene, name: str) -> Scene:
        scene = cls.__new__(cls)
        scene._core = core
        scene._prepare(name)
        return scene

    def _changed(self) -> None:
        self._baked = None

    def _material(self, material: Material) -> int:
        if not isinstance(material, Material):
            raise usage(f"material: one of raypager's is expected, such as raypager.diffuse(), not {material!r}")
        if id(material) in self._numbers:
            return self._numbers[id(material)][1]
        core = material._core
        if core is None:
            assert material._parts is not None
            first, second, amount = material._parts
            core = _raypager.mix(_raypager.NOTHING if first is None else self._material(first), self._material(second), amount)
        images = [_raypager.ImageParameter(parameter, image._core, (1, 1, 1), image.repeat) for parameter, image in material._images]
        number_of = self._core.add_material(core, images)
        self._numbers[id(material)] = (material, number_of)  # the material is kept, so that its id stays its own
        return number_of

    @property
    def warnings(self) -> list[str]:
        """What was read but could not be used, one line each."""
        return list(self._core.warnings)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, in pixels."""
        return self._core.width, self._core.height

    def object(self, name: str = "object") -> Object:
        """A new object, which is seen where :meth:`instances` put it."""
        self._changed()
        return Object(self, self._core.add_object(name), name)

    # Lights

    def point_light(self, position: Vector, intensity: Color) -> None:
        """``intensity``: what a surface that faces it gets at distance 1."""
        self._light(_raypager.point_light(vector(position, "point_light: position"), color(intensity, "point_light: intensity")))

    def spot_light(self, position: Vector, target: Vector, intensity: Color, *, angle: float = 30, full_angle: float | None = None) -> None:
        """Shines towards ``target`` within ``full_angle`` degrees of the axis, by default five sixths of ``angle``, where light ends."""
        place, aim = vector(position, "spot_light: position"), vector(target, "spot_light: target")
        axis = tuple(b - a for a, b in zip(place, aim))
        if not any(axis):
            raise usage("spot_light: position and target must be different points")
        end = number(angle, 1e-3, 180, "spot_light: angle")
        full = end * 5 / 6 if full_angle is None else number(full_angle, 0, end, "spot_light: full_angle")
        self._light(_raypager.spot_light(place, axis, color(intensity, "spot_light: intensity"), end, full))

    def distant_light(self, direction: Vector, irradiance: Color) -> None:
        """Such as the sun. ``direction``: in which its light goes. ``irradiance``: on a surface that faces it."""
        towards = tuple(-v for v in vector(direction, "distant_light: direction"))
        if not any(towards):
            raise usage("distant_light: direction must not be zero")
        self._light(_raypager.distant_light(towards, color(irradiance, "distant_light: irradiance")))

    def infinite_light(self, radiance: Color) -> None:
        """The same light from all around. A scene has one, or a :meth:`sky`."""
        self._light(_raypager.infinite_light(color(radiance, "infinite_light: radiance")))

    def _light(self, light: _raypager.Light) -> None:
        self._core.add_light(light)
        self._changed()

    def sky(self, image: ArrayLike, *, axes: ArrayLike | None = None) -> None:
        """Light from all around that differs by direction.

        ``image``: [height, width, 3] float32, linear, rows from the top. Twice as wide as high, it is the map of a globe: from +z at the top to -z,
        and from +x by way of +y. Square, it is in the equal-area mapping of pbrt-v4. ``axes``: [3, 3], the image's x, y and z axis in the world.
        """
        pixels = floats(image, (None, None, 3), "sky: image")
        height, width = pixels.shape[:2]
        if height == 0 or width not in (height, 2 * height):
            raise usage(f"sky: an image that is square, or twice as wide as high, is expected, not one of {width} x {height} pixels")
        if not np.isfinite(pixels).all() or pixels.min() < 0:
            raise usage("sky: all values must be finite and 0 or more")
        frame = np.eye(3) if axes is None else floats(axes, (3, 3), "sky: axes", np.float64)
        self._core.set_sky(pixels, frame.tolist(), width == 2 * height)
        self._changed()

    # Camera

    def camera(
        self,
        eye: Vector,
        target: Vector,
        up: Vector = (0, 1, 0),
        *,
        fov: float = 45,
        projection: Literal["perspective", "orthographic", "equirectangular", "equal-area"] = "perspective",
        height: float | None = None,
        lens_radius: float = 0,
        focus: float | None = None,
        mirrored: bool = False,
    ) -> None:
        """Looks from ``eye`` towards ``target``.

        ``fov``: of the picture's shorter side, in degrees. ``height``: of what an orthographic camera sees. ``lens_radius``: of a thin lens; 0: all is
        in focus. ``focus``: the distance at which it is, by default that of the target. ``mirrored``: left and right are exchanged, as in most pbrt scenes.
        """
        self._core.camera = look_at(
            eye, target, up, size=self.size, fov=fov, projection=projection, height=height, lens_radius=lens_radius, focus=focus, mirrored=mirrored
        )
        self._changed()

    look_at = camera

    def bake(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        progress: Callable[[str, float], Any] | None = None,
        **options: Unpack[BakeOptions],
    ) -> Blocks:
        """Cuts it into blocks, in memory, or in the block file ``path``; see :func:`raypager.bake`."""
        from ._blocks import bake

        return bake(self, path, progress=progress, **options)

    def render(self, *, progress: Callable[[Progress], Any] | None = None, **options: Unpack[RenderOptions]) -> Picture:
        """Bakes it in memory, once, and renders it; see :func:`raypager.render`."""
        from ._render import render

        return render(self, progress=progress, **options)


def look_at(
    eye: Vector,
    target: Vector,
    up: Vector = (0, 1, 0),
    *,
    size: tuple[int, int],
    fov: float = 45,
    projection: Literal["perspective", "orthographic", "equirectangular", "equal-area"] = "perspective",
    height: float | None = None,
    lens_radius: float = 0,
    focus: float | None = None,
    mirrored: bool = False,
) -> _raypager.Camera:
    """A camera for pictures of this size, for :func:`render`; its arguments are those of :meth:`Scene.camera`."""
    if projection not in _PROJECTIONS:
        raise usage(f"camera: '{projection}' is not a projection; use {', '.join(_PROJECTIONS)}")
    place, aim, upright = vector(eye, "camera: eye"), vector(target, "camera: target"), vector(up, "camera: up")
    angle = number(fov, 1e-3, 179.9, "camera: fov") if projection == "perspective" else 90
    camera = _raypager.make_camera(place, aim, upright, angle, size[0], size[1], mirrored)
    distance = float(np.linalg.norm(np.subtract(aim, place)))
    forward = np.array(camera.forward) / np.linalg.norm(camera.forward)
    if projection == "orthographic":
        if height is None:
            raise usage("camera: an orthographic one needs the height of what it sees")
        half = number(height, 1e-30, 1e30, "camera: height") / 2
        camera.right = (np.array(camera.right) / np.linalg.norm(camera.right) * half * size[0] / size[1]).tolist()
        camera.up = (np.array(camera.up) / np.linalg.norm(camera.up) * half).tolist()
        camera.forward = forward.tolist()
    elif projection != "perspective":
        camera.right = (np.array(camera.right) / np.linalg.norm(camera.right)).tolist()
        camera.up = (np.array(camera.up) / np.linalg.norm(camera.up)).tolist()
        camera.forward = forward.tolist()
    camera.projection = _PROJECTIONS[projection]
    if lens_radius:
        camera.lens_radius = number(lens_radius, 0, 1e30, "camera: lens_radius")
        ahead = distance if focus is None else number(focus, 1e-30, 1e30, "camera: focus")
        camera.focal_distance = ahead / float(np.linalg.norm(camera.forward))
    return camera


def load(
    *paths: str | os.PathLike[str],
    material: Material | None = None,
    sky: Color | None = None,
    light: Literal["none", "key", "sun"] | None = None,
    light_strength: float = 1,
    sun: tuple[float, float] | None = None,
    ground: bool = True,
    size: tuple[int, int] | None = None,
    columns: str = "",
    host_limit: int | str | None = None,
) -> Scene:
    """Reads one pbrt scene, or any number of meshes and point clouds, which are framed, lit and given a ground together.

    Of meshes and clouds: ``material``, what they are made of, by default what the files say. ``sky``: radiance from all around. ``light``: a square at
    the viewer's left (key), the sun, or none; ``light_strength``: 1 is as usual. ``sun``: its azimuth and elevation in degrees. ``ground``: whether they
    stand on one. ``size``: of the picture that is framed. ``columns``: of text clouds, such as ``"x,y,z,i,r,g,b"``.

    Meshes and clouds are read when the scene is baked. What could not be used is warned of, and in :attr:`Scene.warnings`.
    """
    from ._sizes import size as bytes_of

    if not paths:
        raise usage("load: name a file, or several")
    look = _raypager.BareLook()
    if material is not None:
        if material._core is None or material._images:
            raise usage("load: a material with images, or a mix, cannot be given to what files say; build the scene from arrays")
        look.material = material._core
    if sky is not None:
        look.sky = color(sky, "load: sky")
    if light is not None and light not in ("none", "key", "sun"):
        raise usage(f"load: '{light}' is not a light; use none, key or sun")
    if light is not None or sun is not None or light_strength != 1:
        place = None if sun is None else (number(sun[0], -360, 360, "load: azimuth"), number(sun[1], 0, 90, "load: elevation"))
        look.set_light(light or ("sun" if sun else "usual"), number(light_strength, 1e-6, 1e6, "load: light_strength"), place)
    look.no_ground = not ground
    if size is not None:
        look.width, look.height = (whole(s, 1, 65535, "load: size") for s in size)
    core = _raypager.load([os.fspath(p) for p in paths], look, columns, bytes_of(host_limit, "load: host_limit"))
    scene = Scene._loaded(core, os.fspath(paths[0]))
    for text in scene.warnings:
        warnings.warn(text, RaypagerWarning, stacklevel=2)
    return scene


__all__ = ["Chunk", "Chunks", "Image", "Object", "Scene", "load", "look_at"]
