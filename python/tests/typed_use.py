"""What a program that uses the package sees of its types: read by mypy alone (scripts/python_test.sh)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

import meniscus


def surface_of(points: NDArray[np.float64], out: Path) -> None:
    camera = meniscus.Camera.frame(points, up="z", size=(640, 480))
    assert_type(camera.view, NDArray[np.float64])
    device = meniscus.Device("cpu")
    assert_type(device.name, str)
    surface = meniscus.extract(points, camera, velocities=np.zeros_like(points), layers=2,
                               attributes={"temperature": points[:, 0]}, device=device,
                               particle_radius=.025, support=8, progress=print, on_notice=print,
                               whitewater={"foam": {"points": points, "radii": points[:, 0]}})
    assert_type(surface.depth, NDArray[np.float32])
    assert_type(surface.group, NDArray[np.uint32])
    assert_type(surface.thickness, NDArray[np.float32] | None)
    assert_type(surface.attributes["temperature"], NDArray[np.float32])
    assert_type(surface.whitewater["foam"].velocity, NDArray[np.float32] | None)
    assert_type(surface.notices, list[meniscus.Notice])
    assert_type(surface.mesh.positions, NDArray[np.float32])
    assert_type(surface.mesh.triangles, NDArray[np.uint32])
    surface.set_forward(camera, 24)
    surface.write(out / "a.exr", half=True)
    meniscus.write(out / "a.png", surface, preview="glass")
    assert_type(meniscus.read_exr(out / "a.exr").camera, meniscus.Camera)


def mesh_of(path: Path) -> meniscus.Mesh:
    try:
        particles = meniscus.open_particles(path, .025, attributes=["temperature"])
    except meniscus.MissingFileError as error:
        assert_type(error.filename, str | None)
        assert_type(error.notice, meniscus.Notice | None)
        raise
    assert_type(particles.points, NDArray[np.float32])
    assert_type(particles.velocities, NDArray[np.float32] | None)
    mesh = meniscus.extract_closed(particles, adaptive=True, device=meniscus.default_device())
    assert_type(mesh.velocities, NDArray[np.float32] | None)
    assert_type(meniscus.devices(), list[dict[str, Any]])
    assert_type(meniscus.methods(), dict[str, str])
    return mesh
