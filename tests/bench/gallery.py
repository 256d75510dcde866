#!/usr/bin/env python3
"""Every command of data/gallery/README.md, made small: tests/bench/gallery.py PROGRAM. What is downloaded has stand-ins; nothing is plotted."""
import re
import stat
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GALLERY = ROOT / "data" / "gallery"
PAGE = (GALLERY / "README.md").read_text(encoding="utf-8")
SMALLER = [(r"--spp \d+", "--spp 2"), (r"--size \d+x\d+", "--size 32x24"), (r"--triangles \S+", "--triangles 20K"), (r"--points \S+", "--points 20K"),
           (r"--preset \S+", "--instances 2K --triangles 20K"), (r"-limit \d+[MG]", "-limit 1G"),
           (r"(bench sweep [^&]*)--limits \S+", r"\1--limits 100%,20% --repeats 1 --reference-spp 4")]
TRIANGLE = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n" \
           "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 0 1\n3 0 1 2\n"
SCENE = 'LookAt 0 0 5 0 0 0 0 1 0\nCamera "perspective"\nWorldBegin\nLightSource "infinite"\nShape "sphere"\nWorldEnd\n'


def commands():
    return re.findall(r"^```\n(.*?)\n```$", PAGE, re.MULTILINE | re.DOTALL)


SURVEY = r"""
import struct, sys
from pathlib import Path
if "-sLO" in sys.argv:
    header = bytearray(227)  # LAS 1.2 with four points of format 0
    header[:4], header[24:26] = b"LASF", b"\x01\x02"
    struct.pack_into("<HII", header, 94, 227, 227, 0)
    struct.pack_into("<BHI", header, 104, 0, 20, 4)
    struct.pack_into("<6d", header, 131, 0.01, 0.01, 0.01, 0, 0, 0)
    struct.pack_into("<6d", header, 179, 1, 0, 1, 0, 1, 0)
    points = [struct.pack("<3i8x", 100 * x, 100 * y, 50 * x * y) for x in (0, 1) for y in (0, 1)]
    Path("autzen_trim.las").write_bytes(bytes(header) + b"".join(points))
"""


def stand_ins(folder):
    """Programs that leave what a download would: a survey, a scan, a scene."""

    def writes(path, text):
        return f"from pathlib import Path; path = Path({path!r}); path.parent.mkdir(); path.write_text({text!r})"

    programs = {"curl": SURVEY, "tar": writes("dragon_recon/dragon_vrip_res2.ply", TRIANGLE), "unzip": writes("coffee/scene.pbrt", SCENE)}
    for name, text in programs.items():
        path = folder / name
        path.write_text(f"#!{sys.executable}\n{text}\n", encoding="utf-8")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)


class Gallery(unittest.TestCase):
    program = ""

    def test_every_command_ends_in_its_picture(self):
        self.assertEqual(len(commands()), 7)
        for command in commands():
            for pattern, small in SMALLER:
                command = re.sub(pattern, small, command)
            with self.subTest(command=command), tempfile.TemporaryDirectory() as scratch:
                folder = Path(scratch)
                (folder / "bin").mkdir()
                stand_ins(folder / "bin")
                command = command.replace("build/raypager", self.program).replace("&& bench/plot_sweep.py results", "")
                words = ["bash", "-euo", "pipefail", "-c", f"PATH={folder}/bin:$PATH; {command}"]
                done = subprocess.run(words, cwd=folder, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                result = re.findall(r"-o (\S+)", command)[-1]
                self.assertTrue((folder / result).exists(), f"no {result}: {done.stderr}")

    def test_pictures_and_pages_are_there(self):
        for link in re.findall(r"\]\(([^)#]+)[^)]*\)", PAGE):
            if not link.startswith("http"):
                self.assertTrue((GALLERY / link).exists(), link)
        for picture in GALLERY.iterdir():
            self.assertLess(picture.stat().st_size, 512 * 1024, picture)
            self.assertTrue(picture.suffix == ".md" or f"({picture.name})" in PAGE, f"{picture.name} is on no page")


if __name__ == "__main__":
    Gallery.program = str(Path(sys.argv.pop()).resolve())
    unittest.main()
