"""Times splashsurf's smooth surface (weighted Laplacian smoothing) on one frame.

  splashsurf_frame.py PARTICLES.ply RUNS

Its recommended settings with smoothing: smoothing length 2 r, cubes of 0.5 r, threshold 0.6, mesh
clean-up, 25 weighted smoothing iterations, normals smoothed 10 times, all threads. A frame is
particles in memory to mesh and normals in memory: no start of a program, no files.
"""

import importlib.metadata
import sys

import frame
import pysplashsurf


def main():
    particles, radius = frame.read_ply(sys.argv[1])
    made = {}

    def reconstruct():
        mesh, _ = pysplashsurf.reconstruction_pipeline(
            particles, particle_radius=radius, smoothing_length=2.0, cube_size=0.5,
            iso_surface_threshold=0.6, mesh_cleanup=True, mesh_smoothing_weights=True,
            mesh_smoothing_iters=25, compute_normals=True, normals_smoothing_iters=10)
        made["triangles"] = len(mesh.mesh.triangles)

    reconstruct()
    frame.report(reconstruct, int(sys.argv[2]), version=importlib.metadata.version("pysplashsurf"),
                 **made)


main()
