#!/usr/bin/env python3
"""Checks closed meshes (`meniscus mesh`, `meniscus-accuracy closed --meshes FOLDER`) with programs that are not ours.

    scripts/mesh_check.py [--table] MESH.ply ...      --table: one line a mesh, as for docs/mesh.md
    scripts/mesh_check.py --apart FULL.ply FEW.ply RADIUS      how far an --adaptive mesh is from the full one

Three readers and checkers that share no code, neither with each other nor with Meniscus (PyPI):
  trimesh     every edge has two faces, which run against each other; the volume is above 0; no face without area
  manifold3d  takes the mesh as a solid (status NoError), of the volume and the Euler number that trimesh finds
  pymeshlab   no edge and no vertex that is not manifold, no open edge; counts the triangles that intersect others.
              Left out where it is not installed: it is large
Prints what each finds, and exits with 1 when a mesh is not closed and manifold, or inside out. Triangles that intersect
are counted and not a fault: docs/mesh.md, "Limits". Wants numpy, scipy, trimesh and manifold3d.
"""
import sys

import numpy as np

try:
    import pymeshlab
except ImportError:
    pymeshlab = None


def with_trimesh(path):
    """What trimesh says, and the faults among that."""
    import trimesh

    mesh = trimesh.load_mesh(path, process=False)
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    said = {
        "triangles": len(mesh.faces), "vertices": len(mesh.vertices), "volume": float(mesh.volume),
        "euler": int(mesh.euler_number), "pieces": int(mesh.body_count),
        # Two vertices at one place: formats that weld by position (STL) would join what is apart.
        "same place": len(mesh.vertices) - len(np.unique(mesh.vertices.astype(np.float32), axis=0)),
    }
    faults = {
        "not watertight": not mesh.is_watertight,
        "winding not consistent": not mesh.is_winding_consistent,
        "not a volume": not mesh.is_volume,
        "inside out": not mesh.volume > 0,
        "no triangles": len(mesh.faces) == 0,
        f"{np.count_nonzero(mesh.area_faces == 0)} triangles without area": bool((mesh.area_faces == 0).any()),
        f"{np.count_nonzero(~used)} vertices of no triangle": not used.all(),
        "not finite": not np.isfinite(mesh.vertices).all(),
        # Each piece that is a sphere with handles has 2, 0, -2 ...
        "odd Euler number": mesh.euler_number % 2 != 0,
    }
    return said, [fault for fault, found in faults.items() if found], mesh


def with_manifold(mesh):
    """The faults that manifold3d finds in the same vertices and triangles."""
    import manifold3d

    solid = manifold3d.Manifold(manifold3d.Mesh(
        np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint32)))
    if solid.status() != manifold3d.Error.NoError:
        return [f"manifold3d: {solid.status().name}"]
    volume, euler = float(solid.volume()), 2 - 2 * solid.genus()
    faults = []
    # Sums of as many terms as triangles, each to 24 bits.
    if abs(volume - mesh.volume) > 1e-5 * abs(mesh.volume):
        faults.append(f"manifold3d finds a volume of {volume}, trimesh {mesh.volume}")
    # It takes vertices with several fans apart, so that there are more.
    if euler != mesh.euler_number:
        faults.append(f"manifold3d finds an Euler number of {euler}, trimesh {mesh.euler_number}")
    return faults


def with_meshlab(path):
    """What MeshLab says of the file."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(path)
    found = meshes.get_topological_measures()
    names = {"boundary_edges": "open edges", "non_two_manifold_edges": "edges that are not manifold",
             "non_two_manifold_vertices": "vertices that are not manifold",
             "unreferenced_vertices": "vertices of no triangle"}
    faults = [f"MeshLab: {found[key]} {name}" for key, name in names.items() if found[key]]
    if not found["is_mesh_two_manifold"] and not faults:
        faults = ["MeshLab: not manifold"]
    meshes.compute_selection_by_self_intersections_per_face()
    said = {"pieces": found["connected_components_number"],
            "intersecting": meshes.current_mesh().selected_face_number()}
    return said, faults


def check_closed(path):
    """What all programs say of a mesh, and a list of its faults: empty when it is closed and manifold."""
    said, faults, mesh = with_trimesh(path)
    if not faults:
        faults += with_manifold(mesh)
    if pymeshlab:
        of_meshlab, more = with_meshlab(path)
        said["intersecting"] = of_meshlab["intersecting"]
        if of_meshlab["pieces"] != said["pieces"]:
            more.append(f"MeshLab finds {of_meshlab['pieces']} pieces, trimesh {said['pieces']}")
        faults += more
    return said, faults


def apart(full, few, radius):
    """Prints how far `few` is from `full`, at 400,000 points or so, and the vertices of `full` from `few`, in radii."""
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(full)
    meshes.load_new_mesh(few)
    for name, start, end, within in [("of the few from the full", 1, 0, True), ("vertices of the full from the few", 0, 1, False)]:
        meshes.get_hausdorff_distance(
            sampledmesh=start, targetmesh=end, samplevert=True, sampleedge=within, sampleface=within, samplenum=400000,
            savesample=True, maxdist=pymeshlab.PercentageValue(50))
        # Layers added last: the samples and the places nearest to them. Vertices are samples, too.
        off = meshes.mesh(meshes.mesh_number() - 2).vertex_scalar_array() / radius
        print(f"{few.rsplit('/', 1)[-1]}: {name}: RMS {np.sqrt((off**2).mean()):.4f}, 99 % {np.percentile(off, 99):.3f}, "
              f"99.9 % {np.percentile(off, 99.9):.3f}, most {off.max():.3f} radii")


def main():
    if sys.argv[1:2] == ["--apart"] and len(sys.argv) == 5 and pymeshlab:
        apart(sys.argv[2], sys.argv[3], float(sys.argv[4]))
        return
    paths = [word for word in sys.argv[1:] if not word.startswith("--")]
    table = "--table" in sys.argv
    if not paths or set(sys.argv[1:]) - set(paths) - {"--table"}:
        sys.exit(__doc__)
    failed = 0
    for path in paths:
        said, faults = check_closed(path)
        failed += bool(faults)
        name = path.rsplit("/", 1)[-1]
        intersecting = said.get("intersecting", "-")
        if table:
            print(f"| {name} | {said['triangles']} | {said['pieces']} | {said['euler']} | {said['same place']} | "
                  f"{intersecting} | {', '.join(faults) or 'none'} |")
        else:
            print(f"{'FAIL' if faults else 'ok  '}  {name}: {said['triangles']} triangles, {said['pieces']} pieces, "
                  f"Euler number {said['euler']}, volume {said['volume']:.6g}, {said['same place']} vertices at the place "
                  f"of others, {intersecting} triangles intersect" + "".join(f"\n      {fault}" for fault in faults))
        sys.stdout.flush()
    print(f"{len(paths)} meshes, {failed} with faults", file=sys.stderr)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
