#!/usr/bin/env python3
"""Makes the man pages and the completions of bash, zsh and fish from what the program's --help says.

  scripts/manual.py PROGRAM FOLDER

Writes man/meniscus.1 and one page for each command, completions/meniscus (bash), _meniscus (zsh) and
meniscus.fish. Nothing about the options is written down here.
"""

import re
import subprocess
import sys
from pathlib import Path


def help_of(program, command):
    """All of the help: a program with --help-all shows on --help only what most people need."""
    for option in ("--help-all", "--help"):
        run = subprocess.run([program, *command, option], capture_output=True, text=True)
        if run.returncode == 0:
            return run.stdout
    raise SystemExit(f"manual: {program} {' '.join(command)} --help failed: {run.stderr}")


def parse(text):
    """What it is, how it is used, and its sections: (heading, [(name, text)])."""
    about, usage, sections = [], "", []
    for line in text.splitlines():
        entry = re.match(r"  (\S.*)", line)
        if line.startswith("Usage: "):
            usage = line[len("Usage: "):]
        elif not line.strip():
            continue
        elif not line.startswith(" "):
            if usage and line.endswith(":"):
                sections.append((line[:-1], []))
            elif usage and sections:
                sections[-1][1].append(("", line))  # a closing remark
            elif not usage:
                about.append(line)
            else:
                about.append(line)
        elif entry and sections:
            name, _, what = entry[1].partition("  ")
            sections[-1][1].append((name, what.strip()))
        elif sections and sections[-1][1]:
            name, what = sections[-1][1][-1]
            sections[-1][1][-1] = (name, f"{what} {line.strip()}".strip())
    return " ".join(about), usage, sections


class Page:
    def __init__(self, program, command):
        self.command = command
        self.about, self.usage, self.sections = parse(help_of(program, command))
        self.commands = [name for heading, entries in self.sections if heading == "Commands"
                         for name, _ in entries if name]  # without closing remarks
        self.what = {name: what for heading, entries in self.sections if heading == "Commands"
                     for name, what in entries}
        self.options = []  # (names, placeholder, text)
        for _, entries in self.sections:
            for name, what in entries:
                if name.startswith("-"):
                    names, _, placeholder = name.partition(" ")
                    self.options.append((names.split(","), placeholder, what))

    @property
    def name(self):
        return " ".join(["meniscus", *self.command])

    @property
    def summary(self):
        text = self.about.rstrip(".").removeprefix("Meniscus ")
        return text[:1].lower() + text[1:]

    @property
    def file(self):
        return "-".join(["meniscus", *self.command]) + ".1"


def words_of(placeholder, what):
    """The words an option takes, where its text lists them."""
    if placeholder != "WORD":
        return []
    described = re.findall(r"(?:^|; )([a-z0-9][a-z0-9-]*): ", what)
    if len(described) > 1:
        return described
    listed = re.sub(r"\([^)]*\)", "", what.split(": ")[-1])
    listed = re.split(r",? or |, ", re.split(r", which ", listed)[0])
    words = [word.strip() for word in listed]
    words = [re.sub(r"^what to do when .*: ", "", word) for word in words]
    return [word for word in words if re.fullmatch(r"[a-z0-9][a-z0-9-]*", word)]


def takes_files(placeholder):
    return "FILE" in placeholder or placeholder in ("DIR", "FOLDER") or "JSON" in placeholder


# man pages

def roff(text):
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return "\\&" + text if text[:1] in (".", "'") else text


def man_page(page, version, pages):
    lines = [f'.TH "{page.file[:-2].upper()}" 1 "" "Meniscus {version}" "User Commands"',
             ".SH NAME", f"{roff(page.file[:-2])} \\- {roff(page.summary)}",
             ".SH SYNOPSIS", f".B {roff(page.name)}",
             roff(page.usage.removeprefix(page.name).strip())]
    for heading, entries in page.sections:
        lines.append(f".SH {roff(heading.upper())}")
        for name, what in entries:
            if not name:
                lines += [".PP", roff(what)]
                continue
            names, _, placeholder = name.partition(" ")
            # A heading in the list where the name is an option, else the name as it is.
            term = ", ".join(f"\\fB{roff(one)}\\fR" for one in names.split(","))
            lines += [".TP", f"{term} \\fI{roff(placeholder)}\\fR" if placeholder else term, roff(what)]
    if not page.command:
        lines += [".SH EXIT STATUS", ".TP", ".B 0", "done", ".TP", ".B 1", "bad input or device",
                  ".TP", ".B 2", "bad usage", ".TP", ".B 3 and more",
                  "of a sequence, see \\fBmeniscus\\-extract\\fR(1) and docs/batches.md",
                  ".SH EXAMPLES", ".nf", roff("meniscus extract frame.ply -o surface.png -o surface.exr"),
                  roff("meniscus extract 'dam.####.ply' -o 'out.####.exr' --camera camera.json --resume"),
                  ".fi"]
    others = [f"\\fB{roff(other.file[:-2])}\\fR(1)" for other in pages if other is not page]
    lines += [".SH SEE ALSO", ",\n".join(others)]
    return "\n".join(lines) + "\n"


