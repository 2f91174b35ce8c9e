"""Particles: where numpy's arrays lie, and what files hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import InvalidArgument
from ._files import name_of

_Place = tuple[int, int, int, int, bool]


def _place(values: ArrayLike, name: str, dimensions: int) -> tuple[_Place, NDArray[Any]]:
    """Where the values lie, and the array that must live while they are read.

    Native float32 and float64 are taken as they lie, with any strides, from whatever numpy.asarray
    makes an array of without a copy. All other numbers are converted to float64.
    """
    if isinstance(values, np.ma.MaskedArray):
        raise InvalidArgument(f"{name} is a masked array; leave masked particles out of it: "
                              f"{name}[~mask]")
    if isinstance(values, (str, PathLike)):
        raise InvalidArgument(f"{name} is a file's name, must be numbers (read the file first: "
                              "meniscus.read_particles)")
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
        raise InvalidArgument(f"{name} has dtype {array.dtype}, must be real numbers")
    wanted = "(n, 3)" if dimensions == 2 else "(n,)"
    if array.ndim != dimensions or (dimensions == 2 and array.shape[1] != 3):
        turned = dimensions == 2 and array.ndim == 2 and array.shape[0] == 3
        raise InvalidArgument(f"{name} has shape {array.shape}, must be {wanted}"
                              + (f" (turn it: {name}.T)" if turned else ""))
    if array.dtype not in (np.float32, np.float64) or not array.dtype.isnative:
        array = array.astype(np.float64)
    strides = array.strides + (0,) * (2 - dimensions)
    return (array.ctypes.data, array.shape[0], strides[0], strides[1],
            array.dtype == np.float64), array


def _attribute_places(values: ArrayLike, name: str) -> list[tuple[str, _Place, NDArray[Any]]]:
    """The components of an attribute of (n,) or (n, k) as the program names those of files."""
    array = values if isinstance(values, np.ndarray) else np.asarray(values)
    place = f"attribute {name}"
    if array.ndim == 1:
        return [(name, *_place(array, place, 1))]
    if array.ndim != 2 or array.shape[1] == 0:
        raise InvalidArgument(f"{place} has shape {array.shape}, must be (n,) or (n, components)")
    components = array.shape[1]
    endings = {1: [""], 3: [".X", ".Y", ".Z"]}.get(components,
                                                   [f".{k}" for k in range(components)])
    return [(name + ending, *_place(array[:, k], place, 1)) for k, ending in enumerate(endings)]


class Particles:
    """One frame of particles that read_particles() or open_particles() found in a file.

    size
        How many there are.
    particle_radius
        World units, as the file states it; 0: it does not.
    time
        Seconds, as the file states it; 0: it does not.
    x, y, z
        (n,) float32, world units. These and the arrays below share memory with this object. None
        where the file does not have them, and where it is left on disk (open_particles).
    vx, vy, vz
        (n,) float32, world units per second.
    radius, density
        (n,) float32: particle radii in world units; density as the file has it.
    id
        (n,) int64, identity over time.
    attribute_names
        Names of what is carried to the surface: `attributes` of read_particles(). A vector has
        several: force.X, force.Y, force.Z.
    attributes
        {name: (n,) float32}, in the file's units; NaN: not known. Empty where they are left on disk.
    """

    size: int
    particle_radius: float
    has_velocity: bool
    has_radius: bool
    time: float
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    z: NDArray[np.float32]
    vx: NDArray[np.float32] | None
    vy: NDArray[np.float32] | None
    vz: NDArray[np.float32] | None
    radius: NDArray[np.float32] | None
    density: NDArray[np.float32] | None
    id: NDArray[np.int64] | None
    attribute_names: list[str]
    attributes: dict[str, NDArray[np.float32]]

    def __init__(self, bare: _core.Frame) -> None:
        self._bare = bare

    def __reduce__(self) -> NoReturn:
        raise TypeError("Particles cannot be pickled or copied: pass on their arrays, as "
                        "particles.points, or the file's name")

    def __len__(self) -> int:
        return self._bare.size

    def __repr__(self) -> str:
        return f"<meniscus.Particles: {len(self)}, radius {self.particle_radius:g}>"

    _OF_BARE = ("size", "particle_radius", "has_velocity", "has_radius", "time", "x", "y", "z", "vx",
                "vy", "vz", "density", "radius", "id", "attribute_names", "attributes")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._OF_BARE})

    def __getattr__(self, name: str) -> Any:
        if name in self._OF_BARE:
            return getattr(self._bare, name)
        raise AttributeError(f"Particles has no attribute {name}")

    @property
    def points(self) -> NDArray[np.float32]:
        """(n, 3) float32, world units: a copy."""
        if self.x is None:
            raise InvalidArgument("these particles are on disk; read_particles() has them in memory")
        return np.stack([self.x, self.y, self.z], axis=1)

    @property
    def velocities(self) -> NDArray[np.float32] | None:
        """(n, 3) float32, world units per second: a copy. None where the file has none."""
        if self.vx is None:
            return None
        return np.stack([self.vx, self.vy, self.vz], axis=1)  # type: ignore[list-item]


def _reading(particle_radius: float, attributes: str | Sequence[str], dataset: str,
             timestep: int | None) -> tuple[float, list[str], str, int]:
    names = [attributes] if isinstance(attributes, str) else list(attributes)
    if timestep is not None and timestep < 0:
        raise InvalidArgument(f"timestep is {timestep}, must be >= 0 or None")
    return float(particle_radius), names, dataset, -1 if timestep is None else int(timestep)


def read_particles(path: str | PathLike[str], particle_radius: float = 0, *,
                   attributes: str | Sequence[str] = (), dataset: str = "",
                   timestep: int | None = None) -> Particles:
    """Reads one frame of particles; the format follows from the ending, as for `meniscus extract`.

    particle_radius
        > 0, world units: replaces every radius that the file states; 0: the file's.
    attributes
        Names of arrays, in any case, that become Particles.attributes, and those of surfaces made
        of these particles. A vector gives NAME.X, NAME.Y, NAME.Z where it has three components,
        else NAME.0, NAME.1 ...
    dataset
        Where a file holds several: the HDF5 group or dataset with the particles, or the array of
        positions of an .npz, or OpenVDB's grid. Empty: what is found.
    timestep
        The TIMESTEP of a LAMMPS dump that holds several; None: the only one.

    Raises InputError: file, place in it, what was found, what was wanted.
    """
    return Particles(_core.read_particles(
        name_of(path), *_reading(particle_radius, attributes, dataset, timestep)))


def open_particles(path: str | PathLike[str], particle_radius: float = 0, *,
                   attributes: str | Sequence[str] = (), dataset: str = "",
                   timestep: int | None = None) -> Particles:
    """The same for frames that need not fit into memory: a large file of a format that streams, such
    as a binary .ply, is left on disk, and extract() reads it in parts. A * in the path stands for
    all parts of one frame."""
    return Particles(_core.open_particles(
        name_of(path), *_reading(particle_radius, attributes, dataset, timestep)))


def frame_of(points: ArrayLike | Particles, velocities: ArrayLike | None,
             radii: ArrayLike | None, particle_radius: float,
             attributes: Mapping[str, ArrayLike] | None = None) -> tuple[_core.Frame, object]:
    """What the library reads, and what must live while it does."""
    if isinstance(points, Particles):
        if velocities is not None or radii is not None or attributes:
            raise InvalidArgument("velocities, radii and attributes go with arrays; Particles bring "
                                  "their own")
        return points._bare, points
    place, keep = _place(points, "points", 2)
    others: list[_Place | None] = []
    kept = [keep]
    for values, name, dimensions in ((velocities, "velocities", 2), (radii, "radii", 1)):
        if values is None:
            others.append(None)
            continue
        other, array = _place(values, name, dimensions)
        if other[1] != place[1]:
            raise InvalidArgument(f"{name} has {other[1]} rows for {place[1]} points")
        others.append(other)
        kept.append(array)
    carried: list[tuple[str, _Place]] = []
    if attributes is None:
        attributes = {}
    if not isinstance(attributes, Mapping) or not all(isinstance(name, str) for name in attributes):
        raise InvalidArgument('attributes must be names and their arrays, as {"temperature": t}')
    for given, values in attributes.items():
        for name, other, array in _attribute_places(values, given):
            if other[1] != place[1]:
                raise InvalidArgument(f"attribute {given} has {other[1]} rows for {place[1]} points")
            carried.append((name, other))
            kept.append(array)
    return _core.borrow(place, others[0], others[1], float(particle_radius), carried), kept
