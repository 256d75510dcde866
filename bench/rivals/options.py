"""Options that all comparisons have, and the virtual environment that each runs in. Needs Python alone."""

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def parser(name: str, about: str, materials: bool = False) -> argparse.ArgumentParser:
    """materials: the rival has more than diffuse ones."""
    made = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = made.add_argument
    add("scenes", nargs="*", default=["cornell", "terrain", "clutter"], help="kinds of make-scene, or files as they are (default: these three)")
    add("--triangles", default="200K", help="of scenes that are made (default: 200K)")
    add("--raypager", type=Path, default=ROOT / "build/raypager", help="the program (default: build/raypager)")
    add("--raypager-device", help="raypager's device (default: its default)")
    add("--work", type=Path, default=Path(f"bench-{name}"), help=f"folder for everything made (default: bench-{name})")
    add("--here", action="store_true", help="use this Python and its packages, without a virtual environment of their own")
    add("--size", default="640x360", help="WxH (default: 640x360)")
    add("--spp", type=int, default=64, help="the error to reach is raypager's at so many samples per pixel (default: 64)")
    add("--reference-spp", type=int, default=1024, help="of the two pictures of each renderer that the reference is made of (default: 1024)")
    add("--limits", default="100%,29%,12.5%", help="how much of its geometry raypager may have resident (default: 100%%,29%%,12.5%%)")
    add("--repeats", type=int, default=3, help="interleaved; medians count (default: 3)")
    add("--most-bias", type=float, default=0.1, help="largest bias of a colour channel, in %% of its mean (default: 0.1)")
    add("--most-difference", type=float, default=1.0, help="largest difference that noise does not explain, in %% of the mean (default: 1)")
    if materials:
        add("--materials", choices=("diffuse", "own"), default="diffuse", help="of scenes that are made (default: diffuse, as for all rivals)")
    return made


def enter(made: argparse.ArgumentParser, packages: Sequence[str]) -> argparse.Namespace:
    """The options; run in a virtual environment with these packages, which is made if it is not there: then this starts the program anew."""
    options = made.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    if options.here:
        return options
    environment = options.work.resolve() / "venv"
    python, complete = environment / "bin/python", environment / "packages.txt"
    if not complete.exists() or complete.read_text().split() != list(packages):
        print(f"making {environment} with {', '.join(packages)}", file=sys.stderr, flush=True)
        for command in ([sys.executable, "-m", "venv", environment], [python, "-m", "pip", "install", "-q", "--only-binary=:all:", *packages]):
            if subprocess.run(command).returncode != 0:
                sys.exit(f"{environment} cannot be made; with these packages installed by hand, --here does without it: {' '.join(packages)}")
        complete.write_text(" ".join(packages) + "\n")
    if Path(sys.prefix).resolve() != environment:
        os.execv(python, [python, *sys.argv])
    return options
