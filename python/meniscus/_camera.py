"""Cameras."""

from __future__ import annotations

import json
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import InvalidArgument, OutputError
from ._files import name_of

if TYPE_CHECKING:
    from ._particles import Particles


_LARGEST = 16384  # pixels a side


def _numbers(name: str, values: Sequence[float]) -> list[float]:
    try:
        numbers = list(map(float, values))
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3:
        raise InvalidArgument(f"{name} is {values!r}, must be three numbers")
    return numbers


def _up(up: Sequence[float] | str) -> list[float]:
    if isinstance(up, str):
        if len(up) != 1 or up not in "xyzXYZ":
            raise InvalidArgument(f"up is {up!r}, must be 'x', 'y', 'z' or three numbers")
        return [float(axis == up.lower()) for axis in "xyz"]
    return _numbers("up", up)


def _degrees(fov: float) -> float:
    try:
        return float(fov)
    except (TypeError, ValueError):
        raise InvalidArgument(f"fov is {fov!r}, must be a number of degrees") from None


def _pixels(size: tuple[int, int]) -> tuple[int, int]:
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        raise InvalidArgument(
            f"size is {size!r}, must be (width, height), whole numbers of pixels") from None
    if max(abs(width), abs(height)) > _LARGEST:
        raise InvalidArgument(f"size is {size!r}, must be 1 to {_LARGEST} pixels a side")
    return width, height


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera in the OpenGL convention: clip = projection @ view @ x, the eye looks down -z.

    width, height
        Pixels, 1 to 16384.
    view
        (4, 4), world to eye space, rigid; rows in order.
    projection
        (4, 4), eye to clip space, perspective or orthographic, z in [-w, w].

    Raises InvalidArgument, naming the entry at fault.
    """

    width: int
    height: int
    view: NDArray[np.float64]
    projection: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name, side in zip(("width", "height"), _pixels((self.width, self.height))):
            object.__setattr__(self, name, side)
        for name in ("view", "projection"):
            try:
                matrix = np.array(getattr(self, name), np.float64)
            except (TypeError, ValueError):
                raise InvalidArgument(f"camera: {name} is {getattr(self, name)!r}, must be (4, 4) "
                                      "numbers") from None
            if matrix.shape != (4, 4):
                raise InvalidArgument(
                    f"camera: {name} has shape {matrix.shape}, must be (4, 4)")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        self._bare()  # checks it

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[int, int, bytes, bytes]:
        # -0 + 0 is 0, which -0 equals.
        return self.width, self.height, (self.view + 0.).tobytes(), (self.projection + 0.).tobytes()

    @staticmethod
    def look_at(eye: Sequence[float], target: Sequence[float],
                up: Sequence[float] | str = (0, 1, 0), *, fov: float = 40,
                size: tuple[int, int] = (1024, 768)) -> Camera:
        """A perspective camera at `eye` that looks at `target`.

        eye, target, up
            World units; up must not be parallel to target - eye, and may be "x", "y" or "z".
        fov
            Vertical field of view, degrees, in (0, 180).
        size
            (width, height), pixels.
        """
        return _camera_of(_core.look_at(_numbers("eye", eye), _numbers("target", target),
                                        _up(up), _degrees(fov), *_pixels(size)))

    @staticmethod
    def frame(points: ArrayLike | Particles, *, size: tuple[int, int] = (1024, 768),
              radii: ArrayLike | None = None, particle_radius: float = 0,
              up: Sequence[float] | str = (0, 1, 0), fov: float = 40) -> Camera:
        """A perspective camera that shows all finite particles from above and to the side.

        points
            (n, 3), world units, or Particles. Strays that a simulation threw away are not framed.
        size
            (width, height), pixels.
        radii, particle_radius
            As for extract(): particles have a size.
        up
            What is up in the world: "x", "y" or "z", or a direction.
        fov
            Vertical field of view, degrees, in (0, 180).
        """
        from ._particles import frame_of

        frame, keep = frame_of(points, None, radii, particle_radius)
        camera = _camera_of(_core.frame_camera(frame, _up(up), _degrees(fov), *_pixels(size)))
        del keep
        return camera

    @staticmethod
    def read(path: str | PathLike[str]) -> Camera:
        """The camera of a JSON file, as the program's --camera takes it. Raises InputError."""
        return _camera_of(_core.read_camera(name_of(path)))

    @staticmethod
    def from_json(text: str) -> Camera:
        """The camera of to_json(). Raises InvalidArgument for JSON that is no camera."""
        try:
            found = json.loads(text)
            return Camera(*(found[key] for key in ("width", "height", "view", "projection")))
        except (ValueError, KeyError, TypeError) as error:
            if isinstance(error, InvalidArgument):
                raise
            raise InvalidArgument(f"camera: wanted JSON with width, height, view and projection: "
                                  f"{type(error).__name__}: {error}") from None

    def to_json(self) -> str:
        """JSON with width, height, view and projection, every number to its last bit."""
        return json.dumps({"width": self.width, "height": self.height,
                           "view": self.view.tolist(), "projection": self.projection.tolist()})

    def write(self, path: str | PathLike[str]) -> None:
        """Writes to_json() into a file, for the program's --camera. Raises OutputError."""
        try:
            with open(path, "w", encoding="utf-8") as file:
                file.write(self.to_json() + "\n")
        except OSError as error:
            raise OutputError(f"{name_of(path)}: cannot be written: {error.strerror}") from None

    def _bare(self) -> _core.Camera:
        return _core.Camera(self.width, self.height, self.view.ravel().tolist(),
                            self.projection.ravel().tolist())


def _camera_of(bare: _core.Camera) -> Camera:
    return Camera(bare.width, bare.height, np.reshape(bare.view, (4, 4)),
                  np.reshape(bare.projection, (4, 4)))
