#!/usr/bin/env python3
"""Checks what `meniscus extract` wrote with programs that are not ours. Run by
scripts/check_outputs.sh, which installs what it needs.

  python scripts/check_outputs.py surface.exr surface.ply surface.vtp surface.glb surface.obj ...

EXR (package OpenEXR, else openimageio): channel names and types, windows, attributes, that Z, A,
kind, N and P agree with each other, that P lies under its own pixel and at Z by worldToNDC and
worldToCamera, and that Z.back, N.back, thickness and layers, where they are there, go with Z. Deep EXR
(package OpenEXR): that samples are in order and, flattened, the Z of the EXR. The channels that
meniscus.attributes names are attributes of the particles. Meshes (meshio, VTK and trimesh): no NaN, no
edge with more than two faces, no degenerate face, normals of unit length that point outward: with the
faces, and towards the eye when an EXR is given too. Prints one line a check and exits with 1 when one fails.
"""

import sys
from collections import namedtuple

import numpy as np

CHANNELS = {"Z", "A", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "id", "kind", "residual"}
LAYERS = {"Z.back", "N.back.X", "N.back.Y", "N.back.Z", "thickness", "layers"}  # with --layers
MOTION = {"V.X", "V.Y", "V.Z", "forward.u", "forward.v"}  # where particles have velocities
ATTRIBUTES = {
    "worldToCamera", "worldToNDC", "software", "comments", "meniscus.hash", "meniscus.method",
    "meniscus.parameters", "meniscus.particleRadius", "meniscus.view", "meniscus.projection",
}
Image = namedtuple("Image", "channels attributes data_window display_window")

failures = 0


def check(name, good, detail=""):
    global failures
    failures += not good
    print(f"  {'ok  ' if good else 'FAIL'}  {name:<52} {detail}")


def read_with_openexr(path):
    import OpenEXR

    part = OpenEXR.File(path, separate_channels=True).parts[0]
    channels = {name: channel.pixels for name, channel in part.channels.items()}
    window = lambda name: tuple(int(v) for corner in part.header[name] for v in corner)
    return Image(channels, part.header, window("dataWindow"), window("displayWindow"))


def read_with_openimageio(path):
    import OpenImageIO as oiio

    image = oiio.ImageInput.open(path)
    spec = image.spec()
    channels = {}
    for k, name in enumerate(spec.channelnames):
        kind = str(spec.channelformat(k))
        dtype = np.uint32 if kind == "uint" or kind == "uint32" else np.float32
        channels[name] = np.asarray(
            image.read_image(k, k + 1, oiio.UINT if dtype == np.uint32 else oiio.FLOAT)
        ).reshape(spec.height, spec.width)
    attributes = {p.name: p.value for p in spec.extra_attribs}
    for theirs, name in {"Software": "software", "ImageDescription": "comments"}.items():
        if theirs in attributes:
            attributes.setdefault(name, attributes[theirs])
    corner = lambda x, y, w, h: (x, y, x + w - 1, y + h - 1)
    return Image(
        channels, attributes, corner(spec.x, spec.y, spec.width, spec.height),
        corner(spec.full_x, spec.full_y, spec.full_width, spec.full_height))


def read_exr(path):
    try:
        return read_with_openexr(path)
    except ImportError:
        return read_with_openimageio(path)


def check_back(c, some):
    """The first exits and what they go with."""
    back = np.stack([c["N.back.X"], c["N.back.Y"], c["N.back.Z"]], -1).astype(float)
    check("Z.back lies behind Z, +inf without surface",
          bool(np.all(c["Z.back"][some] > c["Z"][some]) and np.all(c["Z.back"][~some] == np.inf)))
    check("N.back has unit length",
          bool(np.all(np.abs(np.linalg.norm(back[some], axis=-1) - 1) < 1e-5)))
    check("layers > 0 with surface, thickness at least what Z and Z.back say",
          bool(np.all(c["layers"][some] > 0)) and
          bool(np.all(c["thickness"][some] > 0.9999 * (c["Z.back"][some] - c["Z"][some]))),
          f"up to {c['layers'].max()} layers")


