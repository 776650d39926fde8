"""Tests the messages of CMake if something is missing or too old, with core/requirements.cmake in an otherwise empty project."""
import pathlib
import subprocess
import tempfile
import unittest

REQUIREMENTS = pathlib.Path(__file__).parents[2] / "core/requirements.cmake"


def configure(*options, before="", folders=None):
    """Returns cmake's output without line breaks, and its exit status."""
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.22)\nproject(requirements LANGUAGES CXX)\n"
                                               f"{before}\ninclude({REQUIREMENTS})\nmessage(STATUS \"all is here\")\n")
        for name, text in (folders or {}).items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text)
        options = [option.replace("FOLDER", made) for option in options]
        run = subprocess.run(["cmake", "-S", made, "-B", folder / "build", *options], capture_output=True, text=True, timeout=300)
        return " ".join((run.stdout + run.stderr).split()), run.returncode


class Requirements(unittest.TestCase):
    def test_configuration_succeeds_with_all_packages(self):
        text, status = configure("-DBUILD_TESTING=ON")
        self.assertIn("all is here", text)
        self.assertEqual(status, 0)

    def test_names_all_that_is_missing_and_its_packages(self):
        text, status = configure("-DCMAKE_DISABLE_FIND_PACKAGE_CLI11=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_Protobuf=ON")
        self.assertNotEqual(status, 0)
        self.assertIn("CLI11 2.1 or newer (not found) Protobuf 3.12 or newer (not found)", text)
        self.assertIn("apt-get install libcli11-dev libprotobuf-dev protobuf-compiler)", text)

    def test_names_libraries_without_a_description_for_cmake_too(self):
        # No requirement is found by its files alone.
        text, status = configure("-DSONAR_FFTW=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_tinyxml2=ON",
                                 before="macro(find_library)\nendmacro()\nmacro(find_path)\nendmacro()")
        self.assertNotEqual(status, 0)
        self.assertRegex(text, r"tinyxml2 \(not found\).* snappy \(not found\) fftw3 \(not found\) Install")
        self.assertRegex(text, r"apt-get install .*libtinyxml2-dev .*libsnappy-dev libfftw3-dev\)")
        text, status = configure("-DSONAR_FFTW=OFF", before="macro(find_library)\nendmacro()\nmacro(find_path)\nendmacro()")
        self.assertNotIn("fftw3", text)

    def test_names_what_is_too_old(self):
        text, status = configure("-Dspdlog_DIR=FOLDER/old", folders={
            "old/spdlog-config.cmake": "", "old/spdlog-config-version.cmake": "set(PACKAGE_VERSION 1.8.0)"})
        self.assertNotEqual(status, 0)
        self.assertIn("spdlog 1.9 or newer (1.8.0 was found)", text)
        self.assertIn("libspdlog-dev", text)

    def test_leaves_the_farm_out_where_its_library_is_too_old(self):
        for version, is_built in (("3.2.0", False), ("3.3.0", True), ("3.10.1", True)):
            text, status = configure("-DSONAR_FARM=ON", "-DNATS_INCLUDE_DIR=FOLDER", "-DNATS_LIBRARY=FOLDER/libnats.so",
                                     folders={"nats/version.h": f'#define NATS_VERSION_STRING "{version}"\n'})
            self.assertEqual(status, 0, text)
            self.assertEqual("built without the farm (sonard worker, sonarctl farm): install libnats-dev 3.3" not in text, is_built, version)

    def test_names_a_protobuf_that_is_too_new(self):
        text, status = configure(before="macro(find_package name)\n  _find_package(${ARGV})\n  if(${name} STREQUAL Protobuf)\n"
                                        "    set(Protobuf_VERSION 4.25.1)\n  endif()\nendmacro()")
        self.assertNotEqual(status, 0)
        self.assertIn("Protobuf before 22 (4.25.1 was found)", text)

    def test_names_a_compiler_that_is_too_old(self):
        for compiler, version, sentence in (("GNU", "10.2.1", "g++ 11 or newer (this is 10.2.1, another: -DCMAKE_CXX_COMPILER="),
                                            ("Clang", "13.0.1", "Clang 14 or newer (this is 13.0.1, another: -DCMAKE_CXX_COMPILER=")):
            text, status = configure(before=f"set(CMAKE_CXX_COMPILER_ID {compiler})\nset(CMAKE_CXX_COMPILER_VERSION {version})")
            self.assertNotEqual(status, 0)
            self.assertIn(sentence, text)


if __name__ == "__main__":
    unittest.main()
