#!/usr/bin/env python3
"""Puts a sequence of meshes that meniscus wrote into one USD file, with velocities.

    pip install usd-core numpy
    scripts/usd_sequence.py -o dam.usdc [--fps 24] [--up Y|Z] dam.0001.ply dam.0002.ply ...

The ending says which: .usda is text, .usdc binary. Frames take the last number in their names as
time codes, so that 0001 is frame 1. Each is a time sample of one mesh /surface: points, normals,
faces, velocities (world units per second, which renderers blur by) and a primvar for each attribute
(extract --attribute). Topology changes from frame to frame, so nothing is interpolated between
them but by velocities. The file appears under its name when it is complete.
"""

import argparse
import os
import re
import sys

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

TYPES = {"float": "<f4", "uchar": "u1", "int": "<i4"}


def read_ply(path):
    """Columns of the vertices by name, and faces, of a mesh by meniscus."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.find(b"end_header\n")
    header = data[:end].decode("utf-8", "replace").splitlines()
    if end < 0 or header[:2] != ["ply", "format binary_little_endian 1.0"]:
        sys.exit(f"{path}: is no mesh by meniscus, wanted a binary little-endian PLY")
    counts, columns = {}, []
    for line in header:
        words = line.split()
        if words[0] == "element":
            counts[words[1]] = int(words[2])
        elif words[0] == "property" and words[1] != "list":
            columns.append((words[2], TYPES[words[1]]))
    vertices = np.frombuffer(data, np.dtype(columns), counts["vertex"], end + 11)
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("v", "<i4", (3,))]), counts["face"],
                          end + 11 + vertices.nbytes)
    return vertices, faces["v"]


def frame_of(path):
    numbers = re.findall(r"\d+", os.path.basename(path))
    if not numbers:
        sys.exit(f"{path}: has no number in its name, wanted name.0001.ply")
    return int(numbers[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--fps", type=float, default=24, help="frames per second")
    parser.add_argument("--up", choices=["Y", "Z"], default="Y")
    parser.add_argument("meshes", nargs="+")
    options = parser.parse_args()
    root, ending = os.path.splitext(options.output)
    if ending not in (".usda", ".usdc"):
        sys.exit(f"{options.output}: unknown ending, wanted .usda or .usdc")
    meshes = sorted(options.meshes, key=frame_of)
    frames = [frame_of(path) for path in meshes]
    if len(set(frames)) != len(frames):
        sys.exit("two meshes are of one frame")

    hidden = f"{root}.partial-{os.getpid()}{ending}"
    try:
        stage = Usd.Stage.CreateNew(hidden)
        stage.SetStartTimeCode(frames[0])
        stage.SetEndTimeCode(frames[-1])
        stage.SetTimeCodesPerSecond(options.fps)
        stage.SetFramesPerSecond(options.fps)
        UsdGeom.SetStageUpAxis(stage, getattr(UsdGeom.Tokens, options.up.lower()))
        mesh = UsdGeom.Mesh.Define(stage, "/surface")
        stage.SetDefaultPrim(mesh.GetPrim())
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
        own = {"x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz"}
        for path, frame in zip(meshes, frames):
            vertices, faces = read_ply(path)
            vectors = lambda names: Vt.Vec3fArray.FromNumpy(
                np.ascontiguousarray(np.stack([vertices[n] for n in names], -1)))
            mesh.CreatePointsAttr().Set(vectors("xyz"), frame)
            mesh.CreateNormalsAttr().Set(vectors(("nx", "ny", "nz")), frame)
            if "vx" in vertices.dtype.names:
                mesh.CreateVelocitiesAttr().Set(vectors(("vx", "vy", "vz")), frame)
            mesh.CreateFaceVertexCountsAttr().Set(
                Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)), frame)
            mesh.CreateFaceVertexIndicesAttr().Set(
                Vt.IntArray.FromNumpy(np.ascontiguousarray(faces).reshape(-1)), frame)
            if len(vertices):
                points = np.stack([vertices[n] for n in "xyz"], -1)
                mesh.CreateExtentAttr().Set(
                    [Gf.Vec3f(*map(float, points.min(0))), Gf.Vec3f(*map(float, points.max(0)))],
                    frame)
            primvars = UsdGeom.PrimvarsAPI(mesh)
            for name in vertices.dtype.names:
                if name in own:
                    continue
                primvars.CreatePrimvar(
                    re.sub(r"\W", "_", name), Sdf.ValueTypeNames.FloatArray,
                    UsdGeom.Tokens.vertex).Set(
                        Vt.FloatArray.FromNumpy(np.ascontiguousarray(vertices[name])), frame)
        stage.GetRootLayer().Save()
        os.replace(hidden, options.output)
    finally:
        if os.path.exists(hidden):
            os.remove(hidden)
    print(f"{options.output}: {len(frames)} frames, {frames[0]} to {frames[-1]}")


if __name__ == "__main__":
    main()
