"""Times newton's ParticleSurface on one frame: a mesh by marching cubes, on a GPU.

  newton_surface.py PARTICLES.ply RUNS [DEVICE]

Cubes of 1 and 0.5 r (splashsurf's frame has 0.5 r), neighbours within 6 r, isotropic and anisotropic
kernels, all else as newton has it. A frame is particles in the host's memory to mesh and normals in
the host's memory. DEVICE is one of Warp's, cuda:0 or cpu. Needs the packages newton and warp-lang.
"""

import sys

import frame
import newton
import numpy as np
import warp
from newton._src.geometry.particle_surface import ParticleSurface


def main():
    device = sys.argv[3] if len(sys.argv) > 3 else "cuda:0"
    particles, radius = frame.read_ply(sys.argv[1])
    radii = warp.array(np.full(len(particles), radius, np.float32), dtype=warp.float32, device=device)
    for cube in (1.0, 0.5):
        for anisotropic in (False, True):
            surface = ParticleSurface(cube * radius, kernel_radius=6 * radius, anisotropic=anisotropic,
                                      device=device)
            made = {}

            def reconstruct():
                positions = warp.array(particles, dtype=warp.vec3, device=device)
                mesh = [part.numpy() for part in surface.extract(positions, radii)]
                made["triangles"] = len(mesh[1]) // 3

            reconstruct()
            frame.report(reconstruct, int(sys.argv[2]), cube=cube, anisotropic=anisotropic,
                         version=newton.__version__, warp=warp.config.version, **made)


main()
