"""What the package raises. The text is one line: where, what was found, what was wanted, what to do."""


class Error(RuntimeError):
    """The base of everything that Meniscus raises."""


class InputError(Error):
    """A file that is missing, truncated or wrong, or particles of which none can be used."""


class OutputError(Error):
    """A file that could not be written completely. Nothing is left under its final name."""


class InvalidArgument(Error, ValueError):
    """A parameter, camera or array that a function cannot work with."""


class DeviceError(Error):
    """No usable OpenCL device, a kernel that does not build, or an OpenCL call that failed."""


class OutOfDeviceMemory(DeviceError, MemoryError):
    """The device has no memory for what was asked of it: take a smaller image or less `memory`."""


class MeniscusWarning(UserWarning):
    """What was dropped, estimated or looks wrong in a frame whose surface was made all the same."""


for _class in (Error, InputError, OutputError, InvalidArgument, DeviceError, OutOfDeviceMemory,
               MeniscusWarning):
    _class.__module__ = "meniscus"
