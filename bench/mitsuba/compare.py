#!/usr/bin/env python3
"""Time to equal error: raypager on a CPU device against Mitsuba 3, on the same cores.

Measures: how long each takes to bring a picture to the same root mean square error against a common reference, for all of the geometry
resident in raypager and for parts of it. What counts is the ratio raypager / Mitsuba; below 1, raypager is faster.

Same for both: geometry, camera, materials and lights (raypager bench export writes them), path tracing with next-event estimation and multiple
importance sampling, depth, Russian roulette from the second scattering event on (of 2, 3 and 5 the best for either; by which chance a path goes
on is each tool's own), box filter, float32, cores. Samples are each tool's own: raypager's are Sobol's, scrambled; Mitsuba's are tried with each
of --samplers, and the fastest counts.
Times are those of rendering alone: no loading, baking, building of hierarchies or compiling of kernels, for either.
The reference is the mean of two pictures of each tool at many samples. How far the tools are apart is printed: were it more than their noise
explains (how much that is, the two pictures of each tell), they would not render the same scene, and the comparison would be void (exit
status 1).

    bench/mitsuba/compare.py scene.pbrt --install                # once: makes a virtual environment with Mitsuba from PyPI
    bench/mitsuba/compare.py scene.rpb --target-spp 64 --shares 100,50,12.5

Needs nothing but Python 3.9 and, for Mitsuba's llvm_ad_rgb, which is about twice as fast as scalar_rgb, a libLLVM: of those that are installed,
the newest with which Mitsuba runs is taken (Debian 12: apt-get install libllvm19; versions 15 and 16 do not get along with AVX-512).
"""
import argparse
import glob
import json
import math
import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

MITSUBA = "mitsuba==3.9.1"
VARIANTS = ("llvm_ad_rgb", "scalar_rgb")
SAMPLERS = ("independent", "multijitter")  # the exported scene has sensors with "stratified" and "ldsampler", too


def arguments():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, help="a .pbrt scene, a mesh, or a baked scene (.rpb)")
    parser.add_argument("--raypager", type=Path, default=root / "build/raypager", help="the program (default: build/raypager)")
    parser.add_argument("--device", help="raypager's device (default: its default); a CPU, or the comparison makes no sense")
    parser.add_argument("--work", type=Path, default=Path("bench-mitsuba"), help="folder for everything made (default: bench-mitsuba)")
    parser.add_argument("--install", action="store_true", help=f"make a virtual environment in WORK/venv and install {MITSUBA} there")
    parser.add_argument("--size", default="640x360", help="WxH (default: 640x360)")
    parser.add_argument("--target-spp", type=int, default=64, help="the error to reach is that of raypager at so many samples (default: 64)")
    parser.add_argument("--reference-spp", type=int, default=2048, help="of each tool's pictures for the reference (default: 2048)")
    parser.add_argument("--shares", default="100,50,12.5", help="percentages of the geometry resident (default: 100,50,12.5)")
    parser.add_argument("--repeats", type=int, default=3, help="interleaved; medians count (default: 3)")
    parser.add_argument("--variants", default=",".join(VARIANTS), help=f"Mitsuba's; the fastest counts (default: {','.join(VARIANTS)})")
    parser.add_argument("--samplers", default=",".join(SAMPLERS), help=f"Mitsuba's; the fastest counts (default: {','.join(SAMPLERS)})")
    return parser.parse_args()


def run(command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"compare.py: failed: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


class Raypager:
    """Renders a baked scene; share: percent of the geometry resident."""

    def __init__(self, options, scene):
        self.options, self.scene = options, scene

    def render(self, picture, spp, share=100.0, seed=1):
        report = picture.with_suffix(".json")
        command = [self.options.raypager, "render", self.scene, "-o", picture, "--spp", spp, "--size", self.options.size, "--seed", seed,
                   "--report", report]
        if share < 100:
            command += ["--geometry-limit", f"{share}%"]
        if self.options.device:
            command += ["--device", self.options.device]
        run(command)
        told = json.loads(report.read_text())
        if told["device"]["type"].lower() != "cpu":
            sys.exit(f"compare.py: raypager renders on {told['device']['name']}, which is no CPU; choose one with --device")
        return told["seconds"]["render"], spp


class MitsubaProcess:
    """Mitsuba with the exported scene, loaded once."""

    def __init__(self, options, variant, scene):
        self.name = variant
        libraries = llvm_libraries() if variant.startswith("llvm") else [None]
        for library in libraries:
            environment = os.environ | ({"DRJIT_LIBLLVM_PATH": library} if library else {})
            command = [venv_python(options), __file__, "--serve", variant, str(scene), options.size]
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            stderr=subprocess.DEVNULL, text=True, env=environment)
            try:
                self.ask({"spp": 1, "seed": 0, "sampler": SAMPLERS[0], "picture": None})  # loads and compiles
                return
            except (RuntimeError, BrokenPipeError):
                self.process.kill()
        raise RuntimeError(f"Mitsuba's {self.name} does not run here")

    def ask(self, request):
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"Mitsuba's {self.name} ended")
        return json.loads(answer)


