#!/usr/bin/env python3
"""Runs every command of the documents.

    scripts/run_docs.py [BUILD] [DOCUMENT ...]     BUILD: a whole build of preset release (build/release)
    scripts/run_docs.py --plan                     only whether documents_lines.py fits the documents: a second

Commands are the lines of README.md's and docs' blocks of shell lines, and what stands in `backticks` and
begins with a program of ours, cmake, ctest or the like. Each runs as it stands, in the repository's root,
with `meniscus` on the path and example frames under the names that documents use; it must end with exit
code 0, or with the one that stands in documents_lines.py. That file also holds, in one place and with
the reason, what runs with a smaller input, what other parts of .ci/run and .ci/nightly run, and what cannot run here. An
entry there that no document has any more is a fault.

C++ and CMake blocks are built against the installed library and run. Python blocks run in
scripts/python_test.sh, which knows the package.

Nothing that a command writes stays: each document runs in an overlay of the repository, in a mount name
space of its own (Linux; as root, or where users may have name spaces). Prints a line for each command,
and ends with 1 where one fails, with 3 where no such overlay can be made.
"""
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from check_docs import ROOT, shell_lines
from documents_lines import BLOCKS, ELSEWHERE, EXIT_CODES, LONG, NEVER, PREPARE, SECONDS, SMALLER, WHERE_THERE_IS

# In prose a name alone, such as `meniscus verify`, is no command.
PROGRAMS = r"meniscus(-accuracy)? .* ([-./'A-Z]|\d)|(scripts|examples|benchmarks)/[\w/]*\.(sh|py)|cmake |ctest |cpack |pip |" \
           r"python[.\d]* |mpirun |srun |make |\./host|oclgrind |apt-get |man |docker |spack "

# Lines that need the benchmarks' programs or splashsurf.
BENCHMARKS = r"meniscus-accuracy|reading_bench|benchmarks/(accuracy|peers)|scripts/(accuracy|gallery|real_frames)"


def commands(document):
    """(line, command), each once, in the order of the document."""
    text, found = document.read_text(), {}
    for number, line in shell_lines(text):
        line = re.sub(r"\s#\s.*$", "", re.sub(r"^#\s.*$", "", line)).strip()
        if line:
            found.setdefault(" ".join(line.split()), number)
    prose = re.sub(r"```.*?```", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)
    for match in re.finditer(r"`([^`]+)`", prose):
        command = " ".join(match[1].split())
        if re.match(PROGRAMS, command):
            found.setdefault(command, prose[:match.start()].count("\n") + 1)
    return sorted((number, command) for command, number in found.items())


def blocks(document, language):
    return re.findall(rf"^```{language}\n(.*?)^```", document.read_text(), flags=re.S | re.M)


# --- Inside the name space: one document -----------------------------------------------------------

def run(command, expected):
    begin, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process = subprocess.Popen(["bash", "-e", "-o", "pipefail", "-c", command], stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                               start_new_session=True)
    try:
        said, code = process.communicate(timeout=SECONDS)[0], process.returncode
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, code = process.communicate()[0] + f"\ntook more than {SECONDS} s", 124
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {"command": command, "good": code == expected, "code": code, "expected": expected, "said": said,
            "seconds": time.monotonic() - begin,
            "processor": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime}


def inside(job):
    """Mounts the overlay and runs the commands of the job; prints the results as JSON."""
    work = Path(job["work"])
    subprocess.run(["mount", "-t", "tmpfs", "tmpfs", work], check=True)
    (work / "upper").mkdir()
    (work / "work").mkdir()
    subprocess.run(["mount", "-t", "overlay", "overlay", "-o",
                    f"lowerdir={ROOT},upperdir={work}/upper,workdir={work}/work", ROOT], check=True)
    os.chdir(ROOT)
    results = []
    for command, expected in job["commands"]:
        results.append(run(command, expected))
        if not results[-1]["good"] and command in job["prepare"]:
            break
    print(json.dumps(results))


# --- Outside: all documents ------------------------------------------------------------------------

def plan(documents, faults):
    """Of each document what is run, with the exit code wanted; and what is run elsewhere or never."""
    jobs, elsewhere, never, used, long = [], [], [], set(), set()
    for document in documents:
        name, runs = str(document.relative_to(ROOT)), []
        for number, command in commands(document):
            used.add(command)
            if command in NEVER:
                never.append((name, number, command, NEVER[command]))
            elif command in WHERE_THERE_IS and shutil.which(WHERE_THERE_IS[command]) is None:
                never.append((name, number, command, f"{WHERE_THERE_IS[command]} is not installed"))
            elif command in ELSEWHERE:
                script, text = ELSEWHERE[command]
                if not script.startswith(".ci/") and not any(script in (ROOT / ci).read_text() for ci in CI):
                    faults.append(f"{name}:{number}: {command}: neither of {', '.join(CI)} runs {script}")
                if text not in (ROOT / script).read_text():
                    faults.append(f"{name}:{number}: {command}: {script} has no {text}")
                elsewhere.append((name, number, command, script))
            else:
                instead, seconds = SMALLER.get(command, (command, 0))[:2]
                if seconds >= LONG and instead in long:
                    continue  # ran in an earlier document
                long.add(instead)
                runs.append((number, command, instead, EXIT_CODES.get(command, 0)))
        for language, prepare in BLOCKS.get(name, ()):
            if not blocks(document, language):
                faults.append(f"{name}: has no block of {language}, which documents_lines.py wants to run")
            runs.append((1, f"the {language} block", prepare, 0))
        if runs:
            jobs.append((name, runs))
    known = set(SMALLER) | set(ELSEWHERE) | set(EXIT_CODES) | set(NEVER) | set(WHERE_THERE_IS)
    if documents == all_documents():
        faults += [f"scripts/documents_lines.py: no document has the line any more: {line}" for line in sorted(known - used)]
    return jobs, elsewhere, never


