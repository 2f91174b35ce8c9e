#!/usr/bin/env python3
"""How much a batch gains by overlapping frames: frames a second of one `meniscus extract` of a sequence,
against one `extract` after another, both without what it takes to start.

    overlap.py PROGRAM 'INPUT.####.ply' CAMERA [--rounds 3] [-- MORE OPTIONS]

Start-up is what an extract of a single particle takes, image of the same size, kernels loaded. Of the
batch the time from the first to the last finished frame counts. Turn by turn, the median of the rounds.
"""
import argparse
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time


def run(words):
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(words, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - begin, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    options, more = sys.argv[1:], []
    if "--" in options:
        at = options.index("--")
        options, more = options[:at], options[at + 1:]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("input")
    parser.add_argument("camera", help="one camera, not a list")
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args(options)
    extract = [asked.program, "extract"]
    common = ["--camera", asked.camera, "-q", *more]
    before, after = asked.input.split("####")
    frames = sorted(pathlib.Path(before).parent.glob(pathlib.Path(before).name + "[0-9]" * 4 + after))
    gains = []
    with tempfile.TemporaryDirectory() as folder:
        out, log, lone = f"{folder}/o.####.exr", f"{folder}/log.jsonl", f"{folder}/lone.xyz"
        pathlib.Path(lone).write_text("0 0 0\n")
        single = [*extract, lone, "-o", f"{folder}/lone.exr", "--particle-radius", "0.1", *common]
        run([*extract, asked.input, "-o", out, *common])  # builds the kernels
        print(f"{len(frames)} frames\n{'round':>5} {'one by one':>12} {'batch':>12} {'gain':>6} {'busy':>6}"
              f" {'with start-up':>14}")
        for k in range(asked.rounds):
            start = statistics.median(run(single)[0] for _ in range(5))
            alone = sum(run([*extract, str(f), "-o", f"{folder}/one.exr", *common])[0] for f in frames)
            pathlib.Path(log).unlink(missing_ok=True)
            wall, cpu = run([*extract, asked.input, "-o", out, "--log", log, *common])
            ends = sorted(json.loads(line)["end"] for line in open(log))
            batch = (len(ends) - 1) / (ends[-1] - ends[0])
            serial = len(frames) / (alone - start * len(frames))
            gains.append(batch / serial)
            cores = len(os.sched_getaffinity(0))
            print(f"{k + 1:>5} {serial:>8.2f} f/s {batch:>8.2f} f/s {gains[-1]:>6.2f}"
                  f" {100 * cpu / wall / cores:>4.0f} % {alone / wall:>13.2f}", flush=True)
    print(f"gain {statistics.median(gains):.2f}")


if __name__ == "__main__":
    main()
