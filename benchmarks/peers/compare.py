"""Measures meniscus and its peers on the same frame, turn by turn, and prints the ratios.

  compare.py MENISCUS PARTICLES.ply CAMERA.json OUT.json [ROUNDS]

Each round runs every program once, so that all see the same other load. Medians over the rounds.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).parent
RUNS = 3  # frames a program and round


def last_json(command, **environment):
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
    lines = [line for line in done.stdout.split("\n") if line.startswith("{")]
    if done.returncode or not lines:
        sys.exit(f"compare.py: {' '.join(map(str, command))} failed:\n{done.stderr[-2000:]}")
    return json.loads(lines[-1])


def splashsurf(particles, camera):
    return last_json([sys.executable, here / "splashsurf_frame.py", particles, str(RUNS)])


def vtk(particles, camera):
    return last_json([sys.executable, here / "vtk_frame.py", particles, camera, str(RUNS)],
                     VTK_DEFAULT_OPENGL_WINDOW="vtkEGLRenderWindow")


def meniscus(program, method):
    def measure(particles, camera):
        with tempfile.TemporaryDirectory() as folder:
            out = f"{folder}/frame.json"
            command = [program, "bench", "frame", particles, "--camera", camera, "--method", method,
                       "--seconds", "1", "--json", out]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                sys.exit(f"compare.py: {done.stderr}")
            with open(out) as file:
                root = json.load(file)
        result = root["results"][0]
        return {**{key: result[key] for key in ("median_ms", "least_ms", "cpu_ms", "frames",
                                                "pixels", "frames_per_second")},
                "version": root["version"], "device": root["device"]}
    return measure


def main():
    program, particles, camera, out = sys.argv[1:5]
    rounds = int(sys.argv[5]) if len(sys.argv) > 5 else 3
    programs = {"meniscus fit": meniscus(program, "fit"), "meniscus ssm": meniscus(program, "ssm"),
                "splashsurf smooth": splashsurf, "vtk fluid mapper": vtk}
    results = {name: [] for name in programs}
    for k in range(rounds):
        for name, measure in programs.items():
            print(f"round {k + 1} of {rounds}: {name}", file=sys.stderr)
            results[name].append(measure(particles, camera))

    def median(name, key):
        return statistics.median(r[key] for r in results[name])

    figures = {}
    for name, each in results.items():
        figures[name] = {**each[-1], **{key: median(name, key)
                                        for key in ("median_ms", "least_ms", "cpu_ms")},
                         "wall_ratio": median(name, "median_ms") / median("meniscus fit", "median_ms"),
                         "cpu_ratio": median(name, "cpu_ms") / median("meniscus fit", "cpu_ms"),
                         "rounds": each}
    with open(out, "w") as file:
        json.dump({"particles": particles, "camera": camera, "processors": os.cpu_count(),
                   "load": os.getloadavg()[0], "results": figures}, file, indent=1)
    print(f"{'one frame':<19}{'wall ms':>9}{'least':>9}{'cpu ms':>9}{'wall ratio':>12}{'cpu ratio':>11}")
    for name, f in figures.items():
        print(f"{name:<19}{f['median_ms']:>9.1f}{f['least_ms']:>9.1f}{f['cpu_ms']:>9.1f}"
              f"{f['wall_ratio']:>12.2f}{f['cpu_ratio']:>11.2f}")
    print(f"\nwall: medians of {rounds} rounds; least: the best frame's, median of the rounds; ratios "
          f"to meniscus fit\nload average {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")


main()