CI = [".ci/run", ".ci/nightly"]


def all_documents():
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def tools(build, lines):
    """An environment for what documents ask of pip and of Python; and where one of the lines is a
    benchmark, the benchmarks' programs and splashsurf, which several documents run, made once."""
    made = []
    if any(re.search(BENCHMARKS, line) for line in lines):
        made = [[ROOT / "benchmarks" / "peers" / "splashsurf.sh"],
                ["cmake", "-S", ROOT, "-B", build, "-DMENISCUS_BUILD_BENCHMARKS=ON"],
                ["cmake", "--build", build, "--target", "meniscus_accuracy_program", "meniscus_reading_bench"]]
    for command in made:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if done.returncode:
            sys.exit("run_docs: what the benchmarks need cannot be made:\n" + done.stdout[-3000:])
    home = build / "docs"
    if not (home / "ready").exists():
        subprocess.run([sys.executable, "-m", "venv", home], check=True)
        subprocess.run([home / "bin" / "pip", "-q", "--disable-pip-version-check", "install", "numpy", "pillow"],
                       check=True)
        (home / "ready").touch()
    return home


def main():
    if sys.argv[1:2] == ["--block"]:
        return print(blocks(ROOT / sys.argv[2], sys.argv[3])[0], end="")
    if sys.argv[1:2] == ["--inside"]:
        return inside(json.load(sys.stdin))
    if sys.argv[1:2] == ["--plan"]:
        faults = []
        plan(all_documents(), faults)
        print("\n".join(faults), end="\n" if faults else "")
        return 1 if faults else 0
    build = Path(sys.argv[1] if len(sys.argv) > 1 else "build/release").resolve()
    documents = [Path(d).resolve() for d in sys.argv[2:]] or all_documents()
    faults, begin = [], time.monotonic()
    jobs, elsewhere, never = plan(documents, faults)

    # With processes of its own, too, so that none outlives its document.
    name_space = ["unshare", *([] if os.geteuid() == 0 else ["--map-root-user"]), "--mount", "--pid", "--fork",
                  "--mount-proc", "--kill-child"]
    work = Path(tempfile.mkdtemp())
    trial = [*name_space, sys.executable, __file__, "--inside"]
    if shutil.which("unshare") is None or subprocess.run(
            trial, input=json.dumps({"work": str(work), "commands": [], "prepare": []}), text=True,
            capture_output=True).returncode:
        print("run_docs: no command was run: no overlay can be mounted in a name space here; run it as root, or "
              "where users may have name spaces", file=sys.stderr)
        return 3
    home = tools(build, [instead for _, runs in jobs for _, _, instead, _ in runs])
    environment = dict(os.environ, PATH=f"{build}:{home}/bin:{os.environ['PATH']}", BUILD=str(build),
                       MENISCUS_CACHE_DIR=f"{ROOT}/build/docs-cache",  # tune writes there
                       OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_rmaps_base_oversubscribe="1")

    def document(job):
        name, runs = job
        place = work / name.replace("/", "_")
        place.mkdir(parents=True, exist_ok=True)
        prepare = PREPARE["all"] + PREPARE.get(name, [])
        order = [(command, 0) for command in prepare] + [(instead, code) for _, _, instead, code in runs]
        done = subprocess.run([*name_space, sys.executable, __file__, "--inside"], text=True, env=environment,
                              input=json.dumps({"work": str(place), "commands": order, "prepare": prepare}),
                              stdout=subprocess.PIPE)
        lines, bad = [], []
        results = json.loads(done.stdout) if done.returncode == 0 else []
        for number, result in enumerate(results):
            at = number - len(prepare)
            line, command = (runs[at][0], runs[at][1]) if at >= 0 else (0, result["command"])
            shown = f"{name}:{line}: {command}" + (f"\n    as: {result['command']}" if at >= 0 and runs[at][2] != command else "")
            if at >= 0:
                lines.append(f"{'ok' if result['good'] else 'FAILED':6s} {result['seconds']:5.1f} s, "
                             f"processor {result['processor']:5.1f} s  {shown}")
            if not result["good"]:
                bad.append(f"{shown}\n    exit code {result['code']}, wanted {result['expected']}; it said:\n"
                           + "\n".join("      " + text for text in result["said"].splitlines()[-25:]))
        if len(results) < len(order):
            bad.append(f"{name}: {len(order) - len(results)} commands did not run")
        print("\n".join(lines), flush=True)
        return len(lines), bad

    # The long ones first.
    jobs.sort(key=lambda job: -sum(SMALLER.get(command, (0, 0))[1] for _, command, _, _ in job[1]))
    with ThreadPoolExecutor(max_workers=2) as pool:
        outcomes = list(pool.map(document, jobs))
    shutil.rmtree(work, ignore_errors=True)
    faults += [fault for _, bad in outcomes for fault in bad]
    print("run by other parts of .ci/run and .ci/nightly:")
    for name, number, command, script in elsewhere:
        print(f"       {name}:{number}: {command}  ({script})")
    print("not run here:")
    for name, number, command, reason in never:
        print(f"       {name}:{number}: {command}  ({reason})")
    print("\n".join(faults))
    print(f"{sum(count for count, _ in outcomes)} commands of {len(jobs)} documents ran, {len(elsewhere)} are run by other parts, "
          f"{len(never)} cannot run here; {len(faults)} faults, {time.monotonic() - begin:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
