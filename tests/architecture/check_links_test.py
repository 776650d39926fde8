#!/usr/bin/env python3
"""Plants dead links in made-up trees and expects check_links to report exactly those."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import check_links  # noqa: E402

DOT = "."  # keep this file free of pages that do not exist
PAGE, OTHER = "docs/a" + DOT + "md", "docs/deep/b" + DOT + "md"
FILES = {
    OTHER: "# Big title\n\n## Twice\n\n## Twice\n\n## `code`, and [a link](https://example.org): 1.2 `--x`\n\n<a name=\"own\"></a>\n",
    "docs/picture.png": "", "core/base/units.hpp": "", "core/base/units.cpp": "", "daemon/commands/main.cpp": "", "LICENSE": "",
}


def found_in(files, installed=False, links=()):
    """Returns the dead links of a tree with these files, {name: text}. `links`: symbolic links, (name, target)."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder) / "tree"
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        for name, to in links:
            (root / name).symlink_to(to)
        return check_links.dead_links(root, installed)


class Planted(unittest.TestCase):
    def expect(self, line, words, installed=False):
        found = found_in({**FILES, PAGE: "# Here\n\ntext\n" + line + "\n"}, installed)
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(f"{PAGE}:4: "), found)
        self.assertIn(words, found[0])

    def test_dead_links_to_files_pictures_and_folders_are_found(self):
        for target in ("nowhere.txt", "../docs/nowhere/", "deep/../nowhere.txt", "../../outside.txt", "/docs/picture.png"):
            for line in (f"see [it]({target})", f"![a picture]({target})", f"[![both]({target})](picture.png)", f"[it]: {target}",
                         f'[it]({target} "title")', f"[it](<{target}>)", f'<img alt="x" src="{target}" height="9">',
                         f"| [in a table]({target}) |\n|---|", f"- [in a list]({target})"):
                for installed in (False, True):
                    with self.subTest(line=line, installed=installed):
                        self.expect(line, f"link: {target}: does not exist", installed)

    def test_links_out_of_the_tree_are_dead(self):
        self.expect("[it](../../../)", "does not exist")

    def test_dead_links_to_headings_are_found(self):
        name = OTHER.split("/", 1)[1]
        for target in ("#nowhere", f"{name}#nowhere", f"{name}#twice-2", f"{name}#Big-title", "#big-title"):
            with self.subTest(target=target):
                self.expect(f"[it]({target})", "has no heading of that name")

    def test_tables_with_an_empty_line_are_found(self):
        head = "| a | b |\n|---|:-:|\n| 1 | 2 |\n"
        self.expect("| 3 | 4 |", "table: has no head")
        found = found_in({PAGE: head + "\n| 3 | 4 |\n| 5 | 6 |\n", OTHER: head + "\n" + head + "```\n| 3 | 4 |\n```\n"})
        self.assertEqual([f.partition(": ")[0] for f in found], [f"{PAGE}:5"])

    def test_missing_files_in_backticks_are_found(self):
        for named in ("core/base/nowhere.hpp", "core/nowhere/", "core/base/nowhere", "daemon/main.hpp:12", "core/base/u*.h",
                      "core/base/units.{hpp,h}", "./daemon/run.sh --fast"):
            with self.subTest(named=named):
                self.expect(f"read `{named}` first", "file: ")

    def test_links_to_ignored_files_are_dead(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / PAGE).parent.mkdir()
            (root / PAGE).write_text("[it](made.txt) [it](kept.txt)\n", encoding="utf-8")
            for name in ("made.txt", "kept.txt"):
                (root / "docs" / name).write_text("", encoding="utf-8")
            (root / ".gitignore").write_text("made.txt\n", encoding="utf-8")
            if subprocess.run(["git", "-C", folder, "init", "-q"], check=False, capture_output=True).returncode != 0:
                self.skipTest("git is not installed")
            self.assertEqual(check_links.dead_links(root), [f"{PAGE}:1: link: made.txt: does not exist"])

    def test_dead_symbolic_links_are_found(self):
        for to in ("nowhere", "/etc"):
            found = found_in({"doc/a" + DOT + "md": "[it](scenes/)\n"}, True, [("doc/scenes", to)])
            self.assertEqual(len(found), 1, to)


class Innocent(unittest.TestCase):
    def test_good_links_are_not_reported(self):
        name = OTHER.split("/", 1)[1]
        for line in ("[it](picture.png) ![it](./picture.png) [it](../LICENSE) [it](deep/) [it](../daemon)", "[it](#here)",
                     f"[it]({name}#big-title) [it]({name}#twice) [it]({name}#twice-1) [it]({name}#own)",
                     f"[it]({name}#code-and-a-link-12---x)", "[it](https://example.org/nowhere) [it](mailto:a@example.org)",
                     "```\n[it](nowhere.txt) `core/nowhere.cpp`\n```", "    [it](nowhere.txt)", "`[it](nowhere.txt)`, ``a ` [it](nowhere)``",
                     "`core/base/units.hpp`, `core/base/units.{hpp,cpp}`, `core/base/units`, `core/base/*`, `core/base/`, `daemon/commands/main.cpp:12`",
                     "`build/release/x.cpp`, `and/or`, `m/s`, `core/<vendor>/x.cpp`, `/etc/core/x`, `deep/b" + DOT + "md`"):
            with self.subTest(line=line):
                self.assertEqual(found_in({**FILES, PAGE: "# Here\n\n" + line + "\n"}), [])

    def test_an_installation_names_sources_that_it_does_not_hold(self):
        self.assertEqual(found_in({PAGE: "`docs/nowhere.cpp`\n"}, True), [])

    def test_a_symbolic_link_within_the_tree_is_not_reported(self):
        files = {"share/scenes/a.yaml": "", "doc/a" + DOT + "md": "[it](scenes/a.yaml)\n"}
        self.assertEqual(found_in(files, True, [("doc/scenes", "../share/scenes")]), [])


if __name__ == "__main__":
    unittest.main()
