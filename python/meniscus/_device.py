"""Devices, and the one call."""

from __future__ import annotations

import difflib
import inspect
import os
import threading
import warnings as _warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._camera import Camera
from ._errors import InvalidArgument, MeniscusWarning, Notice
from ._particles import Particles, frame_of
from ._surface import Mesh, Surface, mesh_of

#: Device memory that the passes over particles that stream may take, bytes.
STREAM_MEMORY: int = _core.STREAM_MEMORY

_ADAPTIVE = .05  # particle radii: what the program takes for --adaptive without a number

_KNOWN = {parameter["name"].replace("-", "_") for parameter in _core.named_parameters()}

_default: Device | None = None
_lock = threading.RLock()


def _forget() -> None:  # a child of fork() has none of its parent's OpenCL
    global _default, _lock
    _default, _lock = None, threading.RLock()


os.register_at_fork(after_in_child=_forget)


def devices() -> list[dict[str, Any]]:
    """What there is: index, name, platform, kind, compute_units, global_memory (bytes), usable,
    problem and more of each OpenCL device. Raises DeviceError where there is no platform at all."""
    return _core.devices()


class Device:
    """An opened OpenCL device, which keeps its built kernels and memory from call to call.

    selector
        An index of devices(), `cpu`, `gpu`, or a part of a name. Empty: the fastest kind found.

    Threads may share one; they take turns. Raises DeviceError, naming the devices there are.
    """

    def __init__(self, selector: str | int = "") -> None:
        self._bare = _core.Device(str(selector))
        self.info: dict[str, Any] = self._bare.info

    @property
    def name(self) -> str:
        return str(self.info["name"])

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Device cannot be pickled or copied: open one in each process")

    def __repr__(self) -> str:
        return f"<meniscus.Device: {self.name} ({self.info['platform']})>"

    def cancel(self) -> None:
        """Ends the extraction that runs on this device in another thread, at its next stage, with
        Cancelled. Where none runs nothing happens."""
        self._bare.cancel()

    def extract(self, points: ArrayLike | Particles, camera: Camera, **options: Any) -> Surface:
        """The same as meniscus.extract(points, camera, device=self, **options)."""
        return extract(points, camera, device=self, **options)


def default_device() -> Device:
    """The device that extract() takes where none is given, opened once."""
    global _default
    with _lock:
        if _default is None:
            _default = Device()
        return _default


def _opened(device: Device | None) -> _core.Device:
    if device is None:
        device = default_device()
    if not isinstance(device, Device):
        raise InvalidArgument(f"device is {device!r}, must be a meniscus.Device, which keeps its "
                              f"kernels (open it once: meniscus.Device({device!r}))")
    return device._bare


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InvalidArgument(f"{name} is {value!r}, must be a number") from None


def _bytes(memory: int) -> int:
    try:
        count = -1 if isinstance(memory, str) else int(memory)
    except (TypeError, ValueError, OverflowError):
        count = -1
    if not 0 <= count < 1 << 63:
        raise InvalidArgument(f"memory is {memory!r}, must be a number of bytes, as 128 << 20")
    return count


def _set_maps(bare: _core.Parameters, maps: str | Sequence[str]) -> None:
    names = [maps] if isinstance(maps, str) else list(maps) if np.iterable(maps) else [maps]
    if not all(isinstance(name, str) for name in names):
        raise InvalidArgument(f'maps is {maps!r}, must be names, as "N,id" or ["N", "id"]')
    try:
        bare.set_maps(",".join(names))
    except InvalidArgument as error:  # the program's word for them is aov
        text = str(error).replace("aov has ", "maps has ").replace("aov N,id", '"N,id"')
        named = InvalidArgument(text)
        named.notice = error.notice
        raise named from None


def _check_callbacks(progress: object, on_notice: object) -> None:
    if progress is not None and not callable(progress):
        raise InvalidArgument(f"progress is {progress!r}, must be callable with a stage's name")
    if on_notice is not None and not callable(on_notice):
        raise InvalidArgument(f"on_notice is {on_notice!r}, must be callable with a Notice")


