#!/usr/bin/env python3
"""Writes the same particles in every format that is read, with programs that are not ours.

    scripts/format_samples.py FOLDER [COUNT [WRITER ...]]

Wants numpy, meshio, vtk, h5py and blosc from PyPI. VTK, meshio, NumPy and h5py write their own
formats. DualSPHysics' .bi4, FLIP Fluids' .ffp3, LAMMPS' dumps and Houdini's .bgeo.sc are written
here from their published layouts. tests/data/formats holds what this makes of 37 particles;
tests/io/formats_test.cpp reads it.
"""

import json
import os
import struct
import sys

import blosc
import h5py
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk


def particles(count):
    """Positions, velocities, ids, temperature and force; floats of 32 bits."""
    random = np.random.default_rng(7)
    f = np.float32
    # Multiples of 2^-10, which every text and every type of float keeps.
    grid = lambda low, high, shape: (random.integers(low * 1024, high * 1024, shape) / 1024).astype(f)
    return {
        "position": grid(-2, 2, (count, 3)),
        "velocity": grid(-8, 8, (count, 3)),
        "id": random.permutation(count).astype(np.int64) * 3 + 5,
        "temperature": grid(250, 350, count),
        "force": grid(-1, 1, (count, 3)),
    }


def vtk_arrays(data, positions=np.float32):
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(data["position"].astype(positions)), deep=True))
    arrays = []
    for name in ("velocity", "id", "temperature", "force"):
        kind = vtk.VTK_ID_TYPE if name == "id" else None
        array = numpy_to_vtk(np.ascontiguousarray(data[name]), deep=True, array_type=kind)
        array.SetName(name)
        arrays.append(array)
    return points, arrays


