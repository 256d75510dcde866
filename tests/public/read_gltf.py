#!/usr/bin/env python3
"""Are as many triangles in glTF files as another reader finds, at the same place, and do they lie in the same box?

    read_gltf.py PROGRAM [--folder FOLDER] [FILE...]

Files (.gltf, .glb) are given; with --folder also those of assimp's test models (Debian), which FOLDER keeps between runs. The other reader is trimesh
(PyPI), which must be installed, or be in a virtual environment in FOLDER, where it comes to by itself. Counted are the triangles that have an area,
in the world, those of instances once for each. Prints a line for each file that is refused or that differs, and the totals; exit status 1 if there is
any difference, or a file that is refused without being listed in expected.json.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

from read_suites import readers_python

TOLERANCE = 2e-6  # of the largest coordinate: positions are floats in the world

COUNT = r"""
import json, logging, sys, warnings
warnings.simplefilter("ignore"); logging.disable(logging.CRITICAL)
import numpy, trimesh
def look(path):
    scene = trimesh.load(path, process=False, force="scene", skip_materials=True)
    def with_area(p):
        return (numpy.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) != 0).any(axis=1)
    triangles, placed, corners, known = 0, 0, [], {}
    for node in scene.graph.nodes_geometry:
        place, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not hasattr(mesh, "faces"):
            continue
        if name not in known:
            p = numpy.asarray(mesh.vertices, numpy.float64)[mesh.faces]
            known[name] = p[with_area(p)]
        p = known[name].reshape(-1, 3) @ place[:3, :3].T + place[:3, 3]
        triangles += len(p) // 3
        placed += int(with_area(p.astype(numpy.float32).astype(numpy.float64).reshape(-1, 3, 3)).sum())
        if len(p): corners += [p.min(axis=0), p.max(axis=0)]
    if not corners: return {"triangles": 0, "placed": 0}
    return {"triangles": triangles, "placed": placed, "min": numpy.min(corners, axis=0).tolist(), "max": numpy.max(corners, axis=0).tolist()}
for path in sys.stdin.read().splitlines():
    try: found = look(path)
    except BaseException as error: found = {"error": f"{type(error).__name__}: {error}"[:100]}
    print(json.dumps(found), flush=True)
"""


def fetch(folder):
    models = folder / "assimp"
    if not models.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(["apt-get", "download", "-q", "assimp-testmodels"], cwd=folder, check=True)
        subprocess.run(["dpkg-deb", "-x", next(folder.glob("assimp-testmodels*.deb")), models], check=True)
    return sorted(p for p in models.rglob("*") if p.suffix.lower() in (".gltf", ".glb"))


def ours(program, path, scratch):
    baked = scratch / "baked.rpb"
    baked.unlink(missing_ok=True)
    outcome = subprocess.run([program, "bake", path, "-o", baked, "--host-limit", "1G"], capture_output=True, text=True, timeout=600)
    if outcome.returncode:
        return {"refused": outcome.stderr.strip().splitlines()[-1]}
    facts = json.loads(subprocess.run([program, "inspect", baked, "--json"], capture_output=True, text=True, check=True).stdout)
    said = re.search(r"baked ([\d,]+) triangles? \(([\d,]+) of them ground\)", outcome.stderr)
    ground = int(said.group(2).replace(",", "")) if said else 0
    shown = facts.get("instanced_primitives") or facts["scene"]["triangles"]
    return {"triangles": shown - ground, **facts["bounds"], "said": outcome.stderr.strip().splitlines()}


def differs(mine, other):
    # What is not instanced loses triangles whose area is lost where they are placed.
    if not other["placed"] <= mine["triangles"] <= other["triangles"]:
        return f"{mine['triangles']} triangles, the other reader {other['placed']} to {other['triangles']}"
    size = max(map(abs, other["min"] + other["max"]))
    if max(abs(a - b) for a, b in zip(mine["min"] + mine["max"], other["min"] + other["max"])) > TOLERANCE * size:
        return f"bounds {mine['min']} to {mine['max']}, the other reader's {other['min']} to {other['max']}"
    return None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--folder", type=pathlib.Path)
    parser.add_argument("files", type=pathlib.Path, nargs="*")
    arguments = parser.parse_args()
    paths = arguments.files + (fetch(arguments.folder) if arguments.folder else [])
    python = readers_python(arguments.folder) if arguments.folder else sys.executable
    theirs = subprocess.run([python, "-c", COUNT], input="\n".join(map(str, paths)), capture_output=True, text=True, check=True).stdout.splitlines()
    expected = json.loads((pathlib.Path(__file__).parent / "expected.json").read_text())
    refused, different, wrong = 0, 0, 0
    with tempfile.TemporaryDirectory() as scratch:
        for path, other in zip(paths, map(json.loads, theirs), strict=True):
            mine = ours(arguments.program, path, pathlib.Path(scratch))
            reason = next((r for pattern, r in expected.items() if re.search(pattern, str(path))), None)
            if "refused" in mine:
                refused += 1
                wrong += reason is None
                print(f"refused{'' if reason else ' (NOT EXPECTED)'}: {mine['refused']}{f' [{reason}]' if reason else ''} (other reader: {other})")
            elif "error" in other:
                print(f"read here alone: {path}: {mine['triangles']} triangles; other reader: {other['error']}")
            elif difference := differs(mine, other):
                different += 1
                wrong += reason is None
                print(f"different{'' if reason else ' (NOT EXPECTED)'}: {path}: {difference}{f' [{reason}]' if reason else ''}; it says: {mine['said'][:3]}")
    print(f"{len(paths)} files, {refused} refused, {different} different, {wrong} of these not expected")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
