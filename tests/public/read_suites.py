#!/usr/bin/env python3
"""Every mesh and point cloud of some public suites: is it read, and are as many triangles and points in it as other readers find?

    read_suites.py PROGRAM FOLDER     FOLDER keeps the suites between runs

The suites are packages: assimp's test models, the data and examples of CGAL's demos (Debian), test files of laspy, meshio, pyvista and pyntcloud (PyPI).
The other readers are trimesh, plyfile, laspy and numpy; they come into a virtual environment in FOLDER. Prints a line for each file that is refused
or counted differently, then totals. Refusals that are right are listed in expected.json, with the reason for each; exit status 1 if there is any
other, or any difference in counts that the program does not report itself.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

DEBIAN = ["assimp-testmodels", "libcgal-demo"]
PYPI = ["laspy==2.7.0", "meshio==5.3.5", "pyvista==0.49.1", "pyntcloud==0.3.1"]
READERS = ["trimesh", "plyfile", "laspy", "numpy"]
MESHES = {".ply", ".obj", ".off", ".stl"}
CLOUDS = {".las", ".laz", ".xyz", ".pts", ".asc"}


def fetch(folder):
    files = folder / "files"
    if files.is_dir():
        return files
    packages = folder / "packages"
    packages.mkdir(parents=True, exist_ok=True)
    subprocess.run(["apt-get", "download", "-q", *DEBIAN], cwd=packages, check=True)
    subprocess.run([sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--no-binary", ":all:", *PYPI, "-d", packages], stdout=subprocess.DEVNULL, check=True)
    unpacked = folder / "unpacking"
    shutil.rmtree(unpacked, ignore_errors=True)  # of a run that was broken off
    unpacked.mkdir()
    for package in packages.glob("*.deb"):
        subprocess.run(["dpkg-deb", "-x", package, unpacked / package.name.split("_")[0]], check=True)
    for package in [*packages.glob("*.tar.gz"), *unpacked.rglob("*.tar.gz")]:
        with tarfile.open(package) as archive:
            archive.extractall(unpacked / package.name.removesuffix(".tar.gz"))
    unpacked.rename(files)
    return files


def readers_python(folder):
    python = folder / "venv" / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *READERS], check=True)
    return python


# Runs in the virtual environment: prints the number of triangles and points that another reader finds, or null.
COUNT = r"""
import json, logging, sys, warnings
warnings.simplefilter("ignore"); logging.disable(logging.CRITICAL)
import numpy
def mesh(path):
    import trimesh
    loaded = trimesh.load(path, process=False, maintain_order=True, skip_materials=True)
    parts = loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else [loaded]
    triangles = sum(len(p.faces) for p in parts if hasattr(p, "faces"))
    return {"triangles": triangles} if triangles else {"points": sum(len(p.vertices) for p in parts)}
def las(path):
    import laspy
    points = laspy.read(path)
    good = numpy.ones(len(points), bool)
    if hasattr(points, "withheld"): good &= ~numpy.asarray(points.withheld, bool)
    kind = numpy.asarray(points.classification)
    good &= kind != 7
    if points.header.point_format.id >= 6: good &= kind != 18
    return {"points": int(good.sum())}
def text(path):
    rows = 0
    for line in open(path, errors="replace"):
        words = line.replace(",", " ").replace(";", " ").split()
        try: rows += len([float(w) for w in words[:3]]) == 3
        except ValueError: pass
    return {"points": rows}
for path in sys.stdin.read().splitlines():
    try: found = las(path) if path.endswith(".las") else mesh(path) if path.lower().endswith((".ply", ".obj", ".off", ".stl")) else text(path)
    except BaseException as error: found = {"error": str(error)[:100]}
    print(json.dumps(found), flush=True)
"""


def ours(program, path, scratch):
    baked = scratch / "baked.rpb"
    baked.unlink(missing_ok=True)
    outcome = subprocess.run([program, "bake", path, "-o", baked, "--no-ground", "--host-limit", "1G"], capture_output=True, text=True, timeout=600)
    said = outcome.stderr.strip()
    if outcome.returncode:
        return {"status": outcome.returncode, "said": said}
    scene = json.loads(subprocess.run([program, "inspect", baked, "--json"], capture_output=True, text=True, check=True).stdout)["scene"]
    # What was left out, as the program itself says.
    dropped = sum(int(n.replace(",", "")) for n in re.findall(r"([\d,]+) (?:triangles?|degenerate|faces?|points?|statements?)[^;,:]*? dropped", said))
    return {"status": 0, "said": said, "triangles": scene["triangles"], "points": scene["spheres"], "dropped": dropped}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    arguments = parser.parse_args()
    files = fetch(arguments.folder)
    python = readers_python(arguments.folder)
    paths = sorted(p for p in files.rglob("*") if p.is_file() and p.suffix.lower() in MESHES | CLOUDS)
    theirs = subprocess.run([python, "-c", COUNT], input="\n".join(map(str, paths)), capture_output=True, text=True, check=True).stdout.splitlines()
    expected = json.loads((pathlib.Path(__file__).parent / "expected.json").read_text())
    refused, different, wrong = 0, 0, 0
    with tempfile.TemporaryDirectory() as scratch:
        for path, other in zip(paths, map(json.loads, theirs)):
            name = str(path.relative_to(files))
            mine = ours(arguments.program, path, pathlib.Path(scratch))
            reason = next((r for pattern, r in expected.items() if re.search(pattern, name)), None)
            if mine["status"]:
                refused += 1
                wrong += reason is None
                print(f"refused{'' if reason else ' (NOT EXPECTED)'}: {name}: {mine['said'].splitlines()[-1] if mine['said'] else '(nothing said)'}"
                      f"{f' [{reason}]' if reason else ''} (other reader: {other})")
                continue
            for kind in ("triangles", "points"):
                if kind in other and mine[kind] != other[kind]:
                    different += 1
                    told = mine[kind] + mine["dropped"] == other[kind]
                    wrong += not told and reason is None
                    print(f"different{' (as it says)' if told else '' if reason else ' (NOT EXPECTED)'}: {name}: {mine[kind]} {kind}, other reader "
                          f"{other[kind]}; it says: {mine['said'].splitlines()[:3]}{f' [{reason}]' if reason else ''}")
    print(f"{len(paths)} files, {refused} refused, {different} counted differently, {wrong} of these not expected")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
