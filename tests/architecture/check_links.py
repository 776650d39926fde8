#!/usr/bin/env python3
"""Follows the links of all Markdown pages of a tree: files, pictures and headings; and, in a checkout, the files that pages name in
backticks (`daemon/commands/main.cpp`). Finds tables that an empty line cuts: GitHub shows the rows below it as text.

usage: check_links.py ROOT              a checkout: its tracked files
       check_links.py --installed ROOT  an installation below ROOT: its pages may link only to files there

Prints one line per dead link or cut table, exits 1 if there is any. Links to the web are not followed.
"""
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from check_floors import line_of, tracked_files  # noqa: E402

FENCED = re.compile(r"^(?P<fence>```+|~~~+).*?^(?P=fence)[ \t]*$", re.M | re.S)
INDENTED = re.compile(r"(?:(?<=\n\n)|\A)(?:(?: {4}|\t).*\n?)+")
CODE = re.compile(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", re.S)
LINK = re.compile(r"\]\(\s*<?(?P<inline>[^\s)>]+)>?(?:\s+\"[^\"]*\")?\s*\)|^ {0,3}\[[^\]^]+\]:\s+<?(?P<reference>[^\s>]+)"
                  r"|<img\b[^>]*?\bsrc=\"(?P<picture>[^\"]+)\"", re.M)
WEB = re.compile(r"[a-z][a-z0-9+.-]*:", re.I)
# A path that a page names in backticks, alone or at the beginning of a command; `*` and `{a,b}` stand for several files.
NAMED = re.compile(r"(?:\./)?(?P<path>[\w.+-]+/[\w./+*{},-]*?)/?(?::\d+(?:-\d+)?)?(?:\s.*)?", re.S)

TABLE = re.compile(r"(?:^\|.*\n?)+", re.M)
RULE = re.compile(r"\|(?: *:?-+:? *\|)+ *")  # below the head of a table


def blank(match):
    return re.sub(r"[^\n]", " ", match.group())


def prose_of(text):
    """Returns the text without code blocks; line numbers stay."""
    return INDENTED.sub(blank, FENCED.sub(blank, text))


def anchors_of(text):
    """Returns the anchors of a page: those that GitHub derives from its headings, and those that the page defines."""
    names, seen = set(re.findall(r'<a\s+(?:id|name)="([^"]+)"', text)), {}
    for heading in re.findall(r"^ {0,3}#{1,6}[ \t]+(.+?)[ \t]*#*[ \t]*$", FENCED.sub(blank, text), re.M):
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", plain.replace("`", "").lower()).replace(" ", "-")
        seen[name] = seen.get(name, -1) + 1
        names.add(f"{name}-{seen[name]}" if seen[name] else name)
    return names


def alternatives(path):
    """Expands `a.{hpp,cpp}` to two files."""
    match = re.search(r"\{([^{}]*)\}", path)
    if match is None:
        return [path]
    return [p for part in match[1].split(",") for p in alternatives(path[:match.start()] + part + path[match.end():])]


class Tree:
    def __init__(self, root, installed):
        self.root, self.installed = root.resolve(), installed
        if installed:
            names = sorted(p.relative_to(self.root).as_posix() for p in self.root.rglob("*.md"))
        else:
            names = tracked_files(self.root)
            self.there = set(names) | {p.as_posix() for n in names for p in pathlib.PurePath(n).parents}
        self.pages = [n for n in names if n.endswith(".md")]
        self.folders = {n.split("/")[0] for n in names if "/" in n}
        self.anchors = {}

    def text(self, name):
        return (self.root / name).read_text(encoding="utf-8")

    def place(self, path):
        """Returns the target's name below the root; None if it does not exist, is outside the root or is not tracked."""
        whole = path.resolve()
        if not whole.exists() or not whole.is_relative_to(self.root):
            return None
        name = whole.relative_to(self.root).as_posix()
        return name if self.installed or name in self.there else None

    def has_anchor(self, page, anchor):
        if page not in self.anchors:
            self.anchors[page] = anchors_of(self.text(page))
        return anchor in self.anchors[page]

    def why_dead(self, page, target):
        """Returns the fault of a link on a page; None if its target exists."""
        path, _, anchor = target.partition("#")
        place = self.place((self.root / page).parent / path) if path else page
        if place is None:
            return "does not exist"
        if anchor and place.endswith(".md") and not self.has_anchor(place, anchor):
            return f"{place} has no heading of that name"
        return None

    def names_a_file(self, page, path):
        """Checks a path from the root or from the page's own folder; a module may be named without the endings of its files."""
        return any(self.place(p) for base in (self.root, (self.root / page).parent) for end in ("", ".*") for p in base.glob(path + end))

    def dead_links(self, page):
        text = prose_of(self.text(page))
        for match in LINK.finditer(CODE.sub(blank, text)):
            target = match["inline"] or match["reference"] or match["picture"]
            why = None if WEB.match(target) else self.why_dead(page, target)
            if why:
                yield f"{page}:{line_of(text, match.start())}: link: {target}: {why}"
        for match in () if self.installed else CODE.finditer(text):
            named = NAMED.fullmatch(match[2])
            if named is None or named["path"].split("/")[0] not in self.folders:
                continue
            for path in alternatives(named["path"]):
                if not self.names_a_file(page, path):
                    yield f"{page}:{line_of(text, match.start())}: file: {path}: does not exist"

    def cut_tables(self, page):
        text = prose_of(self.text(page))
        for match in TABLE.finditer(text):
            if RULE.fullmatch((match.group().splitlines() + [""])[1]) is None:
                yield f"{page}:{line_of(text, match.start())}: table: has no head: an empty line cuts it from the rows above?"


def dead_links(root, installed=False):
    tree = Tree(pathlib.Path(root), installed)
    return [dead for page in tree.pages for found in (tree.dead_links(page), tree.cut_tables(page)) for dead in found]


def main():
    installed = sys.argv[1:2] == ["--installed"]
    arguments = sys.argv[2:] if installed else sys.argv[1:]
    if len(arguments) != 1:
        sys.exit(__doc__)
    found = dead_links(arguments[0], installed)
    print("\n".join(found) if found else "all links lead somewhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
