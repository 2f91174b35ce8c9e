#!/usr/bin/env python3
"""Says which sources are compiled as one, which halves the processor time of a build.

  scripts/unity_groups.py            # writes cmake/unity_groups.txt anew
  scripts/unity_groups.py --check    # ends with 1 where two sources of a group share a name

Reading the headers is most of what a source costs, so some are read into one (CMake's UNITY_GROUP).
What a source has for itself, in namespaces without a name, as static functions and as macros, is
then seen by those behind it, and so are the headers that it reads. So a source shares no name of its
own with another of its group, nor with headers that only the other reads: it would be defined twice,
or, worse, another overload would be taken. Sources that stand in no group, new ones too, are
compiled alone. -DMENISCUS_UNITY=OFF compiles all of them alone.
"""

import argparse
import functools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIST = ROOT / "cmake" / "unity_groups.txt"
FOLDERS = ("src", "src/program", "src/verify", "benchmarks", "benchmarks/kernels", "tests")
INCLUDED = ("src", "include", "benchmarks", "tests")
REFERENCES = "src/verify/reference/"
ALONE = {"src/stages/sheet/delaunay.cpp"}  # CGAL takes seven seconds and a gigabyte
TARGETS_ALONE = {"meniscus_native_kernels", "meniscus_program", "every_call", "failing_call",
                 "limits", "faulty_kernel"}
MOST_FILES, MOST_LINES = 9, 2500  # of a group: several are compiled at once


def without_comments(text):
    text = re.sub(r'R"(\w*)\(.*?\)\1"', '""', text, flags=re.S)
    text = re.sub(r"'(?:\\.|[^'\\\n])'", "' '", text)
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', '""', text)
    return re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.S)


def name_of(declaration):
    """The names that a declaration at the top of a namespace adds to it."""
    text = re.sub(r"^template\s*<[^{]*?>\s*(?=\w)", "", declaration.strip())
    typed = re.match(r"(?:struct|class|enum(?:\s+class)?|union)\s+(?:alignas\([^)]*\)\s*)?(\w+)", text)
    if typed:
        return {typed[1]}
    alias = re.match(r"using\s+(\w+)\s*=", text) or re.match(r"namespace\s+(\w+)\s*=", text)
    if alias:
        return {alias[1]}
    if re.match(r"using\b|$", text):
        return set()
    test = re.match(r"(TEST(?:_P|_F)?|MATCHER(?:_P\d*)?)\s*\(\s*(\w+)\s*(?:,\s*(\w+))?", text)
    if test:
        return {test[2] + ("." + (test[3] or "") if test[1].startswith("TEST") else "")}
    if re.match(r"[A-Z0-9_]+\s*\(", text):
        return set()  # another macro's use
    head, depth = "", 0  # up to the parameters or the value, without template arguments
    for char in text:
        depth += {"<": 1, ">": -1 if depth else 0}.get(char, 0)
        if depth == 0 and char in "(=[;{":
            break
        if depth == 0:
            head += char
    names = set()
    for part in head.split(","):
        words = re.findall(r"\w+", part)
        if words:
            names.add(words[-1])
    if re.match(r"(?:static\s+|inline\s+)*const(?:expr)?\b", text):  # several in one line
        names.update(re.findall(r",\s*(\w+)\s*[={]", text))
    return names


def names_in(body):
    """The names at the top of a namespace's body."""
    names, current, at, parentheses = set(), "", 0, 0
    while at < len(body):
        char = body[at]
        if char == "#":
            at = re.compile(r"(?:[^\n]*\\\n)*[^\n]*").match(body, at).end()
            continue
        parentheses += {"(": 1, ")": -1}.get(char, 0)
        if char == "{":
            depth, at = 1, at + 1
            opened = at
            while depth and at < len(body):
                depth += {"{": 1, "}": -1}.get(body[at], 0)
                at += 1
            if parentheses == 0:
                names |= name_of(current + "{")
                if re.match(r"\s*enum\s+(?!class\b|struct\b)", current):
                    names.update(re.findall(r"(\w+)\s*(?:=[^,]*)?(?:,|$)", body[opened:at - 1].strip()))
                current = ""
                rest = re.compile(r"[^;{}()\n]*;").match(body, at)
                at = rest.end() if rest else at
            continue
        if char == ";" and parentheses == 0:
            names |= name_of(current + ";")
            current = ""
        else:
            current += char
        at += 1
    return names


def bodies(text, head):
    """What stands in the braces behind each match of a pattern that ends with one."""
    for match in re.finditer(head, text):
        depth, end = 1, match.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        yield text[match.end():end - 1]


