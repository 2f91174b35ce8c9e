"""That arrays are read where they lie: by their addresses, and by the memory that a process takes."""

import subprocess
import sys

import numpy as np

import meniscus
from meniscus import _particles


def test_the_library_is_given_the_arrays_own_address(points):
    records = np.zeros(len(points), [("kind", "u1"), ("at", "<f4", 3), ("mass", "<f8")])
    for array in (points, points.astype(np.float32), points[::-2], np.asfortranarray(points),
                  records["at"], points[:0]):
        place, keep = _particles._place(array, "points", 2)
        address, size, step, between, wide = place
        assert keep is array
        assert address == array.__array_interface__["data"][0] and size == len(array)
        assert (step, between) == array.strides and wide == (array.dtype == np.float64)
    # Records of 21 bytes, and numbers that are converted.
    for array in (points.astype(np.int32), points.astype(">f4")):
        assert _particles._place(array, "points", 2)[1] is not array


def test_a_file_s_arrays_are_the_library_s(dam):
    particles = meniscus.read_particles(dam)
    x = particles.x
    assert not x.flags.owndata and x.ctypes.data == particles.x.ctypes.data
    del particles
    assert np.isfinite(x).all()


# How far the peak of a process's memory rises above what it has, in MB, while it extracts `count`
# particles from every second row of an array of float64. Frames of that size stream through the device
# in parts of 2^20 particles, so that beyond some parts the rise does not depend on the count.
MEASURED = """
import sys, numpy as np, meniscus
count = int(sys.argv[1])
base = np.zeros((2 * count, 3))
points = base[::2]
random = np.random.default_rng(1)
for first in range(0, count, 100_000):
    points[first:first + 100_000] = random.random((100_000, 3))
camera = meniscus.Camera.look_at((.5, .5, 3), (.5, .5, .5), size=(64, 48))

def extract(points):
    return meniscus.extract(points, camera, particle_radius=.5 * len(points) ** (-1 / 3), mesh=False)

def memory(key):
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(key + ":")) / 1024

extract(points[:300_000])
open("/proc/self/clear_refs", "w").write("5")  # the peak begins anew
before = memory("VmRSS")
surface = extract(points)
assert np.isfinite(surface.depth).sum() > 300
print(memory("VmHWM") - before)
"""


def grown(count):
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", MEASURED, str(count)],
                         capture_output=True, text=True, check=True)
    return float(run.stdout)


def test_more_particles_take_no_more_memory():
    few, many = 2_500_000, 10_000_000
    copy = (many - few) * 3 * 4 / 2**20  # MB, the least that a copy of those more would take
    # They rise by 94 and 113 MB, and 5,000,000 by 102 or 106 MB, as the allocator takes 4 MB more or
    # not. What it keeps by chance only adds: of three runs the least counts.
    assert min(grown(many) for _ in range(3)) - min(grown(few) for _ in range(3)) < copy / 3
