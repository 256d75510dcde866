"""Pictures without noise."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from . import _raypager
from ._errors import usage
from ._render import Picture


def _packaged_library() -> str:
    """The one in the package pyoidn, if that is installed; else empty, and the engine looks elsewhere."""
    spec = None if "RAYPAGER_OIDN" in os.environ else importlib.util.find_spec("pyoidn")
    for folder in (spec and spec.submodule_search_locations) or ():
        for library in sorted(Path(folder).rglob("libOpenImageDenoise.so*")):
            return str(library)
    return ""


def _guide(values: npt.ArrayLike | None, film: npt.NDArray[np.float32], name: str) -> npt.NDArray[np.float32] | None:
    if values is None:
        return None
    guide = np.ascontiguousarray(values, dtype=np.float32)
    if guide.shape != (*film.shape[:2], 3):
        raise usage(f"denoise: {name}: an array of shape {[*film.shape[:2], 3]} is expected, not {list(guide.shape)}")
    return guide


def denoise(
    picture: Picture | npt.ArrayLike,
    albedo: npt.ArrayLike | None = None,
    normal: npt.ArrayLike | None = None,
    *,
    library: str | os.PathLike[str] | None = None,
    fast: bool = False,
) -> npt.NDArray[np.float32]:
    """The picture without its noise, [height, width, 3 or 4] float32, by Intel's Open Image Denoise.

    ``picture``: what a render made, of which the layers albedo and normal are used where it has them; or an array, [height, width, 3 or 4], linear.
    ``albedo``, ``normal``: [height, width, 3], of the same render; a normal needs an albedo. ``library``: the shared library; by default that which
    the environment variable RAYPAGER_OIDN names, that of the package pyoidn, or the system's. ``fast``: takes albedo and normal with their noise,
    in a seventh of the time.

    ::

        picture = rp.render(scene, spp=16, layers="albedo,normal")
        rp.save("clean.png", rp.denoise(picture))
    """
    if isinstance(picture, Picture):
        albedo = picture.layers.get("albedo") if albedo is None else albedo
        normal = picture.layers.get("normal") if normal is None and albedo is not None else normal
        picture = picture.film
    film = np.ascontiguousarray(picture, dtype=np.float32)
    if film.ndim != 3 or film.shape[2] not in (3, 4) or film.size == 0:
        raise usage(f"denoise: a picture of shape [height, width, 3 or 4] is expected, not {list(film.shape)}")
    return _raypager.denoise(
        film, _guide(albedo, film, "albedo"), _guide(normal, film, "normal"), os.fspath(library) if library else _packaged_library(), fast
    )


__all__ = ["denoise"]
