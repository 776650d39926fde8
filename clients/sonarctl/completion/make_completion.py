#!/usr/bin/env python3
"""Writes the shell completions of sonard and sonarctl from the output of their --help.

usage: make_completion.py BUILD_DIR [--check]      --check: writes nothing, exits 1 if a file is out of date

Run it after you add a command or an option. A test runs it with --check.
"""
import difflib
import pathlib
import re
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
OPTION = re.compile(r"^  (?:(-\w),)?(--[\w-]+)(?:,--[\w-]+)*((?:[ :=(]\S.*|\s{2,}.*)?)$")
CHOICES = re.compile(r"\{([^}]+)\}|TEXT:([\w.-]+(?:\|[\w.-]+)*)|INT:([\w.-]+(?:\|[\w.-]+)+)")  # as CLI11 prints them, and as our commands do
COMMAND = re.compile(r"^  ([a-z][\w-]*)\s{2,}\S")
FILE_WORDS = {"--png", "--record", "--token-file", "--out", "--poses", "--json-file", "--pcap", "--mcap", "--raw", "--from", "--credentials"}
FILES = ["a file"]  # stands for choices if the value is a file of a make's own kind
SCENE_COMMANDS = {"load", "run", "check", "render", "dataset", "replay", "info", "import", "submit", "collect"}  # their argument is a file


def help_of(program, words):
    return subprocess.run([program, *words, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout


def read_help(text):
    """Returns the sub-commands, and the options with the choices for their values. An empty list allows any value; an option with
    None has no value."""
    commands, options, section = [], {}, ""
    for line in text.splitlines():
        if re.match(r"^\S.*:$", line):
            section = line
            continue
        if section == "Subcommands:":
            match = COMMAND.match(line)
            if match:
                commands.append(match[1])
            continue
        match = OPTION.match(line.rstrip())
        if not match or not section or section.startswith("examples"):
            continue
        rest = match[3]
        takes_value = bool(re.match(r"[ =]?(TEXT|INT|UINT|FLOAT|PATH|FILE|ENUM|NUMBER|\{)", rest.strip())) and not rest.startswith("  ")
        choices = CHOICES.search(rest.split("  ")[0]) if takes_value else None
        words = [w.split("->")[0] for w in re.split(r"[,|]", choices[1] or choices[2] or choices[3])] if choices else []
        options[match[2]] = FILES if "the makers' own kind of file" in rest else words if takes_value else None
    return commands, options


def walk(program, words=()):
    """Returns {("pose", "circle"): (commands, options)} for a command and all its sub-commands."""
    commands, options = read_help(help_of(program, words))
    tree = {words: (commands, options)}
    for command in commands:
        tree.update(walk(program, (*words, command)))
    return tree


def sonard_tree(program):
    """Like walk(). sonard lists its commands in a sentence and not in a section of --help."""
    tree = walk(program)
    if len(tree) == 1:
        commands = ["run", "check", "render", "dataset", "worker", "farm", "replay"]
        tree[()] = (commands, tree[()][1])
        for command in commands:
            tree.update(walk(program, (command,)))
    return tree


def values(tree, of_words, files, anything):
    """Returns the branches of a shell `case` that complete the value of an option. Options with the same completion share one
    branch."""
    actions = {}
    for words, (_, options) in tree.items():
        path = " ".join(("", *words))
        for option, choices in options.items():
            if choices is None:
                continue
            is_file = choices is FILES or not choices and option in FILE_WORDS
            action = files if is_file else of_words(" ".join(choices)) if choices else anything
            actions.setdefault(action, []).append(f'"{path}:{option}"')
    return [f"    {' | '.join(labels)}) {action} ;;" for action, labels in actions.items()]


def words_of(name, tree):
    """Yields the path of each command, the words that may follow it, and whether a file name may follow it."""
    for words, (commands, options) in tree.items():
        takes_files = name == "sonard" if not words else words[-1] in SCENE_COMMANDS
        yield " ".join(("", *words)), " ".join([*commands, *options]), takes_files


def paths_below(tree):
    return " | ".join(f'"{" ".join(("", *words))}"' for words in tree if words)


def bash(name, tree):
    lines = [f"# bash completion of {name}. Made by clients/sonarctl/completion/make_completion.py: do not edit.", f"_{name}() {{",
             '  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} path="" word',
             '  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do', '    case "$path $word" in',
             f'      {paths_below(tree)}) path="$path $word" ;;', "    esac", "  done", '  case "$path:$previous" in']
    lines += values(tree, lambda words: f'COMPREPLY=($(compgen -W "{words}" -- "$current")); return',
                    'COMPREPLY=($(compgen -f -- "$current")); return', "COMPREPLY=(); return")
    lines += ["  esac", '  case "$path" in']
    for path, words, takes_files in words_of(name, tree):
        files = '; [[ $current == -* ]] || COMPREPLY+=($(compgen -f -- "$current"))' if takes_files else ""
        lines.append(f'    "{path}") COMPREPLY=($(compgen -W "{words}" -- "$current")){files} ;;')
    return "\n".join([*lines, "  esac", "}", f"complete -o filenames -F _{name} {name}", ""])


def zsh(name, tree):
    """The completion of bash(), with the functions of zsh."""
    lines = [f"#compdef {name}", f"# zsh completion of {name}. Made by clients/sonarctl/completion/make_completion.py: do not edit.",
             f"_{name}() {{", '  local current=${words[CURRENT]} previous=${words[CURRENT-1]} at="" word',
             '  for word in ${words[2,CURRENT-1]}; do', '    case "$at $word" in', f'      {paths_below(tree)}) at="$at $word" ;;',
             "    esac", "  done", '  case "$at:$previous" in']
    lines += values(tree, lambda words: f"compadd -- {words}; return", "_files; return", "return")
    lines += ["  esac", '  case "$at" in']
    for path, words, takes_files in words_of(name, tree):
        lines.append(f'    "{path}") compadd -- {words}{"; [[ $current == -* ]] || _files" if takes_files else ""} ;;')
    return "\n".join([*lines, "  esac", "}", f'_{name} "$@"', ""])


def main():
    build = pathlib.Path(sys.argv[1])
    check = "--check" in sys.argv[2:]
    wrong = 0
    for name, program, read in [("sonarctl", build / "clients/sonarctl", walk), ("sonard", build / "daemon/sonard", sonard_tree)]:
        tree = read(str(program))
        for file, text in [(HERE / name, bash(name, tree)), (HERE / f"_{name}", zsh(name, tree))]:
            if not check:
                file.write_text(text, encoding="utf-8")
                continue
            there = file.read_text(encoding="utf-8") if file.exists() else ""
            if there != text:
                wrong = 1
                print(f"{file.name} is not what --help says; run clients/sonarctl/completion/make_completion.py BUILD_DIR:")
                print("\n".join(difflib.unified_diff(there.splitlines(), text.splitlines(), "there", "should be", lineterm="", n=0)))
    return wrong


if __name__ == "__main__":
    sys.exit(main())