def check_deep(path, flat):
    """A deep image against the maps of the same frame, in the file `flat` (None: there are none)."""
    import OpenEXR

    print(path)
    part = OpenEXR.File(path, separate_channels=True).parts[0]
    check("a deep image of scan lines", part.header["type"] == OpenEXR.deepscanline)
    check("channel names", set(part.channels) == {"A", "Z", "ZBack"}, " ".join(part.channels))
    deep = {name: channel.pixels.ravel() for name, channel in part.channels.items()}
    counts = np.array([0 if z is None else len(z) for z in deep["Z"]])
    joined = {name: np.concatenate([v for v in values if v is not None and len(v)])
              for name, values in deep.items()}
    first = np.zeros(len(joined["Z"]), bool)
    first[np.cumsum(counts[counts > 0]) - counts[counts > 0]] = True
    check("A is 1", bool(np.all(joined["A"] == 1)), f"{len(first)} samples")
    check("intervals are not empty", bool(np.all(joined["ZBack"] > joined["Z"])))
    check("samples of a pixel are in order and do not overlap",
          bool(np.all((joined["Z"][1:] > joined["ZBack"][:-1]) | first[1:])))
    if flat is None:
        return
    c = read_exr(flat).channels
    nearest = np.full(counts.shape, np.inf, np.float32)
    nearest[counts > 0] = joined["Z"][first]
    check("flattened it is the map Z, bit for bit", nearest.tobytes() == c["Z"].tobytes())
    if "layers" in c:
        check("as many samples as layers", np.array_equal(counts, np.minimum(c["layers"].ravel(), 8)))
        back = np.full(counts.shape, np.inf, np.float32)
        back[counts > 0] = joined["ZBack"][first]
        check("the first ends at Z.back, bit for bit", back.tobytes() == c["Z.back"].tobytes())


def check_exr(path):
    """Returns the eye's position in the world, or None for an orthographic camera."""
    image = read_exr(path)
    c = image.channels
    print(path)
    carried = set(str(image.attributes.get("meniscus.attributes", "")).split("\n")) - {""}
    wanted = CHANNELS | carried
    for optional in (MOTION, LAYERS):
        wanted |= optional if optional & set(c) else set()
    check("channel names", set(c) == wanted, " ".join(sorted(set(c) ^ wanted)))
    check("attributes", ATTRIBUTES <= set(image.attributes),
          " ".join(sorted(ATTRIBUTES - set(image.attributes))))
    if not CHANNELS <= set(c) or not ATTRIBUTES <= set(image.attributes):
        return None
    uint = {name for name in c if c[name].dtype == np.uint32}
    single = {name for name in c if c[name].dtype == np.float32}
    check("channel types", uint == {"id", "kind", "layers"} & wanted and single == wanted - uint)
    height, width = c["Z"].shape
    check("data window = display window = image",
          image.data_window == image.display_window == (0, 0, width - 1, height - 1),
          f"{width} x {height}")

    for name in sorted(carried):
        check(f"attribute {name} is not zero everywhere", bool(np.any(c[name])))
    z, kind = c["Z"], c["kind"]
    normal = np.stack([c["N.X"], c["N.Y"], c["N.Z"]], -1).astype(float)
    point = np.stack([c["P.X"], c["P.Y"], c["P.Z"]], -1).astype(float)
    some = kind != 0
    check("kind is 0, 1 or 2", kind.max(initial=0) <= 2,
          ", ".join(f"{n} {np.count_nonzero(kind == k)}"
                    for k, n in enumerate(["none", "surface", "splash"])))
    check("no NaN", not any(np.isnan(c[name]).any() for name in single))
    check("Z finite and > 0 with surface, +inf without",
          bool(np.all(np.isfinite(z[some])) and np.all(z[some] > 0) and np.all(z[~some] == np.inf)))
    check("A is 1 with surface, 0 without", bool(np.array_equal(c["A"], some.astype(np.float32))))
    check("what is not depth is 0 without surface",
          not any(np.any(c[name][~some]) for name in wanted - {"Z", "Z.back", "A", "kind"}))
    if "layers" in c:
        check_back(c, some)
    length = np.linalg.norm(normal[some], axis=-1)
    check("N has unit length", bool(np.all(np.abs(length - 1) < 1e-5)))
    check("surface has an id, residual >= 0",
          bool(np.all(c["id"][kind == 1] > 0) and np.all(c["residual"] >= 0)),
          f"{len(np.unique(c['id'][kind == 1]))} groups")

    matrix = lambda name: np.asarray(image.attributes[name], float).reshape(4, 4)
    world = np.concatenate([point[some], np.ones((np.count_nonzero(some), 1))], -1)
    eye = world @ matrix("worldToCamera")
    ndc = world @ matrix("worldToNDC")
    ndc = ndc[:, :2] / ndc[:, 3:]
    rows, columns = np.nonzero(some)
    off_x = np.abs(ndc[:, 0] * width - columns - 0.5).max(initial=0)
    off_y = np.abs(ndc[:, 1] * height - rows - 0.5).max(initial=0)
    # The matrices and P have 24 bits: a few units in the last place of the largest coordinate.
    size = np.abs(world).max(initial=1) + np.abs(matrix("worldToCamera")).max()
    off_z = np.abs(eye[:, 2] - z[some]).max(initial=0)
    check("P lies at Z by worldToCamera", off_z < 32 * size * 2.0**-24, f"{off_z:.1e} off")
    check("P lies in its pixel by worldToNDC", max(off_x, off_y) < 0.01,
          f"{max(off_x, off_y):.1e} pixels off")
    check("matrix is left-handed, +z forward", np.linalg.det(matrix("worldToCamera")) < 0)

    projection = matrix("meniscus.projection")
    if projection[3, 2] == 0:
        return None
    position = -np.linalg.inv(matrix("meniscus.view")[:3, :3]) @ matrix("meniscus.view")[:3, 3]
    towards = np.sum((position - point[some]) * normal[some], -1)
    away = np.count_nonzero(towards < 0)
    check("N points towards the eye", away <= 0.001 * len(towards), f"{away} pixels do not")
    return position


