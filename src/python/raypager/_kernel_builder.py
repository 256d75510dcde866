"""Names the program that builds kernels for this process, where a driver's compiler takes one at a time in a process (NVIDIA's)."""

from __future__ import annotations

import os
import sys

from . import _raypager

_BUILD = "import sys; sys.path[:] = {!r}; from raypager import _raypager; sys.exit(_raypager.run_program(sys.argv[1:], [], None))"


def name_kernel_builder() -> None:
    """Names Python itself, unless this is an application with Python inside, which must not be started once more."""
    if os.path.basename(sys.executable or "").startswith("python"):
        _raypager.set_kernel_builder([sys.executable, "-c", _BUILD.format(sys.path), "build-kernels"])
