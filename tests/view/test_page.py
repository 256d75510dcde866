"""The live view in a browser: what its user sees and does. python3 tests/view/test_page.py PROGRAM [FOLDER FOR SCREENSHOTS]

Needs chromium and python3-websocket; without them it says so and ends with exit status 77.
"""

import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

try:
    import browser
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)
if browser.program() is None:
    print("skipped: there is no chromium")
    sys.exit(77)

PROGRAM, SHOTS = "raypager", None
MEAN = """(() => {
    const canvas = document.getElementById("picture");
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let sum = 0;
    for (let i = 0; i < data.length; i += 4) sum += data[i] + data[i + 1] + data[i + 2];
    return sum / (data.length * 0.75);
})()"""
STATE = "window.raypager?.state"
PICTURE = "window.raypager?.picture.picture"


class Page(unittest.TestCase):
    """In the order of their names, in one page: a new program for each would take most of the time."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.stderr = open(cls.folder / "stderr", "w")
        for arguments in (
            ["make-scene", "clutter", "-o", "clutter", "--triangles", "300K"],
            ["bake", "clutter/scene.pbrt", "-o", "clutter.rpb", "--block-size", "64K"],
        ):
            subprocess.run([PROGRAM, *arguments], cwd=cls.folder, check=True, capture_output=True)
        cls.viewer = cls.start("view", "clutter.rpb", "--size", "640x360")
        cls.url = cls.viewer.stdout.readline().strip()
        cls.browser = browser.Browser(cls.folder)
        cls.browser.open(cls.url)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        if cls.viewer.poll() is None:
            cls.viewer.kill()
        cls.viewer.wait()
        cls.viewer.stdout.close()
        cls.stderr.close()
        cls.temporary.cleanup()

    @classmethod
    def start(cls, *arguments):
        return subprocess.Popen([PROGRAM, *arguments], cwd=cls.folder, stdout=subprocess.PIPE, stderr=cls.stderr, text=True)

    def shot(self, name):
        if SHOTS:
            self.browser.screenshot(SHOTS / f"{name}.png")

    def state(self, key):
        return self.browser.value(f"{STATE}.{key}")

    def place(self, x, y):
        """In the window, of a point of the picture in shares of its size."""
        box = self.browser.value("(b => [b.left, b.top, b.width, b.height])(document.getElementById('picture').getBoundingClientRect())")
        return box[0] + x * box[2], box[1] + y * box[3]

    def whole_picture(self, view):
        """Waits for one of that view or a later one, at full size."""
        return self.browser.wait(f"({PICTURE}?.view >= {view} && {PICTURE}.width === 640) && {PICTURE}.view")

    def test_01_shows_the_picture_as_it_converges(self):
        b = self.browser
        b.wait(f"{PICTURE}?.spp > 0")
        b.wait(f"{STATE}?.phase === 'rendering' && document.getElementById('title').textContent === 'clutter.rpb'")
        first = b.value(f"{PICTURE}.spp")
        self.shot("1_first")
        b.wait(f"{PICTURE}.spp > {first} + 1")
        self.assertGreater(b.value(MEAN), 10)
        self.assertGreater(self.state("rays_per_second"), 0)
        self.shot("2_converging")

    def test_02_exposes_it(self):
        b = self.browser
        set_exposure = "(v => { const e = document.getElementById('exposure'); e.value = v; e.dispatchEvent(new Event('input')); })"
        before = b.value(MEAN)
        b.value(f"{set_exposure}(2)")
        self.assertGreater(b.value(MEAN), 1.3 * before)
        b.value(f"{set_exposure}(0)")
        self.assertLess(abs(b.value(MEAN) / before - 1), 0.2)

    def test_03_moves_the_camera(self):
        b = self.browser
        for name, act in (
            ("orbit", lambda: b.drag(self.place(0.5, 0.5), self.place(0.7, 0.6))),
            ("pan", lambda: b.drag(self.place(0.5, 0.5), self.place(0.55, 0.45), button="right")),
            ("zoom", lambda: b.mouse("mouseWheel", *self.place(0.5, 0.5), deltaX=0, deltaY=-200)),
            ("fly", lambda: b.key("KeyW", 0.4)),
        ):
            with self.subTest(name):
                camera, view = self.state("camera"), self.state("view")
                act()
                b.wait(f"{STATE}.camera !== {camera!r} && {STATE}.view > {view} && !{STATE}.preview")
                self.assertGreater(self.state("resident_bytes"), 0)  # blocks stay
                self.whole_picture(self.state("view"))
        self.shot("3_moved")
        view = self.state("view")
        b.key("KeyR", 0)
        b.wait(f"{STATE}.camera === window.raypager.movement.first.text()")
        self.whole_picture(view + 1)

    def test_04_shows_something_at_once_while_it_moves(self):
        b = self.browser
        view = self.state("view")
        start, end = self.place(0.4, 0.5), self.place(0.6, 0.5)
        b.mouse("mousePressed", *start, buttons=1, clickCount=1)
        seen = set()
        for i in range(1, 41):
            b.mouse("mouseMoved", start[0] + (end[0] - start[0]) * i / 40, start[1], buttons=1)
            seen.add(b.value(f"{PICTURE}.view"))
            time.sleep(0.04)
        b.mouse("mouseReleased", *end, clickCount=1)
        self.assertGreater(len(seen), 3)
        self.whole_picture(view + 2)

    def test_05_tells_what_is_at_a_pixel(self):
        b = self.browser
        b.wait(f"{STATE}.spp > 1.5 && !{STATE}.preview")  # every pixel has a sample
        b.click(*self.place(0.5, 0.7))
        text = b.wait("(t => t.includes('depth') && t.includes('material') && t)(document.getElementById('pixel').textContent)")
        self.assertRegex(text, r"pixel 3(19|20|21), 25[123]")
        before = self.state("camera")
        b.click(*self.place(0.5, 0.7), count=2)  # orbits go about it
        b.wait(f"{STATE}.camera !== {before!r}")

    def test_06_maps_the_blocks(self):
        b = self.browser
        b.value("document.getElementById('blocks').click()")
        count = "['absent', 'coming', 'resident', 'wanted'].reduce((sum, s) => sum + Number(document.getElementById(`${s}-blocks`).textContent), 0)"
        b.wait(f"{count} === {STATE}.blocks")
        b.wait("""(c => c.width > 0 && c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(v => v > 0))
            (document.getElementById('overlay'))""")
        self.shot("4_blocks")

    def test_07_goes_on_within_other_limits(self):
        b = self.browser
        whole, loads = self.state("pool_bytes"), self.state("loads")
        type_limit = """(t => { document.getElementById('limit').value = t; document.getElementById('limits').requestSubmit(); })"""
        b.value(f"{type_limit}('20%')")
        b.wait(f"{STATE}.pool_bytes < 0.25 * {whole}")
        spp = self.state("spp")
        b.wait(f"{STATE}.spp > {spp} + 0.5 && {STATE}.loads > {loads} + 20")
        time.sleep(1)
        self.shot("5_limit")
        b.value(f"{type_limit}('1')")
        b.wait("(n => !n.hidden && n.textContent.includes('limit'))(document.getElementById('notice'))")
        self.assertLess(self.state("pool_bytes"), 0.25 * whole)
        b.value(f"{type_limit}('')")
        b.wait(f"{STATE}.pool_bytes === {whole}")

    def test_08_hands_out_camera_and_picture(self):
        b = self.browser
        b.call("Browser.grantPermissions", permissions=["clipboardReadWrite", "clipboardSanitizedWrite"])
        b.value("document.getElementById('copy').click()")
        b.wait("!document.getElementById('notice').hidden")
        line = b.wait("navigator.clipboard.readText()")
        self.assertEqual(line, f"--camera {self.state('camera')}")
        subprocess.run(
            [PROGRAM, "render", "clutter.rpb", "-o", "same.pfm", "--size", "16x9", "--spp", "1", *line.split()],
            cwd=self.folder,
            check=True,
            capture_output=True,
        )
        b.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(self.folder))
        for name, magic in (("png", b"\x89PNG"), ("exr", b"\x76\x2f\x31\x01")):
            b.value(f"document.getElementById('save-{name}').click()")
            path, end = self.folder / f"raypager.{name}", time.monotonic() + browser.PATIENCE
            while not path.exists() or path.stat().st_size == 0:
                self.assertLess(time.monotonic(), end, path)
                time.sleep(0.05)
            self.assertEqual(path.read_bytes()[:4], magic)

    def test_09_asks_nobody_else_and_complains_of_nothing(self):
        b = self.browser
        elsewhere = [a for a in b.addresses if not a.startswith(self.url) and not a.startswith("data:") and a != "about:blank"]
        self.assertEqual(elsewhere, [])
        # Refused limits are errors of requests that the page expects.
        self.assertEqual([e for e in b.errors if "400" not in e], [])

    def test_10_ends_with_the_program(self):
        self.viewer.send_signal(signal.SIGINT)
        self.assertEqual(self.viewer.wait(browser.PATIENCE), 0)
        lines = (self.folder / "stderr").read_text().splitlines()
        self.assertEqual(len(lines), 1, lines)
        self.browser.wait("document.getElementById('phase').textContent.startsWith('ended')")
        self.shot("6_ended")

    def test_11_watches_a_render(self):
        b = self.browser
        render = self.start("render", "clutter.rpb", "-o", "watched.pfm", "--size", "640x360", "--spp", "24", "--view")
        b.open(render.stdout.readline().strip())
        b.wait(f"{PICTURE}?.spp > 0 && {STATE}?.phase === 'rendering'")
        self.assertFalse(self.state("camera_moves"))
        self.shot("7_render")
        self.assertEqual(render.wait(120), 0)
        render.stdout.close()
        b.wait("document.getElementById('phase').textContent.startsWith('ended')")
        plain = subprocess.run(
            [PROGRAM, "render", "clutter.rpb", "-o", "plain.pfm", "--size", "640x360", "--spp", "24"], cwd=self.folder, capture_output=True, text=True
        )
        self.assertEqual(plain.returncode, 0, plain.stderr)
        self.assertEqual((self.folder / "watched.pfm").read_bytes(), (self.folder / "plain.pfm").read_bytes())


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
    if len(sys.argv) > 2:
        SHOTS = pathlib.Path(sys.argv[2])
        SHOTS.mkdir(parents=True, exist_ok=True)
    outcome = unittest.main(argv=sys.argv[:1], verbosity=2, exit=False).result
    bad = len({str(test) for test, _ in outcome.failures + outcome.errors})
    print(f"{bad} tests failed out of {outcome.testsRun}")
    sys.exit(not outcome.wasSuccessful())
