"""The matrix of scripts/portability.sh as Markdown.

    portability_matrix.py FOLDER RUNTIME ...

Reads FOLDER/RUNTIME.json, what `meniscus verify` wrote, and FOLDER/hashes.txt, lines of
runtime|frame|method|hash. Exit code 1 when a runtime failed or the hashes of a frame differ.
"""

import json
import sys


def main(folder: str, runtimes: list[str]) -> int:
    columns = []
    for runtime in runtimes:
        with open(f"{folder}/{runtime}.json") as file:
            run = json.load(file)
        device = run["devices"][0]
        columns.append((runtime, device, [row for row in run["rows"] if row["index"] == 0]))

    def line(title, cells):
        print("| " + " | ".join([title, *cells]) + " |")

    line("", [f"`{runtime}`" for runtime, _, _ in columns])
    print("|---" * (len(columns) + 1) + "|")
    line("platform", [device["platform"] for _, device, _ in columns])
    line("driver", [device["driver"] for _, device, _ in columns])
    line("device", [device["name"].replace("|", "/") for _, device, _ in columns])

    def tally(rows, group, required=True):
        rows = [row for row in rows if row["group"] == group and row["required"] is required]
        failed = sum(row["result"] == "fail" for row in rows)
        passed = sum(row["result"] == "pass" for row in rows)
        if not rows:
            return "-"
        if failed:
            return f"**{failed} of {len(rows)} differ**"
        untested = len(rows) - passed
        return f"**{untested} of {len(rows)} not tested**" if untested else f"{passed} the same"

    line("launches of kernels", [tally(rows, "kernel") for _, _, rows in columns])
    line("... in the other vector width", [tally(rows, "kernel", False) for _, _, rows in columns])
    line("whole frames of `verify`", [tally(rows, "frame") for _, _, rows in columns])

    def checks(rows, group):
        # Limits are figures: what is below a device's claim is told, whether it is needed or not.
        rows = [r for r in rows if r["group"] == group and (r["required"] or group == "limit")]
        failed = [row["kernel"] for row in rows if row["result"] == "fail"]
        if not rows:
            return "-"
        passed = sum(row["result"] == "pass" for row in rows)
        return "**" + ", ".join(sorted(set(failed))) + "**" if failed else f"{passed} pass"

    line("arithmetic", [checks(rows, "probe") for _, _, rows in columns])
    line("against double precision", [checks(rows, "reference") for _, _, rows in columns])
    line("limits", [checks(rows, "limit") for _, _, rows in columns])
    line("verdict", ["passed" if device["good"] else "**failed or incomplete**" for _, device, _ in columns])
    good = all(device["good"] for _, device, _ in columns)

    hashes = {}
    with open(f"{folder}/hashes.txt") as file:
        for entry in file:
            runtime, frame, method, value = entry.strip().split("|")
            hashes.setdefault((frame, method), {})[runtime] = value
    for (frame, method), found in hashes.items():
        same = len(set(found.values())) == 1 and "failed" not in found.values()
        good = good and same
        mark = "`" if same else "**"
        cells = [found.get(runtime) for runtime, _, _ in columns]
        line(f"{frame}, `{method}`", [f"{mark}{c}{mark}" if c else "-" for c in cells])
    return 0 if good else 1


sys.exit(main(sys.argv[1], sys.argv[2:]))
