"""Kernels that other processes build, where a device's profile says so; those of an application with Python inside build none."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import sys
sys.executable = sys.argv[1]
from raypager.__main__ import main
sys.exit(main(["render", *sys.argv[2:], "--size", "32x24", "--spp", "1", "--traversal", "ray", "--tune", "build-processes=3,cache-kernels=1"]))
"""


@pytest.mark.parametrize(("name", "builds"), [("python-counted", True), ("application", False)])
def test_other_processes(mesh_file: Path, tmp_path: Path, name: str, builds: bool) -> None:
    started, program = tmp_path / "started", tmp_path / name
    program.write_text(f'#!/bin/sh\n{sys.executable} "$@"\nstatus=$?\necho "$3 $status" >>{started}\nexit $status\n')
    program.chmod(0o755)
    cache = tmp_path / "cache"
    command = [sys.executable, "-c", PROGRAM, program, mesh_file, "-o", tmp_path / "a.pfm"]
    run = subprocess.run(command, env=os.environ | {"XDG_CACHE_HOME": str(cache)}, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "a.pfm").exists()
    kernels = list((cache / "raypager" / "kernels").iterdir())
    assert kernels
    if not builds:
        assert not started.exists()
        return
    assert set(started.read_text().splitlines()) == {"build-kernels 0"}
