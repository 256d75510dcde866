"""Scenes from arrays: what is taken without a copy, what is converted, and what is refused in which words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raypager as rp
from conftest import empty_scene, film, waves, write_ply

PLACES = np.eye(4)[None, :3].repeat(2, 0)


def test_arrays_are_not_copied() -> None:
    positions, triangles = waves()
    scene, moved = empty_scene(), empty_scene()
    scene.mesh(positions, triangles)
    moved.mesh(positions + np.float32([0, 0.25, 0]), triangles)
    positions += np.float32([0, 0.25, 0])  # seen by the scene, for it has these very numbers
    assert film(scene) == film(moved)


def test_arrays_outlive_their_names() -> None:
    scene = empty_scene()
    scene.mesh(*waves())
    kept = [np.zeros(len(waves()[0]) * 3, np.float32) for _ in range(8)]  # would take the place of what was freed
    whole = empty_scene()
    positions, triangles = waves()
    whole.mesh(positions, triangles)
    assert film(scene) == film(whole) and len(kept) == 8


def test_other_layouts_are_converted() -> None:
    positions, triangles = waves()
    expected = empty_scene()
    expected.mesh(positions, triangles)
    for p, t in [
        (positions.astype(np.float64), triangles.astype(np.int64)),
        (np.asfortranarray(positions), triangles.tolist()),
        (np.repeat(positions, 2, axis=0)[::2], np.asfortranarray(triangles)),
    ]:
        scene = empty_scene()
        scene.mesh(p, t)
        assert film(scene) == film(expected)


def test_the_film_is_not_copied(scene: rp.Scene) -> None:
    picture = scene.render()
    assert not picture.film.flags.owndata  # it lies where the engine put it
    assert picture.film.flags.writeable and picture.film.flags.c_contiguous
    assert np.asarray(picture) is picture.film


def test_a_mesh_in_a_file_and_in_arrays_is_the_same(tmp_path: Path) -> None:
    positions, triangles = waves()
    write_ply(tmp_path / "a.ply", positions, triangles)
    loaded = rp.load(tmp_path / "a.ply", ground=False, light="none", sky=1, material=rp.clay(), size=(32, 24))
    scene = rp.Scene(width=32, height=24)
    scene.mesh(positions, triangles)
    scene.infinite_light(1)
    look = {"camera": rp.look_at((0, 1, 2), (0, 0, 0), size=(32, 24)), "spp": 4}
    assert film(loaded, **look) == film(scene, **look)


def test_what_was_loaded_may_be_added_to(mesh_file: Path) -> None:
    scene, same = (rp.load(mesh_file, size=(32, 24)) for _ in range(2))
    scene.sphere((0, 0.5, 0), 0.2, material=rp.metal())  # before the ground, which comes last
    assert scene.bake().spheres == 1 and film(scene, spp=4) != film(same, spp=4)


def test_every_attribute_counts() -> None:
    positions, triangles = waves()
    n = len(positions)
    rng = np.random.default_rng(7)
    up = np.tile(np.float32([0, 1, 0]), (n, 1))
    pictures = set()
    for attributes in [
        {},
        {"normals": up},
        {"colors": rng.integers(0, 255, (n, 3), np.uint8)},
        {"colors": np.tile([0.1, 0.5, 0.9], (n, 1))},
        {"transform": np.diag([1, 2, 1, 1])},
        {"transform": np.diag([1, 2, 1, 1])[:3] + 0.01},
        {"emission": (1, 2, 3)},
        {"emission": 1, "power": 5, "two_sided": True},
        {"flip": True, "emission": 1},
    ]:
        scene = empty_scene()
        scene.mesh(positions, triangles, **attributes)
        pictures.add(film(scene, seed=1))
    assert len(pictures) == 9


def test_colors_may_be_bytes_floats_or_packed() -> None:
    positions, triangles = waves()
    n = len(positions)
    rgb = np.tile(np.uint8([255, 128, 0]), (n, 1))
    linear = np.where(rgb / 255 <= 0.04045, rgb / 255 / 12.92, ((rgb / 255 + 0.055) / 1.055) ** 2.4)
    films = set()
    for colors in (rgb, linear, np.full(n, 255 | 128 << 8, np.uint32)):
        scene = empty_scene()
        scene.mesh(positions, triangles, colors=colors)
        films.add(film(scene))
    assert len(films) == 1


def cloud(n: int = 3000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return (
        rng.uniform(-1, 1, (n, 3)).astype(np.float32),
        rng.integers(0, 255, (n, 3), np.uint8),
        rng.uniform(0.01, 0.03, n).astype(np.float32),
    )


class Chunks:
    """Can be gone through again."""

    def __init__(self, make: Callable[[], Iterator[Any]]) -> None:
        self.make = make
        self.times = 0

    def __iter__(self) -> Iterator[Any]:
        self.times += 1
        return self.make()


def test_chunks_are_the_same_as_the_whole() -> None:
    positions, colors, radius = cloud()
    whole = empty_scene()
    whole.points(positions, colors=colors, radius=radius)
    expected = film(whole)

    def chunks() -> Iterator[Any]:
        for i in range(0, len(positions), 777):
            yield positions[i : i + 777], colors[i : i + 777], radius[i : i + 777]

    def named() -> Iterator[Any]:
        for i in range(0, len(positions), 1000):
            rows = slice(i, i + 1000)
            yield {"positions": positions[rows].astype(np.float64), "colors": colors[rows], "radius": radius[rows]}

    again = Chunks(chunks)
    for source, facts in [(chunks, {}), (named, {}), (again, {"count": len(positions), "colored": True})]:
        scene = empty_scene()
        scene.points(source, **facts)
        assert film(scene) == expected
    assert again.times >= 1


def test_chunks_without_colors_and_with_one_radius() -> None:
    positions, _, _ = cloud()
    whole, parts = empty_scene(), empty_scene()
    whole.points(positions, radius=0.02)
    parts.points(lambda: (positions[i : i + 500] for i in range(0, len(positions), 500)), radius=0.02)
    assert film(whole) == film(parts)


def test_chunks_go_over_the_disk_as_the_whole_does(tmp_path: Path) -> None:
    positions, colors, radius = cloud(400_000)
    whole, parts = empty_scene(), empty_scene()
    whole.points(positions, colors=colors, radius=radius * 0.1)
    parts.points(
        lambda: ((positions[i : i + 50_000], colors[i : i + 50_000], radius[i : i + 50_000] * np.float32(0.1)) for i in range(0, 400_000, 50_000))
    )
    baked = [s.bake(tmp_path / f"{i}.rpb", host_limit="24M") for i, s in enumerate((whole, parts))]
    assert all(b.summary and b.summary["buckets"] > 1 for b in baked)
    assert baked[0].render().film.tobytes() == baked[1].render().film.tobytes()


def test_what_chunks_raise_comes_out() -> None:
    def broken() -> Iterator[Any]:
        yield np.zeros((10, 3), np.float32)
        raise ValueError("the disk\nis gone")

    scene = empty_scene()
    scene.points(broken, count=20, colored=False, radius=0.1)
    with pytest.raises(rp.Error, match="points 1: its chunks cannot be read: ValueError: the disk is gone") as caught:
        scene.bake()
    assert isinstance(caught.value.__cause__, ValueError)
    with pytest.raises(ValueError):
        empty_scene().points(broken)


def test_what_cannot_even_be_said_comes_out() -> None:
    class Mute(Exception):
        def __str__(self) -> str:
            raise RuntimeError

    def broken() -> Iterator[Any]:
        yield np.zeros((10, 3), np.float32)
        raise Mute

    scene = empty_scene()
    scene.points(broken, count=20, colored=False, radius=0.1)
    with pytest.raises(rp.Error, match="cannot be read: an exception without words"):
        scene.bake()


def test_chunks_that_change_are_refused() -> None:
    scene = empty_scene()
    sizes = iter([10, 7, 12])
    scene.points(lambda: iter([np.zeros((next(sizes), 3), np.float32)]), radius=0.1)
    with pytest.raises(rp.Error, match="have 7 points, where there were 10 before"):
        scene.bake()
    with pytest.raises(rp.Error, match="have more points, where there were 10 before"):
        scene.bake()


def test_iterators_are_refused() -> None:
    with pytest.raises(rp.Error, match="only once"):
        empty_scene().points(iter([np.zeros((1, 3))]))


def test_instances_are_copies_to_the_eye() -> None:
    positions, triangles = waves(40)
    places = np.zeros((3, 3, 4))
    places[:, :, :3] = np.eye(3) * 0.4
    places[:, :, 3] = [[-0.5, 0, 0], [0.5, 0.2, 0], [0, 0.1, -0.5]]
    instanced, copied = empty_scene(), empty_scene()
    tile = instanced.object("tile")
    tile.mesh(positions, triangles)
    instanced.instances(tile, places)
    for place in places:
        copied.mesh(positions, triangles, transform=place)
    a, b = instanced.bake(), copied.bake()
    assert a.summary and a.summary["instances"] == 3 and a.summary["objects"] == 1
    assert np.abs(a.render(spp=32).film - b.render(spp=32).film).mean() < 0.02


def test_instances_have_materials_and_colors() -> None:
    positions, triangles = waves(40)
    places = np.zeros((2, 3, 4))
    places[:, :, :3] = np.eye(3) * 0.5
    places[:, 0, 3] = [-0.5, 0.5]
    films = set()
    gold, red = rp.metal("gold"), rp.diffuse((0.8, 0.1, 0.1))
    for look in [
        {},
        {"materials": gold},
        {"materials": [gold, None]},
        {"materials": [None, gold, red], "material_ids": [1, 2]},
        {"colors": [[1, 0, 0], [0, 1, 0]]},
    ]:
        scene = empty_scene()
        tile = scene.object()
        tile.mesh(positions, triangles)
        scene.instances(tile, places, **look)
        films.add(film(scene, seed=5))
    assert len(films) == 5


def test_objects_lie_in_objects() -> None:
    scene = empty_scene()
    leaf, tree = scene.object("leaf"), scene.object("tree")
    leaf.mesh(*waves(40), transform=np.diag([0.3, 0.3, 0.3, 1]))
    places = PLACES.copy()
    places[:, 0, 3] = [-0.3, 0.3]
    tree.instances(leaf, places)
    tree.sphere(radius=0.1)
    scene.instances(tree, places)
    assert scene.render().film.mean() > 0


def test_cameras(scene: rp.Scene) -> None:
    blocks = scene.bake()
    films = {
        blocks.render(camera=rp.look_at((0, 1, 2), (0, 0, 0), size=(32, 24), **look)).film.tobytes()
        for look in [
            {},
            {"fov": 30},
            {"mirrored": True},
            {"lens_radius": 0.1},
            {"lens_radius": 0.1, "focus": 1.0},
            {"projection": "orthographic", "height": 2},
            {"projection": "equirectangular"},
            {"projection": "equal-area"},
        ]
    }
    assert len(films) == 8
    assert blocks.render(camera=rp.look_at((0, 1, 2), (0, 0, 0), size=(32, 24))).film.tobytes() == blocks.render().film.tobytes()


def test_baked_files_are_opened_again(scene: rp.Scene, tmp_path: Path) -> None:
    stages: list[tuple[str, float]] = []
    blocks = scene.bake(tmp_path / "a.rpb", progress=lambda stage, fraction: stages.append((stage, fraction)), block_size="16K")
    assert len(blocks) > 1 and stages and all(0 <= f <= 1 for _, f in stages)
    opened = rp.open(tmp_path / "a.rpb")
    assert opened.triangles == 2 * 24 * 24 and opened.size == (32, 24) and opened.summary is None
    assert np.allclose(opened.bounds[:, 0], [-1, 1])
    assert opened.render().film.tobytes() == film(scene) == rp.render(tmp_path / "a.rpb").film.tobytes()


def test_dropped_triangles_are_warned_of() -> None:
    positions, triangles = waves()
    positions[0] = np.nan
    triangles[5] = 10**6
    scene = empty_scene()
    scene.mesh(positions, triangles)
    with pytest.warns(rp.RaypagerWarning, match="not finite dropped, 1 triangle with a vertex that does not exist"):
        scene.bake()


def mesh(**changes: Any) -> Callable[[rp.Scene], None]:
    arguments = {"positions": np.zeros((4, 3)), "triangles": [[0, 1, 2]]} | changes
    return lambda scene: scene.mesh(**arguments)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (mesh(positions=np.zeros((4, 2))), r"mesh: positions: an array of shape \[n, 3\] is expected, not \[4, 2\]"),
        (mesh(positions=np.zeros(4)), r"mesh: positions: .* not \[4\]"),
        (mesh(positions="text"), "mesh: positions: an array of numbers is expected"),
        (mesh(positions=[[1, 2, 3], [4, 5]]), "mesh: positions: is no array"),
        (mesh(positions=np.zeros((4, 3), complex)), "mesh: positions: an array of numbers is expected, not of complex128"),
        (mesh(triangles=[[0, 1, 2.5]]), "mesh: triangles: whole numbers are expected, not float64"),
        (mesh(triangles=[[0, 1, -1]]), "mesh: triangles: numbers from 0 to 2.32 - 2"),
        (mesh(triangles=[[0, 1, 2**32]]), "mesh: triangles: numbers from 0 to 2.32 - 2"),
        (mesh(normals=np.zeros((3, 3))), r"mesh: normals: an array of shape \[4, 3\] is expected, not \[3, 3\]"),
        (mesh(uvs=np.zeros((4, 3))), r"mesh: uvs: an array of shape \[4, 2\]"),
        (mesh(colors=np.zeros((4, 3), int)), "mesh: colors: uint8 .sRGB. or floats"),
        (mesh(transform=np.eye(3)), r"mesh: transform: an array of shape \[4, 4\]"),
        (mesh(transform=np.full((4, 4), np.nan)), "mesh: transform: is not finite"),
        (mesh(material="gold"), "material: one of raypager's is expected"),
        (mesh(power=3), "give emission, too"),
        (mesh(emission=-1), "mesh: emission: numbers from 0 on"),
        (lambda s: s.sphere((0, 0), 1), "sphere: center: three numbers are expected"),
        (lambda s: s.sphere(radius=0), "sphere: radius: a number from 1e-30"),
        (lambda s: s.points(np.zeros((5, 3)), colors=np.zeros((4, 3), np.uint8)), r"points: colors: an array of shape \[5, 3\]"),
        (lambda s: s.points(lambda: iter([]), colors=np.zeros((4, 3), np.uint8)), "with chunks, colours and radii come in them"),
        (lambda s: s.points(lambda: iter([{"position": 1}])), "a chunk has positions, colors and radius, not position"),
        (lambda s: s.instances(s.object(), np.zeros((2, 4, 4))), r"instances: transforms: an array of shape \[n, 3, 4\]"),
        (lambda s: s.instances(empty_scene().object(), PLACES), "one of another scene"),
        (lambda s: s.instances(s.object(), PLACES, materials=[rp.clay()] * 3), "3 materials for 2 instances"),
        (lambda s: s.instances(s.object(), PLACES, materials=rp.clay(), material_ids=[0, 1]), "choose number 1 of 1"),
        (lambda s: s.instances(s.object(), PLACES, material_ids=[0, 1]), "give these, too"),
        (lambda s: s.camera((0, 0, 0), (0, 0, 0)), "camera: has no direction"),
        (lambda s: s.camera((0, 0, 0), (0, 0, 1), projection="fish"), "'fish' is not a projection"),
        (lambda s: s.camera((0, 0, 0), (0, 0, 1), projection="orthographic"), "needs the height"),
        (lambda s: s.spot_light((0, 0, 0), (0, 0, 0), 1), "different points"),
        (lambda s: s.distant_light((0, 0, 0), 1), "must not be zero"),
        (lambda s: s.sky(np.zeros((4, 5, 3))), "square, or twice as wide as high"),
        (lambda s: s.sky(np.full((4, 4, 3), -1)), "finite and 0 or more"),
        (lambda s: rp.diffuse((1, 2)), "diffuse: color: three numbers"),
        (lambda s: rp.diffuse("red"), "'red' is not a colour"),
        (lambda s: rp.metal("mithril"), "'mithril' is not known"),
        (lambda s: rp.plastic(roughness=2), "plastic: roughness: a number from 0 to 1"),
        (lambda s: rp.Image(np.zeros((4, 4, 2))), "image: an image of shape"),
        (lambda s: rp.Image(np.zeros((4, 4), np.uint16), encoding="srgb"), "only uint8 can be sRGB"),
        (lambda s: rp.Scene(width=0), "scene: width: a whole number from 1"),
        (lambda s: rp.load(), "name a file"),
    ],
)
def test_wrong_usage_is_said_in_one_line(wrong: Callable[[rp.Scene], None], words: str) -> None:
    with pytest.raises(rp.Error, match=words) as caught:
        wrong(empty_scene())
    assert caught.value.exit_code == 2 and "\n" not in str(caught.value)


def test_what_the_engine_refuses_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(rp.Error, match="nowhere.ply") as caught:
        rp.load(tmp_path / "nowhere.ply")
    assert caught.value.exit_code == 1
    scene = empty_scene()
    scene.infinite_light(2)
    with pytest.raises(rp.Error, match="infinite"):
        scene.bake()
    (tmp_path / "bad.rpb").write_bytes(b"no block file")
    with pytest.raises(rp.Error, match="bad.rpb"):
        rp.open(tmp_path / "bad.rpb")
