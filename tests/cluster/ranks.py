"""Renders that several processes share, by mpirun: the film is that of one, also after a rank was killed and with another number of ranks.

usage: ranks.py RAYPAGER MPIRUN SILENT_RANK
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

PROGRAM, MPIRUN, SILENT_RANK = sys.argv[1:4]
LIMIT = 120  # seconds of one render
# Open MPI's words; others have their own defaults for both.
ENVIRONMENT = os.environ | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}


def program(*options: str) -> list[str]:
    return [PROGRAM, "render", "scene.rpb", "-o", "a.pfm", "--report", "a.json", "--size", "64x48", *options]


def command(ranks: int, *options: str) -> list[str]:
    return [*([MPIRUN, "-n", str(ranks)] if ranks > 0 else []), *program(*options)]


def render(ranks: int, *options: str, devices: int = 1) -> dict:
    Path("a.json").unlink(missing_ok=True)
    environment = ENVIRONMENT | {"POCL_DEVICES": " ".join(["pthread"] * devices)}
    run = subprocess.run(command(ranks, *options), env=environment, capture_output=True, text=True, timeout=LIMIT)
    assert run.returncode == 0, f"{ranks} ranks, {options}: exit status {run.returncode}: {run.stderr}"
    return json.loads(Path("a.json").read_text())


def check_films() -> None:
    for options in (["--spp", "32"], ["--spp", "64", "--adaptive", "0.1"]):
        one = render(0, *options)
        for ranks, devices, limit in ((1, 1, "30%"), (4, 1, "100%"), (2, 2, "5%")) if "32" in options else ((2, 1, "30%"),):
            report = render(ranks, *options, "--geometry-limit", limit, *(["--device", "0,1"] if devices > 1 else []), devices=devices)
            assert report["image"] == one["image"], f"{ranks} ranks of {devices} devices at {limit}: {report['image']}, not {one['image']}"
            assert len(report["devices"]) == ranks * devices
            assert sum(device["paths"] for device in report["devices"]) == report["rays"]["camera"]
            assert [device["rank"] for device in report["devices"]] == [rank for rank in range(ranks) for _ in range(devices)]
            for figure in ("loads", "evictions", "bytes_loaded"):
                assert sum(device[figure] for device in report["devices"]) == report["paging"][figure]
            assert abs(sum(device["stall_seconds"] for device in report["devices"]) - report["seconds"]["stall"]) < 1e-6
            if ranks > 1:
                assert len(report["ranks"]) == ranks
                assert report["peak"]["host_bytes"] == max(rank["peak_host_bytes"] for rank in report["ranks"]) > 0


def check_live_figures() -> None:
    """Rows of the log are of all ranks: a sample takes as many rays as in the finished render."""
    options = ["--spp", "1024", "--paths", "4096", "--log", "a.csv", "--snapshots", "0.2", "--geometry-limit", "30%"]
    run = subprocess.run(command(3, *options), env=ENVIRONMENT | {"POCL_DEVICES": "pthread"}, capture_output=True, text=True, timeout=LIMIT)
    assert run.returncode == 0, run.stderr
    *rows, last = [[float(cell or 0) for cell in row.split(",")] for row in Path("a.csv").read_text().splitlines()[1:]]
    assert len(rows) > 1, rows
    for row in rows:
        samples, loads, rays = row[1] / last[1], row[3] / last[3], row[5] / last[5]
        assert abs(rays - samples) < 0.1, f"{rays} of the rays for {samples} of the samples"
        assert samples < 0.2 or loads > 0.6 * samples, f"{loads} of the loads for {samples} of the samples"
    report = json.loads(Path("a.json").read_text())
    assert last[5] == report["rays"]["total"] and last[3] == report["paging"]["loads"]
    assert all(f"rank {rank} device 0" in run.stderr for rank in range(3)), run.stderr


def begin_until_kept(ranks: int, checkpoint: str, *options: str) -> tuple[subprocess.Popen, list[int]]:
    """A job that has written its checkpoint a few times since, or has ended; and its ranks. What it says goes into the file "said"."""
    file = Path(checkpoint)
    last, written = file.stat().st_mtime_ns if file.exists() else 0, 0
    with open("said", "w") as said:
        job = subprocess.Popen(command(ranks, *options), env=ENVIRONMENT, stdout=said, stderr=said, start_new_session=True)
    begin = time.monotonic()
    while job.poll() is None and time.monotonic() - begin < LIMIT and written < 3:
        time.sleep(0.02)
        if file.exists() and file.stat().st_mtime_ns > last:
            last, written = file.stat().st_mtime_ns, written + 1
    return job, [int(process) for process in subprocess.run(["pgrep", "-P", str(job.pid)], capture_output=True, text=True).stdout.split()]


# Of a few seconds, so that they can be stopped; adaptive ones are then past their first samples.
LONG = (["--spp", "1024", "--paths", "8192"], ["--spp", "256", "--paths", "8192", "--adaptive", "0.04"])


def check_killed_ranks() -> None:
    """A rank that is killed ends the render, which goes on from its last checkpoint with other numbers of ranks."""
    for options in LONG:
        expected = render(0, *options)["image"]
        kept = ["--checkpoint", "a.ckpt", "--checkpoint-every", "0.2", "--resume"]
        Path("a.ckpt").unlink(missing_ok=True)
        kills = 0
        for ranks in (3, 2):
            job, processes = begin_until_kept(ranks, "a.ckpt", *options, *kept)
            if job.poll() is None and processes:
                os.kill(processes[kills % len(processes)], signal.SIGKILL)
                assert job.wait(LIMIT) != 0, "the render went on without a rank"
                kills += 1
            job.wait(LIMIT)
        assert kills > 0, "every render ended before a rank could be killed"
        report = render(2, *options, *kept)
        assert report["image"] == expected, f"{options}: {report['image']}, not {expected}"
        assert report["checkpoint"]["runs"] > 1


def check_stops() -> None:
    """The clock ends all, and so does a signal to any of them: what is there is kept, and the render goes on from it."""
    by_clock = render(2, "--spp", "60000", "--paths", "8192", "--time", "0.5", "--snapshots", "0.1")
    assert 0 < by_clock["image"]["average_spp"] < 60000 and Path("a.pfm").stat().st_size > 0
    for options in LONG:
        expected = render(0, *options)["image"]
        kept = ["--checkpoint", "b.ckpt", "--checkpoint-every", "0.2", "--resume"]
        Path("b.ckpt").unlink(missing_ok=True)
        job, processes = begin_until_kept(3, "b.ckpt", *options, *kept)
        assert job.poll() is None and len(processes) == 3, "the render ended before a rank could be stopped"
        begun = Path("b.ckpt").stat().st_mtime_ns
        os.kill(processes[2], signal.SIGINT)
        assert job.wait(LIMIT) != 0
        assert Path("b.ckpt").stat().st_mtime_ns > begun, "what was there is not kept"
        kept_samples = re.search(r"has ([\d.]+) samples per pixel", Path("said").read_text())
        assert kept_samples and float(kept_samples[1]) > 8, f"a checkpoint behind the first samples was to be tried: {Path('said').read_text()}"
        # A number of ranks, or one process, in turn.
        for ranks in (0, 2) if "--adaptive" in options else (2,):
            Path("c.ckpt").write_bytes(Path("b.ckpt").read_bytes())
            report = render(ranks, *options, *kept[2:], "--checkpoint", "c.ckpt", "--snapshots", "0.2")
            assert report["image"] == expected, f"{ranks} ranks, {options}: {report['image']}, not {expected}"


def check_slow_rank() -> None:
    """A rank that is long busy with a round sees all that rank 0 wants, though it wants two things at once: the end, and a snapshot."""
    options = ["--spp", "60000", "--time", "0.4", "--snapshots", "0.4"]
    job = [MPIRUN, "-n", "1", *program(*options, "--paths", "1024"), ":", "-n", "1", *program(*options, "--paths", "256K")]
    for _ in range(3):
        run = subprocess.run(job, env=ENVIRONMENT | {"POCL_DEVICES": "pthread"}, capture_output=True, text=True, timeout=LIMIT)
        assert run.returncode == 0, run.stderr


def check_refusals() -> None:
    for wrong in (["--turntable", "3"], ["--memory-limit", "1"], ["--pool", "host"]):
        run = subprocess.run(command(2, *wrong), env=ENVIRONMENT, capture_output=True, text=True, timeout=LIMIT)
        assert run.returncode != 0, wrong
        lines = [line for line in run.stderr.splitlines() if line.startswith("raypager:")]
        assert len(lines) == 1, f"{wrong}: {run.stderr}"


def check_silent_ranks() -> None:
    """A rank that does not answer is named, and keeps nobody from ending the job with an error."""
    others = ["-n", "2", PROGRAM, "render", "scene.rpb", "-o", "a.pfm"]
    for wrong in (["--turntable", "3"], []):
        job = subprocess.Popen(
            [MPIRUN, "-n", "1", SILENT_RANK, ":", *others, *wrong], env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        watch = threading.Timer(LIMIT, job.kill)
        watch.start()
        lines = []
        for line in job.stderr:
            lines += [line] if line.startswith("raypager:") else []
            if "has waited for" in line:
                job.terminate()
        status = job.wait(LIMIT)
        watch.cancel()
        assert status != 0 and 1 <= len(lines) <= (2 if wrong else 1), lines
        assert ("--turntable" if wrong else "rank 1 has waited for 1") in lines[0] and ("rank 0, which" in lines[0]) == (not wrong), lines


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        subprocess.run([PROGRAM, "make-scene", "cornell", "-o", "scene", "--triangles", "30K"], check=True, capture_output=True)
        subprocess.run([PROGRAM, "bake", "scene/scene.pbrt", "-o", "scene.rpb", "--block-size", "32K"], check=True, capture_output=True)
        check_films()
        check_live_figures()
        check_killed_ranks()
        check_stops()
        check_slow_rank()
        check_refusals()
        check_silent_ranks()


main()
