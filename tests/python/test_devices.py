"""Several devices, in a process of its own: PoCL reads how many there are to be when it is first asked."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PROGRAM = """
import sys
import raypager as rp

pocl = [device.index for device in rp.devices() if device.platform == "Portable Computing Language"]
if len(pocl) < 2:
    print("skipped")
    sys.exit()
one = rp.render(sys.argv[1], width=48, height=36, spp=8, device=pocl[0])
two = rp.render(sys.argv[1], width=48, height=36, spp=8, device=pocl[:2], geometry_limit="30%")
assert one.film.tobytes() == two.film.tobytes()
assert [device["index"] for device in two.report["devices"]] == pocl[:2]
assert sum(device["paths"] for device in two.report["devices"]) == 48 * 36 * 8
for wrong, words in (([], "list is empty"), ([pocl[0], pocl[0]], "named twice"), ([pocl[0], 77], "77")):
    try:
        rp.render(sys.argv[1], device=wrong)
        raise SystemExit(f"{wrong} is taken")
    except rp.Error as error:
        assert words in str(error), error
"""


def test_share_a_picture(mesh_file: Path) -> None:
    environment = os.environ | {"POCL_DEVICES": "pthread pthread"}
    environment.pop("RAYPAGER_DEVICE", None)
    run = subprocess.run([sys.executable, "-c", PROGRAM, mesh_file], env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "skipped" not in run.stdout
