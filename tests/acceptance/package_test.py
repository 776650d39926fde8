"""Tests the results of `cpack -G DEB` and `cmake --install`: the right files in the right places, and a sonard that runs from
any folder."""
import gzip
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

from running_sonard import BUILD, ROOT, run

sys.path.insert(0, str(ROOT / "tests/architecture"))
import check_links  # noqa: E402

DOCUMENTS = "usr/share/doc/sonard/"
WANTED = {
    "sonard": ["usr/bin/sonard", "usr/bin/sonarctl", "usr/libexec/sonard/sonard-import-mesh", "usr/lib/systemd/system/sonard.service", "usr/share/man/man8/sonard.8.gz",
               "usr/share/man/man1/sonarctl.1.gz", "usr/share/man/man5/sonard.yaml.5.gz", "usr/share/sonard/scenes/demo.yaml",
               "usr/share/sonard/scenes/meshes/wreck.obj", "usr/share/doc/sonard/copyright", DOCUMENTS + "CHANGELOG.md",
               DOCUMENTS + "examples/sonard.yaml", DOCUMENTS + "examples/sonard-blueview.yaml",
               DOCUMENTS + "examples/sonard-aris.yaml", DOCUMENTS + "examples/sonard-3d15.yaml",
               DOCUMENTS + "examples/sonard-ping360.yaml", DOCUMENTS + "examples/sonard-surveyor.yaml",
               DOCUMENTS + "examples/sonard-omniscan.yaml", DOCUMENTS + "examples/sonard-ping1d.yaml", DOCUMENTS + "examples/sonard-s500.yaml", DOCUMENTS + "examples/sonard-micron.yaml", DOCUMENTS + "examples/sonard-norbit.yaml",
               DOCUMENTS + "examples/sonard-dvl.yaml",
               DOCUMENTS + "examples/sonard-m3.yaml", DOCUMENTS + "examples/sonard-suite.yaml",
               "usr/share/sonard/python/sonard_client/__init__.py",
               "usr/share/sonard/python/sonard_client/convert/__main__.py",
               "usr/share/sonard/ros2_bridge/package.xml",
               "usr/share/sonard/protocol/control/control.proto", DOCUMENTS + "docs/driver-test/test_driver.py"],
    "sonard-bvtsdk": ["usr/lib/sonard/bvt3/lib/libbvtsdk.so.3", "usr/lib/sonard/bvt4/lib/libbvtsdk.so.4",
                      "usr/lib/sonard/bvt4/include/bvt_sdk.h", "usr/lib/sonard/bvt3/lib/pkgconfig/bvtsdk.pc",
                      "usr/lib/sonard/bvt3/colormaps/jet.cmap", "usr/share/doc/sonard-bvtsdk/copyright"],
}


def why_not():
    missing = [p for p in ("cpack", "dpkg-deb", "dpkg-shlibdeps", "file", "gzip") if shutil.which(p) is None]
    if missing:
        return "not here: " + ", ".join(missing)
    cache = (BUILD / "CMakeCache.txt").read_text(encoding="utf-8")
    if "SONAR_SANITIZE:STRING=\n" not in cache:
        return "an instrumented build is not for packages"
    if not (BUILD / "bvt4/lib/libbvtsdk.so").exists() or not (BUILD / "package/sonard.8.gz").exists():
        return f"{BUILD} is not built completely"
    return None


def fields(package):
    """Returns the control file as a dictionary, with continuation lines joined."""
    text = run("dpkg-deb", "-f", package).stdout
    return dict(line.split(": ", 1) for line in text.replace("\n ", " ").splitlines() if ": " in line)


def files_below(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if not p.is_dir()}


