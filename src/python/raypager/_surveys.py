"""Point clouds in formats that Python's libraries keep: LAZ and COPC (laspy with lazrs), Entwine tiles (EPT), E57 (pye57).

They are unpacked, a chunk at a time, into a scratch file in LAS, which the engine streams as any other. So the picture is that of the LAS file.
"""

from __future__ import annotations

import importlib
import json
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ._errors import Error

_CHUNK = 1_000_000  # points


def is_survey(path: str | os.PathLike[str]) -> bool:
    """Whether the engine needs this file unpacked: .laz (.copc.laz), .e57, or the ept.json of Entwine tiles."""
    name = os.fspath(path).lower()
    return name.endswith((".laz", ".e57")) or Path(name).name == "ept.json"


class Unpacked:
    """Paths whose surveys lie unpacked in a folder of their own, for as long as this is kept."""

    def __init__(self, paths: list[str]) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self.paths = [self._unpack(path, number) if is_survey(path) else path for number, path in enumerate(paths)]

    def _unpack(self, path: str, number: int) -> str:
        if not os.path.isfile(path):
            raise Error(f"{path}: no such file")
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="raypager-")
        # The name stays: messages have it.
        folder = Path(self._folder.name) / str(number)
        folder.mkdir()
        source = Path(path)
        target = folder / (source.resolve().parent.name + ".las" if source.name.lower() == "ept.json" else source.stem + ".las")
        try:
            if source.suffix.lower() == ".e57":
                _write_e57(source, target)
            else:
                _write_laz(_tiles_of_ept(source) if source.name.lower() == "ept.json" else [source], target)
        except Error:
            raise
        except OSError as error:
            raise Error(f"{path}: cannot be unpacked: {error}") from error
        except Exception as error:  # whatever the libraries make of damaged files
            raise Error(f"{path}: cannot be read: {' '.join(str(error).split()) or type(error).__name__}") from error
        return str(target)

    def close(self) -> None:
        """Removes what was unpacked."""
        if self._folder is not None:
            self._folder.cleanup()


def _library(name: str, path: Path, extra: str) -> Any:
    try:
        if name == "laspy":
            importlib.import_module("lazrs")
        return importlib.import_module(name)
    except ImportError as missing:
        package = missing.name or name
        raise Error(f"{path}: to read it takes the package {package}: pip install 'raypager[{extra}]', or pip install {package}") from missing


def _write_laz(sources: list[Path], target: Path) -> None:
    """The points of all sources, with the header of the first, as LAS."""
    laspy = _library("laspy", sources[0], "las")
    with laspy.open(sources[0]) as first:
        header = _plain_header(laspy, first.header)
    with laspy.open(target, mode="w", header=header, do_compress=False) as writer:
        for source in sources:
            with laspy.open(source) as reader:
                for points in reader.chunk_iterator(_CHUNK):
                    if (reader.header.scales != header.scales).any() or (reader.header.offsets != header.offsets).any():
                        points.change_scaling(scales=header.scales, offsets=header.offsets)
                    writer.write_points(points)


def _plain_header(laspy: Any, header: Any) -> Any:
    """Without what says how points are packed or sorted. Where it says in which system the coordinates are, that stays."""
    plain = laspy.LasHeader(version=header.version, point_format=header.point_format)
    plain.scales, plain.offsets = header.scales, header.offsets
    plain.global_encoding = header.global_encoding
    plain.vlrs = [record for record in header.vlrs if record.user_id not in ("laszip encoded", "copc")]
    return plain


def _tiles_of_ept(source: Path) -> list[Path]:
    """The files of all nodes, coarse ones first."""
    about = json.loads(source.read_text())
    if about.get("dataType") != "laszip":
        raise Error(f"{source}: has points of the type {about.get('dataType')!r}; laszip can be read")
    found: list[str] = []
    pages, seen = ["0-0-0-0"], {"0-0-0-0"}
    while pages:
        page = pages.pop()
        for node, count in json.loads((source.parent / "ept-hierarchy" / f"{page}.json").read_text()).items():
            if not all(part.isdigit() for part in node.split("-")):
                raise Error(f"{source}: has a node named {node!r}; it is damaged")
            if count == -1 and node not in seen:
                seen.add(node)
                pages.append(node)
            elif count > 0:
                found.append(node)
    if not found:
        raise Error(f"{source}: has no points")
    found.sort(key=lambda node: [int(part) for part in node.split("-")])
    return [source.parent / "ept-data" / f"{node}.laz" for node in found]


_COLORS = ("colorRed", "colorGreen", "colorBlue")


def _e57_scans(file: Any) -> Iterator[tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]]:
    """Of each scan the points that are finite: positions, [n, 3] float64, and colours, [n, 3] uint16, white where it has none. A scan is in memory
    as a whole.
    """
    for number in range(file.scan_count):
        scan = file.read_scan(number, colors=True, ignore_missing_fields=True)
        positions = np.stack([scan["cartesianX"], scan["cartesianY"], scan["cartesianZ"]], -1)
        if all(name in scan for name in _COLORS):
            colors = np.stack([scan[name] for name in _COLORS], -1).astype(np.uint16) * 257
        else:
            colors = np.full(positions.shape, 65535, np.uint16)
        finite = np.isfinite(positions).all(1)
        yield positions[finite], colors[finite]


def _write_e57(source: Path, target: Path) -> None:
    pye57 = _library("pye57", source, "e57")
    laspy = _library("laspy", source, "e57")
    file = pye57.E57(str(source))
    colored = any(_COLORS[0] in file.get_header(number).point_fields for number in range(file.scan_count))
    writer = None
    try:
        for positions, colors in _e57_scans(file):
            if len(positions) == 0:
                continue
            if writer is None:
                header = laspy.LasHeader(version="1.4", point_format=7 if colored else 6)
                header.offsets = np.floor(positions.min(0))
                header.scales = np.full(3, max(1e-5, float(np.ptp(positions, 0).max()) * 1e-8))
                writer = laspy.open(target, mode="w", header=header, do_compress=False)
            points = laspy.ScaleAwarePointRecord.zeros(len(positions), header=header)
            points.x, points.y, points.z = positions.T
            if colored:
                points.red, points.green, points.blue = colors.T
            writer.write_points(points)
        if writer is None:
            raise Error(f"{source}: has no points")
    finally:
        if writer is not None:
            writer.close()
