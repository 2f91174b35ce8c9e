#!/usr/bin/env python3
"""Checks the documents of this repository.

    scripts/check_docs.py [PROGRAM]      PROGRAM: the program meniscus (build/release/meniscus)

- Every file of the repository that is named in `backticks` is there.
- Every link to a file or picture of the repository leads to one, and every link to a heading (page.md#heading)
  to a heading.
- Every command in a block of shell lines can be given: scripts exist, can be run and are
  mentioned by their right names; programs of ours know the command and every option named; input
  files of the repository are there. (The commands are parsed, not run.)
- Every kernel has a benchmark of its own, or docs/performance.md names it with the reason.
- Rooms of stages use those alone that docs/development.md says they build on.
- No sentence of README.md has more than 30 words.

Prints one line for each fault, with file and line, and ends with 1 where there is one.
"""
import functools
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MOST_WORDS = 30
# Programs of others that blocks may call. What follows them is theirs, up to a program of ours.
OTHERS = {"cmake", "ctest", "mpirun", "srun", "parallel", "mkdir", "git", "make", "./host", "oclgrind", "pip", "python3",
          "sudo", "apt-get", "dpkg", "docker", "spack", "man", "cd", "export", "pytest", "nano", "cp", "c++", "g++",
          "clang++", "pkg-config", "blender", "jupyter", "for", "do", "done", "python", "apt", "source", ".", "kernprof",
          "ulimit", "if", "fi", "echo", "tar", "cpack", "python3.11"}


def documents():
    files = [ROOT / name for name in ("README.md", "CHANGELOG.md", "SECURITY.md")]
    for folder in ("docs", "examples", "scripts", "tests", "benchmarks", "python"):
        files += sorted((ROOT / folder).rglob("*.md"))
    return [f for f in files if f.exists() and "build" not in f.relative_to(ROOT).parts]


def prose(text):
    """The text without its blocks, with the same lines."""
    return re.sub(r"```.*?```", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)


@functools.cache
def anchors(page):
    """What links to the page's headings may end with, as GitHub names them."""
    found = []
    for heading in re.findall(r"^#+ +(.*)", prose(page.read_text()), flags=re.M):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        name = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        again = sum(re.sub(r"-\d+$", "", known) == name for known in found)
        found.append(f"{name}-{again}" if again else name)
    return found


def links(document, text, fault):
    for number, line in enumerate(prose(text).split("\n"), 1):
        for target in re.findall(r"\]\(([^)\s]+)\)", line):
            if re.match(r"[a-z]+:", target):
                continue
            name, _, heading = target.partition("#")
            page = document.parent / name if name else document
            if not page.exists():
                fault(document, number, f"leads nowhere: {target}")
            elif heading and page.suffix == ".md" and heading not in anchors(page):
                fault(document, number, f"leads to no heading of {page.name}: {target}")


def named_files(document, text, fault):
    folders = "benchmarks|cmake|docs|examples|include|kernels|packaging|python|scripts|src|tests"
    for number, line in enumerate(prose(text).split("\n"), 1):
        for name in re.findall(rf"`((?:{folders})/[\w./-]+\.\w+)`", line):
            if not (ROOT / name).exists():
                fault(document, number, f"no such file: {name}")


def shell_lines(text):
    """(line number, command) of all sh blocks, with continued lines joined."""
    inside, joined, first = False, "", 0
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("```"):
            inside = line.strip() in ("```sh", "```bash", "```console")
            continue
        if not inside:
            continue
        if not joined:
            first = number
        joined += line.rstrip("\\") if line.endswith("\\") else line
        if not line.endswith("\\"):
            yield first, joined
            joined = ""


class Program:
    """What the program meniscus knows: its commands and their options, as its help names them."""

    def __init__(self, path):
        self.path, self.helps = path, {}

    def help(self, *command):
        if command not in self.helps:
            texts = []
            for flag in ("--help", "--help-all"):
                run = subprocess.run([self.path, *command, flag], capture_output=True, text=True)
                if run.returncode == 0:
                    texts.append(run.stdout)
            self.helps[command] = "\n".join(texts)
        return self.helps[command]

    def faults(self, words):
        command = []
        while words and re.fullmatch(r"[a-z]+", words[0]) and self.is_command(command, words[0]):
            command.append(words.pop(0))
        if not command and not (words and words[0].startswith("-")):
            return [f"meniscus has no command {words[0] if words else ''}"]
        known = self.help(*[c for c in command if c != "help"])
        found = []
        for word in words:
            name = word.split("=")[0]
            if name == "--" or not re.fullmatch(r"--?[a-zA-Z][-a-z]*", name):
                continue
            if not re.search(rf"(^|[\s,]){re.escape(name)}([\s,]|$)", known):
                found.append(f"meniscus {' '.join(command)} has no option {name}")
        return found

    def is_command(self, before, word):
        if not before and word == "help":
            return True
        if before == ["help"]:
            before = []
        return re.search(rf"^  {word}\s", self.help(*before), flags=re.M) is not None


