"""Scenes: loaded from files, or built from numpy arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np

from . import _raypager
from ._arrays import ArrayLike, Color, Vector, color, floats, number, vector, whole
from ._errors import RaypagerWarning, usage
from ._materials import Image, Material, clay
from ._shapes import Object, Shapes, Watch
from ._surveys import Unpacked
from ._usd import LEVELS, is_usd, levels_of, read_usd

if TYPE_CHECKING:
    from ._blocks import Blocks
    from ._options import BakeOptions, RenderOptions
    from ._raypager import Progress
    from ._render import Picture

_PROJECTIONS = {"perspective": 0, "orthographic": 1, "equirectangular": 2, "equal-area": 3}


class Scene(Shapes):
    """What there is to see: shapes, lights, and a camera. Empty at first.

    ``width``, ``height``: of the picture, in pixels. ``spp``: samples per pixel. ``max_depth``: scattering events of a path. Renders may say
    otherwise.
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
        self._watch = Watch()
        self._default = clay()
        self._baked: Blocks | None = None
        self._unpacked: Unpacked | None = None
        # Of what reads a format: the name of the next shape; files that what is baked depends on; and whether materials with too many images have
        # their means, and are named here, rather than be errors.
        self._label = ""
        self._files: list[str] = []
        self._too_many_images: list[str] | None = None

    def _take_files(self) -> list[str]:
        """For the first shape that asks: a bake depends on them once."""
        files, self._files = self._files, []
        return files

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
        textures = [(parameter, image._texture() if isinstance(image, Image) else image) for parameter, image in material._images]
        height = None if material._height is None else material._height[0]._texture(material._height[1])
        number_of, fits = _raypager.add_textured(self._core, core, textures, height)
        if not fits and self._too_many_images is not None:
            self._too_many_images.append(material.name)
        elif not fits:
            raise usage(f"{material.name}: reads more images than a path can keep texels of; give it fewer")
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
        axis = tuple(b - a for a, b in zip(place, aim, strict=True))
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

        ``fov``: of the picture's shorter side, in degrees. ``height``: of what an orthographic camera sees. ``lens_radius``: of a thin lens; 0:
        all is in focus. ``focus``: the distance at which it is, by default that of the target. ``mirrored``: left and right are exchanged, as in
        most pbrt scenes.
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
    subdivision: int = LEVELS,
    camera: str | None = None,
) -> Scene:
    """Reads one pbrt, glTF or USD scene, or any number of meshes and point clouds, which are framed, lit and given a ground together.

    Clouds may also be in LAZ or COPC (``pip install raypager[las]``), Entwine tiles (their ept.json) or E57 (``raypager[e57]``); these are unpacked
    into a scratch file first. USD (.usd, .usda, .usdc, .usdz) takes ``pip install raypager[usd]``. Of it, ``subdivision``: how often subdivision
    surfaces are subdivided, 0 to 6; ``camera``: path or name of the camera, by default the first.

    Of meshes and clouds: ``material``, what they are made of, by default what the files say. ``sky``: radiance from all around. ``light``: a
    square at the viewer's left (key), the sun, or none; ``light_strength``: 1 is as usual. ``sun``: its azimuth and elevation in degrees.
    ``ground``: whether they stand on one. ``size``: of the picture that is framed. ``columns``: of text clouds, such as ``"x,y,z,i,r,g,b"``.

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
    levels = levels_of(subdivision, "load: subdivision")
    if any(is_usd(p) for p in paths):
        if len(paths) > 1:
            raise usage(f"load: {os.fspath(paths[0])}: a scene stands alone; give either one scene file or meshes and clouds")
        return _warned(read_usd(os.fspath(paths[0]), look, levels, camera))
    if camera is not None:
        raise usage("load: camera names one of a USD file's; cameras of others are those of their files, or of raypager.render")
    unpacked = Unpacked([os.fspath(p) for p in paths])
    core = _raypager.load(unpacked.paths, look, columns, bytes_of(host_limit, "load: host_limit"))
    scene = Scene._loaded(core, os.fspath(paths[0]))
    scene._unpacked = unpacked  # read when the scene is baked
    return _warned(scene)


def _warned(scene: Scene) -> Scene:
    for text in scene.warnings:
        warnings.warn(text, RaypagerWarning, stacklevel=3)
    return scene
