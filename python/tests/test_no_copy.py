"""That arrays are read where they lie: by their addresses, and by the memory that a process takes."""

import subprocess
import sys
from pathlib import Path

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


# Peak memory before and after the extraction of 6 million particles, 144 MB of float64, of which every
# row is the fourth of an array. A copy as float32 would take 72 MB, one as float64 144 MB. Frames stream:
# what the library takes does not grow with them, so the same is done with a third of the particles, and
# the difference is what more particles cost.
MEASURED = """
import resource, sys, numpy as np, meniscus
count = int(sys.argv[1])
base = np.zeros((4 * count, 3))
points = base[::4]
rng = np.random.default_rng(1)
for k in range(3):
    points[:, k] = rng.random(count)
camera = meniscus.Camera.look_at((.5, .5, 3), (.5, .5, .5), size=(64, 48))
radius = .5 * count ** (-1 / 3)
meniscus.extract(points[:300000], camera, particle_radius=.5 * 300000 ** (-1 / 3), mesh=False)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
surface = meniscus.extract(points, camera, particle_radius=radius, mesh=False)
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
assert np.isfinite(surface.depth).sum() > 300
print((after - before) / 1024)
"""


def grown(count):
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", MEASURED, str(count)],
                         capture_output=True, text=True, check=True)
    return float(run.stdout)


def test_more_particles_take_no_more_memory():
    few, many = 1_000_000, 3_000_000
    copy = (many - few) * 3 * 4 / 2**20  # MB, the least that a copy of those more would take
    assert grown(many) - grown(few) < copy / 2
