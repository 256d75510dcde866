"""raypager path-traces scenes many times larger than the device's memory, exactly, on any OpenCL device.

::

    import raypager as rp

    picture = rp.render("statue.ply", width=640, height=480, spp=64, geometry_limit="25%")
    picture.save("statue.png")
    picture.film  # [480, 640, 3] float32, linear sRGB

A picture is made in three steps: a :class:`Scene`, loaded or built from numpy arrays; :class:`Blocks`, which it is baked into; and a :class:`Render`.
:func:`render` does all of them. Lengths are in the scene's units, memory is in bytes, time in seconds, angles in degrees; colours are linear sRGB.
"""

from ._blocks import Blocks, bake, open
from ._denoise import denoise
from ._errors import Error, RaypagerWarning
from ._kernel_builder import name_kernel_builder as _name_kernel_builder
from ._materials import (
    Image,
    Material,
    absorbing,
    clay,
    coated_conductor,
    conductor,
    dielectric,
    diffuse,
    glossy,
    metal,
    mirror,
    mix,
    plastic,
    thin_dielectric,
    translucent,
    with_bumps,
    with_normals,
)
from ._raypager import VERSION as __version__
from ._raypager import Camera, Device, Progress, devices
from ._render import Picture, Render, read_image, render, save
from ._scene import Scene, load, look_at
from ._shapes import Object

__all__ = [
    "Blocks",
    "Camera",
    "Device",
    "Error",
    "Image",
    "Material",
    "Object",
    "Picture",
    "Progress",
    "RaypagerWarning",
    "Render",
    "Scene",
    "__version__",
    "absorbing",
    "bake",
    "clay",
    "coated_conductor",
    "conductor",
    "denoise",
    "devices",
    "dielectric",
    "diffuse",
    "glossy",
    "load",
    "look_at",
    "metal",
    "mirror",
    "mix",
    "open",
    "plastic",
    "read_image",
    "render",
    "save",
    "thin_dielectric",
    "translucent",
    "with_bumps",
    "with_normals",
]

_name_kernel_builder()
