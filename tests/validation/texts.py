"""Handles texts of the validation pages and of their render files: tables, chapters with their marks, steps of a sweep."""

import re


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def tables_of(text):
    """Returns (header, rows) of every table in a text, with cells stripped of blanks."""
    found = []
    for block in re.findall(r"(?:^\|.*\|$\n?)+", text, re.M):
        lines = [[cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in block.splitlines()]
        found.append((lines[0], lines[2:]))
    return found


def mark(name):
    return f"<!-- chapter: {name} -->"


def chapters_of(text):
    """Returns name -> text between its mark and the next one, from an existing page."""
    parts = re.split(r"^<!-- chapter: ([\w-]+) -->\n", text, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2]))


def with_seeds(text, count):
    """Returns a render file's text with a longer sweep: every step `count` times, each time with another seed."""
    lines = text.splitlines()
    out, inside, steps = [], False, 1
    for line in lines:
        if line.startswith("sweep:"):
            inside = True
        elif inside and line.startswith("  ") and ":" in line:
            key, values = line.split("#")[0].split(":", 1)
            items = [v.strip() for v in values.strip().strip("[]").split(",")]
            steps = len(items)
            line = f"{key}: [{', '.join(v for v in items for _ in range(count))}]"
        elif inside and line.strip():
            inside = False
            out.append(f"  seed: [{', '.join(str(s + 1) for _ in range(steps) for s in range(count))}]")
            out.append("seed: $seed")
        out.append(line)
    return "\n".join(out) + "\n"


def with_step(text, step):
    """Returns a render file's text with one step of its sweep."""
    lines, inside = [], False
    for line in text.splitlines():
        if line.startswith("sweep:"):
            inside = True
        elif inside and line.startswith("  ") and ":" in line:
            key, values = line.split("#")[0].split(":", 1)
            line = f"{key}: [{values.strip().strip('[]').split(',')[step].strip()}]"
        elif inside and line.strip():
            inside = False
        lines.append(line)
    return "\n".join(lines) + "\n"