def read_vtp(path):
    """With VTK: points, normals, faces, and arrays of the points."""
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    arrays = data.GetPointData()
    values = {arrays.GetArrayName(k): vtk_to_numpy(arrays.GetArray(k))
              for k in range(arrays.GetNumberOfArrays())}
    cells = data.GetPolys()
    check("triangles only", cells.GetNumberOfCells() == 0 or cells.GetMaxCellSize() == 3)
    faces = vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float), values, faces


def read_glb(path):
    """With trimesh, which keeps attributes that begin with _."""
    import trimesh

    scene = trimesh.load(path, process=False, maintain_order=True)
    mesh = next(iter(scene.geometry.values()))
    values = {name.lstrip("_"): np.asarray(v) for name, v in mesh.vertex_attributes.items()}
    values["Normals"] = mesh.vertex_normals
    return np.asarray(mesh.vertices, float), values, np.asarray(mesh.faces, np.int64)


def read_stl(path):
    """Triangles alone: each has its own corners."""
    import meshio
    import trimesh

    theirs = meshio.read(path)
    mesh = trimesh.load_mesh(path, process=False)
    check("meshio and trimesh read as many triangles",
          len(theirs.cells[0].data) == len(mesh.faces), f"{len(mesh.faces)}")
    return mesh


def check_same(first, points, values, faces):
    """Against the mesh of the first file: the same vertices, faces, velocities and attributes."""
    if first is None:
        return
    check("vertices and faces of the first mesh",
          np.array_equal(points, first[0]) and np.array_equal(faces, first[2]))
    # Each format has names of its own, which attributes get "particle." before.
    bare = lambda name: name.removeprefix("particle.")
    values = {bare(name): v for name, v in values.items()}
    for name, theirs in sorted((bare(name), v) for name, v in first[1].items()):
        check(f"{name} of the first mesh", name in values and np.array_equal(
            np.asarray(values[name], np.float32).reshape(theirs.shape), theirs))


def read_mesh(path):
    """Points, normals, faces, and by name what the vertices carry."""
    if path.lower().endswith(".vtp"):
        points, values, faces = read_vtp(path)
        return points, np.asarray(values.pop("Normals"), float), faces, values
    if path.lower().endswith(".glb"):
        points, values, faces = read_glb(path)
        return points, np.asarray(values.pop("Normals"), float), faces, values
    import meshio

    mesh = meshio.read(path)
    blocks = [cells.data for cells in mesh.cells]
    check("triangles only", all(cells.type == "triangle" for cells in mesh.cells))
    faces = np.concatenate(blocks).astype(np.int64) if blocks else np.zeros((0, 3), np.int64)
    data = mesh.point_data
    if {"nx", "ny", "nz"} <= set(data):
        normals = np.stack([data["nx"], data["ny"], data["nz"]], -1)
    else:
        normals = data.get("obj:vn", np.zeros((0, 3)))
    values = {k: np.asarray(v, np.float32) for k, v in data.items()
              if k not in {"nx", "ny", "nz", "vx", "vy", "vz", "obj:vn"}}
    if {"vx", "vy", "vz"} <= set(data):
        values["velocity"] = np.stack([data["vx"], data["vy"], data["vz"]], -1)
    return mesh.points.astype(float), np.asarray(normals, float).reshape(-1, 3), faces, values


