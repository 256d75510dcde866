"""Renders: the command line's pictures and words, stops, threads, and nothing left behind."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp
from conftest import empty_scene, waves


def test_draws_the_command_lines_picture(mesh_file: Path, tmp_path: Path, program: Path) -> None:
    picture, report = tmp_path / "a.pfm", tmp_path / "a.json"
    settings = ["--size", "48x36", "--spp", "4", "--geometry-limit", "50%", "--seed", "3"]
    subprocess.run([program, "render", mesh_file, "-o", picture, "--report", report, *settings], check=True, capture_output=True)
    ours = rp.render(rp.load(mesh_file, size=(48, 36)), width=48, height=36, spp=4, geometry_limit="50%", seed=3)
    assert ours.film.dtype == np.float32 and ours.film.shape == (36, 48, 3)
    assert ours.film.tobytes() == rp.read_image(picture).tobytes()
    theirs = json.loads(report.read_text())
    assert set(theirs) == set(ours.report)
    for same in ("image", "bounds", "camera", "device", "scene"):
        assert ours.report[same] == theirs[same]
    for name, facts in ours.report.items():
        if isinstance(facts, dict):
            assert set(facts) <= set(theirs[name])
    for same in ("spp", "size", "seed", "geometry_limit", "policy", "traversal", "tile", "together", "camera"):
        assert ours.report["settings"][same] == theirs["settings"][same]


def test_refuses_limits_in_the_command_lines_words(scene: rp.Scene, tmp_path: Path, program: Path) -> None:
    scene.bake(tmp_path / "a.rpb")
    for options, arguments in [
        ({"memory_limit": "100K"}, ["--memory-limit", "100K"]),
        ({"memory_limit": 1 << 50}, ["--memory-limit", str(1 << 50)]),
        ({"geometry_limit": 1000}, ["--geometry-limit", "1000"]),
        ({"device": "no such"}, ["--device", "no such"]),
    ]:
        run = subprocess.run([program, "render", tmp_path / "a.rpb", "-o", tmp_path / "a.pfm", *arguments], capture_output=True, text=True)
        with pytest.raises(rp.Error) as caught:
            rp.render(tmp_path / "a.rpb", **options)
        assert str(caught.value) in run.stderr and run.returncode == caught.value.exit_code


def test_takes_the_camera_that_a_report_has(scene: rp.Scene) -> None:
    blocks = scene.bake()
    plain = blocks.render()
    assert blocks.render(camera=plain.report["camera"]).film.tobytes() == plain.film.tobytes()
    assert blocks.render(camera="0,1,2,0,0,0,0,1,0,20").film.tobytes() != plain.film.tobytes()
    with pytest.raises(rp.Error, match="'0,1,2'"):
        blocks.render(camera="0,1,2")


def test_is_the_same_at_every_limit(scene: rp.Scene) -> None:
    scene.mesh(*waves(80))
    blocks = scene.bake(block_size="16K")
    pictures = [blocks.render(**limits) for limits in ({}, {"geometry_limit": "10%"}, {"memory_limit": "64M"}, {"paths": 999})]
    for picture in pictures:
        assert picture.film.tobytes() == pictures[0].film.tobytes()
        assert all(picture.report["peak"][kind] <= limit for kind, limit in picture.report["limits"].items())
    assert len(blocks) > 8 and pictures[1].report["paging"]["evictions"] > 0


def test_sizes_are_those_of_the_command_line(scene: rp.Scene) -> None:
    blocks = scene.bake()
    for text, limit in [("64M", 64 << 20), ("64 MiB", 64 << 20), ("0.0625GB", 64 << 20), (64 << 20, 64 << 20), (np.int64(64 << 20), 64 << 20)]:
        assert blocks.render(memory_limit=text).report["limits"]["memory_bytes"] == limit
    assert blocks.render(geometry_limit="50%").report["limits"]["geometry_bytes"] <= blocks._core.wide_bytes


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"memory_limit": "8 bananas"}, "render: memory_limit: '8 bananas' is not a size"),
        ({"memory_limit": -1}, "render: memory_limit: -1 is not a size"),
        ({"memory_limit": True}, "render: memory_limit: True is not a size"),
        ({"memory_limit": "1M", "geometry_limit": "2M"}, "geometry_limit: is more than memory_limit"),
        ({"geometry_limit": "101%"}, "geometry_limit: '101%' is not a percentage"),
        ({"spp": 0}, "spp: a whole number from 1 to 65535"),
        ({"spp": 1.5}, "spp: a whole number"),
        ({"width": 0}, "width: a whole number from 1"),
        ({"width": 1 << 20, "height": 1 << 20}, "2.31 pixels"),
        ({"time": 0}, "time: a number from"),
        ({"seed": -1}, "seed: a whole number"),
        ({"policy": "best"}, "'best' is not a policy"),
        ({"traversal": "foot"}, "'foot' is not a kind of traversal"),
        ({"connection": "none"}, "'none' is not a kind of connection"),
        ({"resume": True}, "resume: from which file"),
        ({"background": "#12"}, "render: background: '#12' is not a colour"),
        ({"camera": 42}, "render: camera: one of raypager's is expected"),
        ({"camera": "here"}, "'here'"),
        ({"checkpoint": "/nowhere/a.ckpt"}, "/nowhere"),
    ],
)
def test_wrong_options_are_said_in_one_line(scene: rp.Scene, options: dict[str, Any], words: str) -> None:
    with pytest.raises(rp.Error, match=words) as caught:
        scene.render(**options)
    assert "\n" not in str(caught.value)
    with pytest.raises(TypeError, match="spq"):
        scene.render(spq=4)  # type: ignore[call-arg]
    with pytest.raises(rp.Error, match="a scene, blocks or a path"):
        rp.render(42)  # type: ignore[arg-type]


def test_one_side_follows_the_other(scene: rp.Scene) -> None:
    assert scene.render(width=16).film.shape == (12, 16, 3)
    assert scene.render(height=48).film.shape == (48, 64, 3)


def test_backgrounds(scene: rp.Scene) -> None:
    blue = scene.render(background=(0, 0, 1), camera=rp.look_at((0, 0.1, 2), (0, 0.5, 0), size=(32, 24)))
    assert np.array_equal(blue.film[0, 0], [0, 0, 1])
    clear = scene.render(background="transparent")
    assert clear.film.shape == (24, 32, 4) and clear.film[..., 3].min() == 0 and clear.film[..., 3].max() == 1


def test_is_driven_step_by_step(scene: rp.Scene) -> None:
    whole = scene.render(spp=64)
    with rp.Render(scene, spp=64, interval=0) as render:
        assert not render.done and render.size == (32, 24)
        seen = []
        for progress in render:
            seen.append(progress.fraction)
            assert render.snapshot().shape == (24, 32, 3)
        picture = render.finish()
    assert len(seen) > 1 and seen == sorted(seen) and seen[-1] == 1
    assert picture.film.tobytes() == whole.film.tobytes() and picture.complete
    assert render.done and render.finish() is picture and render.progress.fraction == 1
    with pytest.raises(rp.Error, match="has ended"):
        render.snapshot()


def test_a_cancelled_render_has_a_picture(scene: rp.Scene) -> None:
    render = rp.Render(scene, spp=65535, width=200, height=150)
    threading.Timer(0.2, render.cancel).start()
    steps = sum(1 for _ in render)
    picture = render.finish()
    assert steps >= 1 and not picture.complete and 0 < picture.report["image"]["average_spp"] < 65535
    assert np.isfinite(picture.film).all()


def test_time_ends_a_render(scene: rp.Scene) -> None:
    report = scene.render(time=0.3).report
    assert report["image"]["spp"] >= 1 and report["image"]["complete"] and report["settings"]["time"] == 0.3


def test_goes_on_from_a_checkpoint(scene: rp.Scene, tmp_path: Path) -> None:
    whole = scene.render(spp=64, width=100, height=80)
    settings: dict[str, Any] = {"spp": 64, "width": 100, "height": 80, "checkpoint": tmp_path / "a.ckpt", "interval": 0}
    with rp.Render(scene, **settings) as render:
        next(render)
        render.checkpoint()
    with pytest.raises(rp.Error, match="a.ckpt"):
        scene.render(**settings)
    picture = scene.render(resume=True, **settings)
    assert picture.report["checkpoint"]["runs"] == 2
    assert picture.film.tobytes() == whole.film.tobytes()


def test_one_that_goes_on_and_ends_at_once_keeps_its_checkpoint(scene: rp.Scene, tmp_path: Path) -> None:
    settings: dict[str, Any] = {"spp": 64, "width": 100, "height": 80, "checkpoint": tmp_path / "a.ckpt", "interval": 0}
    for runs in (1, 2, 3):
        with rp.Render(scene, resume=runs > 1, **settings) as render:
            if runs == 1:
                next(render)
            assert render.progress.spp > 0
    picture = scene.render(resume=True, **settings)
    assert picture.report["checkpoint"]["runs"] == 4
    assert picture.film.tobytes() == scene.render(spp=64, width=100, height=80).film.tobytes()


INTERRUPTED = """
import sys
sys.path.insert(0, sys.argv[2])
import raypager as rp
from conftest import empty_scene, waves
scene = empty_scene(200, 150, 65535)
scene.mesh(*waves())
with rp.Render(scene, checkpoint=sys.argv[1], interval=float(sys.argv[3])) as render:
    render.step(0.1)
    print("on the way", flush=True)
    for progress in render:
        pass
