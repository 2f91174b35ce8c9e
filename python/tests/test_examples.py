"""The notebook runs, and the part of the Blender add-on that knows nothing of Blender works."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

import meniscus
from conftest import DATA

EXAMPLES = DATA.parent


def test_the_notebook_runs(tmp_path, monkeypatch):
    plt = pytest.importorskip("matplotlib.pyplot")
    plt.switch_backend("Agg")
    folder = tmp_path / "notebook"  # where it may write
    folder.mkdir()
    (tmp_path / "data").symlink_to(DATA)
    monkeypatch.chdir(folder)
    notebook = json.loads((EXAMPLES / "notebook" / "surface_of_a_simulation.ipynb").read_text())
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), cell["id"], "exec"), names)
    assert len(plt.get_fignums()) == 4  # pictures
    plt.close("all")
    assert (folder / "surface.ply").exists()
    # It comes with its pictures.
    kept = [data for cell in notebook["cells"] for output in cell.get("outputs", ())
            for data in output.get("data", ()) if data == "image/png"]
    assert len(kept) == 4


def test_the_documents_example_runs(dam, tmp_path, monkeypatch):
    text = (EXAMPLES.parent / "docs" / "python.md").read_text()
    blocks = text.split("```python\n")[1:]
    assert blocks
    particles = meniscus.read_particles(dam)
    np.save(tmp_path / "positions.npy", particles.points)
    monkeypatch.chdir(tmp_path)
    for block in blocks:
        exec(block.split("```")[0], {})
    read = meniscus.read_exr("surface.exr")
    assert np.isfinite(read.depth).sum() > 10_000 and read.normal.shape == (768, 1024, 3)


def test_the_readmes_example_runs(dam):
    text = (EXAMPLES.parent / "README.md").read_text()
    (block,) = text.split("```python\n")[1:]
    names = {"meniscus": meniscus, "points": meniscus.read_particles(dam).points}
    exec(block.split("```")[0], names)
    assert np.isfinite(names["surface"].depth).sum() > 10_000


@pytest.fixture
def cache():
    place = EXAMPLES / "blender" / "meniscus_cache" / "cache.py"
    spec = importlib.util.spec_from_file_location("cache", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_addon_finds_frames(cache, tmp_path):
    for name in ("dam.0001.ply", "dam.0012.ply", "dam.12345.ply", "dam.7.ply", "dam.0002.ply.tmp"):
        (tmp_path / name).touch()
    pattern = str(tmp_path / "dam.####.ply")
    assert cache.frames_of(pattern) == [1, 12, 12345]
    assert cache.frame_path(pattern, 12) == tmp_path / "dam.0012.ply"
    assert cache.frame_path(pattern, 12345) == tmp_path / "dam.12345.ply"
    assert cache.frame_path("one.ply", 3) == Path("one.ply") and cache.frames_of("one.ply") == []
    assert cache.mesh_of(pattern, 2, None) is None


def test_the_addon_makes_a_mesh_with_velocities(cache):
    pattern = str(DATA / "dam_sequence" / "dam.####.ply")
    frame = cache.frames_of(pattern)[-1]
    framed = meniscus.Camera.frame(meniscus.read_particles(cache.frame_path(pattern, frame)),
                                   size=(100, 80))
    view = framed.view.astype(np.float32)  # as Blender has it
    camera = cache.camera_of(view, framed.projection, 100, 80)
    assert (camera.width, camera.height) == (120, 96)
    # What was at the edge of the image is a twelfth of the larger image inside.
    inside = camera.projection @ np.linalg.inv(framed.projection) @ [1, 1, 0, 1]
    assert np.allclose(inside[:2] / inside[3], 1 / 1.2)
    mesh = cache.mesh_of(pattern, frame, camera)
    assert len(mesh.triangles) > 500 and mesh.velocities.shape == mesh.positions.shape
    assert np.abs(mesh.velocities).max() > 0
    with pytest.raises(meniscus.InvalidArgument, match="scaled by 2"):
        cache.camera_of(np.diag([2, 2, 2, 1.]), framed.projection, 100, 80)


def test_the_addon_s_manifest_is_one():
    tomllib = pytest.importorskip("tomllib")
    text = (EXAMPLES / "blender" / "meniscus_cache" / "blender_manifest.toml").read_text()
    manifest = tomllib.loads(text)
    for key in ("schema_version", "id", "version", "name", "tagline", "maintainer", "type",
                "blender_version_min", "license"):
        assert manifest[key], key
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"] and len(manifest["tagline"]) <= 64
    assert manifest["version"] == meniscus.__version__
