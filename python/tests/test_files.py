"""Cameras, particles and surfaces as files, and the program in the package."""

import errno
import hashlib
import os
import pickle
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest

import meniscus
from conftest import DATA
from meniscus import _runtime


def program():
    return Path(sysconfig.get_path("scripts")) / "meniscus"


def test_a_camera_looks_at_its_target():
    camera = meniscus.Camera.look_at((1, 2, 3), (4, 5, 6), fov=50, size=(80, 40))
    clip = camera.projection @ camera.view @ [4, 5, 6, 1]
    assert np.allclose(clip[:2], 0, atol=1e-12) and (camera.width, camera.height) == (80, 40)
    assert np.allclose(camera.view[:3, :3] @ camera.view[:3, :3].T, np.eye(3))
    assert camera.projection[1, 1] == pytest.approx(1 / np.tan(np.radians(25)))
    with pytest.raises(ValueError):
        camera.view[0, 0] = 2


def test_a_frame_s_camera_shows_all_particles(dam):
    particles = meniscus.read_particles(dam)
    camera = meniscus.Camera.frame(particles, size=(320, 200))
    clip = np.c_[particles.points, np.ones(len(particles))] @ (camera.projection @ camera.view).T
    assert (np.abs(clip[:, :2]) <= clip[:, 3:]).all()
    same = meniscus.Camera.frame(particles.points, size=(320, 200),
                                 particle_radius=particles.particle_radius)
    assert same == camera and hash(same) == hash(camera)
    assert meniscus.Camera.frame(particles.points[::7].astype(float)).width == 1024


def test_a_frame_s_camera_takes_the_program_s_words(dam, tmp_path):
    particles = meniscus.read_particles(dam)
    camera = meniscus.Camera.frame(particles, up="z", fov=60, size=(320, 200))
    subprocess.run([program(), "extract", dam, "--up", "z", "--fov", "60", "--size", "320x200",
                    "--write-camera", tmp_path / "camera.json", "-o", tmp_path / "a.png", "-q"],
                   check=True)
    assert camera == meniscus.Camera.read(tmp_path / "camera.json")
    assert camera == meniscus.Camera.frame(particles, up=(0, 0, 1), fov=60, size=(320, 200))
    assert camera != meniscus.Camera.frame(particles, size=(320, 200))
    at = dict(eye=(3, 2, 1), target=(0, 0, 0))
    assert meniscus.Camera.look_at(**at, up="Z") == meniscus.Camera.look_at(**at, up=[0, 0, 1])
    for wrong in (dict(up="w"), dict(up="yz"), dict(up=(0, 0, 0)), dict(up=3), dict(fov=0),
                  dict(fov="wide"), dict(fov=180)):
        with pytest.raises(meniscus.InvalidArgument, match="up|fov|field of view"):
            meniscus.Camera.frame(particles, **wrong)


def test_a_camera_survives_json(tmp_path):
    camera = meniscus.Camera.look_at((.1, .2, 1 / 3), (0, 0, 0), size=(33, 22))
    assert meniscus.Camera.from_json(camera.to_json()) == camera
    camera.write(tmp_path / "camera.json")
    assert meniscus.Camera.read(tmp_path / "camera.json") == camera
    with pytest.raises(meniscus.OutputError, match="camera.json: cannot be written: No such"):
        camera.write(tmp_path / "nowhere" / "camera.json")
    for text in ("{", "[]", "{}", '{"width": 1, "height": 1, "view": 1, "projection": 2}'):
        with pytest.raises(meniscus.InvalidArgument, match="camera"):
            meniscus.Camera.from_json(text)
    with pytest.raises(meniscus.InputError, match="nothing.json"):
        meniscus.Camera.read(tmp_path / "nothing.json")


@pytest.mark.parametrize("changed, what", [
    (dict(width=0), "width|size"), (dict(view=np.zeros((4, 4))), "view"),
    (dict(view=np.eye(3)), r"shape \(3, 3\)"), (dict(projection=np.full((4, 4), np.nan)), "proj")])
def test_a_camera_is_checked(changed, what):
    good = meniscus.Camera.look_at((0, 0, 1), (0, 0, 0))
    parts = dict(width=4, height=4, view=good.view, projection=good.projection) | changed
    with pytest.raises(meniscus.InvalidArgument, match=what):
        meniscus.Camera(**parts)
    with pytest.raises(meniscus.InvalidArgument, match="same point"):
        meniscus.Camera.look_at((0, 0, 0), (0, 0, 0))


