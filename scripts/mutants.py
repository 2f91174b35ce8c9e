#!/usr/bin/env python3
"""Changes the kernels in small ways, one at a time, and looks who notices (docs/reliability.md).

  scripts/mutants.py list                          # the mutants: place, kind, before and after
  scripts/mutants.py run --build build/release --out mutants [--file settle.cl ...] [--jobs 1]
  scripts/mutants.py report --out mutants          # tables, and the survivors

Mutants are made from the text of the files of kernels, seeded: swapped comparisons, off by one, a term, a
factor or a sum left out, another constant, another order, a lost tie, other functions and
components. `run` goes on where it was ended, at nice 19. With --known it leaves out what other
runs have done, also those that still go on. Each mutant runs, until somebody notices, on

  verify      the items of `meniscus verify` that launch its kernels, whole frames too, small ones
              first; the probes where the kernels are probes
  references  stages against double precision alone: what would notice if the canonical bits were
              recorded anew with the fault in them
  tests       the tests of the stages that use the file (tests/stages), where neither a small case
              nor a reference fails: those are what Faults.NoneIsFoundWhereNoneIs and
              References.EveryStageIsWithinItsBounds run

With --quick, references and tests are asked only where verify notices nothing; the report says of how
many they were asked. A mutant changes a result when one of them notices. Survivors are to be looked at.
"""

import argparse
import functools
import json
import os
import pathlib
import random
import re
import select
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROBES = {"arithmetic.cl", "fill.cl", "probe.cl"}  # verify's probes launch them, and are named; but
# for probe.cl, whose kernels are timed and decide about no result


# --- The text of kernels ---------------------------------------------------------------------------

def masked(text):
    """The text with comments and strings blanked, of the same length."""
    blank = lambda match: re.sub(r"[^\n]", " ", match.group())
    return re.sub(r"//[^\n]*|/\*.*?\*/|\"[^\"\n]*\"", blank, text, flags=re.S)


class Node:
    """A function, kernel, macro or other definition of a kernel file."""

    def __init__(self, file, name, kernel, begin, end, body, words):
        self.file, self.name, self.kernel = file, name, kernel
        self.begin, self.end, self.body = begin, end, body  # the body is what mutants change
        self.words = words


