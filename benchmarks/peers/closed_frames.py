#!/usr/bin/env python3
"""Makes closed meshes of frames with meniscus, splashsurf (smooth) and OpenVDB, and prints what each takes.

  closed_frames.py FOLDER [FRAME=RADIUS ...]     the frames are the six of docs/mesh.md unless given

Programs are build/release/meniscus and those that splashsurf.sh and openvdb.sh make in build/peers. OpenVDB is left out
where its program is not there, and of frames that are not PLY files as examples/data has them. Whole programs, one after
the other, from file to file. Processor time (the kernel's, too) is the least of three runs (OpenVDB: one, it is slow),
memory the most that was resident. Meshes go to FOLDER/NAME_WHO.ply.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

RUNS = 3
root = pathlib.Path(__file__).resolve().parents[2]
FRAMES = [f"{root}/{name}=0.025" for name in (
    "examples/data/dam/frame_015.ply", "examples/data/cube_drop/frame_007.ply", "examples/data/cube_drop/frame_012.ply",
    "examples/data/dam_sequence/dam.0010.ply", "tests/data/splashsurf/dam_break_frame_9_6859_particles.bgeo",
    "tests/data/splashsurf/double_dam_break_frame_01_4732_particles.vtk")]


def measured(words):
    """Processor seconds and peak resident MB of a program."""
    with tempfile.TemporaryFile() as log:
        child = subprocess.Popen(words, stdout=log, stderr=log)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            log.seek(0)
            sys.exit(f"closed_frames.py: {' '.join(map(str, words))} failed:\n{log.read().decode()[-2000:]}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def triangles(path):
    for line in open(path, "rb"):
        if line.startswith(b"element face"):
            return int(line.split()[2])


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder, frames = sys.argv[1], sys.argv[2:] or FRAMES
    meniscus, splashsurf = root / "build/release/meniscus", root / "build/peers/bin/pysplashsurf"
    openvdb = root / "build/peers/openvdb_mesh"
    for program, script in (meniscus, "scripts/test.sh"), (splashsurf, "benchmarks/peers/splashsurf.sh"):
        if not program.exists():
            sys.exit(f"closed_frames.py: {program} is not there: {script} makes it")
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    print(f"{'frame':<54}{'mesh':<12}{'triangles':>10}{'CPU s':>8}{'MB':>7}")
    for word in frames:
        frame, _, radius = word.partition("=")
        name = pathlib.Path(frame).parent.name + "_" + pathlib.Path(frame).stem
        # The settings of meniscus-accuracy closed.
        commands = {
            "full": [meniscus, "mesh", frame, "-r", radius, "-q", "-o"],
            "adaptive": [meniscus, "mesh", frame, "-r", radius, "-q", "--adaptive", "0.05", "-o"],
            "splashsurf": [
                splashsurf, "reconstruct", frame, f"-r={radius}", "-l=2.0", "-c=0.5", "-t=0.6", "--mesh-cleanup=on",
                "--mesh-smoothing-weights=on", "--mesh-smoothing-iters=25", "--normals=on",
                "--normals-smoothing-iters=10", "-o"],
        }
        with tempfile.TemporaryDirectory() as scratch:
            if openvdb.exists() and frame.endswith(".ply"):
                from frame import read_ply

                positions = pathlib.Path(scratch) / "positions"
                read_ply(frame)[0].tofile(positions)
                commands["openvdb"] = [openvdb, positions]
            for who, words in commands.items():
                mesh = pathlib.Path(folder) / f"{name}_{who}.ply"
                words = [*words, mesh, radius] if who == "openvdb" else [*words, mesh]
                runs = [measured(words) for _ in range(1 if who == "openvdb" else RUNS)]
                print(f"{name:<54}{who:<12}{triangles(mesh):>10}{min(t for t, _ in runs):>8.2f}"
                      f"{max(m for _, m in runs):>7.0f}", flush=True)


main()