def test_files_of_particles_are_read(dam, tmp_path):
    particles = meniscus.read_particles(dam)
    assert len(particles) == len(particles.x) == 35937 and particles.particle_radius > 0
    assert particles.points.shape == (35937, 3)
    assert meniscus.read_particles(dam, particle_radius=.5).particle_radius == .5
    table = tmp_path / "three.csv"
    table.write_text("x,y,z,vx,vy,vz,id\n1,2,3,4,5,6,9\n4,5,6,7,8,9,8\n")
    few = meniscus.read_particles(table)
    assert {"x", "density", "points"} <= set(dir(few))
    assert few.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert few.velocities.tolist() == [[4, 5, 6], [7, 8, 9]] and few.radius is None
    with pytest.raises(AttributeError):
        few.colour


@pytest.mark.parametrize("read", [meniscus.read_particles, meniscus.open_particles, meniscus.read_exr,
                                  meniscus.Camera.read])
def test_a_missing_file_is_python_s_own_error_too(read, tmp_path):
    missing = tmp_path / "missing.ply"
    with pytest.raises(FileNotFoundError, match="missing.ply: cannot be opened: No such") as caught:
        read(missing)
    error = caught.value
    assert isinstance(error, meniscus.InputError)
    assert (error.errno, error.filename) == (errno.ENOENT, str(missing))
    assert error.notice.code == "missing_file"
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.filename == error.filename
    (tmp_path / "file").write_text("")
    for other in (tmp_path, tmp_path / "file" / "a.ply"):
        with pytest.raises(meniscus.InputError) as wrong:
            read(other)
        assert not isinstance(wrong.value, OSError)


def test_attributes_of_files_are_read_and_written(points, camera, tmp_path):
    rng = np.random.default_rng(3)
    heat = rng.random(len(points)).astype(np.float32)
    force = rng.random((len(points), 3)).astype(np.float32)
    at = points.astype(np.float32)
    np.savez(tmp_path / "frame.npz", mine=at, other=2 * at, heat=heat, force=force)
    read = meniscus.read_particles(tmp_path / "frame.npz", .025, attributes=["HEAT", "force"],
                                   dataset="mine")
    assert read.attribute_names == list(read.attributes) == ["HEAT", "force.X", "force.Y", "force.Z"]
    assert np.array_equal(read.attributes["HEAT"], heat)
    assert np.array_equal(read.attributes["force.Z"], force[:, 2])
    assert np.array_equal(read.points, at)
    other = meniscus.read_particles(tmp_path / "frame.npz", .025, dataset="other")
    assert np.array_equal(other.points, 2 * at) and other.attributes == {}
    with pytest.raises(meniscus.InputError, match="no attribute .cold., it has"):
        meniscus.read_particles(tmp_path / "frame.npz", attributes="cold", dataset="mine")

    surface = meniscus.extract(read, camera)
    arrays = meniscus.extract(at, camera, particle_radius=.025,
                              attributes={"HEAT": heat, "force": force})
    opened = meniscus.open_particles(tmp_path / "frame.npz", .025, attributes=["HEAT", "force"],
                                     dataset="mine")
    assert opened.attribute_names == read.attribute_names
    for again in (arrays, meniscus.extract(opened, camera)):
        assert list(again.attributes) == read.attribute_names
        for name, values in surface.attributes.items():
            assert np.array_equal(again.attributes[name], values), name
            assert np.array_equal(again.mesh.attributes[name], surface.mesh.attributes[name]), name
    with pytest.raises(meniscus.InvalidArgument, match="bring their own"):
        meniscus.extract(read, camera, attributes={"heat": heat})

    surface.write(tmp_path / "s.exr")
    for name, values in meniscus.read_exr(tmp_path / "s.exr").attributes.items():
        assert np.array_equal(values, surface.attributes[name]), name
    for ending in ("ply", "vtp", "glb", "obj", "stl"):
        surface.write(tmp_path / f"s.{ending}")
        held = b"HEAT" in (tmp_path / f"s.{ending}").read_bytes()
        assert held == (ending in ("ply", "vtp", "glb")), ending


def test_a_timestep_of_a_dump_is_chosen(tmp_path):
    step = ("ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp pp\n0 9\n0 9\n"
            "0 9\nITEM: ATOMS id x y z\n1 {} 2 3\n")
    (tmp_path / "two.dump").write_text(step.format(0, 1) + step.format(50, 4))
    assert meniscus.read_particles(tmp_path / "two.dump", timestep=50).points.tolist() == [[4, 2, 3]]
    assert meniscus.read_particles(tmp_path / "two.dump", timestep=0).points.tolist() == [[1, 2, 3]]
    with pytest.raises(meniscus.InputError, match="two.dump"):
        meniscus.read_particles(tmp_path / "two.dump")
    with pytest.raises(meniscus.InvalidArgument, match="timestep is -1"):
        meniscus.read_particles(tmp_path / "two.dump", timestep=-1)

