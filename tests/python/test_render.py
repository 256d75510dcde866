"""Renders: the command line's pictures and words, stops, threads, and nothing left behind."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import raypager as rp


def test_draws_the_command_lines_picture(mesh_file: Path, tmp_path: Path, program: Path) -> None:
    picture, report = tmp_path / "a.pfm", tmp_path / "a.json"
    settings = ["--size", "48x36", "--spp", "4", "--geometry-limit", "50%"]
    subprocess.run([program, "render", mesh_file, "-o", picture, "--report", report, *settings], check=True, capture_output=True)
    ours = rp.render(rp.load(mesh_file, size=(48, 36)), width=48, height=36, spp=4, geometry_limit="50%")
    assert ours.film.tobytes() == rp.read_image(picture).tobytes()
    theirs = json.loads(report.read_text())
    assert ours.report["image"] == theirs["image"]
    assert set(theirs) == set(ours.report) | {"camera"}
    assert ours.film.dtype == np.float32 and ours.film.shape == (36, 48, 3)
