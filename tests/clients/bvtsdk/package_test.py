"""Tests the library prefixes as a driver's build uses them: headers in every language, the two-line detector that distinguishes
3.x and 4.x, every function in the library and no other symbol, no foreign libraries, the CMake package and pkg-config."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from prefixes import prefix

CC, CXX = os.environ.get("CC", "cc"), os.environ.get("CXX", "c++")
STRICT = ["-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-pedantic-errors", "-Werror"]
FOREIGN = re.compile(r"boost|protobuf|spdlog|fmt|cuda|fftw|embree|yaml|sonar_")


def functions(abi):
    header = (prefix(abi) / "include/bvt_sdk.h").read_text()
    return set(re.findall(r"BVT_API [^;(]*?\b(BVT\w+)\(", header))


def link(abi):
    return [f"-L{prefix(abi) / 'lib'}", f"-Wl,-rpath,{prefix(abi) / 'lib'}", "-lbvtsdk"]


class Package(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def build(self, compiler, abi, text, *options, suffix=".cpp", libraries=()):
        source = pathlib.Path(self.folder.name) / f"source{suffix}"
        source.write_text(text)
        return subprocess.run([compiler, f"-I{prefix(abi) / 'include'}", *options, str(source), *libraries, "-o",
                               source.with_suffix(".out")],
                              capture_output=True, text=True, check=False, timeout=120)

    def test_headers_are_clean_in_every_language(self):
        for abi, languages in ((3, ["c99", "c11", "c++98", "c++11", "c++17"]), (4, ["c99", "c11", "c++98", "c++11", "c++17", "c++20"])):
            for language in languages:
                with self.subTest(abi=abi, language=language):
                    c = "++" not in language
                    done = self.build(CC if c else CXX, abi, "#include <bvt_sdk.h>\n", "-c", f"-std={language}", *STRICT,
                                      suffix=".c" if c else ".cpp")
                    self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_detector_distinguishes_the_generations(self):
        lines = {3: "BVTSonar_GetTemperature(0);", 4: "float x; BVTSonar_GetTemperature(0, &x);"}
        for abi in (3, 4):
            for generation, line in lines.items():
                for compiler, suffix in ((CC, ".c"), (CXX, ".cpp")):
                    with self.subTest(abi=abi, line=line, suffix=suffix):
                        done = self.build(compiler, abi, f"#include <bvt_sdk.h>\nint main(void) {{ {line} return 0; }}\n",
                                          suffix=suffix, libraries=link(abi))
                        self.assertEqual(done.returncode == 0, abi == generation, done.stderr)

    def test_every_function_links_from_c(self):
        for abi, least in ((3, 130), (4, 180)):
            names = sorted(functions(abi))
            self.assertGreater(len(names), least)
            text = "#include <bvt_sdk.h>\ntypedef void (*F)(void);\nF all[] = {" + ", ".join(f"(F){n}" for n in names) + \
                "};\nint main(void) { return all[0] == 0; }\n"
            done = self.build(CC, abi, text, "-std=c99", suffix=".c", libraries=link(abi))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(subprocess.run([pathlib.Path(self.folder.name) / "source.out"], check=False).returncode, 0)

    def test_only_the_interface_is_exported(self):
        for abi in (3, 4):
            library = prefix(abi) / "lib/libbvtsdk.so"
            symbols = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
            exported = {line.split()[-1].split("@")[0] for line in symbols.splitlines()}
            self.assertEqual(exported, functions(abi))

    def test_soname_and_foreign_libraries(self):
        for abi in (3, 4):
            library = prefix(abi) / "lib/libbvtsdk.so"
            dynamic = subprocess.run(["readelf", "-d", library], capture_output=True, text=True, check=True).stdout
            self.assertIn(f"Library soname: [libbvtsdk.so.{abi}]", dynamic)
            needed = set(re.findall(r"Shared library: \[([\w+.-]+?)\.so", dynamic))
            self.assertLessEqual(needed, {"libz", "libstdc++", "libm", "libgcc_s", "libc", "libpthread", "ld-linux-x86-64",
                                          "ld-linux-aarch64"})
            loaded = subprocess.run(["ldd", "-r", library], capture_output=True, text=True, check=True)
            self.assertIsNone(FOREIGN.search(re.sub(r"\S*/", "", loaded.stdout)), loaded.stdout)
            self.assertNotIn("undefined", loaded.stdout + loaded.stderr)

    def test_colour_maps_lie_in_the_prefix(self):
        for abi in (3, 4):
            maps = {p.name: p.stat().st_size for p in (prefix(abi) / "colormaps").iterdir()}
            self.assertEqual(maps, {f"{n}.cmap": 3 * 4096 for n in ("jet", "bone", "hot", "copper", "cool", "green")})

    def test_3x_handles_are_one_type_and_have_the_names_of_the_later_3x(self):
        mixed = """#include <bvt_sdk.h>
            int main(void) {
              BVTHead head = BVTSonar_Create();  /* kept in a variable of another type, as void* once allowed */
              BVTPing ping = 0;
              int code = BVTHead_GetPing(head, -1, &ping);
              BVTSonar_Destroy(head);
              return code;
            }\n"""
        named = """#include <bvt_sdk.h>
            #include <memory>
            int main() {
              std::shared_ptr<BVTOpaqueSonar> sonar(BVTSonar_Create(), BVTSonar_Destroy);
              std::shared_ptr<BVTOpaquePing> ping;
              BVTHead head = nullptr;
              return sonar && !ping ? BVTSonar_GetHead(sonar.get(), 0, &head) : 0;
            }\n"""
        for compiler, suffix, text, code in ((CC, ".c", mixed, 7), (CXX, ".cpp", mixed, 7), (CXX, ".cpp", named, 14003 % 256)):
            with self.subTest(suffix=suffix, code=code):
                done = self.build(compiler, 3, text, "-Werror", suffix=suffix, libraries=link(3))
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(subprocess.run([pathlib.Path(self.folder.name) / "source.out"], check=False).returncode, code)

    def test_cmake_and_pkg_config_find_the_prefixes(self):
        plain = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
        for abi in (3, 4):
            moved = pathlib.Path(self.folder.name) / f"moved{abi}"
            shutil.copytree(prefix(abi), moved, symlinks=True)
            project = pathlib.Path(self.folder.name) / f"project{abi}"
            project.mkdir()
            (project / "main.cpp").write_text("#include <bvt_sdk.h>\nint main() { return BVTSDK_MajorVersion(); }\n")
            (project / "CMakeLists.txt").write_text(
                "cmake_minimum_required(VERSION 3.16)\nproject(driver CXX)\n"
                f"find_package(BVTSDK {abi} REQUIRED)\nadd_executable(driver main.cpp)\n"
                "target_link_libraries(driver PRIVATE BVTSDK::bvtsdk)\nfile(GLOB maps ${BVTSDK_COLORMAPS}/jet.cmap)\n"
                "install(TARGETS driver DESTINATION bin)\n"
                "if(NOT maps)\n  message(FATAL_ERROR no maps)\nendif()\n")
            for command in (["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={moved}",
                             f"-DCMAKE_CXX_COMPILER={CXX}", f"-DCMAKE_INSTALL_PREFIX={project}/installed"],
                            ["cmake", "--build", project / "build"], ["cmake", "--install", project / "build"]):
                done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            for program in ("build/driver", "installed/bin/driver"):
                self.assertEqual(subprocess.run([project / program], check=False, env=plain).returncode, abi, program)
            if shutil.which("pkg-config"):
                flags = subprocess.run(["pkg-config", "--cflags", "--libs", "bvtsdk"], capture_output=True, text=True, check=True,
                                       env={**os.environ, "PKG_CONFIG_PATH": str(moved / "lib/pkgconfig")}).stdout.split()
                done = subprocess.run([CXX, project / "main.cpp", *flags, "-o", project / "by_flags"], capture_output=True,
                                      text=True, check=False, timeout=120)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(subprocess.run([project / "by_flags"], check=False, env=plain).returncode, abi)


if __name__ == "__main__":
    unittest.main()
