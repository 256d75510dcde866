"""bench/rivals, what comparisons with other renderers have in common: without these, but with one that passes for them."""

from __future__ import annotations

import argparse
import json
import math
import os
import struct
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import waves

BENCH = Path(__file__).parents[2] / "bench"
sys.path.insert(0, str(BENCH))
from rivals import comparison, geometry, memory, options, pictures, scenes, tools  # noqa: E402


def corners(mesh: geometry.Mesh) -> np.ndarray:
    return mesh.vertices[mesh.triangles]


def apart(mesh: geometry.Mesh) -> geometry.Mesh:
    """The same triangles, none of which share a vertex."""
    return geometry.Mesh(corners(mesh).reshape(-1, mesh.vertices.shape[1]), np.arange(mesh.triangles.size, dtype=np.uint32).reshape(-1, 3))


def test_shared_vertices_are_the_same_triangles(tmp_path: Path) -> None:
    mesh = geometry.Mesh(*waves())
    shared = geometry.share_vertices(apart(mesh))
    assert len(shared.vertices) == len(mesh.vertices) and np.array_equal(corners(shared), corners(mesh))
    used = shared.triangles.ravel()
    firsts = used[np.sort(np.unique(used, return_index=True)[1])]
    assert np.array_equal(firsts, np.arange(len(shared.vertices))), "numbered as they occur"
    geometry.write_ply(tmp_path / "a.ply", shared)
    assert (tmp_path / "a.ply").stat().st_size < 12 * len(shared.vertices) + 13 * len(shared.triangles) + 250
    again = geometry.read_ply(tmp_path / "a.ply")
    assert np.array_equal(again.vertices, shared.vertices) and np.array_equal(again.triangles, shared.triangles)


def test_vertices_are_shared_where_all_is_equal_to_the_bit() -> None:
    base = np.array([[0, 0, 0, 0, 1, 0], [1, 0, 0, 0, 1, 0], [0, 0, 1, 0, 1, 0]], np.float32)
    other_normal = base + np.array([0, 0, 0, 1, -1, 0], np.float32)
    nearly = np.nextafter(base, np.float32(2))
    faces = np.arange(12, dtype=np.uint32).reshape(-1, 3)
    shared = geometry.share_vertices(geometry.Mesh(np.concatenate([base, other_normal, nearly, base]), faces))
    assert shared.triangles.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8], [0, 1, 2]]
    empty = geometry.Mesh(np.empty((0, 3), np.float32), np.empty((0, 3), np.uint32))
    assert geometry.share_vertices(empty) is empty


def test_random_soups_keep_their_triangles() -> None:
    seed = np.random.SeedSequence().entropy
    random = np.random.default_rng(seed)
    grid = random.integers(0, 6, (3000, 3)).astype(np.float32)  # many equal ones
    mesh = geometry.Mesh(grid, np.arange(3000, dtype=np.uint32).reshape(-1, 3))
    shared = geometry.share_vertices(mesh)
    assert np.array_equal(corners(shared), corners(mesh)), f"seed {seed}"
    assert len(shared.vertices) == len(np.unique(grid, axis=0)), f"seed {seed}"


