# SPDX-License-Identifier: GPL-3.0-or-later
"""From a frame of a particle cache to the arrays of a mesh. Knows nothing of Blender."""

import re
from pathlib import Path

import numpy as np

import meniscus


def frame_path(pattern, frame):
    """The file of a frame: #### in the name stands for its number, filled up with zeros."""
    found = list(re.finditer("#+", Path(pattern).name))
    if not found:
        return Path(pattern)
    place = found[-1]
    name = Path(pattern).name
    number = str(frame).zfill(len(place[0]))
    return Path(pattern).with_name(name[:place.start()] + number + name[place.end():])


def frames_of(pattern):
    """The numbers of all frames that there are, ascending."""
    name = Path(pattern).name
    found = list(re.finditer("#+", name))
    if not found:
        return []
    place = found[-1]
    wanted = re.compile(re.escape(name[:place.start()]) + f"(\\d{{{len(place[0])},}})" +
                        re.escape(name[place.end():]))
    matches = (wanted.fullmatch(file.name) for file in Path(pattern).parent.iterdir())
    return sorted(int(match[1]) for match in matches if match)


def camera_of(view, projection, width, height, margin=.1):
    """A camera of Blender's matrices, which sees a share `margin` of the image more on each side, so
    that what motion blur and refraction bring in from there is not missing.

    view: (4, 4), from the object's space to the camera's; rigid. projection: (4, 4), OpenGL's.
    """
    projection = np.array(projection, float)
    projection[:2] /= 1 + 2 * margin
    # Blender's are single precision: the rotation is made one again.
    view = np.array(view, float)
    u, scale, v = np.linalg.svd(view[:3, :3])
    if not np.allclose(scale, 1, atol=1e-3):
        raise meniscus.InvalidArgument(
            f"the object or the camera is scaled by {scale.max():g}: apply the scale (Ctrl-A)")
    view[:3, :3] = u @ v
    view[3] = 0, 0, 0, 1
    grown = (round(width * (1 + 2 * margin)), round(height * (1 + 2 * margin)))
    return meniscus.Camera(*grown, view, projection)


def mesh_of(pattern, frame, camera, particle_radius=0, cell=2):
    """The mesh of a frame: positions, normals and velocities (n, 3) and triangles (m, 3); or None
    where the cache has no such frame."""
    path = frame_path(pattern, frame)
    if not path.exists():
        return None
    particles = meniscus.open_particles(path, particle_radius)
    return meniscus.extract(particles, camera, image=False, cell=cell).mesh