def _set(bare: _core.Parameters, parameters: Mapping[str, float], call: Callable[..., object]) -> None:
    for name, value in parameters.items():
        if name not in _KNOWN and (meant := _argument_like(name, call)):
            raise InvalidArgument(f"there is no parameter {name}, did you mean {meant}?")
        bare.set(name.replace("_", "-"), _number(name, value) if name in _KNOWN else 0)


def _argument_like(name: str, call: Callable[..., object]) -> str | None:
    """The argument of `call` itself that is nearly called `name`, or whose last word it is."""
    known = [each.name for each in inspect.signature(call).parameters.values()
             if each.kind is each.KEYWORD_ONLY]
    meant = (difflib.get_close_matches(name, known, 1, .75)
             or [each for each in known if each.endswith("_" + name)])
    return meant[0] if meant else None


def extract(points: ArrayLike | Particles, camera: Camera, *,
            velocities: ArrayLike | None = None, radii: ArrayLike | None = None,
            attributes: Mapping[str, ArrayLike] | None = None, particle_radius: float = 0,
            method: str = "fit", maps: str | Sequence[str] | None = None, layers: int = 0,
            whitewater: Mapping[str, Any] | None = None,
            image: bool = True, mesh: bool = True, motion: bool = True, strict: bool = False,
            device: Device | None = None, memory: int = STREAM_MEMORY, timings: bool = False,
            progress: Callable[[str], object] | None = None,
            on_notice: Callable[[Notice], object] | None = None, **parameters: float) -> Surface:
    """Extracts the surface of `points` that `camera` sees.

    points
        (n, 3), world units, in any order, or Particles. float32 and float64 arrays are read where
        they lie, with any strides, and must not be changed meanwhile; of other numbers a float64
        copy is made. float64 is rounded to float32. NaN and infinite points are dropped with a
        warning.
    velocities
        (n, 3), world units per second: the surface gets velocities, too.
    radii
        (n,), particle radii, world units, > 0.
    attributes
        {name: (n,) or (n, components)}, such as {"temperature": t}, in any unit: carried to the
        surface as velocities are, a weighted mean over the particles around. They become
        Surface.attributes and Mesh.attributes. The components of a vector are called NAME.X,
        NAME.Y, NAME.Z where there are three, else NAME.0, NAME.1 ... NaN, infinite values and those
        above 1e30 are left out with a warning.
    particle_radius
        World units, half the particle spacing. 0: the middle of `radii`, else what the file states,
        else an estimate from the spacing, with a warning.
    method
        One of methods(); `fit` is the paper's with a fit around every particle.
    maps
        Those wanted beside depth, e.g. "N,id" or ["N", "id"]: N, P, id, kind, residual, V. None:
        all. "" or []: none.
    layers
        1 to 8: also where each pixel's ray enters and leaves the bodies of fluid along it, up to so
        many: Surface.entry, exit, thickness, back_normal and layers. Methods fit, groups and stable.
    whitewater
        Particles of "foam", "spray" and "bubble" that are drawn with the water: Surface.whitewater.
        Each is what `points` takes, or {"points": ..., "velocities": ..., "radii": ...}. Wants
        `image`.
    image, mesh, motion
        Whether maps, the mesh, and velocities are made.
    strict
        NaN and infinite values are an error.
    device
        None: default_device().
    memory
        Bytes of the device that frames of 2^18 particles and more may take while they stream
        through it; never changes the result.
    timings
        Fill Surface.timings, at some cost.
    progress
        Called with the name of each stage as it begins. What it raises ends the extraction.
    on_notice
        Called with each Notice as soon as it is known, once each, in this thread: that
        particle_radius does not fit, for one, before the work that takes long. What it raises ends
        the extraction. It must not extract on the same device. Surface.notices has all of them, and
        the warnings come at the end, as without it.
    **parameters
        Every number of named_parameters(), with _ for -: support=8, contour_density=.1.

    The same particles give the same bits, on every device. Other Python threads run meanwhile.
    Ctrl-C ends it at the next stage with KeyboardInterrupt; the device can be used on.

    Raises InvalidArgument, InputError, DeviceError, OutOfDeviceMemory and Cancelled; gives
    MeniscusWarning.
    """
    if not isinstance(camera, Camera):
        raise InvalidArgument(f"camera is a {type(camera).__name__}, must be a meniscus.Camera")
    if whitewater is not None and not isinstance(whitewater, Mapping):
        raise InvalidArgument(f"whitewater is {type(whitewater).__name__}, must be types and their "
                              'particles, as {"foam": points}')
    bare = _core.Parameters()
    bare.set_method(str(method))
    if maps is not None:
        _set_maps(bare, maps)
    bare.image, bare.mesh, bare.motion, bare.strict = image, mesh, motion, strict
    if not isinstance(layers, (int, np.integer)):
        raise InvalidArgument(f"layers is {layers!r}, must be a whole number, 0 to 8")
    bare.layers = int(layers)
    bare.particle_radius = _number("particle_radius", particle_radius)
    _set(bare, parameters, extract)
    frame, keep = frame_of(points, velocities, radii, 0, attributes)
    memory = _bytes(memory)
    _check_callbacks(progress, on_notice)
    made = _core.extract(_opened(device), frame, camera._bare(), bare, memory,
                         timings, progress, on_notice)
    del keep
    if whitewater:
        _draw_whitewater(made, whitewater, device, memory, timings, progress, on_notice)
    surface = Surface(made)
    for notice in surface.notices:
        warning = MeniscusWarning(notice.text)
        warning.notice = notice
        _warnings.warn(warning, stacklevel=2)
    return surface


