"""The examples, the notebook and the README's lines, at sizes that take seconds; and the types."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import raypager as rp
from conftest import waves, write_ply

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "src" / "python" / "examples"

ARGUMENTS = {
    "mesh_file": ["{mesh}", "{picture}"],
    "height_field": ["{picture}"],
    "chunks_of_points": ["{folder}/a.rpb", "{picture}", "20000"],
    "forest": ["{picture}", "50"],
    "watched": ["{mesh}", "{picture}", "4"],
}


def test_every_example_is_run_and_short() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(ARGUMENTS)
    for path in EXAMPLES.glob("*.py"):
        assert len(path.read_text().splitlines()) < 40


# Their pictures are small here: what the file says of sizes and samples is put in its place.
def small(text: str) -> str:
    text = re.sub(r"width=\d+, height=\d+", "width=32, height=24", text)
    return re.sub(r"spp=\d+", "spp=2", text)


def ending() -> str:
    return "png" if rp._raypager.writes_png else "pfm"


@pytest.mark.parametrize("name", ARGUMENTS)
def test_example(name: str, tmp_path: Path) -> None:
    write_ply(tmp_path / "mesh.ply", *waves())
    picture = tmp_path / f"a.{ending()}"
    script = tmp_path / f"{name}.py"
    script.write_text(small((EXAMPLES / f"{name}.py").read_text()))
    values = {"mesh": tmp_path / "mesh.ply", "picture": picture, "folder": tmp_path}
    arguments = [a.format(**values) for a in ARGUMENTS[name]]
    subprocess.run([sys.executable, "-W", "error", script, *arguments], check=True, cwd=tmp_path)
    assert rp.read_image(picture).shape == (24, 32, 3)


def test_the_readmes_lines(tmp_path: Path) -> None:
    text = (ROOT / "README.md").read_text()
    block = text.split("<!-- begin: python -->")[1].split("<!-- end: python -->")[0]
    code = block.split("```python\n")[1].split("```")[0]
    assert len(code.splitlines()) <= 12
    write_ply(tmp_path / "statue.ply", *waves())
    (tmp_path / "a.py").write_text(small(code).replace(".png", f".{ending()}"))
    subprocess.run([sys.executable, "-W", "error", "a.py"], check=True, cwd=tmp_path)


def test_notebook(tmp_path: Path) -> None:
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    if ending() != "png":
        pytest.skip("pictures are shown as PNG, which this build does not write")
    path = EXAMPLES / "tour.ipynb"
    assert path.stat().st_size < 16 << 10
    cells = json.loads(path.read_text())["cells"]
    assert all(not cell["outputs"] for cell in cells if cell["cell_type"] == "code")
    notebook = nbformat.reads(small(path.read_text()), as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute(cwd=str(tmp_path))


def test_types(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    # Not in the checkout, where the package's sources would be found without the part that is compiled.
    command = [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", os.fspath(tmp_path / "cache")]
    for what in (["-p", "raypager"], list(map(str, EXAMPLES.glob("*.py")))):
        run = subprocess.run([*command, *what], cwd=tmp_path, capture_output=True, text=True)
        assert run.returncode == 0, run.stdout
