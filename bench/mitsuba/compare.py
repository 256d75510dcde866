#!/usr/bin/env python3
"""Seconds to equal error: raypager against Mitsuba 3, on the same cores or the same GPU.

Both trace paths of the same length at most, with next-event estimation, multiple importance sampling, roulette from the second event on and a box
filter. Samples are each renderer's own: raypager's are Sobol's, scrambled; Mitsuba's are tried with each of --samplers, and the fastest counts.
Seconds are those of rendering alone, with kernels compiled before; those with building also hold what Mitsuba takes to read the scene and build
its hierarchy, and raypager to bake, start and read it.
"""

import glob
import math
import os
import re
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from rivals import options  # noqa: E402

PACKAGES = ("mitsuba==3.9.1", "numpy")
VARIANTS = {"scalar": "scalar_rgb", "llvm": "llvm_ad_rgb", "cuda": "cuda_ad_rgb"}
SAMPLERS = ("independent", "multijitter", "stratified", "ldsampler")  # what the exported scene has sensors with
MOST_SAMPLES = {"llvm": 2**25, "cuda": 2**26}  # of all pixels, at once in memory


class Mitsuba:
    """See rivals.tools.Renderer."""

    def __init__(self, scene, width, height, variant):
        import drjit
        import mitsuba

        self.drjit, self.mitsuba, self.variant, self.pixels = drjit, mitsuba, variant, width * height
        mitsuba.set_variant(VARIANTS[variant])
        began = time.monotonic()
        self.scene = mitsuba.load_file(scene, width=width, height=height)
        self.wait()
        self.build = time.monotonic() - began
        self.sensors = {sensor.id(): sensor for sensor in self.scene.sensors()}
        self.version = f"Mitsuba {mitsuba.__version__}"
        self.device = VARIANTS[variant]
        self.kind = "GPU" if variant == "cuda" else "CPU"
        self.render(1, 0, "independent")  # compiles

    def wait(self):
        if self.variant != "scalar":
            self.drjit.sync_thread()

    def render(self, samples, seed, sampler):
        import numpy as np

        began = time.monotonic()
        picture, used = self.passes(samples, seed, sampler)
        return np.array(picture), used, time.monotonic() - began

    def passes(self, samples, seed, sampler):
        """All of their samples are in memory at once, so there may be several."""
        most = max(1, MOST_SAMPLES.get(self.variant, math.inf) // self.pixels)
        if sampler != "independent" and samples > most:
            most = 4 ** int(math.log(most, 4))  # which every sampler takes as it is
        sensor, total, used, seed = self.sensors[sampler], 0, 0, 10007 * seed
        while used < samples:
            part = self.mitsuba.render(self.scene, sensor=sensor, spp=int(min(samples - used, most)), seed=seed)
            done = sensor.sampler().sample_count()
            total, used, seed = total + part * done, used + done, seed + 1
            if self.variant != "scalar":
                self.drjit.eval(total)
            self.wait()
        return total / used, used


def llvm_libraries():
    """Newest first; one that the environment names, alone."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return [os.environ["DRJIT_LIBLLVM_PATH"]]
    found = {}
    for path in glob.glob("/usr/lib/*/libLLVM*.so*") + glob.glob("/usr/lib/llvm-*/lib/libLLVM*.so*"):
        version = re.search(r"libLLVM[-.so]*(\d+)", os.path.realpath(path))
        if version:
            found[int(version.group(1))] = path
    return [path for _, path in sorted(found.items(), reverse=True)]


def start(chosen, scene, work):
    """Of the libraries of LLVM the first with which it runs."""
    from rivals.tools import Failed, Rival

    libraries, failed = llvm_libraries() if chosen.variant == "llvm" else [None], Failed("no libLLVM is installed; apt-get install libllvm19")
    for library in libraries:
        environment = {"DRJIT_LIBLLVM_PATH": library} if library else {}
        try:
            rival = Rival(f"mitsuba-{chosen.variant}", [__file__, "--serve", scene, *chosen.size.split("x"), chosen.variant], work, environment)
            return [(f"Mitsuba, {sampler}", rival, {"sampler": sampler}) for sampler in chosen.samplers.split(",")]
        except Failed as error:
            failed = error
    raise failed


def main():
    made = options.parser("mitsuba", __doc__, materials=True)
    made.add_argument("--variant", choices=VARIANTS, default="llvm", help="scalar and llvm are for CPUs, cuda for NVIDIA's GPUs (default: llvm)")
    made.add_argument("--samplers", default="independent,multijitter", help=f"of {', '.join(SAMPLERS)} (default: independent,multijitter)")
    chosen = options.enter(made, PACKAGES)
    unknown = set(chosen.samplers.split(",")) - set(SAMPLERS)
    if unknown:
        made.error(f"no such sampler: {', '.join(unknown)}")
    from rivals.comparison import compare

    sys.exit(compare(chosen, lambda scene, work: start(chosen, scene, work)))


def serve(scene, width, height, variant):
    from rivals import tools

    tools.serve(lambda: Mitsuba(scene, int(width), int(height), variant))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    else:
        main()
