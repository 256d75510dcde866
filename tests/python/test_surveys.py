"""Surveys that are unpacked for the engine: the same film as of the file in LAS."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp

laspy = pytest.importorskip("laspy")
pytest.importorskip("lazrs")


def survey(path: Path, part: slice = slice(None), point_format: int = 7) -> None:
    """2000 coloured points of a wavy square, or a part of them; compressed if the ending says so."""
    random = np.random.default_rng(3)
    x, y = random.uniform(0, 20, (2, 2000))
    header = laspy.LasHeader(version="1.4", point_format=point_format)
    header.offsets, header.scales = [0, 0, 0], [0.001] * 3
    points = laspy.LasData(header)
    points.x, points.y, points.z = x[part], y[part], np.sin(x)[part]
    points.red, points.green, points.blue = random.integers(0, 65535, (3, 2000))[:, part]
    points.write(str(path))


def film(path: Path, **options: Any) -> np.ndarray:
    return rp.render(rp.load(path, size=(48, 32)), width=48, height=32, spp=2, **options).film


@pytest.fixture(name="las")
def fixture_las(tmp_path: Path) -> Path:
    survey(tmp_path / "a.las")
    return tmp_path / "a.las"


def test_laz_is_the_las_file(las: Path) -> None:
    survey(las.with_suffix(".laz"))
    assert las.with_suffix(".laz").stat().st_size < las.stat().st_size
    expected = film(las)
    assert expected.std() > 0.01
    assert np.array_equal(film(las.with_suffix(".laz")), expected)
    assert np.array_equal(film(las.with_suffix(".laz"), geometry_limit="20%"), expected)


def test_the_command_line_takes_them(las: Path, tmp_path: Path) -> None:
    survey(las.with_suffix(".laz"))
    output = tmp_path / "a.pfm"
    arguments = [sys.executable, "-m", "raypager", "render", str(las.with_suffix(".laz")), "-o", str(output), "--size", "48x32", "--spp", "2"]
    done = subprocess.run(arguments, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert np.array_equal(rp.read_image(output), film(las))
    arguments[4] = str(tmp_path / "none.laz")
    done = subprocess.run(arguments, capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr == f"raypager: {tmp_path}/none.laz: no such file\n"
    assert subprocess.run([sys.executable, "-m", "raypager", "no-verb"], capture_output=True).returncode == 2


def test_damaged_files_are_errors(las: Path) -> None:
    laz = las.with_suffix(".laz")
    survey(laz)
    whole = laz.read_bytes()
    for size in (0, 10, 300, 2000, len(whole) - 100):
        laz.write_bytes(whole[:size])
        with pytest.raises(rp.Error, match="a.laz"):
            film(laz)


def test_tiles_are_put_together(tmp_path: Path) -> None:
    (tmp_path / "ept-hierarchy").mkdir()
    (tmp_path / "ept-data").mkdir()
    about = tmp_path / "ept.json"
    about.write_text(json.dumps({"dataType": "laszip"}))
    (tmp_path / "ept-hierarchy" / "0-0-0-0.json").write_text(json.dumps({"0-0-0-0": 1200, "1-0-0-0": -1}))
    (tmp_path / "ept-hierarchy" / "1-0-0-0.json").write_text(json.dumps({"1-0-0-0": 800}))
    survey(tmp_path / "ept-data" / "0-0-0-0.laz", slice(0, 1200))
    survey(tmp_path / "ept-data" / "1-0-0-0.laz", slice(1200, 2000))
    survey(tmp_path / "all.las")
    assert np.array_equal(film(about), film(tmp_path / "all.las"))
    (tmp_path / "ept-hierarchy" / "1-0-0-0.json").write_text(json.dumps({"../x": 5}))
    with pytest.raises(rp.Error, match="ept.json: has a node named"):
        rp.load(about)


def test_e57_has_positions_and_colours(tmp_path: Path) -> None:
    pye57 = pytest.importorskip("pye57")
    survey(tmp_path / "a.las")
    points = laspy.read(str(tmp_path / "a.las"))
    colors = {f"color{name.title()}": (np.asarray(points[name]) >> 8).astype(np.uint8) for name in ("red", "green", "blue")}
    names = ("cartesianX", "cartesianY", "cartesianZ")
    file = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    positions = np.stack([points.x, points.y, points.z], -1)
    file.write_scan_raw({**dict(zip(names, positions.T.copy(), strict=True)), **colors})
    # A second scan without colours.
    file.write_scan_raw(dict(zip(names, positions[:10].T.copy(), strict=True)))
    file.close()
    scene = rp.load(tmp_path / "a.e57", size=(48, 32))
    picture = rp.render(scene, width=48, height=32, spp=2)
    assert picture.report["scene"]["spheres"] == 2010
    # Colours of 8 bits; the file in LAS has 16.
    assert np.abs(picture.film - film(tmp_path / "a.las")).mean() < 0.02


def test_what_is_missing_is_named(las: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    survey(las.with_suffix(".laz"))
    monkeypatch.setitem(sys.modules, "lazrs", None)
    with pytest.raises(rp.Error, match="pip install 'raypager\\[las\\]'"):
        rp.load(las.with_suffix(".laz"))
