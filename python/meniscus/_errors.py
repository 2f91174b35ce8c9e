"""What the package raises. The text is one line: where, what was found, what was wanted, what to do."""
from __future__ import annotations

import errno
import os
from dataclasses import dataclass


@dataclass(frozen=True)
class Notice:
    """One thing to say about a frame, or why there is none: for programs, and as a line.

    code
        What it is about: "not_finite", "radius_estimated", "parameter_out_of_range" ...; "other": the
        text alone tells. include/meniscus/notice.hpp has the list.
    text
        The line.
    subject
        The parameter, map or attribute that it is about, or empty.
    place
        Of a particle, from 0, or None.
    count, of
        How many of how many.
    found, wanted
        What was found and what was wanted, or None.
    """

    code: str
    text: str
    subject: str = ""
    place: int | None = None
    count: int = 0
    of: int = 0
    found: float | None = None
    wanted: float | None = None


class Error(RuntimeError):
    """The base of everything that Meniscus raises; `notice` is the same for programs."""

    notice: Notice | None = None


class InputError(Error):
    """A file that is missing, truncated or wrong, or particles of which none can be used."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there."""

    errno = errno.ENOENT
    strerror = os.strerror(errno)

    @property
    def filename(self) -> str | None:
        return self.notice.subject if self.notice else None


class OutputError(Error):
    """A file that could not be written completely. Nothing is left under its final name."""


class InvalidArgument(Error, ValueError):
    """A parameter, camera or array that a function cannot work with."""


class DeviceError(Error):
    """No usable OpenCL device, a kernel that does not build, or an OpenCL call that failed."""


class OutOfDeviceMemory(DeviceError, MemoryError):
    """The device has no memory for what was asked of it: take a smaller image or less `memory`."""


class Cancelled(Error):
    """Device.cancel() was called."""


class MeniscusWarning(UserWarning):
    """What was dropped, estimated or looks wrong in a frame whose surface was made all the same;
    `notice` is the same for programs."""

    notice: Notice | None = None


for _class in (Notice, Error, InputError, MissingFileError, OutputError, InvalidArgument,
               DeviceError, OutOfDeviceMemory, Cancelled, MeniscusWarning):
    _class.__module__ = "meniscus"