def _draw_whitewater(made: _core.Surface, whitewater: Mapping[str, Any], device: Device | None,
                     memory: int, timings: bool, progress: Callable[[str], object] | None,
                     on_notice: Callable[[Notice], object] | None) -> None:
    frames, kept = [], []
    for name, given in whitewater.items():
        arrays = dict(given) if isinstance(given, Mapping) else {"points": given}
        unknown = set(arrays) - {"points", "velocities", "radii"}
        if unknown or "points" not in arrays:
            raise InvalidArgument(f"whitewater {name} has {', '.join(sorted(arrays)) or 'nothing'}, "
                                  "must be points, and may have velocities and radii")
        frame, keep = frame_of(arrays["points"], arrays.get("velocities"), arrays.get("radii"), 0)
        frames.append((name, frame))
        kept.append(keep)
    _core.draw_whitewater(_opened(device), made, frames, memory, timings,
                          progress, on_notice)


def extract_closed(points: ArrayLike | Particles, *, cell: float = 1, adaptive: float | bool = 0,
                   memory: int = 1 << 30, velocities: ArrayLike | None = None, radii: ArrayLike | None = None,
                   attributes: Mapping[str, ArrayLike] | None = None, particle_radius: float = 0,
                   motion: bool = True, strict: bool = False, device: Device | None = None,
                   progress: Callable[[str], object] | None = None,
                   on_notice: Callable[[Notice], object] | None = None, **parameters: float) -> Mesh:
    """Meshes all of the fluid, without a camera: closed, manifold, triangles counter-clockwise seen
    from outside.

    cell
        Side of the cells that the mesh is made of, particle radii, .1 to 4. Half of it makes four
        times as many triangles.
    adaptive
        Fewer triangles where the mesh is flat: how far vertices of the full mesh may be from it,
        particle radii, up to 1. True: .05, which keeps its accuracy. 0 or False: the full mesh.
    memory
        Bytes that a frame of 2^18 particles and more may take beside its mesh and these arrays,
        about. One that takes more is made in parts of space; the mesh is the same.

    All else is as in extract(); the method is `fit`. Raises
    InvalidArgument also where cells are so small that the mesh would be too large.
    """
    if adaptive is True:
        adaptive = _ADAPTIVE
    bare = _core.Parameters()
    bare.motion, bare.strict = motion, strict
    bare.particle_radius = _number("particle_radius", particle_radius)
    _set(bare, parameters, extract_closed)
    frame, keep = frame_of(points, velocities, radii, 0, attributes)
    _check_callbacks(progress, on_notice)
    made = _core.extract_closed(_opened(device), frame, _number("cell", cell),
                                _number("adaptive", adaptive), _bytes(memory), bare,
                                progress, on_notice)
    del keep
    for notice in made.notices:
        warning = MeniscusWarning(notice.text)
        warning.notice = notice
        _warnings.warn(warning, stacklevel=2)
    return mesh_of(made)