@pytest.mark.parametrize(
    "damage",
    [
        lambda all: all[:-1],
        lambda all: all[:40],
        lambda all: all.replace(b"little", b"big"),
        lambda all: all.replace(b"float z", b"double z"),
        lambda all: all.replace(b"uchar int", b"uchar short"),
        lambda all: all.replace(b"element vertex 625", b"element vertex 626"),
        lambda all: all[:-13] + b"\4" + all[-12:],
        lambda all: all[:-4] + struct.pack("<I", 625),
    ],
)
def test_damaged_meshes_are_errors(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    path = tmp_path / "a.ply"
    geometry.write_ply(path, geometry.Mesh(*waves()))
    assert len(geometry.read_ply(path).vertices) == 625
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(ValueError, match="a.ply: "):
        geometry.read_ply(path)


def test_a_sphere_is_closed_and_faces_outwards() -> None:
    mesh = geometry.sphere(2, 3)
    assert mesh.triangles.shape == (20 * 4**3, 3) and len(mesh.vertices) == 10 * 4**3 + 2, "Euler: each vertex is shared"
    assert np.allclose(np.linalg.norm(mesh.vertices, axis=1), 2, atol=1e-6)
    a, b, c = corners(mesh).astype(float).transpose(1, 0, 2)
    assert math.isclose(np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6, 4 / 3 * math.pi * 8, rel_tol=0.02), "volume, and so orientation"


def noisy(random: np.random.Generator, truth: np.ndarray, sigma: float) -> pictures.Twice:
    return pictures.Twice(*(truth + random.normal(0, sigma, truth.shape) for _ in range(2)))


def test_noise_is_told_from_other_pictures() -> None:
    seed = np.random.SeedSequence().entropy
    random = np.random.default_rng(seed)
    truth = random.uniform(0.2, 1, (90, 160, 3))
    ours = noisy(random, truth, 0.05)
    assert math.isclose(ours.noise, 0.05**2 / 2, rel_tol=0.05), f"seed {seed}"
    same = pictures.agreement(noisy(random, truth, 0.03), ours)
    assert same.within(0.005, 0.02), f"seed {seed}: {same}"
    assert math.isclose(same.rmse, math.sqrt(0.05**2 / 2 + 0.03**2 / 2), rel_tol=0.05), f"seed {seed}"
    tinted = pictures.agreement(noisy(random, truth * [1, 1, 0.98], 0.03), ours)
    assert math.isclose(tinted.bias[2], -0.02, abs_tol=0.003) and abs(tinted.bias[0]) < 0.003, f"seed {seed}"
    assert not tinted.within(0.005, 0.5), f"seed {seed}: one channel in a hundred"
    moved = pictures.agreement(noisy(random, np.roll(truth, 1, 0), 0.03), ours)
    assert max(np.abs(moved.bias)) < 0.003 and moved.unexplained > 0.3, f"seed {seed}"
    assert not moved.within(0.005, 0.02), f"seed {seed}: the same mean, but not the same picture"
    half = np.where(np.arange(160)[:, None] < 80, 0.97, 1.03)
    uneven = pictures.agreement(noisy(random, truth * half, 0.1), noisy(random, truth, 0.1))
    assert max(np.abs(uneven.bias)) < 0.01 and math.isclose(uneven.unexplained, 0.03, rel_tol=0.6), f"seed {seed}: far below the noise of a pixel"


def test_what_is_no_number_does_not_agree() -> None:
    good = np.ones((2, 2, 3))
    bad = good.copy()
    bad[0, 0, 0] = math.nan
    assert not pictures.agreement(pictures.Twice(bad, bad), pictures.Twice(good, good)).within(1, 1)
    for reference in (bad, 0 * good, good[:1]):
        with pytest.raises(ValueError):
            pictures.agreement(pictures.Twice(good, good), pictures.Twice(reference, reference))


def test_seconds_and_samples_to_an_error() -> None:
    assert pictures.seconds_to(3, 0.02, 0.01) == 12 and pictures.seconds_to(3, 0.01, 0.01) == 3
    assert pictures.samples_to(64, 0.01, 0.02) == 16 and pictures.samples_to(1, 0.01, 1) == 1
    seed = np.random.SeedSequence().entropy
    random = np.random.default_rng(seed)
    truth = random.uniform(0.2, 1, (90, 160, 3))
    reference, picture = truth + random.normal(0, 0.02, truth.shape), truth + random.normal(0, 0.05, truth.shape)
    assert math.isclose(pictures.error_to(picture, reference, 0.02**2), 0.05, rel_tol=0.03), f"seed {seed}: without the reference's own"
    assert pictures.error_to(truth, truth, 1.0) == 0


def test_pictures_come_in_and_go_out(tmp_path: Path) -> None:
    picture = np.arange(24, dtype=np.float32).reshape(2, 4, 3) / 23
    (tmp_path / "a.pfm").write_bytes(b"PF\n4 2\n-1.0\n" + picture[::-1].tobytes())
    assert np.array_equal(pictures.read_pfm(tmp_path / "a.pfm"), picture)
    for bad in (b"PF\n4 2\n-1.0\n" + picture.tobytes()[:-1], b"Pf\n4 2\n-1.0\n" + picture.tobytes(), b"PF\n4\n-1.0\n"):
        (tmp_path / "b.pfm").write_bytes(bad)
        with pytest.raises(ValueError, match="b.pfm"):
            pictures.read_pfm(tmp_path / "b.pfm")
    pictures.write_png(tmp_path / "a.png", picture)
    png = (tmp_path / "a.png").read_bytes()
    content = zlib.decompress(png[png.index(b"IDAT") + 4 : png.index(b"IEND") - 8])
    assert struct.unpack(">II", png[16:24]) == (4, 2) and len(content) == 2 * (1 + 12) and content[1] == 0 and content[-1] == 255


def chosen(program: Path, work: Path, scene: Path | str, *more: str) -> argparse.Namespace:
    words = [str(scene), "--raypager", str(program), "--work", str(work), "--size", "48x27", "--spp", "4", "--reference-spp", "64", "--repeats", "1"]
    return options.parser("rival", "").parse_args([*words, "--limits", "100%,50%", "--most-bias", "2", "--most-difference", "4", *more])


def test_scenes_become_diffuse_and_come_back(program: Path, tmp_path: Path) -> None:
    prepared = comparison.prepare(chosen(program, tmp_path, "cornell", "--triangles", "5K"), "cornell")
    scene = scenes.read(prepared.exported)
    assert scene.depth == 5 and scene.eye.tolist() == [278, 273, -800] and math.isclose(scene.field_of_view, 39.3, rel_tol=1e-6)
    assert np.allclose(np.cross(scene.right, scene.forward), scene.up), "right-handed"
    meshes = [geometry.read_ply(shape.mesh) for shape in scene.shapes]
    assert sum(len(m.triangles) for m in meshes) == prepared.triangles > 40960, "with two spheres of 20480"
    assert sum(len(m.vertices) for m in meshes) == prepared.vertices < 0.7 * prepared.triangles
    lamps = [shape for shape in scene.shapes if shape.radiance is not None]
    assert len(lamps) == 1 and lamps[0].radiance.tolist() == [34, 27, 17] and not lamps[0].color.any()
    gold = [(0.143, 3.983), (0.375, 2.386), (1.442, 1.603)]
    wanted = [((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k) for n, k in gold]
    assert any(np.allclose(shape.color, wanted, atol=1e-5) for shape in scene.shapes)


def test_what_others_draw_differently_is_refused(program: Path, tmp_path: Path) -> None:
    geometry.write_ply(tmp_path / "m.ply", geometry.Mesh(*waves()))
    shapes = {"spheres": 'Shape "sphere"', "materials": 'Material "dielectric"\nShape "plymesh" "string filename" "m.ply"'}
    for what, shape in shapes.items():
        path = tmp_path / f"{what}.pbrt"
        path.write_text(f'Scale -1 1 1\nLookAt 0 0 5 0 0 0 0 1 0\nCamera "perspective"\nWorldBegin\nLightSource "infinite"\n{shape}\n')
        prepared = comparison.prepare(chosen(program, tmp_path / "work", path), str(path))
        with pytest.raises(ValueError, match=what):
            scenes.read(prepared.exported)
    with pytest.raises(tools.Failed, match="no such file, and no kind"):
        comparison.prepare(chosen(program, tmp_path / "work", "nothing.pbrt"), "nothing.pbrt")


PASSES_FOR_A_RIVAL = """
import sys
import time
from pathlib import Path
program, baked, size, work, bench, factor = sys.argv[1:]
sys.path.insert(0, bench)
from rivals import tools

class Renderer:
    build, device, kind, version = 0.5, "a device", "", "Rival 1.0"

    def __init__(self):
        self.raypager = tools.Raypager(program, None, baked, size, 0, Path(work))

    def render(self, samples, seed):
        if factor == "fails":
            sys.exit("out of luck")
        done = self.raypager.render(2 * samples, seed + 5000)
        return float(factor) * done.picture, samples, 100.0

tools.serve(Renderer)
"""


def compare(program: Path, folder: Path, factor: str) -> int:
    script, own = folder / "rival.py", folder / "own"
    script.write_text(PASSES_FOR_A_RIVAL)
    own.mkdir()

    def start(scene: Path, work: Path) -> list[tuple[str, tools.Rival, dict]]:
        words = [script, program, scene.parents[1] / "scene.rpb", "48x27", own, BENCH, factor]
        return [("Rival", tools.Rival("rival", words, work), {})]

    return comparison.compare(chosen(program, folder / "work", "terrain", "--triangles", "5K"), start)


def test_a_rival_of_the_same_picture_is_timed(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(program, tmp_path, "1") == 0
    text = capsys.readouterr().out
    assert "| terrain | Rival | all | " in text and "| terrain | raypager | 50% | 4 | " in text and "the same |" in text
    found = json.loads((tmp_path / "work/result.json").read_text())["results"][0]
    ours, _, rival = found["rows"]
    assert rival["samples"] in (2, 3) and abs(rival["rmse"] / found["target_rmse"] - 1) < 0.3, "each of its samples is two of raypager's"
    assert math.isclose(rival["whole"], rival["render"] + 0.5) and ours["whole"] > ours["render"]
    assert math.isclose(rival["render"], 100 * (rival["rmse"] / found["target_rmse"]) ** 2)
    assert (tmp_path / "work/terrain/difference.png").exists()


def test_a_rival_of_another_picture_gets_no_times(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(program, tmp_path, "0.94") == 1
    text = capsys.readouterr().out
    assert "-6.0" in text and "**not the same: no times**" in text and "render, s" not in text
    found = json.loads((tmp_path / "work/result.json").read_text())["results"][0]
    assert found["rows"] == [] and found["target_rmse"] is None


def test_a_rival_that_ends_is_one_line(program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(program, tmp_path, "fails") == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert "rival ended: out of luck; all that it said is in " in said[-1]


def test_device_memory_is_the_most_meanwhile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    says = tmp_path / "says"
    says.write_text("100")
    script = tmp_path / "nvidia-smi"
    script.write_text(f"#!/bin/sh\nwhile sleep 0.01; do cat {says}; echo; done\n")
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    assert memory.DeviceMemory.is_there()
    device = memory.DeviceMemory()
    try:
        assert device.now() == 100 << 20

        def becomes(mebibytes: int) -> None:
            """That is what the driver says from now on, and what has been heard."""
            (tmp_path / "next").write_text(str(mebibytes))
            (tmp_path / "next").rename(says)
            end = time.monotonic() + 60
            while device.last != mebibytes << 20 and time.monotonic() < end:
                time.sleep(0.01)

        def work() -> str:
            becomes(700)
            becomes(300)
            return "done"

        assert device.during(work) == ("done", 700 << 20)
        assert device.now() == 300 << 20, "what was before does not count"
    finally:
        device.close()
