"""What the peers' scripts share: the frame, and how it is timed."""

import json
import statistics
import time

import numpy as np


def read_ply(path):
    """Positions [n, 3] and the particle radius of a binary PLY of floats, as in examples/data."""
    with open(path, "rb") as file:
        header, body = file.read().split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    words = " ".join(lines).split()
    radius = float(words[words.index("particle_radius") + 1])
    values = np.frombuffer(body, "<f4", count * len(names)).reshape(count, len(names))
    return np.ascontiguousarray(values[:, :3]), radius


def report(frame, runs, **more):
    """Calls frame() twice untimed, then `runs` times, and prints one line of JSON."""
    frame()
    frame()
    wall, cpu = [], []
    for _ in range(runs):
        w, c = time.perf_counter(), time.process_time()
        frame()
        wall.append(1e3 * (time.perf_counter() - w))
        cpu.append(1e3 * (time.process_time() - c))
    print(json.dumps({"median_ms": statistics.median(wall), "least_ms": min(wall),
                      "cpu_ms": statistics.median(cpu), "frames": runs, **more}))
