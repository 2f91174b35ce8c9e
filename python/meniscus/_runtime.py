"""Lets the system's OpenCL loader find the CPU runtime of `pip install meniscus-surface[cpu]`.

The loader is the system's, so that all vendors' drivers are found as ever. Only where it would find no
driver at all is it pointed to one that pip has installed.
"""

from __future__ import annotations

import ctypes
import os
from importlib import metadata
from pathlib import Path

# Distributions with an OpenCL runtime for the processor, and what its library is called.
_RUNTIMES = (("intel-opencl-rt", "libintelocl.so"), ("pocl-binary-distribution", "libpocl*.so"))
_TOLD = ("OCL_ICD_VENDORS", "OCL_ICD_FILENAMES")


def installed_runtime() -> Path | None:
    """The library of a CPU runtime that pip has installed, or None."""
    for distribution, library in _RUNTIMES:
        try:
            files = metadata.files(distribution) or []
        except metadata.PackageNotFoundError:
            continue
        for file in files:
            if file.match(library):
                path = Path(str(file.locate())).resolve()
                if path.exists():
                    return path
    return None


def prepare(vendors: str = "/etc/OpenCL/vendors") -> Path | None:
    """Names a runtime of pip's to the loader where it finds no other; returns the one that it named.

    To be called before the process makes its first OpenCL call, since loaders look once, and before it
    loads oneTBB: Intel's runtime needs the one beside it, which is newer than those of distributions.
    """
    if any(os.environ.get(name) for name in _TOLD) or any(Path(vendors).glob("*.icd")):
        return None
    library = installed_runtime()
    if library is not None:
        threads = library.with_name("libtbb.so.12")
        if threads.exists():
            ctypes.CDLL(str(threads), mode=ctypes.RTLD_GLOBAL)
        os.environ["OCL_ICD_VENDORS"] = str(library)  # ocl-icd takes a library, too
        os.environ["OCL_ICD_FILENAMES"] = str(library)  # Khronos' loader
    return library
