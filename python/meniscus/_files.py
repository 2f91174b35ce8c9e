"""Names of files."""

from __future__ import annotations

from os import PathLike, fsdecode

from ._errors import InvalidArgument


def name_of(path: str | PathLike[str]) -> str:
    """The name as the library takes it. Raises InvalidArgument for an empty one, and for one of bytes
    that are no UTF-8."""
    name = fsdecode(path)
    if not name:
        raise InvalidArgument("the file's name is empty")
    try:
        name.encode()
    except UnicodeEncodeError:
        raise InvalidArgument(f"{name!r}: the name is no UTF-8, must be (rename it)") from None
    return name
