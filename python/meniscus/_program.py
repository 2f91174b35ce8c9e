"""The command `meniscus`: the program that the wheel carries, with an OpenCL runtime where pip has one."""

import os
import sys
from pathlib import Path

from . import _runtime


def main() -> None:
    """Becomes the program; never returns."""
    program = Path(__file__).parent / "bin" / "meniscus"
    _runtime.prepare()
    os.execv(program, ["meniscus", *sys.argv[1:]])
