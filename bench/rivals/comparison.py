"""Brings raypager and a rival to the same error, once their pictures agree."""

import argparse
import contextlib
import math
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from . import pictures, scenes, table
from .memory import DeviceMemory
from .tools import Failed, Raypager, Render, Rival, run


class Contestant(NamedTuple):
    """A way to render the scene: raypager at one limit, or the rival with one sampler."""

    name: str
    resident: str  # of the geometry
    render: Callable[[int, int], Render]  # samples, seed


class Prepared(NamedTuple):
    """A scene in both forms."""

    name: str
    baked: Path
    exported: Path  # scene.xml
    bake_seconds: float
    triangles: int
    vertices: int
    commands: list[str]


def prepare(options: argparse.Namespace, scene: str) -> Prepared:
    """Makes the scene if it is a kind of make-scene, bakes it, and writes it for others with vertices that triangles share."""
    folder = options.work / Path(scene).stem
    folder.mkdir(parents=True, exist_ok=True)
    commands = []

    def raypager(*words: object) -> float:
        began = time.monotonic()
        run(options.raypager, *words)
        commands.append(" ".join(["raypager", *map(str, words)]))
        return time.monotonic() - began

    source, bake_seconds = Path(scene), 0.0
    if scene in scenes.KINDS:
        raypager("make-scene", scene, "-o", folder / "made", "--triangles", options.triangles)
        source = folder / "made/scene.pbrt"
        if getattr(options, "materials", "diffuse") == "diffuse":
            scenes.all_diffuse(source)
    elif not source.exists():
        raise Failed(f"no such file, and no kind of scene; kinds are {', '.join(scenes.KINDS)}")
    baked = source
    if source.suffix != ".rpb":
        baked = folder / "scene.rpb"
        bake_seconds = raypager("bake", source, "-o", baked)
    for old in (folder / "exported").glob("mesh*.ply"):
        old.unlink()
    raypager("bench", "export", baked, "-o", folder / "exported")
    vertices, triangles = scenes.share_all_vertices(folder / "exported")
    return Prepared(scene, baked, folder / "exported/scene.xml", bake_seconds, triangles, vertices, commands)


