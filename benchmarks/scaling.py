#!/usr/bin/env python3
"""Measures how a frame's time grows with the number of particles and with the number of pixels.

    benchmarks/scaling.py [--program build/release/meniscus] [--largest 1e8] [--sizes WxH,...] [--folder FOLDER]

Makes breaking dams of 10^4 particles and more with `meniscus generate` in a folder (12 bytes a
particle are needed there; each file is removed when it has been measured), extracts each a few
times, and prints two tables: times by particles at 1024x768, and times by pixels at the largest
number. "passes" are those over all particles: survey, fronts and
select; "rest" is all later stages. The fastest run counts. CPU time counts all threads.
"""

import argparse
import os
import resource
import subprocess
import tempfile

CAMERA = ["--eye", "5,2.2,3.4", "--target", "1.5,.3,.75", "--fov", "32"]
PASSES = ("survey", "fronts", "select")
SIZES = ("640x480", "1024x768", "1440x1080", "2048x1536", "2560x1920", "3264x2448")


def extract(program, file, size, method):
    """One run: milliseconds of the passes and of the rest, CPU seconds, counts and memory."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [program, "extract", file, "-o", file + ".png", "--size", size, "--method", method,
               "--timings", "-q"] + CAMERA
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    os.remove(file + ".png")
    stages, counts, memory, table = {}, {}, {}, None
    for line in out.splitlines():
        if line.startswith(("stage ", "what ", "memory ")):
            table = line.split()[0]
            continue
        if not line.strip():
            continue
        name, rest = line[:17].strip(), line[17:].split()
        if table == "stage":
            stages[name] = float(rest[0])
        elif table == "what":
            counts[name] = int(rest[0].replace(",", ""))
        elif table == "memory":
            memory[name] = " ".join(rest)
    passes = sum(stages.get(name, 0) for name in PASSES)
    return {"passes": passes, "rest": stages["all stages"] - passes, "counts": counts,
            "cpu": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
            "memory": memory}


def fastest(runs):
    best = min(runs, key=lambda run: run["passes"] + run["rest"])
    best["cpu"] = min(run["cpu"] for run in runs)
    best["passes"] = min(run["passes"] for run in runs)
    best["rest"] = min(run["rest"] for run in runs)
    return best


def row(cells, widths):
    print("| " + " | ".join(str(c).rjust(w) for c, w in zip(cells, widths)) + " |", flush=True)


def table(titles, widths):
    row(titles, widths)
    print("|" + "|".join("-" * (w + 1) + ":" for w in widths) + "|", flush=True)


def generate(program, folder, particles):
    file = os.path.join(folder, f"dam_{particles}.ply")
    subprocess.run([program, "generate", "--particles", str(particles), "-o", file, "-q"],
                   check=True)
    return file


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--program", default="build/release/meniscus")
    parser.add_argument("--largest", type=float, default=1e8)
    parser.add_argument("--sizes", default=",".join(SIZES))
    parser.add_argument("--method", default="fit")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--folder")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        titles = ("particles", "passes ms", "M particles/s", "rest ms", "ns/particle", "CPU s",
                  "pipeline on", "pixels", "device", "program")
        widths = [max(11, len(t)) for t in titles]
        table(titles, widths)
        particles = 10000
        while particles <= options.largest * 1.001:
            file = generate(options.program, folder, particles)
            run = fastest([extract(options.program, file, "1024x768", options.method)
                           for _ in range(options.runs)])
            os.remove(file)
            rate = 1e-3 * particles / run["passes"] if run["passes"] else None
            row((f"{particles:,}", f"{run['passes']:.0f}" if rate else "",
                 f"{rate:.0f}" if rate else "", f"{run['rest']:.0f}",
                 f"{1e6 * (run['passes'] + run['rest']) / particles:.0f}", f"{run['cpu']:.1f}",
                 f"{run['counts'].get('in view', 0):,}", f"{run['counts'].get('pixels', 0):,}",
                 run["memory"].get("device buffers", ""),
                 run["memory"].get("whole program", "")), widths)
            particles *= 10
        print()
        particles = int(options.largest)
        file = generate(options.program, folder, particles)
        titles = ("image", "megapixels", "passes ms", "rest ms", "ns/covered pixel", "CPU s",
                  "pipeline on", "covered", "device", "program")
        widths = [max(11, len(t)) for t in titles]
        print(f"{particles:,} particles:\n", flush=True)
        table(titles, widths)
        for size in options.sizes.split(","):
            run = fastest([extract(options.program, file, size, options.method)
                           for _ in range(options.runs)])
            width, height = map(int, size.split("x"))
            covered = run["counts"].get("pixels", 0)
            row((size, f"{1e-6 * width * height:.1f}", f"{run['passes']:.0f}",
                 f"{run['rest']:.0f}", f"{1e6 * run['rest'] / max(1, covered):.0f}",
                 f"{run['cpu']:.1f}", f"{run['counts'].get('in view', 0):,}", f"{covered:,}",
                 run["memory"].get("device buffers", ""),
                 run["memory"].get("whole program", "")), widths)


if __name__ == "__main__":
    main()