def write_vtk(folder, data):
    count = len(data["id"])
    for name, mode, zlib, wide, big, kind in [
        ("ascii", "ascii", 0, 0, 0, "vtp"),
        ("inline", "binary", 0, 0, 0, "vtp"),
        ("inline_zlib", "binary", 1, 1, 0, "vtp"),
        ("raw", "raw", 0, 1, 0, "vtp"),
        ("raw_narrow_big", "raw", 0, 0, 1, "vtp"),
        ("raw_double", "raw", 0, 0, 0, "vtp"),
        ("raw_zlib", "raw", 1, 0, 0, "vtp"),
        ("raw_zlib_big", "raw", 1, 1, 1, "vtp"),
        ("base64", "base64", 0, 0, 0, "vtp"),
        ("base64_zlib", "base64", 1, 0, 0, "vtp"),
        ("raw", "raw", 0, 0, 0, "vtu"),
        ("base64_zlib", "base64", 1, 1, 0, "vtu"),
    ]:
        double = name.endswith("double")
        points, arrays = vtk_arrays(data, np.float64 if double else np.float32)
        if kind == "vtp":
            grid, writer = vtk.vtkPolyData(), vtk.vtkXMLPolyDataWriter()
            vertices = vtk.vtkCellArray()
            for k in range(count):
                vertices.InsertNextCell(1, [k])
            grid.SetPoints(points)
            grid.SetVerts(vertices)
        else:
            grid, writer = vtk.vtkUnstructuredGrid(), vtk.vtkXMLUnstructuredGridWriter()
            grid.SetPoints(points)
            for k in range(count):
                grid.InsertNextCell(vtk.VTK_VERTEX, 1, [k])
        for array in arrays:
            grid.GetPointData().AddArray(array)
        time = vtk.vtkDoubleArray()
        time.SetName("TimeValue")
        time.InsertNextValue(0.25)
        grid.GetFieldData().AddArray(time)
        writer.SetFileName(f"{folder}/vtk_{name}.{kind}")
        writer.SetInputData(grid)
        {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary}.get(
            mode, writer.SetDataModeToAppended)()
        writer.SetEncodeAppendedData(1 if mode == "base64" else 0)
        if zlib:
            writer.SetCompressorTypeToZLib()
            writer.SetBlockSize(128)  # several blocks even of few particles
        else:
            writer.SetCompressorTypeToNone()
        (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
        assert writer.Write() == 1


def write_meshio(folder, data):
    count = len(data["id"])
    mesh = meshio.Mesh(
        data["position"], [("vertex", np.arange(count).reshape(-1, 1))],
        point_data={k: data[k] for k in ("velocity", "id", "temperature", "force")})
    meshio.vtu.write(f"{folder}/meshio_zlib.vtu", mesh, binary=True, compression="zlib")
    meshio.vtu.write(f"{folder}/meshio_plain.vtu", mesh, binary=True, compression=None)
    meshio.vtu.write(f"{folder}/meshio_ascii.vtu", mesh, binary=False)
    meshio.vtk.write(f"{folder}/meshio.vtk", mesh, binary=True)
    # meshio's PLY holds what it knows of a mesh: positions alone.


def write_numpy(folder, data):
    both = np.hstack([data["position"], data["velocity"]])
    np.save(f"{folder}/numpy_six.npy", both)
    np.save(f"{folder}/numpy_fortran.npy", np.asfortranarray(both.astype(np.float64)))
    np.save(f"{folder}/numpy_big.npy", both.astype(">f4"))
    record = np.zeros(len(data["id"]), dtype=[
        ("id", "<i8"), ("pos", "<f4", (3,)), ("velocity", "<f8", (3,)), ("note", "S3"),
        ("temperature", "<f4"), ("force", ">f4", (3,))])
    for here, there in [("id", "id"), ("pos", "position"), ("velocity", "velocity"),
                        ("temperature", "temperature"), ("force", "force")]:
        record[here] = data[there]
    np.save(f"{folder}/numpy_record.npy", record)
    arrays = dict(data, steps=np.arange(5), mass=np.float64(2))
    np.savez(f"{folder}/numpy_stored.npz", **arrays)
    np.savez_compressed(f"{folder}/numpy_deflated.npz", **arrays)
    # Beside them what has no use and cannot be read.
    np.savez_compressed(f"{folder}/numpy_beside.npz", **arrays, notes=np.array([{}, "a"], dtype=object),
                        day=np.array(["2026-11-30"], dtype="M8[D]"), name="dam",
                        heat=data["temperature"].astype(np.float16), grid=np.zeros((1, 1025, 1025), "i1"))


def write_h5py(folder, data):
    with h5py.File(f"{folder}/h5py_plain.h5", "w") as file:
        for name, values in data.items():
            file[name] = values
    with h5py.File(f"{folder}/h5py_packed.hdf5", "w") as file:
        group = file.create_group("frame/fluid")
        for name, values in data.items():
            chunk = (min(7, len(values)),) + values.shape[1:]
            group.create_dataset(name, data=values.astype(
                np.float64 if name == "position" else values.dtype), chunks=chunk,
                compression="gzip", shuffle=True, fletcher32=name == "id")
    # As PySPH's HDF output: /particles/NAME/arrays with a dataset for each property.
    with h5py.File(f"{folder}/pysph.hdf5", "w") as file:
        for name, shift in (("fluid", 0), ("boundary", 100)):
            arrays = file.create_group(f"particles/{name}/arrays")
            columns = {"x": 0, "y": 1, "z": 2}
            for axis, k in columns.items():
                arrays[axis] = data["position"][:, k].astype(np.float64) + shift
            for axis, k in {"u": 0, "v": 1, "w": 2}.items():
                arrays[axis] = data["velocity"][:, k].astype(np.float64)
            arrays["gid"] = data["id"].astype(np.uint32)
            arrays.create_dataset("temperature", data=data["temperature"], compression="gzip")
            for k, axis in enumerate("xyz"):
                arrays[f"force_{axis}"] = data["force"][:, k]
        file.create_group("solver_data").attrs["t"] = 0.25
    with h5py.File(f"{folder}/h5py_latest.h5", "w", libver="latest") as file:
        for name, values in data.items():
            file[name] = values
    # Beside them what has no use and cannot be read.
    with h5py.File(f"{folder}/h5py_beside.h5", "w") as file:
        for name, values in data.items():
            file[name] = values
        file.create_dataset("grid", data=np.zeros((1, 70, 60), np.float32), compression="gzip")
        file.create_dataset("later", (len(data["id"]), 3), np.float32)
        file["heat"] = data["temperature"].astype(np.float16)
        file["table"] = np.zeros(3, [("a", np.int32), ("b", np.float32)])


def write_refused(folder, data):
    """Files whose velocities are not to be taken for positions, and one that was not finished."""
    folder = folder.rstrip("/") + "_refused"
    os.makedirs(folder, exist_ok=True)
    half = data["position"].astype(np.float16)
    np.savez(f"{folder}/numpy_velocity.npz", velocity=data["velocity"])
    with h5py.File(f"{folder}/h5py_half.h5", "w") as file:
        file["position"], file["velocity"] = half, data["velocity"]
    with h5py.File(f"{folder}/h5py_compound.h5", "w") as file:
        file["particles"] = np.zeros(3, [("position", np.float32, 3)])
        file["velocity"] = data["velocity"]
    with h5py.File(f"{folder}/h5py_partly.h5", "w") as file:
        position = file.create_dataset("position", data["position"].shape, np.float32, chunks=(10, 2))
        position[:20] = data["position"][:20]


def bi4(data, big=False, wide=False, double=False, walls=0):
    """DualSPHysics' file of a part, as JBinaryData lays it out."""
    order = ">" if big else "<"
    text = lambda s: struct.pack(order + "I", len(s)) + s.encode()
    number = lambda code, value: struct.pack(order + code, value)

    def value(name, kind, payload):
        return text(name) + number("i", kind) + payload

    def array(name, kind, values):
        raw = values.tobytes()
        base = text("\nARRAY") + text(name) + number("i", 0) + number("i", kind)
        base += number("Q" if wide else "I", len(values)) + number("Q" if wide else "I", len(raw))
        return number("I", len(base)) + base + raw

    def item(name, values, arrays=(), items=()):
        packed = text("\nVALUES") + number("I", len(values)) + b"".join(values) if values else b""
        base = text("\nITEM\n") + text(name) + number("i", 0) + number("i", 0)
        base += text("%.7E") + text("%.15E")
        base += number("I", len(arrays)) + number("I", len(items)) + number("I", len(packed))
        return number("I", len(base)) + base + packed + b"".join(arrays) + b"".join(items)

    n, f, i = len(data["id"]), order + "f4", order + "u4"
    wall = np.zeros((walls, 3))
    # The walls have the lower ids: the fluid's are those of the other formats.
    first_fluid = int(data["id"].min()) if walls else 0
    ids = np.concatenate([np.arange(walls), data["id"]]).astype(i)
    position = np.vstack([wall + 50, data["position"]]).astype(order + ("f8" if double else "f4"))
    part = item("PART_0001", [
        value("Cpart", 8, number("I", 1)), value("TimeStep", 12, number("d", 0.25)),
        value("Npok", 8, number("I", n + walls)),
        value("DomainMin", 23, struct.pack(order + "3d", -2, -2, -2)),
    ], [
        array("Idp", 8, ids),
        array("Posd" if double else "Pos", 23 if double else 22, position),
        array("Vel", 22, np.vstack([wall, data["velocity"]]).astype(f)),
        array("temperature", 11, np.concatenate([np.zeros(walls), data["temperature"]]).astype(f)),
        array("force", 22, np.vstack([wall, data["force"]]).astype(f)),
    ])
    root = item("PART_0001", [
        value("AppName", 1, text("sample")), value("Data2d", 2, number("i", 0)),
        value("CaseNfixed", 10, number("Q", first_fluid)), value("CaseNmoving", 10, number("Q", 0)),
        value("CaseNfloat", 10, number("Q", 0)), value("CaseNfluid", 10, number("Q", n)),
    ], (), [part])
    head = "#FileJBD JPartDataBi4".ljust(58).encode() + b"\n\0"
    return head + bytes([int(big) + 10 * int(wide), int(wide), 0, 0]) + root


class HoudiniJson:
    """Houdini's binary JSON. Lists become arrays; numpy arrays become uniform ones."""

    def __init__(self):
        self.out, self.tokens = bytearray(b"\x7fNSJb"), {}

    def length(self, n):
        self.out += (bytes([n]) if n < 0xf1 else b"\xf2" + struct.pack("<H", n) if n < 65536
                     else b"\xf4" + struct.pack("<I", n))

    def put(self, value):
        if isinstance(value, str):
            if value not in self.tokens:  # defined once, then named by number
                self.tokens[value] = len(self.tokens)
                self.out.append(0x2b)
                self.length(self.tokens[value])
                self.length(len(value))
                self.out += value.encode()
            self.out.append(0x26)
            self.length(self.tokens[value])
        elif isinstance(value, bool):
            self.out.append(0x31 if value else 0x30)
        elif isinstance(value, int):
            self.out += (b"\x11" + struct.pack("<b", value) if -128 <= value < 128
                         else b"\x13" + struct.pack("<i", value))
        elif isinstance(value, float):
            self.out += b"\x1a" + struct.pack("<d", value)
        elif isinstance(value, dict):
            self.out.append(0x7b)
            for key, item in value.items():
                self.out.append(0x27)
                self.length(len(key))
                self.out += key.encode()
                self.put(item)
            self.out.append(0x7d)
        elif isinstance(value, np.ndarray) and value.dtype == bool:
            self.out += b"\x40\x10"
            self.length(len(value))
            packed = np.packbits(value, bitorder="little").tobytes()
            self.out += packed.ljust((len(value) + 31) // 32 * 4, b"\0")
        elif isinstance(value, np.ndarray):
            self.out += b"\x40" + {"f4": b"\x19", "f8": b"\x1a", "i4": b"\x13", "i8": b"\x14"}[
                value.dtype.str[1:]]
            self.length(value.size)
            self.out += value.tobytes()
        else:
            self.out.append(0x5b)
            for item in value:
                self.put(item)
            self.out.append(0x5d)


def houdini(data):
    """Geometry of points alone, by the schema that the HDK's documentation publishes."""
    count, page = len(data["id"]), 16

    def attribute(name, values, storage, form="pages"):
        values = values.reshape(count, -1)
        size = values.shape[1]
        about = ["scope", "public", "type", "numeric", "name", name, "options", {}]
        head = ["size", size, "storage", storage]
        if form == "tuples":
            body = head + ["tuples", [row for row in values]]
        elif form == "arrays":
            body = head + ["arrays", [np.ascontiguousarray(c) for c in values.T]]
        else:
            # The last component apart, where there are three; pages of one value once.
            packing = [2, 1] if size == 3 and form == "packed" else [size]
            raw, flags = [], [[] for _ in packing]
            for first in range(0, count, page):
                rows, column = values[first:first + page], 0
                for v, width in enumerate(packing):
                    part = rows[:, column:column + width]
                    same = bool(np.all(part == part[0]))
                    flags[v].append(same)
                    raw.append((part[:1] if same else part).reshape(-1))
                    column += width
            body = head + ["packing", [int(w) for w in packing], "pagesize", page,
                           "constantpageflags", [np.array(f, bool) for f in flags],
                           "rawpagedata", np.concatenate(raw)]
        return [about, ["size", size, "storage", storage, "defaults",
                        ["size", 1, "storage", "fpreal64", "values", np.zeros(1)], "values", body]]

    json_bytes = HoudiniJson()
    json_bytes.put([
        "fileversion", "19.5.303", "hasindex", False, "pointcount", count, "vertexcount", 0,
        "primitivecount", 0, "info", {"software": "sample", "artist": "none"},
        "topology", ["pointref", ["indices", np.zeros(0, np.int32)]],
        "attributes", ["pointattributes", [
            attribute("P", data["position"], "fpreal32", "packed"),
            attribute("v", data["velocity"], "fpreal32"),
            attribute("id", data["id"], "int64", "arrays"),
            attribute("temperature", data["temperature"], "fpreal32"),
            attribute("zero", data["temperature"] * 0, "fpreal32"),
            attribute("force", data["force"], "fpreal32", "tuples"),
        ]]])
    return bytes(json_bytes.out)


def scf(raw):
    """SideFX's seekable container: blocks that blosc packs, and where they are."""
    block = 1 << 9  # theirs are larger
    about = json.dumps({"sample": True}).encode()
    out = bytearray(b"scf1" + struct.pack(">q", len(about)) + about)
    places = []
    for first in range(0, len(raw), block):
        places.append(len(out))
        out += blosc.compress(raw[first:first + block], typesize=1, cname="lz4")
    index = struct.pack(f">{len(places) + 2}q", block, len(raw) % block, *places)
    return bytes(out + index + struct.pack(">q", len(index)) + b"1fcs")


def write_ffp3(folder, data):
    n, kinds, limit = len(data["id"]), (len(data["id"]) // 3, len(data["id"]) // 5), 10
    inside = n - sum(kinds)
    counts = np.array([[round(c * k / (limit - 1)) for c in (*kinds, inside)]
                       for k in range(limit)], dtype="<u4")
    head = struct.pack("<4I", *kinds, inside, limit) + counts.tobytes()
    for kind, values in (("", data["position"]), ("velocity", data["velocity"]),
                         ("uid", data["id"].astype("<u8")), ("temperature", data["temperature"]),
                         ("force", data["force"])):
        with open(f"{folder}/fluidparticles{kind}000001.ffp3", "wb") as file:
            file.write(head + values.tobytes())


def write_lammps(folder, data):
    def dump(path, columns, position, steps=(0,), before=""):
        with open(path, "w") as file:
            for step in steps:
                file.write(before)
                file.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(data['id'])}\n")
                file.write("ITEM: BOX BOUNDS pp pp pp\n" + "-2.0 2.0\n" * 3)
                file.write(f"ITEM: ATOMS id type {columns} vx vy vz temperature "
                           "force_x force_y force_z \n")
                for k in range(len(data["id"])):
                    row = [*position[k], *data["velocity"][k], data["temperature"][k],
                           *data["force"][k]]
                    shift = step / 1000  # of later steps
                    row[0] += shift
                    file.write(f"{data['id'][k]} 1 " + " ".join(repr(float(v)) for v in row) + "\n")

    p = data["position"].astype(np.float64)
    dump(f"{folder}/lammps.lammpstrj", "x y z", p)
    dump(f"{folder}/lammps_scaled.dump", "xs ys zs", (p + 2) / 4)
    dump(f"{folder}/lammps_unwrapped.dump", "xu yu zu", p)
    # As dump_modify units yes time yes has them.
    dump(f"{folder}/lammps_timed.dump", "x y z", p, before="ITEM: UNITS\nlj\nITEM: TIME\n0.25\n")
    dump(f"{folder}/lammps_steps.lammpstrj", "x y z", p, steps=(1000, 0, 2000))


def write_tables(folder, data):
    columns = np.hstack([data["position"], data["velocity"], data["temperature"][:, None],
                         data["force"]])
    with open(f"{folder}/dualsphysics.csv", "w") as file:  # as its tool PartVTK writes them
        file.write(" ;Part;Time [s];Np\n ;1;0.25;37\n\n")
        file.write("Pos.x [m];Pos.y [m];Pos.z [m];Idp;Vel.x [m/s];Vel.y [m/s];Vel.z [m/s];"
                   "Temperature;Force.x [N];Force.y [N];Force.z [N]\n")
        for k, row in enumerate(columns):
            t = [repr(float(v)) for v in row]
            file.write(";".join([*t[:3], str(data["id"][k]), *t[3:]]) + "\n")
    with open(f"{folder}/decimal_comma.csv", "w") as file:
        file.write("x;y;z;vx;vy;vz;temperature;force_x;force_y;force_z;id\n")
        for k, row in enumerate(columns):
            file.write(";".join(repr(float(v)).replace(".", ",") for v in row)
                       + f";{data['id'][k]}\n")
    with open(f"{folder}/reference.csv", "w") as file:
        file.write("x,y,z,vx,vy,vz,temperature,force_x,force_y,force_z,id\n")
        for k, row in enumerate(columns):
            file.write(",".join(repr(float(v)) for v in row) + f",{data['id'][k]}\n")


def main():
    folder = sys.argv[1]
    data = particles(int(sys.argv[2]) if len(sys.argv) > 2 else 37)
    os.makedirs(folder, exist_ok=True)
    for name in sys.argv[3:]:  # vtk, numpy, ...: these alone
        globals()["write_" + name](folder, data)
    if sys.argv[3:]:
        return
    write_vtk(folder, data)
    write_meshio(folder, data)
    write_numpy(folder, data)
    write_h5py(folder, data)
    write_refused(folder, data)
    for name, options in (("", {}), ("_big", {"big": True}), ("_wide", {"wide": True, "walls": 5}),
                          ("_double", {"double": True})):
        with open(f"{folder}/Part{name}_0001.bi4", "wb") as file:
            file.write(bi4(data, **options))
    with open(f"{folder}/houdini.bgeo", "wb") as file:
        file.write(houdini(data))
    with open(f"{folder}/houdini.bgeo.sc", "wb") as file:
        file.write(scf(houdini(data)))
    write_ffp3(folder, data)
    write_lammps(folder, data)
    write_tables(folder, data)
    with open(f"{folder}/series.pvd", "w") as file:
        file.write('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n')
        for time, name in ((0.5, "vtk_raw_zlib.vtp"), (0.25, "vtk_raw.vtp")):
            file.write(f'<DataSet timestep="{time}" group="" part="0" file="{name}"/>\n')
        file.write("</Collection>\n</VTKFile>\n")


if __name__ == "__main__":
    main()