class Comparison:
    """Of one scene. Reference: the mean of two pictures of raypager and two of the rival, once these agree."""

    def __init__(self, options: argparse.Namespace, work: Path, ours: list[Contestant], theirs: list[Contestant]):
        self.options, self.work, self.ours, self.theirs = options, work, ours, theirs

    def agree(self) -> tuple[pictures.Agreement, bool]:
        """Also leaves the pictures, and ten times their difference, where a user can look at them."""
        spp = self.options.reference_spp
        ours, theirs = (pictures.Twice(*(tool.render(spp, seed).picture for seed in seeds)) for tool, seeds in self.first_of_both())
        for name, picture in (("raypager", ours.picture), ("rival", theirs.picture), ("difference", 10 * abs(ours.picture - theirs.picture))):
            pictures.write_png(self.work / f"{name}.png", picture)
        found = pictures.agreement(theirs, ours)
        most_bias, most_difference = self.options.most_bias / 100, self.options.most_difference / 100
        if max(found.bias_error) > most_bias:
            raise Failed(f"the bias is known to {100 * max(found.bias_error):.2g} % alone; raise --reference-spp")
        self.reference, self.noise = (ours.picture + theirs.picture) / 2, (ours.noise + theirs.noise) / 4
        return found, found.within(most_bias, most_difference)

    def first_of_both(self) -> tuple[tuple[Contestant, tuple[int, int]], tuple[Contestant, tuple[int, int]]]:
        return (self.ours[0], (101, 102)), (self.theirs[0], (201, 202))

    def error(self, picture) -> float:
        error = pictures.error_to(picture, self.reference, self.noise)
        if error**2 < 2 * self.noise:
            raise Failed("the pictures are as good as the reference; raise --reference-spp")
        return error

    def samples(self, tool: Contestant, target: float) -> int:
        """That the tool takes to the target, about: timed renders then say what it really came to."""
        samples = self.options.spp
        for seed in range(7, 10):
            done = tool.render(samples, seed)
            wanted = pictures.samples_to(done.samples, self.error(done.picture), target)
            near = abs(math.log(wanted / done.samples)) < 0.2
            samples = min(max(wanted, done.samples // 8, 1), 8 * done.samples)
            if near:
                break
        return samples

    def measure(self) -> tuple[float, list[table.Row]]:
        """The root mean square error that is the target, and a row for each contestant."""
        first = self.ours[0].render(self.options.spp, 7)
        target = self.error(first.picture)
        samples = {id(tool): self.options.spp for tool in self.ours} | {id(tool): self.samples(tool, target) for tool in self.theirs}
        for tool in self.theirs:
            tool.render(samples[id(tool)], 999)  # some compile anew for each number of samples
        runs: dict[int, list[tuple[Render, float]]] = {}
        for repeat in range(self.options.repeats):
            for tool in self.ours + self.theirs:
                done = tool.render(samples[id(tool)], 1000 + repeat)
                runs.setdefault(id(tool), []).append((done, self.error(done.picture)))
                print(f"  {tool.name} {tool.resident}: {done.samples} spp, {done.seconds:.2f} s", file=sys.stderr, flush=True)
        return target, [self.row(tool, runs[id(tool)], target, tool in self.ours) for tool in self.ours + self.theirs]

    def row(self, tool: Contestant, runs: list[tuple[Render, float]], target: float, ours: bool) -> table.Row:
        def median(seconds: Callable[[Render, float], float]) -> float:
            return statistics.median(seconds(done, error) for done, error in runs)

        return table.Row(
            tool=tool.name,
            ours=ours,
            resident=tool.resident,
            samples=runs[0][0].samples,
            rmse=median(lambda _, error: error),
            render=median(lambda done, error: pictures.seconds_to(done.seconds, error, target)),
            whole=median(lambda done, error: done.whole - done.seconds + pictures.seconds_to(done.seconds, error, target)),
            processor=median(lambda done, error: pictures.seconds_to(done.processor, error, target)),
            memory=max(done.memory for done, _ in runs),
        )


def same_kind(raypager: Raypager, rivals: list[Rival]) -> None:
    """A GPU against a CPU would say nothing."""
    own = raypager.told["device"]
    for rival in rivals:
        if rival.told["kind"] not in ("", own["type"]):
            raise Failed(f"{rival.name} renders on a {rival.told['kind']}, raypager on {own['name']}; choose one with --raypager-device")


def contestants(
    options: argparse.Namespace, raypager: Raypager, started: list[tuple[str, Rival, dict]], gpu: DeviceMemory | None, idle: int
) -> tuple[list[Contestant], list[Contestant]]:
    """raypager's and the rival's. idle: bytes of the GPU in use before the rival was started, which keeps some until it is closed."""

    def metered(work: Callable[[], Render], before: Callable[[], int]) -> Render:
        if not gpu:
            return work()
        already = before()
        done, peak = gpu.during(work)
        return done._replace(memory=peak - already)

    def at(limit: str) -> Contestant:
        def render(samples: int, seed: int) -> Render:
            return metered(lambda: raypager.render(samples, seed, limit), gpu.now if gpu else int)

        return Contestant("raypager", limit, render)

    def of(name: str, rival: Rival, more: dict) -> Contestant:
        def render(samples: int, seed: int) -> Render:
            return metered(lambda: rival.render(samples, seed, **more), lambda: idle)

        return Contestant(name, "all", render)

    return [at(limit) for limit in options.limits.split(",")], [of(*each) for each in started]


def compare_scene(options: argparse.Namespace, scene: str, start: Callable[[Path, Path], list[tuple[str, Rival, dict]]]) -> dict:
    print(f"{scene}: making it", file=sys.stderr, flush=True)
    prepared = prepare(options, scene)
    work = options.work / Path(scene).stem
    raypager = Raypager(options.raypager, options.raypager_device, prepared.baked, options.size, prepared.bake_seconds, work)
    raypager.warm_up()
    with contextlib.ExitStack() as ends:
        gpu = DeviceMemory() if raypager.told["device"]["type"] == "GPU" and DeviceMemory.is_there() else None
        if gpu:
            ends.callback(gpu.close)
        idle = gpu.now() if gpu else 0
        started = start(prepared.exported, work)
        rivals = list({id(rival): rival for _, rival, _ in started}.values())
        for rival in rivals:
            ends.callback(rival.close)
        same_kind(raypager, rivals)
        comparison = Comparison(options, work, *contestants(options, raypager, started, gpu, idle))
        print(f"{scene}: comparing pictures", file=sys.stderr, flush=True)
        found, agree = comparison.agree()
        target, rows = comparison.measure() if agree else (None, [])
    return {
        "scene": scene,
        "triangles": prepared.triangles,
        "vertices": prepared.vertices,
        "size": options.size,
        "commands": prepared.commands + [" ".join(raypager.command(options.spp, 1000, "100%"))] + [" ".join(r.command) for r in rivals],
        "raypager": raypager.told["device"],
        "rival": {"version": rivals[0].told["version"], "device": rivals[0].told["device"]},
        "agreement": found._asdict(),
        "agree": agree,
        "target_rmse": target,
        "rows": [row._asdict() for row in rows],
    }


def compare(options: argparse.Namespace, start: Callable[[Path, Path], list[tuple[str, Rival, dict]]]) -> int:
    """Compares all scenes, writes result.json and result.md into the work folder and prints the latter. 0, or 1 if pictures differ or a
    scene fails.

    start: from scene.xml and a folder for logs, the rival's processes, already started: name, process, and what else a render is asked with."""
    results, failed = [], False
    for scene in options.scenes:
        try:
            results.append(compare_scene(options, scene, start))
        except (Failed, ValueError, OSError) as error:
            print(f"{Path(sys.argv[0]).parent.name}/{Path(sys.argv[0]).name}: {scene}: {error}", file=sys.stderr)
            failed = True
    if results:
        print(table.write(options.work, table.conditions(options, sys.argv, len(os.sched_getaffinity(0))), results))
    return 0 if not failed and all(result["agree"] for result in results) else 1