class Installed:
    """Checks for both ways of installation; `self.root` contains usr or usr/local."""
    prefix = "usr"

    def program(self, name):
        return self.root / self.prefix / "bin" / name

    def test_the_programs_run_and_print_their_version(self):
        result = run(self.program("sonard"), "--version")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"^sonard \d+\.\d+\.\d+")

    def test_shipped_scenes_are_found_beside_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            config = pathlib.Path(folder) / "my.yaml"
            text = "world: {scene: SCENE}\nvehicles: [{name: rov}]\nsonars: [{name: a, profile: oculus-m1200d, bind_ip: ADDRESS}]\n"
            config.write_text(text.replace("ADDRESS", "127.0.0.9").replace("SCENE", "tank-rod.yaml"), encoding="utf-8")
            found = run(self.program("sonard"), "check", config)
            self.assertEqual(found.returncode, 0, found.stderr)
            config.write_text(text.replace("ADDRESS", "127.0.0.9").replace("SCENE", "nowhere.yaml"), encoding="utf-8")
            error = run(self.program("sonard"), "check", config).stderr
            looked = error.split("looked in ")[1]
            first = looked.strip().replace(" and ", ", ").split(", ")[1]
            self.assertEqual(pathlib.Path(first).resolve(), (self.root / self.prefix / "share/sonard/scenes").resolve(), error)

    def test_every_link_of_the_pages_leads_to_an_installed_file(self):
        self.assertTrue((self.root / DOCUMENTS / "docs/control.md").is_file())
        for root in self.roots.values():
            self.assertEqual(check_links.dead_links(root, installed=True), [])

    def test_the_example_configuration_is_valid(self):
        example = self.root / self.prefix / "share/doc/sonard/examples/sonard.yaml"
        result = run(self.program("sonard"), "check", example)
        self.assertEqual(result.returncode, 0, result.stderr)