def test_a_frame_is_the_same_from_a_file_an_array_and_the_program(dam, tmp_path):
    camera = meniscus.Camera.read(DATA / "dam" / "camera.json")
    particles = meniscus.open_particles(dam)
    surface = meniscus.extract(particles, camera)
    surface.write(tmp_path / "python.exr")
    meniscus.write(tmp_path / "python.ply", surface)
    surface.write(tmp_path / "python.png")
    arrays = meniscus.read_particles(dam)
    again = meniscus.extract(arrays.points, camera, velocities=arrays.velocities,
                             particle_radius=arrays.particle_radius, progress=None)
    assert np.array_equal(again.depth, surface.depth)
    assert np.array_equal(again.mesh.positions, surface.mesh.positions)
    subprocess.run([program(), "extract", dam, "--camera", DATA / "dam" / "camera.json", "-q",
                    *(f"-o{tmp_path}/program.{e}" for e in ("ply", "png"))], check=True)
    for ending in ("ply", "png"):
        digests = {hashlib.sha256((tmp_path / f"{who}.{ending}").read_bytes()).hexdigest()
                   for who in ("python", "program")}
        assert len(digests) == 1, ending
    read = meniscus.read_exr(tmp_path / "python.exr")
    assert np.array_equal(read.depth, surface.depth) and read.camera == camera
    assert np.array_equal(read.normal, surface.normal)
    pixels = np.isfinite(surface.depth).sum()
    assert f"{pixels} pixels" in repr(surface) and f"{pixels} pixels" in repr(read)


def test_a_notebook_shows_the_picture(points, camera, tmp_path):
    surface = meniscus.extract(points, camera, particle_radius=.025)
    surface.write(tmp_path / "s.png")
    assert surface._repr_png_() == (tmp_path / "s.png").read_bytes()
    assert meniscus.extract(points, camera, particle_radius=.025, image=False)._repr_png_() is None


def test_what_cannot_be_written_is_said(points, camera, tmp_path):
    surface = meniscus.extract(points, camera, particle_radius=.025)
    with pytest.raises(meniscus.OutputError, match="nowhere"):
        surface.write(tmp_path / "nowhere" / "s.exr")
    with pytest.raises(meniscus.InvalidArgument, match="compression is dwaa"):
        surface.write(tmp_path / "s.exr", compression="dwaa")
    with pytest.raises(meniscus.OutputError, match="unknown ending, wanted .exr.*png.*stl"):
        surface.write(tmp_path / "s.jpg")
    assert list(tmp_path.iterdir()) == []


def test_names_of_files_are_text_or_said_not_to_be(dam, tmp_path):
    assert meniscus.read_particles(os.fsencode(dam)).size == meniscus.read_particles(dam).size
    with pytest.raises(meniscus.InvalidArgument, match=r"dam.udcff.ply': the name is no UTF-8"):
        meniscus.read_particles(os.fsdecode(b"dam\xff.ply"))


def test_the_program_is_in_the_package():
    said = subprocess.run([program(), "--version"], capture_output=True, text=True, check=True)
    assert said.stdout == f"meniscus {meniscus.__version__}\n"
    module = subprocess.run([sys.executable, "-m", "meniscus", "extract", "no.ply", "-o", "a.png"],
                            capture_output=True, text=True)
    assert module.returncode == 1 and "no.ply" in module.stderr


def test_a_runtime_of_pip_s_is_named_only_where_there_is_no_other(tmp_path, monkeypatch):
    for name in ("OCL_ICD_VENDORS", "OCL_ICD_FILENAMES"):
        monkeypatch.delenv(name, raising=False)
    library = tmp_path / "libintelocl.so"
    library.touch()
    monkeypatch.setattr(_runtime, "installed_runtime", lambda: library)
    vendors = tmp_path / "vendors"
    vendors.mkdir()
    (vendors / "some.icd").touch()
    assert _runtime.prepare(str(vendors)) is None and "OCL_ICD_VENDORS" not in os.environ
    (vendors / "some.icd").unlink()
    monkeypatch.setenv("OCL_ICD_VENDORS", "mine")
    assert _runtime.prepare(str(vendors)) is None and os.environ["OCL_ICD_VENDORS"] == "mine"
    monkeypatch.delenv("OCL_ICD_VENDORS")
    assert _runtime.prepare(str(vendors)) == library
    assert os.environ["OCL_ICD_VENDORS"] == str(library)
    monkeypatch.setenv("OCL_ICD_VENDORS", "")  # put back at the end


def test_stubs_and_docstrings_are_there():
    folder = Path(meniscus.__file__).parent
    assert (folder / "py.typed").exists() and "def extract" in (folder / "_core.pyi").read_text()
    for name in meniscus.__all__:
        what = getattr(meniscus, name)
        assert not callable(what) or what.__doc__, name
