"""Layers, adaptive sampling and denoising from Python."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import raypager as rp
from conftest import waves


@pytest.fixture(name="scene")
def fixture_scene() -> rp.Scene:
    scene = rp.Scene(width=32, height=24, spp=4)
    positions, triangles = waves()
    scene.mesh(positions, triangles, material=rp.diffuse((0.2, 0.5, 0.8)))
    scene.infinite_light(1)
    scene.camera((0, 2, 2), (0, 0, 0))
    return scene


def test_layers_are_arrays(scene: rp.Scene) -> None:
    plain = rp.render(scene)
    assert plain.layers == {} and plain.report["layers"] is None
    picture = rp.render(scene, layers=["albedo", "depth", "samples"])
    assert list(picture.layers) == ["albedo", "depth", "samples"]
    assert picture.layers["albedo"].shape == (24, 32, 3) and picture.layers["depth"].shape == (24, 32, 1)
    assert np.array_equal(picture.film, plain.film)
    hit = np.isfinite(picture.layers["depth"][..., 0])
    assert 100 < hit.sum() < 24 * 32
    assert picture.layers["depth"][hit].min() > 1
    assert np.allclose(picture.layers["albedo"][12, 16], (0.2, 0.5, 0.8), atol=2e-3)
    assert (picture.layers["samples"] == 4).all()
    assert set(rp.render(scene, layers="all", spp=1).layers) >= {"normal", "waits", "variance"}
    with pytest.raises(rp.Error, match="'fog' is not a layer"):
        rp.render(scene, layers="albedo,fog")


def test_layers_are_saved(scene: rp.Scene, tmp_path: Path) -> None:
    picture = rp.render(scene, layers="albedo,instance")
    if not rp._raypager.writes_png:
        pytest.skip("built without OpenImageIO")
    picture.save(tmp_path / "a.exr")
    picture.save(tmp_path / "a.png")
    assert (tmp_path / "a.exr").stat().st_size > 3000
    assert np.array_equal(rp.read_image(tmp_path / "a.exr"), picture.film)
    assert b"albedo.G" in (tmp_path / "a.exr").read_bytes()
    with pytest.raises(rp.Error, match="layer 'albedo': shape"):
        rp.save(tmp_path / "b.exr", picture.film, layers={"albedo": picture.film[..., :1]})
    with pytest.raises(rp.Error, match="no layers"):
        rp.save(tmp_path / "b.png", picture.film, layers=picture.layers)


def test_adaptive_pictures_have_fewer_samples(scene: rp.Scene) -> None:
    picture = rp.render(scene, spp=64, adaptive=0.5, layers="samples")
    counts = picture.layers["samples"]
    assert counts.min() == 16 and counts.mean() < 64
    assert picture.report["image"]["average_spp"] == pytest.approx(counts.mean())
    assert picture.report["settings"]["adaptive"] == 0.5
    with pytest.raises(rp.Error, match="adaptive"):
        rp.render(scene, adaptive=0)


def test_denoising_without_the_library_says_what_to_install(scene: rp.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAYPAGER_OIDN", "/nowhere/libOpenImageDenoise.so")
    picture = rp.render(scene, spp=1)
    with pytest.raises(rp.Error, match="/nowhere/libOpenImageDenoise.so"):
        rp.denoise(picture)
    with pytest.raises(rp.Error, match="shape"):
        rp.denoise(np.zeros((4, 4)))
    with pytest.raises(rp.Error, match="albedo"):
        rp.denoise(picture.film, albedo=np.zeros((2, 2, 3)))


def test_denoised_pictures_are_smoother(scene: rp.Scene) -> None:
    fake = os.environ.get("RAYPAGER_FAKE_OIDN")
    if not fake:
        pytest.skip("RAYPAGER_FAKE_OIDN names no library")
    picture = rp.render(scene, spp=1, layers="albedo,normal")
    clean = rp.denoise(picture, library=fake)
    assert clean.shape == picture.film.shape and clean.dtype == np.float32
    assert np.abs(np.diff(clean, axis=1)).mean() < np.abs(np.diff(picture.film, axis=1)).mean()