def check_mesh(path, eye, first=None):
    """Returns what read_mesh does, less the normals. `first`: that of another file of this mesh."""
    import trimesh

    print(path)
    if path.lower().endswith(".stl"):
        mesh = read_stl(path)
        if first is not None:
            check("triangles of the first mesh", np.array_equal(
                np.asarray(mesh.triangles, np.float32), first[0][first[2]].astype(np.float32)))
        return first
    points, normals, faces, values = read_mesh(path)
    if not path.lower().endswith(".obj"):
        check_same(first, points, values, faces)
    check("vertices and faces", True, f"{len(points)} and {len(faces)}")
    check("a normal at every vertex", normals.shape == points.shape)
    if len(faces) == 0 or normals.shape != points.shape:
        return first
    if not path.lower().endswith(".vtp"):  # which trimesh does not read
        theirs = trimesh.load_mesh(path, process=False, maintain_order=True)
        theirs = theirs if hasattr(theirs, "vertices") else next(iter(theirs.geometry.values()))
        check("trimesh reads the same", np.array_equal(theirs.vertices, points) and
              np.array_equal(theirs.faces, faces))
        check("trimesh finds the winding consistent", theirs.is_winding_consistent)
    check("no NaN", bool(np.all(np.isfinite(points)) and np.all(np.isfinite(normals))))
    check("every vertex is used", len(np.unique(faces)) == len(points),
          f"{len(points) - len(np.unique(faces))} are not")
    same = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    check("no face names a vertex twice", not same.any())
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    _, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    check("no edge has more than two faces", count.max() <= 2,
          f"{np.count_nonzero(count == 1)} open, {np.count_nonzero(count > 2)} too many")
    check("normals have unit length",
          bool(np.all(np.abs(np.linalg.norm(normals, axis=1) - 1) < 1e-5)))
    a, b, c = points[faces[:, 0]], points[faces[:, 1]], points[faces[:, 2]]
    facing = np.cross(b - a, c - a)
    against = np.count_nonzero(np.sum(facing * normals[faces].sum(1), -1) < 0)
    # A face that bridges a small step between two sheets is seen almost edge-on and need not agree
    # with the sheets' normals; they are few.
    check("normals point to the faces' outside", against <= 0.001 * len(faces),
          f"{against} faces do not")
    if eye is not None:
        away = np.count_nonzero(np.sum(facing * (eye - a), -1) < 0)
        check("faces look at the eye", away == 0, f"{away} do not")
        away = np.count_nonzero(np.sum(normals * (eye - points), -1) < 0)
        check("normals point towards the eye", away <= 0.001 * len(points), f"{away} do not")
    return (points, values, faces) if first is None else first


def check_usd(path, first):
    """With usd-core: the one frame that usd_sequence.py made of the first mesh."""
    from pxr import Usd, UsdGeom

    print(path)
    stage = Usd.Stage.Open(path)
    mesh = UsdGeom.Mesh(stage.GetDefaultPrim())
    check("is a mesh by usd-core", bool(mesh))
    time = stage.GetStartTimeCode()
    good, reason = UsdGeom.Mesh.ValidateTopology(
        mesh.GetFaceVertexIndicesAttr().Get(time), mesh.GetFaceVertexCountsAttr().Get(time),
        len(mesh.GetPointsAttr().Get(time)))
    check("topology is valid", good, reason or "")
    points, values, faces = first
    check("points, faces and velocities of the first mesh",
          np.array_equal(np.array(mesh.GetPointsAttr().Get(time)), points.astype(np.float32)) and
          np.array_equal(np.array(mesh.GetFaceVertexIndicesAttr().Get(time)), faces.reshape(-1)) and
          np.array_equal(np.array(mesh.GetVelocitiesAttr().Get(time)), values["velocity"]))
    primvars = UsdGeom.PrimvarsAPI(mesh)
    for name in sorted(set(values) - {"velocity"}):
        primvar = primvars.GetPrimvar(name.replace(".", "_"))
        check(f"{name} is a primvar", bool(primvar) and np.array_equal(
            np.array(primvar.Get(time)), values[name]))


def main(paths):
    if not paths or paths[0] in ("-h", "--help"):
        print(__doc__)
        return 2
    eye = first = flat = None
    order = [".exr", ".ply"]  # the mesh that others are compared with
    rank = lambda path: next((k for k, e in enumerate(order) if path.lower().endswith(e)), 2)
    deep = [path for path in paths if path.lower().endswith(".deep.exr")]
    for path in sorted(set(paths) - set(deep), key=lambda path: (rank(path), path)):
        if path.lower().endswith(".exr"):
            eye, flat = check_exr(path), path
        elif path.lower().endswith((".usda", ".usdc")):
            check_usd(path, first)
        else:
            first = check_mesh(path, eye, first)
    for path in deep:
        check_deep(path, flat)
    print("all good" if failures == 0 else f"{failures} checks failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
