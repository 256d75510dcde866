#!/usr/bin/env python3
"""What renders take of an NVIDIA GPU's memory, as its driver counts it, against their --memory-limit.

    bench/driver_memory.py scene.rpb --limits 64M,96M,128M,192M,256M [--raypager build/raypager] [-- render options ...]

Samples the driver's count of used memory while each render runs, less what was used before the first; nothing else may run on that GPU.
What a render takes beyond its limit (the driver's context and the program's code) must not grow with the limit: exit status 1 if it does
by more than --slack, or if the program's own count passed the limit.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading

MIB = 1 << 20
UNITS = {"K": 1 << 10, "M": MIB, "G": 1 << 30}


def size(text):
    return int(text[:-1]) * UNITS[text[-1]] if text[-1] in UNITS else int(text)


class Sampler:
    """The largest "used" figure of a GPU that nvidia-smi printed since the last reset, in bytes."""

    def __init__(self, gpu):
        self.process = subprocess.Popen(
            ["nvidia-smi", f"--id={gpu}", "--query-gpu=memory.used", "--format=csv,noheader,nounits", "--loop-ms=20"],
            stdout=subprocess.PIPE, text=True)
        self.peak = self.samples = 0
        self.fresh = threading.Event()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.peak = max(self.peak, int(line) * MIB)
            self.samples += 1
            self.fresh.set()

    def reset(self):
        self.peak = self.samples = 0

    def wait_for_a_sample(self):
        self.fresh.clear()
        self.fresh.wait(10)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--limits", default="64M,96M,128M,192M,256M")
    parser.add_argument("--raypager", default="build/raypager")
    parser.add_argument("--gpu", default="0", help="as nvidia-smi numbers them")
    parser.add_argument("--slack", default="16M", help="by how much what is beyond the limit may differ")
    end = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    arguments, render_options = parser.parse_args(sys.argv[1:end]), sys.argv[end + 1:]

    sampler = Sampler(arguments.gpu)
    sampler.wait_for_a_sample()
    before = sampler.peak
    beyond, broken = [], False
    print(f"{before / MIB:.0f} MiB used before\n{'limit':>9} {'own count':>10} {'driver':>9} {'beyond':>9} {'samples':>8}   MiB")
    with tempfile.TemporaryDirectory() as folder:
        for text in arguments.limits.split(","):
            report = os.path.join(folder, "report.json")
            sampler.wait_for_a_sample()
            sampler.reset()
            subprocess.run([arguments.raypager, "render", arguments.scene, "-o", os.path.join(folder, "picture.pfm"), "--memory-limit",
                            str(size(text)), "--report", report, *render_options], check=True)
            with open(report) as file:
                own = json.load(file)["peak"]["memory_bytes"]
            driver = sampler.peak - before
            broken |= own > size(text)
            # A limit that was not used up says nothing of what lies beyond it.
            beyond.append(driver - own)
            print(f"{size(text) / MIB:9.1f} {own / MIB:10.1f} {driver / MIB:9.1f} {beyond[-1] / MIB:9.1f} {sampler.samples:8d}", flush=True)
    spread = max(beyond) - min(beyond)
    print(f"beyond the program's own count: {min(beyond) / MIB:.0f} to {max(beyond) / MIB:.0f} MiB")
    sampler.process.kill()
    sys.exit(1 if broken or spread > size(arguments.slack) else 0)


if __name__ == "__main__":
    main()