@functools.lru_cache(None)
def own_names(file):
    """What a source has for itself."""
    text = without_comments((ROOT / file).read_text())
    names = {"#" + name for name in re.findall(r"^\s*#\s*define\s+(\w+)", text, re.M)}
    for body in bodies(text, r"\bnamespace\s*\{"):
        names |= names_in(body)
    return names | set(re.findall(r"^static [^(=;]*?(\w+)\s*[(=]", text, re.M))


@functools.lru_cache(None)
def names_of_header(file):
    text = without_comments((ROOT / file).read_text())
    return frozenset().union(*(names_in(body) for body in bodies(text, r"\bnamespace\s+[\w:]+\s*\{")))


@functools.lru_cache(None)
def headers_of(file):
    """The project's headers that a file reads, directly or not."""
    found, open_files = set(), [file]
    while open_files:
        here = open_files.pop()
        for name in re.findall(r'^#include ["<]([\w/.]+)[">]', (ROOT / here).read_text(), re.M):
            for folder in INCLUDED:
                header = f"{folder}/{name}"
                if header not in found and (ROOT / header).is_file():
                    found.add(header)
                    open_files.append(header)
    return frozenset(found)


def shared(one, other):
    """The names of their own that two sources must not have if they are compiled as one."""
    names = own_names(one) & own_names(other)
    for a, b in ((one, other), (other, one)):
        for header in headers_of(b) - headers_of(a):
            names = names | (own_names(a) & names_of_header(header))
    # The loops that stages are compared with define what they like, each header by itself.
    loops = [[header for header in headers_of(a) - headers_of(b) if header.startswith(REFERENCES)]
             for a, b in ((one, other), (other, one))]
    for header in loops[0]:
        for rival in loops[1]:
            names = names | (names_of_header(header) & names_of_header(rival))
    return names


def targets():
    """Of each target in CMake's files its sources, as paths from the root."""
    found = {}
    for folder in FOLDERS:
        text = re.sub(r"#[^\n]*", "", (ROOT / folder / "CMakeLists.txt").read_text())
        special = set(re.findall(r"[\w./]+\.cpp", " ".join(
            re.findall(r"set_source_files_properties\(([^)]*)\)", text))))
        for target, sources in re.findall(
                r"(?:add_library|add_executable|meniscus_test)\(\s*([\w]+)\s([^)]*)\)", text):
            files = [f"{folder}/{name}" for name in re.findall(r"[\w./]+\.cpp", sources)
                     if name not in special and ".." not in name]
            files = [file for file in files if file not in ALONE and (ROOT / file).exists()]
            if len(files) > 1 and target not in TARGETS_ALONE:
                found[target] = files
    several = [file for files in found.values() for file in files]
    return {target: [file for file in files if several.count(file) == 1]  # a file has one group
            for target, files in found.items()}


def folder(file):
    """Of small folders of the library, one for two."""
    name = re.sub(r"^(src|tests)/stages/.*", r"\1/stages", file.rsplit("/", 1)[0])
    return {"src/api": "src/prepare", "src/output": "src/prepare", "src/device": "src/base",
            "src/program/page": "src/program", "src/program/batch": "src/program",
            "benchmarks/accuracy/figures": "benchmarks/accuracy"}.get(name, name)


def groups_of(files):
    """Greedily, those that share most names with others first; of one folder, which read the same
    headers."""
    lines = {file: (ROOT / file).read_text().count("\n") for file in files}
    rivals = {file: sum(bool(shared(file, other)) for other in files) for file in files}
    groups = []
    for file in sorted(files, key=lambda file: (-rivals[file], file)):
        for group in groups:
            if (len(group) < MOST_FILES and folder(file) == folder(group[0])
                    and sum(lines[other] for other in group) + lines[file] <= MOST_LINES
                    and not any(shared(file, other) for other in group)):
                group.append(file)
                break
        else:
            groups.append([file])
    return sorted(sorted(group) for group in groups if len(group) > 1)


def check():
    """In words, what is wrong with the list."""
    wrong = []
    known = {target: set(files) for target, files in targets().items()}
    for line in LIST.read_text().splitlines():
        if line.startswith("#"):
            continue
        target, *files = line.split()
        for k, file in enumerate(files):
            if not (ROOT / file).exists() or file not in known.get(target, ()):
                wrong.append(f"{file} is no source of {target}")
                continue
            for other in files[:k]:
                if (ROOT / other).exists():
                    wrong += [f"{name} would have two meanings in {other} and {file}, which are "
                              "compiled as one" for name in sorted(shared(file, other))]
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        wrong = check()
        for text in wrong:
            print(f"unity_groups: {text} (scripts/unity_groups.py writes the groups anew)")
        return 1 if wrong else 0
    lines = ["# By scripts/unity_groups.py: a target, and sources that are compiled as one."]
    for target, files in sorted(targets().items()):
        lines += [" ".join([target, *group]) for group in groups_of(files)]
    LIST.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
