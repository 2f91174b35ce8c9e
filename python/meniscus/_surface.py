"""Surfaces: maps and meshes as arrays, and files of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._camera import Camera, _camera_of
from ._errors import InvalidArgument, Notice, OutputError
from ._files import name_of

_NO_PICKLE = ("a {} cannot be pickled or copied: pass on its arrays, as {}, or write() a file in the "
              "process that made it")
_MESHES = (".ply", ".vtp", ".glb", ".obj", ".stl")


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a normal at each vertex, in world space; of extract() open where the camera sees
    no further, of extract_closed() closed.

    positions
        (vertices, 3) float32, world units.
    normals
        (vertices, 3) float32, unit, outward.
    velocities
        (vertices, 3) float32, world units per second; None where the particles carry none.
    triangles
        (triangles, 3) uint32, counter-clockwise seen from outside.
    attributes
        {name: (vertices,) float32}, those of the particles, in their units.

    The arrays share memory with the surface.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    velocities: NDArray[np.float32] | None
    triangles: NDArray[np.uint32]
    attributes: dict[str, NDArray[np.float32]]
    _bare: Any = field(repr=False)

    def __reduce__(self) -> NoReturn:
        raise TypeError(_NO_PICKLE.format("Mesh", "mesh.positions and mesh.triangles"))

    def __repr__(self) -> str:
        return (f"<meniscus.Mesh: {len(self.positions)} vertices, {len(self.triangles)} triangles"
                + "".join(f", {name}" for name in self.attributes) + ">")

    def write(self, path: str | PathLike[str]) -> None:
        """Writes .ply, .vtp, .glb, .obj or .stl, by the ending. The file appears under its name when
        it is complete. Raises OutputError, InvalidArgument."""
        self._bare.write_mesh(name_of(path))


def mesh_of(bare: _core.Surface) -> Mesh:
    return Mesh(bare.mesh_positions, bare.mesh_normals, bare.mesh_velocities, bare.mesh_triangles,
                bare.mesh_attributes, bare)


@dataclass(frozen=True, eq=False)
class Whitewater:
    """What pixels show of one type of whitewater: foam, spray or bubbles, as discs.

    coverage
        (h, w) float32, share of the pixel that is covered, 0 to 1.
    density
        (h, w) float32, sum of the shares that discs cover.
    depth
        (h, w) float32, of the nearest disc, as Surface.depth; +inf: none.
    velocity
        (h, w, 3) float32, mean over the discs, world units per second; 0: none. None where the
        particles carry none.
    behind
        (h, w) float32, of bubbles: mean depth behind the surface's, world units; 0: none. None of
        foam and spray.

    The arrays share memory with the surface.
    """

    coverage: NDArray[np.float32]
    density: NDArray[np.float32]
    depth: NDArray[np.float32]
    velocity: NDArray[np.float32] | None
    behind: NDArray[np.float32] | None


class Surface:
    """The surface that a camera sees: maps of (height, width), row 0 on top, and a mesh.

    The arrays share memory with this object; none is copied. Those that were not asked for are None.

    depth
        (h, w) float32, planar distance along the camera's axis, world units; +inf: no surface.
    normal
        (h, w, 3) float32, unit, outward, world axes; 0: no surface.
    position
        (h, w, 3) float32, world units; 0: no surface.
    group
        (h, w) uint32, the fit that weighs most, counted from 1; 0: none.
    kind
        (h, w) uint8: 0 none, 1 surface, 2 splash.
    residual
        (h, w) float32, RMS residual of that fit, particle radii; 0: none.
    velocity
        (h, w, 3) float32, world units per second; None where the particles carry none.
    layers
        (h, w) uint32, bodies of fluid along the ray; 0: no surface. This and the next four are None
        unless extract() was asked for layers.
    thickness
        (h, w) float32, fluid along the ray, of all of them, world units.
    entry, exit
        (layers, h, w) float32, where the ray enters and leaves each that is kept, nearest first, as
        depth; +inf where there are fewer. entry[0] is depth.
    back_normal
        (h, w, 3) float32, at exit[0]: unit, outward, world axes; 0: no surface.
    forward
        (h, w, 2) float32, pixels to the right and down until the next frame; after set_forward().
    attributes
        {name: (h, w) float32}, those of the particles, in their units; 0: no surface. Empty where the
        particles carry none.
    whitewater
        {"foam" | "spray" | "bubble": Whitewater}, those that extract() was given.
    camera
        The Camera.
    particle_radius
        World units, as it was used.
    disorder
        How irregularly the particles lay, 0 to 2 (docs/method.md).
    counts
        How many particles, how many of them in view, visible, ...
    notices
        What was dropped, estimated or looks wrong: each a Notice. They were also given as
        MeniscusWarning.
    warnings
        The line of each.
    parameters
        All numbers it was made with, as text.
    timings
        [(stage, ms on the host, ms of its kernels)] where extract() was asked for them.
    """

    depth: NDArray[np.float32]
    normal: NDArray[np.float32]
    position: NDArray[np.float32]
    group: NDArray[np.uint32]
    kind: NDArray[np.uint8]
    residual: NDArray[np.float32]
    velocity: NDArray[np.float32] | None
    layers: NDArray[np.uint32] | None
    thickness: NDArray[np.float32] | None
    entry: NDArray[np.float32] | None
    exit: NDArray[np.float32] | None
    back_normal: NDArray[np.float32] | None
    forward: NDArray[np.float32] | None
    attributes: dict[str, NDArray[np.float32]]
    particle_radius: float
    disorder: float
    notices: list[Notice]
    parameters: str
    timings: list[tuple[str, float, float]]

    def __init__(self, bare: _core.Surface) -> None:
        self._bare = bare
        self.camera: Camera = _camera_of(bare.camera)
        self.counts: dict[str, int] = dict(bare.counts)

    _OF_BARE = ("depth", "normal", "position", "group", "kind", "residual", "velocity", "layers",
                "thickness", "entry", "exit", "back_normal", "forward", "attributes",
                "particle_radius", "disorder", "notices", "parameters", "timings")

    def __reduce__(self) -> NoReturn:
        raise TypeError(_NO_PICKLE.format("Surface", "surface.depth"))

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._OF_BARE})

    def __getattr__(self, name: str) -> Any:
        if name in self._OF_BARE:
            return getattr(self._bare, name)
        raise AttributeError(f"Surface has no attribute {name}")

    def __repr__(self) -> str:
        pixels = 0 if self.depth is None else np.count_nonzero(np.isfinite(self.depth))
        return (f"<meniscus.Surface: {self.camera.width}x{self.camera.height}, {pixels} pixels, "
                f"{len(self.mesh.triangles)} triangles>")

    def _repr_png_(self) -> bytes | None:
        """The lit picture, which notebooks show."""
        if self.depth is None:
            return None
        with TemporaryDirectory() as folder:
            path = Path(folder) / "surface.png"
            self.write(path)
            return path.read_bytes()

    @property
    def warnings(self) -> list[str]:
        """The lines of `notices`."""
        return [notice.text for notice in self.notices]

    @property
    def whitewater(self) -> dict[str, Whitewater]:
        """The maps of each type of whitewater that extract() was given."""
        return {name: Whitewater(**maps) for name, maps in self._bare.whitewater.items()}

    @property
    def mesh(self) -> Mesh:
        """The mesh of what the camera sees; without triangles where it was not asked for."""
        return mesh_of(self._bare)

    def set_forward(self, next_camera: Camera | None = None, frames_per_second: float = 24) -> None:
        """Makes the map `forward`: where each pixel's point goes within 1 / frames_per_second seconds,
        as the next frame's camera (default: the same) sees it. Raises InvalidArgument without velocity.
        """
        self._bare.set_forward((next_camera or self.camera)._bare(), float(frames_per_second))

    def write(self, path: str | PathLike[str], *, compression: str = "zip", half: bool = False,
              preview: str = "lit") -> None:
        """Writes the maps (.exr), the layers (.deep.exr), a picture (.png) or the mesh (.ply, .vtp, .glb, .obj, .stl), by the
        ending. Attributes go into .exr, .ply, .vtp and .glb.

        compression, half
            .exr: none, rle, zips, zip, piz or pxr24; normals and motion as 16-bit floats.
        preview
            .png: lit, normal, depth, groups, or glass, which wants layers.

        The file appears under its name when it is complete. Raises OutputError, InvalidArgument.
        """
        name = name_of(path)
        ending = Path(name).suffix.lower()
        if name.lower().endswith(".deep.exr"):
            self._bare.write_deep_exr(name)
        elif ending == ".exr":
            self._bare.write_exr(name, compression, half)
        elif ending == ".png":
            self._bare.write_png(name, preview)
        elif ending in _MESHES:
            self._bare.write_mesh(name)
        else:
            raise OutputError(f"{name}: unknown ending, wanted .exr (maps), .deep.exr (layers), "
                              f".png (picture) or {', '.join(_MESHES)} (mesh)")


def read_exr(path: str | PathLike[str]) -> Surface:
    """Reads the maps and the camera that write() put into an .exr; the mesh stays empty."""
    return Surface(_core.read_exr(name_of(path)))


def write(path: str | PathLike[str], surface: Surface, **options: Any) -> None:
    """The same as surface.write(path, **options): .exr, .deep.exr, .png, .ply, .vtp, .glb, .obj or .stl."""
    if not isinstance(surface, Surface):
        raise InvalidArgument(f"write: found {type(surface).__name__}, wanted a Surface")
    surface.write(path, **options)