def commands(document, text, program, fault):
    for number, line in shell_lines(text):
        line = re.sub(r"\s#\s.*$", "", re.sub(r"^#\s.*$", "", line)).strip()
        if not line or line.startswith("["):
            continue
        for part in re.split(r"&&|\|\||;|\|", line):
            try:
                words = [w for w in shlex.split(part) if w not in ("\\", "&", "")]
            except ValueError as error:
                fault(document, number, f"is no command: {error}: {part.strip()}")
                continue
            while words and re.match(r"[A-Z_]+=", words[0]):
                words.pop(0)
            if not words:
                continue
            ours = [k for k, w in enumerate(words) if w == "meniscus" or w.endswith("/meniscus")]
            for script in [w for w in words if re.match(r"(\./)?(scripts|benchmarks)/[\w./-]+\.(sh|py)$", w)]:
                if not os.access(ROOT / script, os.X_OK):
                    fault(document, number, f"no such script, or it cannot be run: {script}")
            if ours and program and not words[0].startswith("scripts/"):
                for what in program.faults(words[ours[0] + 1:]):
                    fault(document, number, what)
            elif not ours and words[0] not in OTHERS and not re.match(r"(\./)?[\w-]+/", words[0]) and \
                    not words[0].startswith(("meniscus-", "$", "<", ">", "%", "(")):
                fault(document, number, f"which program is that? {words[0]}")


def sentences(document, text, fault):
    text = prose(text)
    number = 1
    for paragraph in re.split(r"\n(?=\s*\n|\s*[-|#])", text):
        words = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", paragraph.strip().lstrip("-#").strip())
        for cell in (words.split("|") if words.startswith("|") else [words]):
            for sentence in re.split(r"(?<=[.:;!?])\s+", cell.replace("\n", " ")):
                count = len(sentence.split())
                if count > MOST_WORDS:
                    fault(document, number, f"{count} words in a sentence: {sentence[:60]}...")
        number += paragraph.count("\n") + 1


def kernels(fault):
    """Kernels that meniscus bench has no row for must be accounted for."""
    page = ROOT / "docs" / "performance.md"
    measured = "".join(f.read_text() for f in (ROOT / "benchmarks" / "kernels").rglob("*.cpp"))
    for file in sorted((ROOT / "kernels").rglob("*.cl")):
        if file.name in ("probe.cl", "arithmetic.cl"):  # part of no frame
            continue
        for name in re.findall(r"^kernel void (\w+)", file.read_text(), flags=re.M):
            if f'"{name}"' not in measured and f"`{name}`" not in page.read_text():
                fault(page, 1, f"{name} of {file.name} has neither a row in meniscus bench nor a reason here")


def rooms(fault):
    """A room of stages reads the headers, and its kernels use the files, of those rooms alone that the
    documents say it builds on, which come before it."""
    page = ROOT / "docs" / "development.md"
    rows = re.findall(r"^\| \[`(\w+)`\]\(#\w+\) \|.*\|([^|]*)\|$", page.read_text(), flags=re.M)
    allowed = {room: set(re.findall(r"`(\w+)`", below)) for room, below in rows}
    for number, (room, below) in enumerate(allowed.items()):
        for other in sorted(below - set(list(allowed)[:number])):
            fault(page, 1, f"the room {room} builds on {other}, which does not come before it")
    kernel_room = {file.name: file.parent.name for file in (ROOT / "kernels").rglob("*.cl")}
    for file in sorted([*(ROOT / "src" / "stages").rglob("*.?pp"), *(ROOT / "kernels").rglob("*.cl")]):
        text = file.read_text()
        own = "" if file.parent.name in ("stages", "kernels") else file.parent.name
        if own and own not in allowed:
            fault(page, 1, f"the room {own} of {file.relative_to(ROOT)} is missing")
        used = re.findall(r'^#include "stages/(\w+)/', text, flags=re.M)
        for line in re.findall(r"^// uses: (.*)$", text, flags=re.M):
            used += [kernel_room[name] for name in line.split()]
        for other in sorted(set(used) - {own} - allowed.get(own, set())):
            fault(page, 1, f"{file.relative_to(ROOT)} uses the room {other}, which it must not build on")


def main():
    program = Program(sys.argv[1]) if len(sys.argv) > 1 else None
    faults = []

    def fault(document, number, what):
        faults.append(f"{document.relative_to(ROOT)}:{number}: {what}")

    for document in documents():
        text = document.read_text()
        links(document, text, fault)
        named_files(document, text, fault)
        if document.name != "CHANGELOG.md":
            commands(document, text, program, fault)
    sentences(ROOT / "README.md", (ROOT / "README.md").read_text(), fault)
    kernels(fault)
    rooms(fault)
    print("\n".join(faults) or f"{len(documents())} documents: links and commands are good")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