"""


# Between two steps, and within one that would take days.
@pytest.mark.parametrize("interval", ["0", "1e6"])
def test_ctrl_c_leaves_a_whole_checkpoint(tmp_path: Path, interval: str) -> None:
    checkpoint = tmp_path / "a.ckpt"
    arguments = [sys.executable, "-c", INTERRUPTED, str(checkpoint), str(Path(__file__).parent), interval]
    child = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout is not None and "on the way" in child.stdout.readline()
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == -signal.SIGINT and "KeyboardInterrupt" in errors
    scene = empty_scene(200, 150, 65535)
    scene.mesh(*waves())
    render = rp.Render(scene, checkpoint=checkpoint, resume=True)
    render.cancel()
    report = render.finish().report
    assert report["checkpoint"]["runs"] == 2 and report["image"]["average_spp"] > 0  # it was whole, and has work in it


BAKE_INTERRUPTED = """
import sys, time
sys.path.insert(0, sys.argv[2])
import numpy as np, raypager as rp
from conftest import empty_scene
def chunks():
    for i in range(1000):
        print("on the way", flush=True)
        time.sleep(0.05)
        yield np.random.default_rng(i).random((1000, 3), np.float32)
scene = empty_scene()
scene.points(chunks, radius=0.01, count=1_000_000, colored=False)
scene.bake(sys.argv[1])
"""


def test_ctrl_c_ends_a_bake(tmp_path: Path) -> None:
    output = tmp_path / "a.rpb"
    child = subprocess.Popen(
        [sys.executable, "-c", BAKE_INTERRUPTED, str(output), str(Path(__file__).parent)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout is not None and "on the way" in child.stdout.readline()
    child.send_signal(signal.SIGINT)
    _, errors = child.communicate(timeout=45)  # all chunks would take longer
    assert child.returncode == -signal.SIGINT and "KeyboardInterrupt" in errors
    assert list(tmp_path.iterdir()) == []


def test_what_a_callback_raises_ends_a_bake(scene: rp.Scene) -> None:
    def broken(stage: str, fraction: float) -> None:
        raise LookupError(stage)

    with pytest.raises(LookupError):
        scene.bake(progress=broken)
    assert scene.render().complete


def test_other_threads_go_on(scene: rp.Scene) -> None:
    turns = 0
    ended = threading.Event()

    def work() -> None:
        scene.render(spp=300, width=100, height=80, interval=1e6)
        ended.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not ended.wait(0.001):
        turns += 1
    thread.join()
    assert turns > 20  # with the GIL held there would be none


def test_two_renders_at_once_are_the_same_as_one_by_one(scene: rp.Scene) -> None:
    blocks = scene.bake(block_size="16K")
    settings = [{"spp": 64, "seed": seed, "geometry_limit": "30%"} for seed in (1, 2)]
    alone = [blocks.render(**s).film.tobytes() for s in settings]
    together: dict[int, bytes] = {}
    threads = [threading.Thread(target=lambda i=i: together.update({i: blocks.render(**settings[i]).film.tobytes()})) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert alone == [together[0], together[1]] and alone[0] != alone[1]


def test_threads_may_share_a_render(scene: rp.Scene) -> None:
    whole = scene.render(spp=200).film.tobytes()
    render = rp.Render(scene, spp=200, interval=0)
    threads = [threading.Thread(target=lambda: [render.snapshot() for _ in render]) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert render.finish().film.tobytes() == whole


# What a process has after 40 turns, and after all. In one of its own, for others leave their caches and pieces of memory.
GROWTH = """
import gc, os, sys
sys.path.insert(0, sys.argv[1])
import raypager as rp
from conftest import empty_scene, waves
def resident():
    return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