def nodes_of(file, code):
    nodes = []
    # Macros, then definitions with braces in what is left.
    rest = list(code)
    for match in re.finditer(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", code, re.M):
        for at in range(*match.span()):
            if rest[at] != "\n":
                rest[at] = " "
        define = re.match(r"\s*#\s*define\s+(\w+)(\([^)]*\))?", match.group())
        if define:
            body = match.start() + define.end()
            nodes.append(Node(file, define[1], False, match.start(), match.end(), body,
                              set(re.findall(r"\w+", code[body:match.end()]))))
    rest = "".join(rest)
    begin = at = 0
    while at < len(rest):
        if rest[at] == ";":
            begin = at + 1
        elif rest[at] == "{":
            depth, end = 0, at
            while True:
                depth += {"{": 1, "}": -1}.get(rest[end], 0)
                end += 1
                if depth == 0:
                    break
            head = rest[begin:at]
            name = re.search(r"(\w+)\s*\(", head)
            if not name:  # a structure: its name follows
                tail = re.compile(r"\s*(\w+)\s*;").match(rest, end)
                name = tail or re.search(r"(\w+)", head)
                end = tail.end() if tail else end
            nodes.append(Node(file, name[1], bool(re.search(r"\bkernel\s+void\b", head)), begin,
                              end, at, set(re.findall(r"\w+", rest[begin:end]))))
            begin, at = end, end - 1
        at += 1
    return nodes


@functools.lru_cache(None)
def kernel_files():
    """The kernel files by their names, which differ whatever the folder."""
    return {path.name: path for path in
            sorted((ROOT / "kernels").rglob("*.cl"), key=lambda path: path.name)}


def programs():
    """The files that are built together: each with those that its line "// uses:" names, and what
    these use."""
    texts = {name: path.read_text() for name, path in kernel_files().items()}

    def with_used(name):
        line = re.search(r"^// uses: (.*)$", texts[name], re.M)
        files = [used for one in (line[1].split() if line else []) for used in with_used(one)]
        return list(dict.fromkeys([*files, name]))

    return [["prelude.cl", *with_used(name)] for name, text in texts.items()
            if re.search(r"\bkernel\s+void\b", text)]


def kernels_reached(nodes_by_file):
    """Of each node, the kernels that contain it or call what does."""
    reached = {}
    for files in programs():
        nodes = [node for file in files for node in nodes_by_file[file]]
        by_name = {}
        for node in nodes:
            by_name.setdefault(node.name, []).append(node)
        for kernel in (node for node in nodes if node.kernel):
            seen, open_nodes = {id(kernel)}, [kernel]
            while open_nodes:
                node = open_nodes.pop()
                reached.setdefault(id(node), set()).add(kernel.name)
                for word in node.words:
                    for other in by_name.get(word, []):
                        if id(other) not in seen:
                            seen.add(id(other))
                            open_nodes.append(other)
    return reached


# --- Mutants ---------------------------------------------------------------------------------------

FACTOR = r"\w[\w.]*(?:\[[^\[\]]*\]|\((?:[^()]|\([^()]*\))*\))*"
TERM = rf"{FACTOR}(?: [*/] {FACTOR})*"


def swap(table):
    return lambda match: table[match.group(1)]


def split_arguments(text):
    """The arguments of a call whose "(" is the first character, and where it ends."""
    depth, begin, arguments = 0, 1, []
    for at, char in enumerate(text):
        depth += {"(": 1, ")": -1}.get(char, 0)
        if depth == 0 or (depth == 1 and char == ","):
            arguments.append(text[begin:at])
            begin = at + 1
        if depth == 0:
            return arguments, at + 1
    return [], 0


def simple_kinds():
    """Kind, pattern, what the first group becomes (None: nothing that is left out)."""
    constant = lambda match: f"{float(match.group(1)[:-1]) * 1.01 or 0.01:#.9g}".rstrip("0") + "f"
    step = lambda match: str(int(match.group(1)) + 1)
    functions = {"min": "max", "max": "min", "fmin": "fmax", "fmax": "fmin", "smaller": "larger",
                 "larger": "smaller", "floor": "ceil", "ceil": "floor", "ANY": "ALL", "ALL": "ANY",
                 "atomic_min": "atomic_max", "atomic_max": "atomic_min", "atomic_inc": "atomic_dec"}
    parts = {"x": "y", "y": "x", "z": "w", "w": "z", "lo": "hi", "hi": "lo"}
    return [
        ("comparison", r" (<=|>=|==|!=|<|>) ",
         swap({"<": ">", ">": "<", "<=": ">=", ">=": "<=", "==": "!=", "!=": "=="})),
        ("tie", r" (<=|>=|<|>) ", swap({"<": "<=", "<=": "<", ">": ">=", ">=": ">"})),
        ("tie", rf"( \|\| \({FACTOR} == [^()]*\))", lambda match: ""),
        ("off by one", r"(?<![\w.])(\d+)(?![\w.])", step),
        ("term", rf"\w\)?( [+-] {TERM})(?= ?[;,)+-])", lambda match: ""),
        ("factor", rf"\w\)?( [*/] {FACTOR})(?![\w.(\[])", lambda match: ""),
        ("sum", r" (\+=|-=|\|=|&=) ", lambda match: "="),
        ("constant", r"(?<![\w.])(\d+\.\d*(?:e-?\d+)?f)", constant),
        ("order", rf"(?<=[=(,] )({FACTOR} \+ {FACTOR} \+ {FACTOR})(?= ?[;,)+-])",
         lambda match: re.sub(r"^(.*?) \+ (.*)$", r"\1 + (\2)", match.group(1))),
        ("logic", r" (&&|\|\||&|\|) ", swap({"&&": "||", "||": "&&", "&": "|", "|": "&"})),
        ("logic", r"[(\s](!)(?=[\w(])", lambda match: ""),
        ("function", r"\b(" + "|".join(functions) + r")(?=\()", swap(functions)),
        ("component", r"\w\.(x|y|z|w|lo|hi)\b", swap(parts)),
    ]


def candidates(code, node):
    """(kind, begin, end, replacement) of all that can be changed in a node."""
    found = []
    body = code[:node.end]
    for kind, pattern, change in simple_kinds():
        for match in re.compile(pattern).finditer(body, node.body):
            begin, end = match.span(1)
            if kind == "component" and match.group(1) in "zw" and ".w" not in body[node.begin:]:
                continue
            head = body[body.rfind("\n", 0, begin) + 1:begin]
            if re.match(r"\s*#(?!\s*define)", head):
                continue
            if kind == "sum" and "for (" in head and head.count("(") > head.count(")"):
                continue  # such a loop has no end: nobody needs to be asked
            found.append((kind, begin, end, change(match)))
    for match in re.compile(r"\b(SELECT|fma)(?=\()").finditer(body, node.body):
        arguments, size = split_arguments(body[match.end():])
        if len(arguments) != 3:
            continue
        begin, end = match.end() + 1, match.end() + size - 1
        a, b, c = arguments
        if match[1] == "SELECT":
            found.append(("order", begin, end, f"{b.strip()}, {a.strip()},{c}"))
        else:
            found.append(("order", match.start(), match.end() + size,
                          f"(({a.strip()}) * ({b.strip()}) + ({c.strip()}))"))
    return found


@functools.cache  # a file's own text is asked for with each of its mutants
def preprocessed(text, options):
    return subprocess.run(["cpp", "-P", "-w", *options], input=text, capture_output=True,
                          text=True).stdout


def is_built(file, before, after, prelude):
    """Whether any width sees the change; sections for probes are always counted."""
    if file in PROBES:
        return True
    for width in (1, 8, 16):
        options = (f"-DWIDTH={width}",)
        one, other = (text if file == "prelude.cl" else prelude + text for text in (before, after))
        if preprocessed(one, options) != preprocessed(other, options):
            return True
    return False


class Mutant:
    def __init__(self, file, text, node, kind, begin, end, new, kernels):
        self.file, self.kind, self.kernels = file, kind, sorted(kernels)
        self.text = text[:begin] + new + text[end:]
        self.line = text.count("\n", 0, begin) + 1
        first = text.rfind("\n", 0, begin) + 1
        last = text.find("\n", end)
        self.old_line = text[first:last].strip()
        self.new_line = (text[first:begin] + new + text[end:last]).strip()
        self.function = node.name

    def key(self):
        """Says which mutant it is, wherever its line may stand."""
        return f"{self.file} {self.function}: {self.old_line} -> {self.new_line}"

    def place(self):
        return f"{kernel_files()[self.file].relative_to(ROOT)}:{self.line}"


def make_mutants(seed, only):
    texts = {name: path.read_text() for name, path in kernel_files().items()}
    codes = {file: masked(text) for file, text in texts.items()}
    nodes = {file: nodes_of(file, code) for file, code in codes.items()}
    reached = kernels_reached(nodes)
    mutants = []
    for file, text in texts.items():
        if only and file not in only:
            continue
        rng = random.Random(f"{seed} {file}")
        by_kind = {}
        for node in nodes[file]:
            for found in candidates(codes[file], node):
                if id(node) in reached:
                    by_kind.setdefault(found[0], []).append((node, found))
        for each in by_kind.values():
            rng.shuffle(each)
        wanted = 10 + min(4, text.count("\n") // 110)
        chosen, keys = [], set()
        while len(chosen) < wanted and any(by_kind.values()):
            # Kinds in turn, so that rare ones are there, too.
            for kind in sorted(by_kind, key=lambda k: rng.random()):
                if len(chosen) == wanted or not by_kind[kind]:
                    continue
                node, (_, begin, end, new) = by_kind[kind].pop()
                mutant = Mutant(file, text, node, kind, begin, end, new, reached[id(node)])
                if mutant.key() in keys or not is_built(file, text, mutant.text,
                                                        texts["prelude.cl"]):
                    continue
                keys.add(mutant.key())
                chosen.append(mutant)
        mutants += sorted(chosen, key=lambda m: m.line)
    return mutants


# --- Runs ------------------------------------------------------------------------------------------

SILENCE = 25  # seconds of processor time without a word: it is taken to hang
MOST = 1800  # seconds, whatever the machine is busy with


def seconds_used(pid):
    try:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def watched(command, environment):
    """Runs a command; its lines, and "hangs", or its exit code, negative for a signal."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          env=environment) as process:
        output, used, last = b"", 0.0, time.monotonic()
        while True:
            if not select.select([process.stdout], [], [], 5)[0]:
                if seconds_used(process.pid) - used < SILENCE and time.monotonic() - last < MOST:
                    continue
                process.kill()
                process.wait()
                code = "hangs"
                break
            some = os.read(process.stdout.fileno(), 65536)
            if not some:
                code = process.wait()
                break
            output += some
            used, last = seconds_used(process.pid), time.monotonic()
    return output.decode(errors="replace").splitlines(), code


class Runner:
    def __init__(self, build, out, job, quick):
        self.quick = quick
        self.tests = build / "tests"
        self.folder = out / f"job{job}"
        self.cache = self.folder / "pocl"
        self.cache.mkdir(parents=True, exist_ok=True)
        shim = next(build.glob("tests/**/*mutant_kernels.so"))
        self.environment = dict(os.environ, LD_PRELOAD=str(shim), POCL_CACHE_DIR=str(self.cache),
                                MENISCUS_CACHE_DIR="/dev/null/none")  # keeps no mutant's program
        self.environment.setdefault("OCL_ICD_VENDORS", "pocl.icd")
        self.first_failure = next(build.glob("tests/**/first_failure"))
        self.kept = None

    def call(self, mutant, *command):
        environment = dict(self.environment)
        if mutant:
            environment["MENISCUS_MUTANT"] = str(self.folder / mutant.file)
        return watched([str(part) for part in command], environment)

    def baseline(self):
        """Everything once without a mutant: nothing may fail, and the cache is filled. Once for each
        build of the program."""
        status, passed = self.first_failure.stat(), self.folder / "passed.json"
        build = [status.st_size, status.st_mtime]
        known = json.loads(passed.read_text()) if passed.exists() else {}
        if known.get("build") != build:
            lines, code = self.call(None, self.first_failure, "probe,kernel,reference,frame")
            if code != 0:
                sys.exit(f"mutants: verify fails without a mutant: {code}, {lines[-1:]}")
            known = {"build": build, "cache": [entry.name for entry in self.cache.glob("*")]}
            passed.write_text(json.dumps(known))
        self.kept = {self.cache / name for name in known["cache"]}

    def first(self, mutant, groups, kernels):
        """How somebody notices, or None."""
        lines, code = self.call(mutant, self.first_failure, groups, *kernels)
        if code == 0:
            return None
        fails = [line.split("\t")[1:] for line in lines if line.startswith("fails\t")]
        if code == 3 and fails:
            items = [line for line in lines if line.startswith(("small\t", "large\t"))]
            return {"group": fails[0][0], "kernels": sorted({each[1] for each in fails}),
                    "small": items[-1].startswith("small"), "case": fails[0][2],
                    "reason": fails[0][3]}
        if code in (1, 2):
            raise RuntimeError(f"mutants: first_failure: {code}: {lines[-1:]}")
        return {"group": "crash", "kernels": [], "small": bool(lines) and lines[-1][:5] == "small",
                "case": lines[-1] if lines else "", "reason": str(code)}

    def failing_test(self, mutant):
        """The first test that fails of those of the file's stages, or of the roofline's probes."""
        folder, stems = "stages", stages_of(mutant)
        if mutant.file == "probe.cl":
            folder, stems = "device", ["probe"]
        for stem in stems:
            source = next((ROOT / "tests" / folder).rglob(f"{stem}_test.cpp"), None)
            if not source:
                continue
            suites = set(re.findall(r"TEST(?:_[PF])?\((\w+),", source.read_text()))
            names = ":".join(f"{suite}.*:*/{suite}.*" for suite in sorted(suites))
            lines, code = self.call(mutant, self.tests / f"{folder}_test",
                                    f"--gtest_filter={names}", "--gtest_fail_fast",
                                    "--gtest_brief=1")
            if code != 0:
                failed = [line for line in lines if line.startswith("[  FAILED  ] ")]
                return failed[0][13:].split(",")[0] if failed else f"{stem}_test: {code}"
        return None

    def run(self, mutant):
        path = self.folder / mutant.file
        planted = pathlib.Path(f"{path}.planted")
        planted.unlink(missing_ok=True)
        path.write_text(mutant.text)
        result = {"key": mutant.key(), "file": mutant.file, "place": mutant.place(),
                  "kind": mutant.kind, "function": mutant.function, "kernels": mutant.kernels,
                  "old": mutant.old_line, "new": mutant.new_line}
        begin = time.monotonic()
        probes = mutant.file in PROBES
        asked = [] if probes or mutant.file == "prelude.cl" else mutant.kernels
        groups = "probe" if probes else "kernel,reference,frame"
        result["verify"] = None
        if mutant.file == "probe.cl":
            result["test"] = self.failing_test(mutant)
        else:
            result["verify"] = self.first(mutant, groups, asked)
        if result["verify"] and "did not build" in result["verify"]["reason"]:
            result["invalid"] = result["verify"]["reason"]
        elif not planted.exists():
            result["invalid"] = "is part of no program that was built"
        elif mutant.file == "probe.cl":
            pass
        elif probes:
            result["test"] = "Faults.NoneIsFoundWhereNoneIs" if result["verify"] else None
        elif not (self.quick and result["verify"]):
            result["references"] = self.first(mutant, "reference", asked)
            if result["references"]:
                result["test"] = "References.EveryStageIsWithinItsBounds"
            elif result["verify"] and result["verify"]["small"]:
                result["test"] = "Faults.NoneIsFoundWhereNoneIs"
            else:
                result["test"] = self.failing_test(mutant)
        result["seconds"] = round(time.monotonic() - begin, 1)
        for entry in set(self.cache.glob("*")) - (self.kept or set()):
            shutil.rmtree(entry, ignore_errors=True)
        return result


def stages_of(mutant):
    """The stages that launch a kernel which the mutant may change."""
    stages = []
    for source in sorted((ROOT / "src" / "stages").rglob("*.cpp")):
        if set(mutant.kernels) & set(re.findall(r"\bkernels::(\w+)", source.read_text())):
            stages.append(source.stem)
    own = pathlib.Path(mutant.file).stem
    return sorted(stages, key=lambda stage: (stage != own, stage))


def read_results(out):
    path = pathlib.Path(out) / "results.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def run(arguments):
    os.nice(arguments.nice)
    out = pathlib.Path(arguments.out).resolve()
    out.mkdir(parents=True, exist_ok=True)

    def keys_done():
        return {result["key"] for folder in [out, *arguments.known] for result in read_results(folder)}

    done = keys_done()
    todo, number = [], {}
    for mutant in make_mutants(arguments.seed, arguments.file):
        number[mutant.file] = number.get(mutant.file, 0) + 1
        wanted = mutant.place() in arguments.at if arguments.at else mutant.key() not in done
        if wanted and not 0 < arguments.first < number[mutant.file]:
            todo.append((number[mutant.file], mutant.file, mutant))
    # Files in the order of --file; without it in turn, so that each is begun.
    place = {file: k for k, file in enumerate(arguments.file)}
    todo.sort(key=lambda each: (place.get(each[1], 0), *each[:2]))
    todo = [mutant for _, _, mutant in todo]
    print(f"{len(todo)} mutants to run, {len(done)} done before", flush=True)
    free = []
    for job in range(arguments.jobs):
        runner = Runner(pathlib.Path(arguments.build).resolve(), out, job, arguments.quick)
        runner.baseline()
        free.append(runner)

    def one(mutant):
        if not arguments.at and mutant.key() in keys_done():
            return  # by another run meanwhile
        runner = free.pop()
        try:
            result = runner.run(mutant)
        finally:
            free.append(runner)
        with open(out / "results.jsonl", "a") as file:
            file.write(json.dumps(result) + "\n")
        print(f"{result['place']} {result['kind']}: {verdict_of(result)} ({result['seconds']} s)",
              flush=True)

    with ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(one, todo))


# --- Reports ---------------------------------------------------------------------------------------

def named_rightly(result):
    found = result["verify"]
    if not found:
        return False
    if result["file"] in PROBES:
        return found["group"] == "probe"
    named = set(found["kernels"])
    if found["group"] == "frame":  # its kernel is the method; the reason says where it began
        named = set(re.findall(r"\bkernel (\w+)", found["reason"]))
    return bool(named) and named <= set(result["kernels"])


def noticed(result):
    return bool(result["verify"] or result.get("references") or result.get("test"))


def verdict_of(result):
    if "invalid" in result:
        return "invalid: " + result["invalid"]
    if not noticed(result):
        return "survives"
    if not result["verify"]:
        return "NOT NOTICED BY VERIFY"
    return ("named" if named_rightly(result) else "noticed") + f" by {result['verify']['group']}"


def report(arguments):
    results = [r for out in [*arguments.known, arguments.out] for r in read_results(out)
               if "invalid" not in r]
    latest = {result["key"]: result for result in results}  # the last run of each counts
    files = {}
    for result in latest.values():
        files.setdefault(result["file"], []).append(result)
    rows, total = [], [0] * 9
    for file in sorted(files):
        all_of = files[file]
        changing = [r for r in all_of if noticed(r)]
        row = [len(all_of), len(changing), sum(bool(r["verify"]) for r in changing),
               sum(named_rightly(r) for r in changing),
               sum(bool(r.get("references")) for r in changing),
               sum("references" in r for r in changing),
               sum(bool(r.get("test")) for r in changing), sum("test" in r for r in changing),
               len(all_of) - len(changing)]
        total = [a + b for a, b in zip(total, row)]
        rows.append((f"`{file}`", row))
    print("| kernel file | mutants | change a result | noticed by `verify` | named rightly | "
          "by references | by tests | survive |")
    print("|---|---|---|---|---|---|---|---|")
    for name, row in [*rows, ("all", total)]:
        asked = [f"{row[k]} of {row[k + 1]}" for k in (4, 6)]
        print(f"| {name} | " + " | ".join(map(str, [*row[:4], *asked, row[8]])) + " |")
    for title, chosen in (
            ("Survivors", [r for r in latest.values() if not noticed(r)]),
            ("Not noticed by verify", [r for r in latest.values()
                                       if noticed(r) and not r["verify"]]),
            ("Named wrongly", [r for r in latest.values()
                               if r["verify"] and not named_rightly(r)])):
        print(f"\n{title}: {len(chosen)}")
        for r in sorted(chosen, key=lambda r: r["place"]):
            print(f"{r['place']} {r['function']} ({r['kind']})\n  - {r['old']}\n  + {r['new']}")
            if r["verify"]:
                print(f"  {r['verify']['group']}: {', '.join(r['verify']['kernels'])}: "
                      f"{r['verify']['reason'][:160]}")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("list", "run", "report"):
        command = commands.add_parser(name)
        command.add_argument("--seed", default="1")
        command.add_argument("--file", nargs="*", default=[])
        command.add_argument("--out", default="build/mutants")
        command.add_argument("--known", nargs="*", default=[],
                             help="folders of other runs, whose results count as well")
        if name == "run":
            command.add_argument("--build", default="build/release")
            command.add_argument("--jobs", type=int, default=1)
            command.add_argument("--nice", type=int, default=19)
            command.add_argument("--at", nargs="*", default=[], metavar="kernels/FOLDER/FILE:LINE",
                                 help="the mutants of these lines alone, done before or not")
            command.add_argument("--first", type=int, default=0,
                                 help="run the first so many of each file alone (default: all)")
            command.add_argument("--quick", action="store_true",
                                 help="ask references and tests only where verify notices nothing")
    arguments = parser.parse_args()
    if arguments.command == "run":
        return run(arguments)
    if arguments.command == "report":
        return report(arguments)
    mutants = make_mutants(arguments.seed, arguments.file)
    for m in mutants:
        print(f"{m.place()} {m.function} ({m.kind})\n  - {m.old_line}\n  + {m.new_line}")
    print(f"{len(mutants)} mutants in {len({m.file for m in mutants})} files")


if __name__ == "__main__":
    main()