@unittest.skipIf(why_not(), why_not())
class Package(Installed, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        made = pathlib.Path(cls.folder.name) / "made"
        result = subprocess.run(["cpack", "-G", "DEB", "-B", str(made), "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip"], cwd=BUILD,
                                stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False)
        if result.returncode != 0:
            raise AssertionError(result.stdout + result.stderr)
        cls.packages = {name: next(made.glob(f"{name}_*.deb")) for name in WANTED}
        cls.roots = {}
        for name, package in cls.packages.items():
            cls.roots[name] = pathlib.Path(cls.folder.name) / "root" / name
            cls.roots[name].mkdir(parents=True)
            subprocess.run(["dpkg-deb", "-x", str(package), str(cls.roots[name])], check=True)
        cls.root = cls.roots["sonard"]

    def test_the_files_are_where_they_belong_and_nothing_else_is_there(self):
        for name, wanted in WANTED.items():
            there = files_below(self.roots[name])
            self.assertEqual([w for w in wanted if w not in there], [], name)
            allowed = ("usr/bin/", "usr/libexec/sonard/", "usr/lib/systemd/", "usr/lib/sonard/", "usr/share/")
            self.assertEqual([t for t in there if not t.startswith(allowed)], [], name)
        self.assertFalse([t for t in files_below(self.root) if "bvtsdk.so" in t], "the libraries have their own package")

    def test_nothing_is_a_configuration_file_and_nothing_starts_by_itself(self):
        self.assertFalse((self.root / "etc").exists(), "without a configuration the service runs the demo")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["dpkg-deb", "-e", str(self.packages["sonard"]), folder], check=True)
            scripts = {p: (pathlib.Path(folder) / p).read_text(encoding="utf-8") for p in ("postinst", "prerm", "postrm")}
            for name in scripts:
                self.assertTrue(os.access(pathlib.Path(folder) / name, os.X_OK), name)
                self.assertEqual(run("sh", "-n", pathlib.Path(folder) / name).returncode, 0, name)
        self.assertIn("daemon-reload", scripts["postinst"])
        for name in ("postinst", "postrm"):
            self.assertNotRegex(scripts[name], r"systemctl (--now )?(enable|start|restart)")

    def test_nothing_stays_behind_after_an_upgrade_and_a_removal(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder) / "root"
            log = pathlib.Path(folder) / "log"
            (root / "var/lib/dpkg/info").mkdir(parents=True)
            (root / "var/lib/dpkg/updates").mkdir()
            (root / "var/lib/dpkg/status").touch()
            (root / "etc").mkdir()

            def dpkg(*arguments):
                result = run("dpkg", f"--root={root}", f"--log={log}", "--force-script-chrootless", "--force-not-root",
                             "--force-depends", "--force-bad-path", *arguments)
                self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

            def installed():
                return {p.relative_to(root) for p in root.rglob("*")} - {p.relative_to(root) for p in (root / "var/lib/dpkg").rglob("*")}

            before = installed()
            dpkg("--install", *self.packages.values())
            of_the_package = installed()
            run(sys.executable, "-m", "compileall", "-q", root / "usr/share/sonard/python", root / "usr/share/doc/sonard")
            (root / "etc/sonard").mkdir()  # systemd makes it when the service starts
            self.assertTrue(list(root.rglob("*.pyc")))
            dpkg("--install", *self.packages.values())
            self.assertEqual(installed() - of_the_package, {pathlib.Path("etc/sonard")})
            run(sys.executable, "-m", "compileall", "-q", root / "usr/share/sonard/python", root / "usr/share/doc/sonard")
            dpkg("--purge", *self.packages)
            self.assertEqual(installed() - before, set())

    def test_the_control_file_has_maintainer_description_and_dependencies(self):
        for name, package in self.packages.items():
            control = fields(package)
            self.assertEqual(control["Package"], name)
            self.assertRegex(control["Version"], r"^\d+\.\d+\.\d+$")
            self.assertIn("@", control["Maintainer"])
            self.assertRegex(control["Depends"], r"\blibc6\b.*\blibstdc\+\+6\b")
            self.assertGreater(len(control["Description"]), 100)
        self.assertRegex(fields(self.packages["sonard"])["Depends"], r"\blibembree")
        self.assertEqual(fields(self.packages["sonard"])["Recommends"], "python3", "sonarctl judge and lab are Python programs")
        self.assertNotIn("embree", fields(self.packages["sonard-bvtsdk"])["Depends"])

    def test_the_copyright_file_has_the_licence_of_the_binaries(self):
        text = (self.root / "usr/share/doc/sonard/copyright").read_text(encoding="utf-8")
        linked = run("readelf", "-d", self.program("sonard")).stdout if shutil.which("readelf") else ""
        self.assertIn("Apache-2.0", text)
        if "fftw" in linked:
            self.assertRegex(text, r"Files: usr/bin/\*\nCopyright:.*\nLicense: GPL-3\+")

    def test_the_manual_pages_can_be_displayed(self):
        for page in ("man8/sonard.8.gz", "man1/sonarctl.1.gz", "man5/sonard.yaml.5.gz"):
            text = gzip.decompress((self.root / "usr/share/man" / page).read_bytes()).decode()
            self.assertTrue(text.startswith(".Dd "), page)
            if shutil.which("man"):
                shown = subprocess.run(["man", "--warnings", "-l", "-"], input=text, capture_output=True, text=True, timeout=60,
                                       env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "100"}, check=False)
                self.assertEqual((shown.returncode, shown.stderr), (0, ""), page)

    def test_the_programs_name_no_folder_they_were_built_in(self):
        """Assertions, or a folder of scenes in the source tree, would add such names."""
        for name in ("sonard", "sonarctl"):
            self.assertNotIn(str(ROOT).encode(), self.program(name).read_bytes(), name)
            self.assertNotIn(str(BUILD).encode(), self.program(name).read_bytes(), name)

    def test_lintian_finds_no_error(self):
        if shutil.which("lintian") is None:
            self.skipTest("lintian is not installed")
        for name, package in self.packages.items():
            result = run("lintian", "--fail-on", "error", "--allow-root", package)
            self.assertEqual(result.returncode, 0, f"{name}: {result.stdout}")


@unittest.skipIf(why_not(), why_not())
class Destdir(Installed, unittest.TestCase):
    prefix = "usr"

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.root = pathlib.Path(cls.folder.name)
        cls.roots = {"all": cls.root}
        result = subprocess.run(["cmake", "--install", str(BUILD), "--prefix", "/usr"], stdin=subprocess.DEVNULL, capture_output=True,
                                text=True, timeout=300, check=False, env={**os.environ, "DESTDIR": str(cls.root)})
        if result.returncode != 0:
            raise AssertionError(result.stdout + result.stderr)

    def test_it_installs_what_both_packages_hold(self):
        there = files_below(self.root)
        self.assertEqual([w for wanted in WANTED.values() for w in wanted if w not in there], [])


if __name__ == "__main__":
    unittest.main()
