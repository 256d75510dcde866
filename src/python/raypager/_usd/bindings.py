"""What changes the look of a prototype from outside: objects are shared where all of it is the same."""

from __future__ import annotations

from typing import Any, TypeAlias

from pxr import Usd, UsdGeom, UsdShade

from .lights import is_light
from .reading import Reading

# For each purpose the material, and whether it is stronger than what lies within has; and whether collections have any.
_Bound: TypeAlias = "tuple[dict[str, tuple[str, bool]], bool]"
_BINDINGS = {"material:binding": "", "material:binding:full": "full", "material:binding:preview": "preview"}
_COLLECTION = "material:binding:collection"
# Of the root of an instance, what is looked at for each instance, or does not count.
_OWN = ("xformOp", "visibility", "purpose", "extent", "material:binding", "userProperties:")


class Outside:
    def __init__(self, reading: Reading) -> None:
        self._reading = reading
        self._bound: dict[Any, _Bound] = {}

    def of(self, prim: Usd.Prim) -> tuple[Any, ...]:
        """Materials, primvars and purposes that it has or inherits."""
        bound, by_collection = self._bindings(prim)
        primvars = UsdGeom.PrimvarsAPI(prim).FindInheritablePrimvars()
        values = tuple(sorted((str(p.GetName()), str(p.ComputeFlattened(self._reading.time))) for p in primvars))
        purpose = str(UsdGeom.Imageable(prim).ComputePurpose()) if prim.IsA(UsdGeom.Imageable) else ""
        # Which of its parts a collection names is seen by path.
        return tuple(sorted(bound.items())), prim.GetPath() if by_collection else None, values, purpose, hidden_in_renders(prim)

    def of_root(self, prim: Usd.Prim) -> tuple[Any, ...]:
        """Of the root of an instance, which has values of its own: where the file says those that make a difference."""
        if not (prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer) or is_light(prim)):
            return ()
        named = [p for p in prim.GetAuthoredProperties() if not p.GetName().startswith(_OWN)]
        said = tuple((str(spec.layer.identifier), str(spec.path)) for p in named for spec in p.GetPropertyStack(self._reading.time))
        return str(prim.GetTypeName()), tuple(prim.GetAppliedSchemas()), said

    def _bindings(self, prim: Usd.Prim) -> _Bound:
        """What reaches it."""
        unknown = []
        while not prim.IsPseudoRoot() and prim.GetPath() not in self._bound:
            unknown.append(prim)
            prim = prim.GetParent()
        known = self._bound.get(prim.GetPath(), ({}, False))
        for each in reversed(unknown):
            known = self._bound[each.GetPath()] = self._with_own(each, *known)
        return known

    def _with_own(self, prim: Usd.Prim, above: dict[str, tuple[str, bool]], by_collection: bool) -> _Bound:
        found = dict(above)
        for name, purpose in _BINDINGS.items():
            relationship = prim.GetRelationship(name)
            targets = relationship.GetForwardedTargets() if relationship else []
            if targets and not found.get(purpose, ("", False))[1]:
                strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
                found[purpose] = str(targets[0]), strength == UsdShade.Tokens.strongerThanDescendants
        by_collection = by_collection or any(name.startswith(_COLLECTION) for name in prim.GetAuthoredPropertyNames())
        return found, by_collection


def hidden_in_renders(prim: Usd.Prim) -> bool:
    """By the renderVisibility of it or of what it lies in, which only counts for what has the purpose render."""
    while prim and not prim.IsPseudoRoot():
        if prim.HasAPI(UsdGeom.VisibilityAPI):
            value = UsdGeom.VisibilityAPI(prim).GetRenderVisibilityAttr().Get()
            if value in (UsdGeom.Tokens.visible, UsdGeom.Tokens.invisible):
                return bool(value == UsdGeom.Tokens.invisible)
        prim = prim.GetParent()
    return False
