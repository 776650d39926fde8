"""Checks the container file with our own rules, and with hadolint if it is installed. Does not build the image."""
import fnmatch
import json
import pathlib
import re
import shutil
import unittest

from running_sonard import BUILD, ROOT, run

FILE = ROOT / "Containerfile"
TEXT = FILE.read_text(encoding="utf-8")


def instructions():
    """Returns (word, rest) of each instruction, with continued lines joined and without comments."""
    lines = [line for line in TEXT.splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n\s*", " ", "\n".join(lines))
    lines = [" ".join(line.split()) for line in joined.splitlines() if line.strip()]
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in lines)]


def stages():
    found = []
    for word, rest in instructions():
        if word == "FROM":
            found.append([])
        found[-1].append((word, rest))
    return found


def setup_packages():
    text = (ROOT / "tests/tools/setup.sh").read_text(encoding="utf-8")
    listed = re.search(r"^product_packages=\(\n(.*?)^\)", text, re.M | re.S).group(1)
    return set((listed + " " + re.search(r"^page_packages=\((.*?)\)", text, re.M).group(1)).split())


def ignored(path):
    """Returns whether docker ignores a file of the tree. The last line that matches it, or a folder above it, decides."""
    path, decided = pathlib.PurePosixPath(path), False
    for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines():
        anywhere, pattern = "**/" in line, line.lstrip("!").removeprefix("**/")
        if pattern and pattern[0] != "#":
            tried = path.parts if anywhere else [str(folder) for folder in (path, *path.parents)]
            if any(fnmatch.fnmatch(name, pattern) for name in tried):
                decided = line[0] != "!"
    return decided


class Container(unittest.TestCase):
    def test_only_known_instructions_and_no_shell_form_where_signals_must_arrive(self):
        known = {"FROM", "RUN", "COPY", "USER", "WORKDIR", "STOPSIGNAL", "HEALTHCHECK", "ENTRYPOINT", "CMD"}
        self.assertEqual([word for word, _ in instructions() if word not in known], [])
        for word, rest in instructions():
            if word in ("ENTRYPOINT", "CMD"):
                self.assertIsInstance(json.loads(rest), list)
            if word == "HEALTHCHECK":
                self.assertIn("/healthz", "".join(json.loads(rest.partition(" CMD ")[2])))

    def test_two_stages_on_the_release_we_build_on_and_the_last_does_not_run_as_root(self):
        froms = [rest for word, rest in instructions() if word == "FROM"]
        self.assertEqual(len(froms), 2)
        for base in froms:
            self.assertRegex(base, r"^docker\.io/library/debian:bookworm-slim\b")
        last = stages()[-1]
        words = [word for word, _ in last]
        self.assertEqual([rest for word, rest in last if word == "USER"], ["sonard"])
        self.assertNotIn("RUN", words[words.index("USER"):], "nothing is changed after root is left")
        self.assertTrue(any(word == "COPY" and rest.startswith("--from=build ") for word, rest in last))
        self.assertFalse(any(word == "COPY" and not rest.startswith("--from=build ") for word, rest in last))

    def test_packages_are_installed_without_extras_and_their_lists_removed(self):
        for word, rest in instructions():
            if word == "RUN" and "apt-get install" in rest:
                self.assertRegex(rest, r"apt-get update && apt-get install -y --no-install-recommends")
                self.assertIn("/var/lib/apt/lists/*", rest)
        self.assertNotRegex(TEXT, r"\bADD\b|\bsudo\b|curl|wget|:latest")

    def test_the_build_stage_installs_what_setup_does(self):
        first = next(rest for word, rest in stages()[0] if word == "RUN")
        installed = set(re.search(r"--no-install-recommends (.*?) &&", first).group(1).split())
        self.assertEqual(installed - {"dpkg-dev", "file"}, setup_packages())
        self.assertLessEqual({"dpkg-dev", "file"}, installed, "for the dependencies of the package")

    def test_what_the_build_and_the_package_need_is_not_ignored(self):
        installed = set()
        for script in BUILD.rglob("cmake_install.cmake"):
            installed.update(re.findall(rf'"{re.escape(str(ROOT))}/([^"]+)"', script.read_text(encoding="utf-8")))
        build = f"{BUILD.relative_to(ROOT)}/" if BUILD.is_relative_to(ROOT) else "build/"
        installed = {path.rstrip("/") for path in installed if not path.startswith(build)}
        self.assertLessEqual({"scenes", "docs", "tests/judge", "README.md"}, installed)
        needed = {"CMakeLists.txt", "core", "cuda", "protocol", "daemon", "clients", "CHANGELOG.md"} | installed
        self.assertEqual([path for path in sorted(needed) if not (ROOT / path).exists()], [])
        self.assertEqual([path for path in sorted(needed) if ignored(path)], [])
        for path in ("build/release/x.o", "tests/core/x.cpp", "docs/__pycache__", ".git/HEAD"):
            self.assertTrue(ignored(path), path)

    @unittest.skipIf(shutil.which("hadolint") is None, "hadolint is not installed")
    def test_hadolint_finds_nothing(self):
        result = run("hadolint", "--ignore", "DL3008", FILE)  # DL3008 requires fixed versions; the Debian release fixes ours
        self.assertEqual(result.returncode, 0, result.stdout)


if __name__ == "__main__":
    unittest.main()
