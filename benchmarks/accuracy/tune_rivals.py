#!/usr/bin/env python3
"""Searches the best settings of the rivals on the tuning seeds (docs/rivals.md).

    benchmarks/accuracy/tune_rivals.py --program build/release/meniscus-accuracy [METHOD ...]

One option is varied at a time over its candidates, round after round, until a round changes
nothing. The score is the mean over the scenes of the error along the normal (RMS, s) plus a
fiftieth of the median normal error (degrees): 1 degree counts like 0.02 s. Seeds 1 to 3 are for
tuning; docs/accuracy.md reports others.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

FOOTPRINT = [1.2, 1.3, 1.4, 1.42, 1.43, 1.45, 1.5, 1.6]
SIGMA = [0.7, 1, 1.3, 1.4, 1.45, 1.5, 1.6, 2]

# The candidates of every option, in the order in which they are varied.
SEARCHED = {
    "paper": {
        "paper-offset": [0, 0.5, 1, 1.2],
        "merge-cosine": [0.9, 0.95, 0.98, 0.99, 0.995, 0.999, 1],
        "merge-distance": [0, 2, 3, 4, 6, 10],
        "blend-d-max": [1, 2, 3, 6],
        "d-max": [3, 4, 6],
        "paper-b": [0.05, 0.15, 0.3, 0.6],
        "paper-b-gain": [0, 0.2, 0.45, 0.8, 1.5],
        "reach": [1, 2, 3, 5],
        "ridge": [1e-4, 1e-3, 1e-2, 0.1],
        "max-edge": [4, 5.2, 7],
        "owned": [0.02, 0.04, 0.08],
        "sigma-s": [0.5, 1, 2, 4],
        "sigma-n": [0.1, 0.3, 1],
    },
    "ssm": {"ssm-footprint": FOOTPRINT, "ssm-sigma": SIGMA, "ssm-z-max": [1.5, 2, 3, 4.5]},
    "spheres": {"spheres-footprint": FOOTPRINT},
    "bilateral": {
        "bilateral-footprint": FOOTPRINT,
        "bilateral-sigma": SIGMA,
        "bilateral-range": [2, 5, 10, 15, 20],
        "bilateral-iterations": [1, 2, 3],
        "bilateral-separable": [0, 1],
    },
    "narrow-range": {
        "narrow-footprint": FOOTPRINT,
        "narrow-sigma": SIGMA,
        "narrow-delta": [0.5, 1, 2, 3, 5],
        "narrow-mu": [0, 0.25, 0.5, 1, 2],
        "narrow-iterations": [1, 2, 3],
        "narrow-separable": [0, 1],
        "narrow-cleanup": [0, 2, 4],
    },
    "curvature-flow": {
        "flow-footprint": FOOTPRINT,
        "flow-time": [0.8, 1.2, 1.8, 2.2, 2.7, 4],
        "flow-z-max": [2, 3, 4.5, 7],
    },
    "anisotropic": {
        "anisotropic-ks": [1.25, 1.6, 2, 2.5],
        "anisotropic-level": [0.2, 0.25, 0.3, 0.33, 0.36, 0.4],
        "anisotropic-lambda": [0.5, 0.7, 0.9],
        "anisotropic-kr": [2, 4, 8],
        "anisotropic-h": [1.5, 2, 2.5],
        "anisotropic-few": [3, 6, 15],
    },
}


def measure(args, variants):
    """Of each METHOD+name=value+... the figures of the mean over the scenes and seeds."""
    with tempfile.TemporaryDirectory() as folder:
        results = pathlib.Path(folder, "results.json")
        command = [args.program, "--method", ",".join(variants), "--seeds", args.seeds]
        if args.scenes:
            command += ["--scene", args.scenes]
        subprocess.run(command + ["--json", results], check=True, stdout=subprocess.DEVNULL)
        rows = json.loads(results.read_text())["rows"]
    return {row["method"]: row["figures"] for row in rows if row["scene"] == "mean"}


def score(figures):
    return figures["normal_rms"] + figures["angle_median"] / 50


def search(args, method):
    known = {}

    def name_of(settings):
        return "+".join([method] + [f"{name}={value}" for name, value in sorted(settings.items())])

    def evaluate(trials):
        """The first of the best trials."""
        new = [name for name in map(name_of, trials) if name not in known]
        for name, figures in (measure(args, new) if new else {}).items():
            known[name] = score(figures)
            print(f"{known[name]:.5f}  {figures['normal_rms']:.4f} s {figures['normal_bias']:+.4f} s "
                  f"{figures['angle_median']:5.2f} deg  crease {figures['crease_rms']:.3f} s "
                  f"{figures['crease_angle']:.1f} deg  {name}", flush=True)
        return min(trials, key=lambda settings: known[name_of(settings)])

    best = {}  # what is not in it has its default
    before = None
    while best != before:
        before = best
        for name, candidates in SEARCHED[method].items():
            best = evaluate([best] + [{**best, name: value} for value in candidates])
    print(f"best of {method}: {known[name_of(best)]:.5f} {name_of(best)}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/release/meniscus-accuracy")
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--scenes", default="", help="all unless given")
    parser.add_argument("methods", nargs="*", metavar="METHOD", default=list(SEARCHED))
    args = parser.parse_args()
    for method in args.methods:
        search(args, method)


if __name__ == "__main__":
    main()
