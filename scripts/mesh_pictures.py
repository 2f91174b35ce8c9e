#!/usr/bin/env python3
"""Draws closed meshes from three sides: docs/images/closed_mesh.png, closed_rivals.png and adaptive_mesh.png.

    scripts/mesh_pictures.py [--width PIXELS] [--columns N] [--beside] [--wires] OUT.png MESH[:UP[:LABEL]][,MESH...] ...

Each word is a row of three sides, and further rows where commas join meshes: these are seen by the first one's cameras.
UP: y (default) or z. --width: of a picture (460). --columns: so many sides of three (3). --beside: such meshes are put
beside each other. --wires: edges are drawn, too.
docs/mesh.md has the commands. Wants numpy, pillow, trimesh and embreex (PyPI).
"""
import argparse
import pathlib

import numpy as np
import trimesh
from PIL import Image, ImageDraw, ImageFont
from trimesh.ray.ray_pyembree import RayMeshIntersector

FLAT, FINE = 33 / 46, 3  # height of a picture over its width; rays a pixel along each side
FIELD = np.radians(30)  # vertical field of view
SLOPE = np.tan(FIELD / 2) * np.array([1 / FLAT, 1])
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


def camera(mesh, side, up):
    """Eye and axes (right, above, ahead) that show all of a mesh; the slopes of the picture's edges are in SLOPE."""
    ahead = -np.array(side, float) / np.linalg.norm(side)
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, ahead)
    points = mesh.vertices - mesh.bounds.mean(0)
    seen = np.stack([points @ right, points @ above], 1)
    away = (np.abs(seen) / SLOPE).max(1) - points @ ahead  # at which a vertex is on the picture's edge
    return mesh.bounds.mean(0) - ahead * away.max() * 1.04, right, above, ahead


def wires(mesh, face, share, size):
    """How dark edges make each place: those nearer than half a pixel of `size`."""
    corner = mesh.triangles[face]
    side = np.stack([corner[:, 2] - corner[:, 1], corner[:, 0] - corner[:, 2], corner[:, 1] - corner[:, 0]], 1)
    height = 2 * mesh.area_faces[face][:, None] / np.linalg.norm(side, axis=2)
    return np.where((share * height).min(1) < 0.5 * size, 0.35, 1)[:, None]


def picture(mesh, seen_from, width, with_wires):
    eye, right, above, ahead = seen_from
    height = round(width * FLAT)
    fine = width * FINE, height * FINE
    x, y = np.meshgrid((np.arange(fine[0]) + 0.5) / fine[0] * 2 - 1, 1 - (np.arange(fine[1]) + 0.5) / fine[1] * 2)
    rays = ahead + x.reshape(-1, 1) * SLOPE[0] * right + y.reshape(-1, 1) * SLOPE[1] * above
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    at, ray, face = RayMeshIntersector(mesh).intersects_location(
        np.repeat(eye[None], len(rays), 0), rays, multiple_hits=False)
    share = trimesh.triangles.points_to_barycentric(mesh.triangles[face], at)
    normal = (corner_normals(mesh)[face] * share[:, :, None]).sum(1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    light = -0.6 * rays[ray] + 0.5 * above - 0.4 * right
    light /= np.linalg.norm(light, axis=1)[:, None]
    lit = np.clip((normal * light).sum(1), 0, 1)[:, None] * 0.8 + 0.15
    image = np.full((fine[0] * fine[1], 3), float(BACKGROUND))
    image[ray] = np.clip(WATER * lit + 40 * lit**8, 0, 255)
    if with_wires:
        image[ray] *= wires(mesh, face, share, ((at - eye) @ ahead) * 2 * SLOPE[0] / width)
    return image.reshape(height, FINE, width, FINE, 3).mean((1, 3)).astype(np.uint8)


def labelled(picture, label):
    image = Image.fromarray(picture)
    ImageDraw.Draw(image).text((10, 8), label, fill=(235, 235, 235), font=ImageFont.load_default(size=18))
    return np.asarray(image)


def main():
    words = argparse.ArgumentParser(usage=__doc__)
    words.add_argument("--width", type=int, default=460)
    words.add_argument("--columns", type=int, default=3)
    words.add_argument("--beside", action="store_true")
    words.add_argument("--wires", action="store_true")
    words.add_argument("out")
    words.add_argument("meshes", nargs="+")
    words = words.parse_args()
    rows = []
    for group in words.meshes:
        cameras, of_group = None, []
        for name in group.split(","):
            path, axis, label = (name.split(":") + ["", ""])[:3]
            axis = axis or "y"
            mesh = trimesh.load(pathlib.Path(path), process=False)
            cameras = cameras or [camera(mesh, side, AXES[axis]) for side in SIDES[axis][:words.columns]]
            row = [picture(mesh, seen_from, words.width, words.wires) for seen_from in cameras]
            row[0] = labelled(row[0], label)
            of_group.append(np.hstack(row))
        rows.append((np.hstack if words.beside else np.vstack)(of_group))
    Image.fromarray(np.vstack(rows)).quantize(128).save(words.out, optimize=True)


if __name__ == "__main__":
    main()
