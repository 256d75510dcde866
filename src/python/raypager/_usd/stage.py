"""What a stage shows: its prims, with instances as instances."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from .._arrays import Array
from .._errors import Error
from .bindings import Outside, hidden_in_renders
from .camera import CameraReader
from .content import Content, Found, corners_of_box
from .gprims import GprimReader
from .images import Images
from .lights import LightReader, is_light
from .materials import Surfaces
from .mesh import MeshReader, Painter
from .reading import Reading, matrix_of

_Work: TypeAlias = "list[tuple[Usd.Prim, Array]]"
_CHILDREN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
# Prototypes may lie under an "over", so that nothing but their instancer shows them.
_CHILDREN_OF_PROTOTYPES = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract)
_MOST_LIGHTS = 1024  # without a surface, that instances place in one object or the world


class StageReader:
    def __init__(self, reading: Reading) -> None:
        images = Images(reading)
        surfaces = Surfaces(reading, images)
        self._reading, self._outside = reading, Outside(reading)
        self._lights, self._cameras = LightReader(reading, images), CameraReader(reading)
        painter = Painter(surfaces.of, images.pixels_of, self._lights.of_shape)
        self._meshes, self._gprims = MeshReader(reading, painter), GprimReader(reading, painter)
        self._objects: dict[Any, Found] = {}
        self._unfinished: set[Any] = set()

    def read(self) -> tuple[bool, Array]:
        """Fills the scene. Whether it has a camera, and points of what is seen, [n, 3]."""
        content = Content(in_object=False, children=_CHILDREN)
        self._walk([(prim, np.eye(4)) for prim in self._reading.stage.GetPseudoRoot().GetFilteredChildren(_CHILDREN)], content)
        self._lights.finish()
        has_camera = self._cameras.finish()
        points = content.seen()
        content.put_into(self._reading.scene, self._reading.scene)
        return has_camera, points

    def _walk(self, work: Iterable[tuple[Usd.Prim, Array]], content: Content) -> None:
        """Prims, each with the matrix of what it lies in, and all that lies in them."""
        left = list(work)[::-1]
        while left:
            prim, matrix = left.pop()
            try:
                left += self._visit(prim, matrix, content)[::-1]
            except (Error, KeyboardInterrupt, MemoryError):
                raise
            except Exception as error:  # attributes of damaged files have values of any type
                raise self._reading.failed(prim, f"cannot be read: {' '.join(str(error).split())}") from error

    def _visit(self, prim: Usd.Prim, outside: Array, content: Content) -> _Work:
        """What lies in it, to be visited next."""
        if prim.IsA(UsdGeom.Imageable) and self._reading.get(UsdGeom.Imageable(prim).GetVisibilityAttr()) == UsdGeom.Tokens.invisible:
            return []
        matrix = self._matrix(prim, outside, content)
        self._note_draw_mode(prim)
        if prim.IsInstance():
            self._place(self._object_of_instance(prim), matrix[None], content)
            return []
        if prim.IsA(UsdGeom.PointInstancer):
            if self._is_drawn(prim):
                self._place_points(UsdGeom.PointInstancer(prim), matrix, content)
            return []
        self._add(prim, matrix, content)
        return [(child, matrix) for child in prim.GetFilteredChildren(content.children)]

    def _matrix(self, prim: Usd.Prim, outside: Array, content: Content) -> Array:
        if not prim.IsA(UsdGeom.Xformable):
            return outside
        xform = UsdGeom.Xformable(prim)
        if xform.TransformMightBeTimeVarying():
            for attribute in [op.GetAttr() for op in xform.GetOrderedXformOps()]:
                self._reading.get(attribute)  # notes which is animated
        own = matrix_of(xform.GetLocalTransformation(self._reading.time))
        if not np.isfinite(own).all():
            raise self._reading.failed(prim, "its transform is not finite; the file is damaged")
        if not xform.GetResetXformStack():
            return outside @ own
        if content.in_object:
            self._reading.notes.add("reset", prim.GetPath(), "its !resetXformStack! leads to the object in which it lies, not to the world")
        return own

    def _is_drawn(self, prim: Usd.Prim) -> bool:
        purpose = UsdGeom.Imageable(prim).ComputePurpose()
        return purpose == UsdGeom.Tokens.default_ or (purpose == UsdGeom.Tokens.render and not hidden_in_renders(prim))

    def _note_draw_mode(self, prim: Usd.Prim) -> None:
        if not prim.HasAPI(UsdGeom.ModelAPI):
            return
        model = UsdGeom.ModelAPI(prim)
        mode = model.ComputeModelDrawMode()
        if mode != UsdGeom.Tokens.default_ and (model.GetModelApplyDrawModeAttr().Get() or Usd.ModelAPI(prim).GetKind() == "component"):
            self._reading.notes.add("draw mode", prim.GetPath(), f"its draw mode {mode} is left out; it is shown as it is")

    def _add(self, prim: Usd.Prim, matrix: Array, content: Content) -> None:
        if prim.IsA(UsdGeom.Camera):
            if not content.in_object:
                self._cameras.add(prim, matrix)
            else:
                self._reading.notes.add("placed camera", prim.GetPath(), "a camera in what instances place is only used where it is named")
        elif is_light(prim) and not prim.IsA(UsdGeom.Gprim):
            self._lights.add(prim, matrix, content)
        elif prim.IsA(UsdGeom.Gprim) and self._is_drawn(prim):
            if abs(np.linalg.det(matrix[:3, :3])) == 0:
                self._reading.notes.add("flat", prim.GetPath(), "a transform that cannot be inverted flattens it; it is left out")
            elif prim.IsA(UsdGeom.Mesh):
                self._meshes.add(prim, matrix, content)
            elif not self._gprims.add(prim, matrix, content):
                kind = prim.GetTypeName()
                self._reading.notes.add(f"gprim {kind}", prim.GetPath(), f"a {kind} is not read; it is left out")

    # Instances

    def _object_of_instance(self, prim: Usd.Prim) -> Found:
        def fill(content: Content) -> None:
            if prim.IsA(UsdGeom.PointInstancer):
                if self._is_drawn(prim):
                    self._place_points(UsdGeom.PointInstancer(prim), np.eye(4), content)
                return
            self._add(prim, np.eye(4), content)
            self._walk([(child, np.eye(4)) for child in prim.GetFilteredChildren(_CHILDREN)], content)

        return self._object((prim.GetPrototype().GetPath(), self._outside.of(prim), self._outside.of_root(prim)), prim, _CHILDREN, fill)

    def _object_of_prototype(self, prim: Usd.Prim) -> Found:
        key = prim.GetPath(), self._outside.of(prim)
        return self._object(key, prim, _CHILDREN_OF_PROTOTYPES, lambda content: self._walk([(prim, np.eye(4))], content))

    def _object(self, key: Any, prim: Usd.Prim, children: Any, fill: Callable[[Content], None]) -> Found:
        if key in self._objects:
            return self._objects[key]
        if key in self._unfinished:
            raise self._reading.failed(prim, "it places itself; the file is damaged")
        self._unfinished.add(key)
        content = Content(in_object=True, children=children)
        fill(content)
        self._unfinished.remove(key)
        found = Found(None, np.zeros((0, 3)), np.eye(4), content.lights)
        if (only := content.only_place()) is not None:
            found.object, found.box, found.inside = only
        elif not content.is_empty():
            found.box = corners_of_box(content.seen())
            found.object = self._reading.scene.object(f"{self._reading.path}: {prim.GetPath()}")
            content.put_into(self._reading.scene, found.object)
        self._objects[key] = found
        return found

    def _place(self, found: Found, matrices: Array, content: Content) -> None:
        if len(matrices) == 0 or found.is_empty():
            return
        usable = np.isfinite(matrices).all((1, 2)) & (np.linalg.det((matrices @ found.inside)[:, :3, :3]) != 0)
        if not usable.all():
            name, count = found.object._name if found.object is not None else "lights", int((~usable).sum())
            self._reading.notes.add("flat instance", name, f"{count} of its instances are flat or not finite; they are left out")
            matrices = matrices[usable]
        if found.object is not None and len(matrices):
            content.place(found.object, found.box, matrices @ found.inside)
        self._place_lights(found, matrices, content)

    def _place_lights(self, found: Found, matrices: Array, content: Content) -> None:
        """Those without a surface, which no object holds."""
        for prim, inside in found.lights:
            some = matrices[: _MOST_LIGHTS - content.placed_lights]
            content.placed_lights += len(some)
            for matrix in some:
                self._lights.add(prim, matrix @ inside, content)
            if len(some) < len(matrices):
                text = f"instances place more than {_MOST_LIGHTS} lights without a surface; others are left out"
                self._reading.notes.add("placed light", prim.GetPath(), text)
                break

    def _is_off(self, path: Sdf.Path) -> bool:
        """Whether it, or what it lies in, is not active or not loaded."""
        while not (prim := self._reading.stage.GetPrimAtPath(path)) and not path.IsAbsoluteRootPath():
            path = path.GetParentPath()
        return not prim.IsActive() or not prim.IsLoaded()

    def _place_points(self, instancer: UsdGeom.PointInstancer, matrix: Array, content: Content) -> None:
        prim, time = instancer.GetPrim(), self._reading.time
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        numbers = self._reading.numbers(prim, instancer.GetProtoIndicesAttr()).astype(np.int64)
        if len(numbers) == 0:
            return
        if numbers.min() < 0 or numbers.max() >= len(targets):
            raise self._reading.failed(prim, f"its protoIndices go from {numbers.min()} to {numbers.max()}, but it has {len(targets)} prototypes")
        for attribute in (instancer.GetPositionsAttr(), instancer.GetOrientationsAttr(), instancer.GetScalesAttr()):
            self._reading.get(attribute)  # notes what is animated
        places = instancer.ComputeInstanceTransformsAtTime(time, time, instancer.ExcludeProtoXform, instancer.IgnoreMask)
        if len(places) != len(numbers):
            raise self._reading.failed(prim, f"has {len(numbers)} protoIndices, but not as many positions, or not as many scales or orientations")
        matrices = matrix @ np.asarray(places, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
        for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithValues():
            if primvar.GetInterpolation() != UsdGeom.Tokens.constant:
                self._reading.notes.add("instance primvars", prim.GetPath(), f"its {primvar.GetPrimvarName()}, one for each instance, is left out")
        mask = instancer.ComputeMaskAtTime(time)
        shown = np.array(mask, bool) if len(mask) == len(numbers) else np.ones(len(numbers), bool)
        for number in np.unique(numbers[shown]):
            prototype = self._reading.stage.GetPrimAtPath(targets[number])
            if self._is_off(targets[number]):
                continue
            if not prototype:
                raise self._reading.failed(prim, f"its prototype {targets[number]} does not exist")
            found = self._object_of_prototype(prototype)
            if found.is_empty():
                self._reading.notes.add("empty prototype", prim.GetPath(), f"its prototype {targets[number]} shows nothing")
            self._place(found, matrices[shown & (numbers == number)], content)
