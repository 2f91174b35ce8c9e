"""Meniscus: the particles of a fluid simulation in, the surface that a camera sees out.

    import meniscus
    camera = meniscus.Camera.frame(points)          # points: (n, 3) float32 or float64
    surface = meniscus.extract(points, camera, particle_radius=.025)
    surface.depth, surface.normal                   # (height, width[, 3]) float32
    surface.mesh.positions, surface.mesh.triangles
    surface.write("surface.exr")

Lengths are in the world's units, parameters in particle radii unless they say otherwise.
"""

from . import _runtime

_runtime.prepare()  # before libraries are loaded that an OpenCL runtime brings newer ones of
try:
    from . import _core
except ImportError as error:
    if "libOpenCL" not in str(error):
        raise
    raise ImportError("meniscus needs the system's OpenCL loader, libOpenCL.so.1 (Debian: "
                      "apt-get install ocl-icd-libopencl1; Fedora: dnf install ocl-icd)") from None
from ._camera import Camera
from ._device import STREAM_MEMORY, Device, default_device, devices, extract, extract_closed
from ._errors import (Cancelled, DeviceError, Error, InputError, InvalidArgument, MeniscusWarning,
                      MissingFileError, Notice, OutOfDeviceMemory, OutputError)
from ._particles import Particles, open_particles, read_particles
from ._surface import Mesh, Surface, Whitewater, read_exr, write

__version__: str = _core.version()


def methods() -> dict[str, str]:
    """The methods of extract(): name and what it is, the default first."""
    return _core.methods()


def named_parameters() -> list[dict[str, object]]:
    """The numbers that extract() takes: name, group, unit, effect, default, least, most of each."""
    return _core.named_parameters()


__all__ = ["STREAM_MEMORY", "Camera", "Cancelled", "Device", "DeviceError", "Error", "InputError",
           "InvalidArgument", "Mesh", "MeniscusWarning", "MissingFileError", "Notice",
           "OutOfDeviceMemory", "OutputError", "Particles", "Surface", "Whitewater",
           "default_device", "devices", "extract", "extract_closed", "methods",
           "named_parameters", "open_particles", "read_exr", "read_particles", "write"]