def whole():
    scene = empty_scene(128, 96, 1)
    scene.mesh(*waves())
    scene.points(lambda: iter([waves()[0]]), radius=0.01)
    return scene.render().report["peak"]["memory_bytes"]
def abandoned():
    rp.Render(blocks, spp=1000, paths=2048).step(0)
    return 0
blocks = empty_scene(128, 96, 1).bake()
used = []
for turn in range(int(sys.argv[3])):
    if turn == 40:
        gc.collect()
        before = resident()
    used.append(globals()[sys.argv[2]]())
gc.collect()
print(min(used), max(used), resident() - before)
"""


@pytest.mark.parametrize(("kind", "turns"), [("whole", 140), ("abandoned", 80)])
def test_a_hundred_renders_leave_nothing_behind(kind: str, turns: int) -> None:
    run = subprocess.run([sys.executable, "-c", GROWTH, str(Path(__file__).parent), kind, str(turns)], check=True, capture_output=True, text=True)
    least, most, growth = map(int, run.stdout.split())
    assert least == most
    if kind == "whole":
        assert 100 * most > 50 << 20  # what would be left behind, if renders kept what they have on the device
    assert growth < 8 << 20


def test_pictures_are_written(scene: rp.Scene, tmp_path: Path) -> None:
    picture = scene.render()
    picture.save(tmp_path / "a.pfm")
    assert rp.read_image(tmp_path / "a.pfm").tobytes() == picture.film.tobytes()
    picture.save(tmp_path / "b.pfm", exposure=1)
    assert np.array_equal(rp.read_image(tmp_path / "b.pfm"), 2 * picture.film)
    rp.save(tmp_path / "c.pfm", picture.film[::2, ::-1])
    assert np.array_equal(rp.read_image(tmp_path / "c.pfm"), picture.film[::2, ::-1])
    with pytest.raises(rp.Error, match="a picture of shape"):
        rp.save(tmp_path / "d.pfm", picture.film[0])
    with pytest.raises(rp.Error, match="nowhere"):
        picture.save(tmp_path / "nowhere" / "a.pfm")


def test_devices_and_facts(scene: rp.Scene) -> None:
    found = rp.devices()
    assert sum(d.is_default for d in found) == 1 and found[0].index == 0 and found[0].memory_bytes > 0
    blocks = scene.bake()
    assert "1152 triangles" in repr(blocks) and "Picture(32x24" in repr(blocks.render()) and rp.__version__.count(".") == 2
    assert blocks.render(device=found[0].index).film.tobytes() == blocks.render().film.tobytes()