class Mitsuba:
    """Renders the exported scene with one of the samplers."""

    def __init__(self, process, sampler):
        self.process, self.sampler, self.name = process, sampler, f"{process.name}/{sampler}"
        process.ask({"spp": 4, "seed": 0, "sampler": sampler, "picture": None})  # compiles

    def render(self, picture, spp, share=100.0, seed=1):
        answer = self.process.ask({"spp": spp, "seed": seed, "sampler": self.sampler, "picture": str(picture)})
        return answer["seconds"], answer["spp"]  # some samplers round the number up


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


def serve(variant, scene, size):
    """Mitsuba's side: a request a line on standard input, the seconds of rendering a line on standard output."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    import drjit as dr
    import mitsuba as mi
    mi.set_variant(variant)
    width, height = (int(n) for n in size.split("x"))
    loaded = mi.load_file(scene, width=width, height=height)
    sensors = {sensor.id(): sensor for sensor in loaded.sensors()}
    for line in sys.stdin:
        request = json.loads(line)
        # All samples of a pass are in memory at once with llvm_ad_rgb.
        most = max(1, 2**25 // (width * height)) if variant.startswith("llvm") else request["spp"]
        if request["sampler"] != "independent" and request["spp"] > most:
            most = 4 ** int(math.log(most, 4))  # which every sampler takes as it is
        sensor, used = sensors[request["sampler"]], 0
        left, seed, total, began = request["spp"], request["seed"] * 10007, None, time.monotonic()
        while left > 0:
            spp = min(left, most)
            picture = mi.render(loaded, sensor=sensor, spp=spp, seed=seed) * sensor.sampler().sample_count()
            total = picture if total is None else total + picture
            dr.eval(total)
            dr.sync_thread()
            left, seed, used = left - spp, seed + 1, used + sensor.sampler().sample_count()
        seconds = time.monotonic() - began
        total = total / used
        if request["picture"]:
            mi.util.write_bitmap(request["picture"], total, write_async=False)
        print(json.dumps({"seconds": seconds, "spp": used}), file=answers, flush=True)


def venv_python(options):
    return options.work / "venv/bin/python"


def install(options):
    if not venv_python(options).exists():
        run([sys.executable, "-m", "venv", options.work / "venv"])
    run([venv_python(options), "-m", "pip", "install", "-q", MITSUBA])


def difference(options, picture, reference):
    return json.loads(run([options.raypager, "compare", picture, reference, "--json"]))


class Measurement:
    """Pilot renders say how many samples each tool needs; timed ones then confirm it."""

    def __init__(self, options, tools):
        self.options, self.tools = options, tools
        self.spp, self.power = {}, {}  # of each tool: samples to the target, and how its error falls with them

    def average_of_two(self, name, tool, seed):
        """A picture at twice the reference's samples, and its mean square error: the two halves tell."""
        halves = [self.options.work / f"reference-{name}-{half}.exr" for half in "ab"]
        for half, picture in enumerate(halves):
            tool.render(picture, self.options.reference_spp, seed=seed + half)
        return self.average(f"reference-{name}.exr", *halves), difference(self.options, *halves)["rmse"] ** 2 / 4

    def average(self, name, first, second):
        result = self.options.work / name
        run([venv_python(self.options), __file__, "--mean", first, second, result])
        return result

    def make_reference(self, raypager, mitsuba):
        """How far the tools are apart, and the mean square error of that difference."""
        own, own_noise = self.average_of_two("raypager", raypager, 101)
        other, other_noise = self.average_of_two("mitsuba", mitsuba, 201)
        self.reference = self.average("reference.exr", own, other)
        self.noise = (own_noise + other_noise) / 4
        return difference(self.options, other, own), own_noise + other_noise

    def error(self, picture):
        """RMSE against the truth: that against the reference, less the reference's own noise."""
        return math.sqrt(max(0.0, difference(self.options, picture, self.reference)["rmse"] ** 2 - self.noise))

    def pilot(self, tool, spp):
        picture = self.options.work / "pilot.exr"
        _, used = tool.render(picture, spp, seed=7)
        error = self.error(picture)
        if error ** 2 < 2 * self.noise:
            sys.exit("compare.py: the pictures are as good as the reference; raise --reference-spp")
        return error, used

    def find_spp(self, name, tool, target):
        """From two pilots, since the error does not fall with the same power of the samples for all tools."""
        error, first = self.pilot(tool, self.options.target_spp)
        factor = (error / target) ** 2
        factor = max(factor, 2) if factor > 1 else min(factor, 0.5)  # far enough apart to tell a power
        error_then, second = self.pilot(tool, max(4, round(first * factor)))
        self.power[name] = min(1.0, max(0.4, math.log(error / error_then) / math.log(second / first)))
        self.spp[name] = max(1, round(second * (error_then / target) ** (1 / self.power[name])))
        tool.render(self.options.work / "warm.exr", self.spp[name])  # some samplers compile anew for each number

    def timed(self, target):
        """Seconds to the target by (tool, share): of each repeat, corrected by what error it really came to."""
        seconds = {}
        for repeat in range(self.options.repeats):
            for name, tool, share in self.tools:
                spp, picture = self.spp[name], self.options.work / "timed.exr"
                took, spp = tool.render(picture, spp, share, seed=1000 + repeat)
                reached = self.error(picture)
                seconds.setdefault((name, share), []).append(took * (reached / target) ** (1 / self.power[name]))
                print(f"  {name:<24} {share:>5g} %  {spp:>6} spp  {took:>8.2f} s  RMSE {reached:.5g}", flush=True)
        return seconds


