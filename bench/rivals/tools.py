"""The renderers: raypager as a program, a rival in a process of its own that loads a scene once and then renders on demand."""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from . import pictures


class Failed(Exception):
    """One line for the user."""


class Render(NamedTuple):
    picture: np.ndarray
    samples: int  # per pixel; some renderers round what is asked for
    seconds: float  # of rendering alone
    whole: float  # with starting and reading or building what the scene needs
    processor: float  # processor seconds of rendering, on all cores
    memory: int  # most bytes of main memory that the process had at once


class Renderer(Protocol):
    """A rival's side, in its own process: __init__(scene, width, height) reads the scene."""

    build: float  # seconds of reading the scene and building hierarchies
    device: str
    kind: str  # "CPU" or "GPU" as raypager's reports have it, or "" for any
    version: str

    def render(self, samples: int, seed: int) -> tuple[np.ndarray, int, float]:
        """Picture, samples per pixel, and seconds of rendering alone. May take more arguments, which requests then bring."""


def run(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise Failed(f"{' '.join(map(str, command))}: {(done.stderr.strip() or done.stdout.strip() or 'failed')[-2000:]}")
    return done.stdout


class Raypager:
    """The program with a baked scene; limit: as of its --geometry-limit."""

    def __init__(self, program: Path, device: str | None, scene: Path, size: str, build: float, work: Path):
        self.program, self.device, self.scene, self.size, self.build, self.work = program, device, scene, size, build, work
        self.told: dict = {}  # report of the last render
        self.start = 0.0  # processor seconds of a process that renders next to nothing

    def warm_up(self) -> None:
        """Compiles kernels, and measures what starting takes."""
        self.render(1, 0)
        self.start = self.render(1, 0).processor

    def command(self, samples: int, seed: int, limit: str) -> list[str]:
        words = [self.program, "render", self.scene, "-o", self.work / "raypager.pfm", "--spp", samples, "--size", self.size, "--seed", seed]
        words += ["--report", self.work / "raypager.json"]
        words += ["--geometry-limit", limit] if limit != "100%" else []
        return [str(w) for w in words + (["--device", self.device] if self.device else [])]

    def render(self, samples: int, seed: int, limit: str = "100%") -> Render:
        command, log, began = self.command(samples, seed, limit), self.work / "raypager.log", time.monotonic()
        with open(log, "w") as said:
            process = subprocess.Popen(command, stdout=said, stderr=said)
            _, status, used = os.wait4(process.pid, 0)
        whole, process.returncode = time.monotonic() - began, os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            raise Failed(f"{' '.join(command)}: {log.read_text(errors='replace').strip()[-2000:] or 'failed'}")
        self.told = json.loads((self.work / "raypager.json").read_text())
        picture = pictures.read_pfm(self.work / "raypager.pfm")
        # The start that was measured held a sample, too.
        processor = (used.ru_utime + used.ru_stime - self.start) * (samples / (samples - 1) if self.start > 0 and samples > 1 else 1)
        return Render(picture, samples, self.told["seconds"]["render"], self.build + whole, max(0.0, processor), used.ru_maxrss << 10)


class Rival:
    """A process that runs `serve`. Failed if it does not start or ends."""

    def __init__(self, name: str, words: list[object], work: Path, environment: dict[str, str] | None = None):
        self.name, self.work = name, work
        self.command = [sys.executable, *map(str, words)]
        self.log = work / f"{name.replace('/', '-')}.log"
        with open(self.log, "w") as log:
            self.process = subprocess.Popen(
                self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log, text=True, env=os.environ | (environment or {})
            )
        self.told = self.answer()

    def answer(self) -> dict:
        line = self.process.stdout.readline()
        if not line:
            self.process.wait()
            last = self.log.read_text(errors="replace").strip().splitlines()[-1:]
            raise Failed(f"{self.name} ended: {' '.join(last) or 'it said nothing'}; all that it said is in {self.log}")
        return json.loads(line)

    def render(self, samples: int, seed: int, **more: object) -> Render:
        picture = self.work / "rival.npy"
        self.process.stdin.write(json.dumps({"samples": samples, "seed": seed, "picture": str(picture), "more": more}) + "\n")
        self.process.stdin.flush()
        told = self.answer()
        return Render(np.load(picture), told["samples"], told["seconds"], self.told["build"] + told["seconds"], told["processor"], told["memory"])

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait()


def serve(load: Callable[[], Renderer]) -> None:
    """A rival's process: what it is on the first line of standard output, then a line for each request on standard input."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    renderer = load()
    told = {name: getattr(renderer, name) for name in ("build", "device", "kind", "version")}
    print(json.dumps(told), file=answers, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        before = time.process_time()
        picture, samples, seconds = renderer.render(request["samples"], request["seed"], **request["more"])
        processor = time.process_time() - before
        np.save(request["picture"], np.ascontiguousarray(picture, np.float32))
        told = {"samples": samples, "seconds": seconds, "processor": processor}
        told["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10
        print(json.dumps(told), file=answers, flush=True)
    answers.close()
    os._exit(0)  # without destructors, some of which crash
