#!/usr/bin/env python3
"""Draws closed meshes from three sides: docs/images/closed_mesh.png.

    scripts/mesh_pictures.py OUT.png MESH[:UP] ...    UP: y (default) or z

The picture of docs/mesh.md shows the meshes of dam/frame_015.ply (meniscus mesh) and of the solids
crown and notch (meniscus-accuracy closed --scene crown,notch --seeds 1001 --meshes FOLDER).
Wants numpy, pillow, trimesh and embreex (PyPI).
"""
import pathlib
import sys

import numpy as np
import trimesh
from PIL import Image
from trimesh.ray.ray_pyembree import RayMeshIntersector

WIDTH, HEIGHT, FINE = 460, 330, 3  # pixels of a picture; rays a pixel along each side
FIELD = np.radians(30)  # vertical field of view
CREASE = np.cos(np.radians(35))  # a corner whose normal turns away farther is shaded flat
WATER, BACKGROUND = np.array([90, 170, 235]), 30
AXES = {"y": (0, 1, 0), "z": (0, 0, 1)}
SIDES = {"y": [(1, 0.6, 1), (-1, 0.5, 0.6), (0.3, -0.7, -1)],
         "z": [(1, 0.4, 0.6), (-0.7, 1, 0.35), (0.5, -0.8, -0.7)]}


def corner_normals(mesh):
    """(triangles, 3, 3): of vertices, but of faces where a crease lies between."""
    normals, faces = mesh.vertex_normals[mesh.faces], mesh.face_normals[:, None, :]
    same = (normals * faces).sum(2) > CREASE
    return np.where(same[:, :, None], normals, np.broadcast_to(faces, normals.shape))


def picture(mesh, side, up):
    width, height = WIDTH * FINE, HEIGHT * FINE
    ahead = -np.array(side, float) / np.linalg.norm(side)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, ahead)
    points = mesh.vertices - mesh.bounds.mean(0)
    slope = np.tan(FIELD / 2) * np.array([width / height, 1])
    seen = np.stack([points @ right, points @ above], 1)
    away = (np.abs(seen) / slope).max(1) - points @ ahead  # at which a vertex is on the picture's edge
    eye = mesh.bounds.mean(0) - ahead * away.max() * 1.04
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    rays = ahead + x.reshape(-1, 1) * slope[0] * right + y.reshape(-1, 1) * slope[1] * above
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    at, ray, face = RayMeshIntersector(mesh).intersects_location(
        np.repeat(eye[None], len(rays), 0), rays, multiple_hits=False)
    share = trimesh.triangles.points_to_barycentric(mesh.triangles[face], at)
    normal = (corner_normals(mesh)[face] * share[:, :, None]).sum(1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    light = -0.6 * rays[ray] + 0.5 * above - 0.4 * right
    light /= np.linalg.norm(light, axis=1)[:, None]
    lit = np.clip((normal * light).sum(1), 0, 1)[:, None] * 0.8 + 0.15
    image = np.full((height * width, 3), float(BACKGROUND))
    image[ray] = np.clip(WATER * lit + 40 * lit**8, 0, 255)
    return image.reshape(HEIGHT, FINE, WIDTH, FINE, 3).mean((1, 3)).astype(np.uint8)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.split("\n\n")[1])
    rows = []
    for name in sys.argv[2:]:
        path, _, axis = name.partition(":")
        mesh = trimesh.load(pathlib.Path(path), process=False)
        axis = axis or "y"
        rows.append(np.hstack([picture(mesh, side, AXES[axis]) for side in SIDES[axis]]))
    Image.fromarray(np.vstack(rows)).quantize(128).save(sys.argv[1], optimize=True)


main()