def mean(first, second, result):
    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    a, b = (mi.TensorXf(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)) for path in (first, second))
    mi.util.write_bitmap(result, (a + b) * 0.5, write_async=False)


def prepare(options):
    options.work.mkdir(parents=True, exist_ok=True)
    if options.install:
        install(options)
    if not venv_python(options).exists():
        sys.exit("compare.py: Mitsuba is not there; run with --install once")
    if options.scene.suffix == ".rpb":
        baked = options.scene
    else:
        baked = options.work / (options.scene.stem + ".rpb")
        run([options.raypager, "bake", options.scene, "-o", baked])
    run([options.raypager, "bench", "export", baked, "-o", options.work / "mitsuba"])
    return baked


def start_mitsubas(options):
    started = []
    for variant in options.variants.split(","):
        try:
            process = MitsubaProcess(options, variant, options.work / "mitsuba/scene.xml")
            started += [Mitsuba(process, sampler) for sampler in options.samplers.split(",")]
        except RuntimeError as error:
            print(f"compare.py: {error}; it is left out", file=sys.stderr)
    if not started:
        sys.exit("compare.py: no variant of Mitsuba runs")
    return started


def main():
    options = arguments()
    baked = prepare(options)
    raypager, mitsubas = Raypager(options, baked), start_mitsubas(options)
    shares = [float(s) for s in options.shares.split(",")]
    tools = [("raypager", raypager, share) for share in shares] + [(m.name, m, 100.0) for m in mitsubas]
    raypager.render(options.work / "warm.exr", 1)  # compiles the kernels

    measurement = Measurement(options, tools)
    apart, noise = measurement.make_reference(raypager, mitsubas[0])
    # Two independent pictures of this noise differ by this much if they are of the same scene.
    agree = apart["rmse"] ** 2 <= 2 * noise
    print(f"references: relative MSE {apart['relative_mse']:.3g}, RMSE {apart['rmse']:.3g}, of which noise {math.sqrt(noise):.3g}: "
          f"{'the same picture' if agree else 'NOT the same picture'}")

    target, _ = measurement.pilot(raypager, options.target_spp)
    print(f"target: RMSE {target:.4g}")
    measurement.spp["raypager"], measurement.power["raypager"] = options.target_spp, 0.5
    for mitsuba in mitsubas:
        measurement.find_spp(mitsuba.name, mitsuba, target)
    seconds = {key: statistics.median(all_of) for key, all_of in measurement.timed(target).items()}
    best = min((m.name for m in mitsubas), key=lambda name: seconds[name, 100.0])
    print(f"\nseconds to RMSE {target:.4g}, medians of {options.repeats}")
    for name in sorted({m.name for m in mitsubas}):
        print(f"  Mitsuba {name:<24}{seconds[name, 100.0]:>8.2f}")
    for share in shares:
        print(f"  raypager, {share:>5g} % resident      {seconds['raypager', share]:>8.2f}   ratio to Mitsuba "
              f"{seconds['raypager', share] / seconds[best, 100.0]:.2f}")
    result = {"scene": str(options.scene), "size": options.size, "cores": len(os.sched_getaffinity(0)), "target_rmse": target, "mitsuba": best,
              "references": apart | {"noise_rmse": math.sqrt(noise), "agree": agree},
              "seconds": [{"tool": n, "resident_percent": s, "seconds": t} for (n, s), t in seconds.items()]}
    (options.work / "result.json").write_text(json.dumps(result, indent=2) + "\n")
    sys.exit(0 if agree else 1)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
    elif sys.argv[1:2] == ["--mean"]:
        mean(*sys.argv[2:])
    else:
        main()
