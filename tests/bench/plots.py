#!/usr/bin/env python3
"""A small sweep is measured and drawn: tests/bench/plots.py PROGRAM. Exit status 77, which ctest takes for skipped, where matplotlib is not there."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from html.parser import HTMLParser
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "bench" / "plot_sweep.py"
LIMITS, POLICIES = ("100%", "10%"), ("aged-wants", "sweep", "host")
FIGURES = {"convergence-aged-wants", "convergence-host", "convergence-sweep", "moved", "residency-aged-wants-10-percent", "residency-sweep-10-percent",
           "stall", "time"}


def sweep(program, folder):
    def run(*words):
        done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"raypager {' '.join(words)}: {done.stderr}")

    run("make-scene", "cornell", "-o", "a&b", "--triangles", "20K")
    run("bake", "a&b/scene.pbrt", "-o", "a&b.rpb", "--block-size", "16K")
    run("bench", "sweep", "a&b.rpb", "-o", "results", "--size", "32x24", "--spp", "2", "--reference-spp", "8", "--snapshots", "0.001", "--repeats", "2",
        "--limits", ",".join(LIMITS), "--policies", ",".join(POLICIES))
    return folder / "results"


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.pictures, self.text, self.rows = [], "", 0
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        self.pictures += [value for name, value in attributes if tag == "img" and name == "src"]
        self.rows += tag == "tr"

    def handle_data(self, data):
        self.text += data


class Plots(unittest.TestCase):
    results = None  # of a sweep; not changed

    def setUp(self):
        self.scratch = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.scratch)

    def draw(self, *words):
        return subprocess.run([sys.executable, SCRIPT, *words], capture_output=True, text=True)

    def copy(self):
        return Path(shutil.copytree(self.results, self.scratch / "copy"))

    def expect_error(self, *words, status=1, says):
        done = self.draw(*words)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertIn(says, done.stderr)
        if status == 1:
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)

    def test_figures_and_a_page_that_shows_them(self):
        folder = self.copy()
        done = self.draw(folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual({file.stem for file in folder.glob("*.svg")}, FIGURES)
        for file in folder.glob("*.svg"):
            self.assertTrue(xml.parse(file).getroot().tag.endswith("svg"))
        page = Page(folder / "sweep.html")
        self.assertEqual(sorted(page.pictures), sorted(f"{name}.svg" for name in FIGURES))
        self.assertEqual(page.rows, 1 + 2 * 2 + 1)
        self.assertIn("a&b.rpb at shrinking memory limits", page.text)
        self.assertIn("bit for bit", page.text)
        self.assertNotIn("nan", page.text)

    def test_pictures_in_another_folder(self):
        out = self.scratch / "new" / "folder"
        self.assertEqual(self.draw(self.results, "-o", out, "--format", "png", "--dpi", "40").returncode, 0)
        self.assertEqual({file.stem for file in out.glob("*.png")}, FIGURES)
        for file in out.glob("*.png"):
            self.assertEqual(file.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.assertFalse((self.results / "sweep.html").exists())

    def test_films_that_differ_are_said(self):
        folder = self.copy()
        told = json.loads((folder / "sweep.json").read_text())
        told["same_films"], told["different_films"] = False, ["one <differs>"]
        (folder / "sweep.json").write_text(json.dumps(told))
        self.assertEqual(self.draw(folder).returncode, 0)
        page = Page(folder / "sweep.html")
        self.assertIn("worth nothing", page.text)
        self.assertIn("one <differs>", page.text)

    def test_bad_input_is_one_line(self):
        self.expect_error(status=2, says="DIR")
        self.expect_error(self.results, "--format", "gif", status=2, says="gif")
        self.expect_error(self.scratch, says="sweep.json: not there")
        folder = self.copy()
        (folder / "residency.csv").write_text("run,round,seconds,block,came\n99,1,0.5,0,1\n")
        self.expect_error(folder, says="residency.csv: cannot be read: run 99")
        (folder / "residency.csv").write_text("something,else\n1,2\n")
        self.expect_error(folder, says="no column 'run'")
        (folder / "residency.csv").unlink()
        self.expect_error(folder, says="residency.csv: cannot be read: No such file")
        for text in ("{", "[]", "{}", '{"variants": [], "runs": [], "input": ["a"], "scene": {"blocks": 1}}'):
            (folder / "sweep.json").write_text(text)
            self.expect_error(folder, says="sweep.json: ")


if __name__ == "__main__":
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        print("no matplotlib (Debian: python3-matplotlib): plots are not tested")
        sys.exit(77)
    if len(sys.argv) != 2 or not os.access(sys.argv[1], os.X_OK):
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as scratch:
        Plots.results = sweep(Path(sys.argv[1]).resolve(), Path(scratch))
        done = unittest.main(argv=sys.argv[:1], exit=False)
    sys.exit(not done.result.wasSuccessful())