# completions

def bash(pages):
    cases, words = [], []
    for page in pages:
        key = " ".join(page.command)
        options = " ".join(name for names, _, _ in page.options for name in names)
        cases.append(f'    "{key}") words="{" ".join(page.commands)} {options}" ;;')
        for names, placeholder, what in page.options:
            options_words = words_of(placeholder, what)
            pattern = "|".join(f'"{key} {name}"' for name in names)
            if options_words:
                words.append(f'    {pattern}) COMPREPLY=($(compgen -W "{" ".join(options_words)}" '
                             '-- "$word")); return ;;')
            elif placeholder and not takes_files(placeholder):
                words.append(f"    {pattern}) return ;;")
            elif placeholder:
                words.append(f'    {pattern}) compopt -o filenames; '
                             'COMPREPLY=($(compgen -f -- "$word")); return ;;')
    commands = " ".join(f'"{" ".join(page.command)}"' for page in pages if page.command)
    return f"""# bash completion of meniscus. Made by scripts/manual.py from the program's help.
_meniscus() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command="" words="" k
  for ((k = 1; k < COMP_CWORD; ++k)); do
    local tried="${{command:+$command }}${{COMP_WORDS[k]}}" known
    for known in {commands}; do
      [[ $tried != "$known" ]] || command=$tried
    done
  done
  case "$command $before" in
{chr(10).join(words)}
  esac
  case "$command" in
{chr(10).join(cases)}
  esac
  if [[ $word == -* || -z $command ]]; then
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  else
    compopt -o filenames
    COMPREPLY=($(compgen -W "${{words%%-*}}" -- "$word") $(compgen -f -- "$word"))
  fi
}}
complete -F _meniscus meniscus
"""


def quoted(text):
    return text.replace("'", "'\\''")


def zsh(pages):
    def function(page):
        return "_".join(["_meniscus", *page.command])

    lines = ["#compdef meniscus", "# Made by scripts/manual.py from the program's help."]
    for page in pages:
        specs = []
        for names, placeholder, what in page.options:
            text = re.sub(r"([\[\]:])", r"\\\1", what)
            action = ""
            if placeholder:
                words = words_of(placeholder, what)
                label = placeholder.replace(":", "")
                action = f":{label}:" + (f"({' '.join(words)})" if words else
                                         "_files" if takes_files(placeholder) else "")
            for name in names:
                specs.append(f"'*{name}[{quoted(text)}]{action}'")
        lines.append(f"{function(page)}() {{")
        if page.commands:
            lines.append("  local -a commands=(")
            lines += [f"    '{name}:{quoted(page.what[name])}'" for name in page.commands]
            lines += ["  )", "  _arguments -C " + " \\\n    ".join(specs + [
                "'1: :->command'", "'*:: :->rest'"]),
                "  case $state in",
                "    command) _describe command commands" + ("; _files" if page.command else "") + " ;;",
                "    rest) case $words[1] in"]
            lines += [f"      {name}) {function(page)}_{name} ;;" for name in page.commands]
            lines += ["    esac ;;", "  esac"]
        else:
            lines.append("  _arguments " + " \\\n    ".join(specs + ["'*:file:_files'"]))
        lines.append("}")
    lines.append('_meniscus "$@"')
    return "\n".join(lines) + "\n"


def fish(pages):
    lines = ["# fish completion of meniscus. Made by scripts/manual.py from the program's help."]
    top = pages[0]
    for name in top.commands:
        lines.append(f"complete -c meniscus -n __fish_use_subcommand -f -a {name} "
                     f"-d '{quoted(top.what[name])}'")
    for page in pages:
        where = (f"-n '__fish_seen_subcommand_from {page.command[-1]}'" if page.command
                 else "-n __fish_use_subcommand")
        if page.command:
            for name in page.commands:
                lines.append(f"complete -c meniscus {where} -a {name} -d '{quoted(page.what[name])}'")
        for names, placeholder, what in page.options:
            flags = " ".join(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}"
                             for name in names)
            words = words_of(placeholder, what)
            argument = ""
            if placeholder:
                argument = " -r" if takes_files(placeholder) else " -x"
            if words:
                argument = f" -x -a '{' '.join(words)}'"
            lines.append(f"complete -c meniscus {where} {flags}{argument} -d '{quoted(what)}'")
    return "\n".join(lines) + "\n"


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    version = subprocess.run([program, "--version"], capture_output=True, text=True,
                             check=True).stdout.split()[-1]
    pages, waiting = [], [[]]
    while waiting:
        page = Page(program, waiting.pop(0))
        pages.append(page)
        waiting += [[*page.command, name] for name in page.commands]
    (folder / "man").mkdir(parents=True, exist_ok=True)
    (folder / "completions").mkdir(exist_ok=True)
    for page in pages:
        (folder / "man" / page.file).write_text(man_page(page, version, pages))
    (folder / "completions" / "meniscus").write_text(bash(pages))
    (folder / "completions" / "_meniscus").write_text(zsh(pages))
    (folder / "completions" / "meniscus.fish").write_text(fish(pages))


if __name__ == "__main__":
    main()
