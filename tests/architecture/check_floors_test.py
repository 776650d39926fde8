#!/usr/bin/env python3
"""Plants one violation of each rule in a made-up tree and expects check_floors to find exactly that one."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import check_floors  # noqa: E402

SLASH, DOT = "/", "."  # so that this file has no violation itself
PAGE = "docs/a" + DOT + "md"


def found_in(files):
    """Returns the violations in a tree that holds these files, {name: text}."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        return list(check_floors.violations(root))


class Planted(unittest.TestCase):
    def expect(self, name, text, place, words):
        if name.endswith(".hpp"):
            text += "#pragma once\n"
        found = found_in({name: text})
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(f"{name}:{place}: "), found)
        self.assertIn(words, found[0])

    def test_upward_and_sideways_includes_are_found(self):
        for name, header in [
                ("core/base/a.hpp", "core/sonar/ping.hpp"), ("core/sonar/a.hpp", "core/scene/scene.hpp"),
                ("core/scene/a.cpp", "core/pipeline/cpu/simulate.hpp"), ("core/pipeline/a.cpp", "protocol/vendor.hpp"),
                ("core/pipeline/a.cpp", "core/text/strict_yaml.hpp"), ("core/pipeline/arithmetic/a.hpp", "core/scene/scene.hpp"),
                ("protocol/oculus/a.cpp", "core/scene/scene.hpp"), ("protocol/oculus/a.cpp", "core/pipeline/ping_engine.hpp"),
                ("protocol/oculus/a.cpp", "protocol/blueview/models.hpp"), ("protocol/control/a.cpp", "daemon/emulator/world/world.hpp"),
                ("clients/sonarctl/a.cpp", "daemon/config/config.hpp"), ("clients/sonarctl/a.cpp", "core/pipeline/cpu/simulate.hpp"),
                ("cuda/a.cu", "core/image/raster.hpp"), ("daemon/a.cpp", "clients/sonarctl/net.hpp")]:
            with self.subTest(name=name, header=header):
                self.expect(name, f'\n#include "{header}"\n', 2, "must not include")

    def test_programs_without_room_for_stacks_are_found(self):
        self.expect("clients/a/main.cpp", "\nint main(int argc, char** argv) { return run(argc, argv); }\n", 2, "make_room_for_stacks()")
        room = "int main() { if (!make_room_for_stacks()) return 1; }\n"
        bare = "int main() { return 0; }\n"
        self.assertEqual(found_in({"daemon/main.cpp": room, "clients/web/print_colour_maps.cpp": bare, "tests/a_test.cpp": bare}), [])

    def test_folders_of_the_daemon_include_each_other_in_one_direction(self):
        def include(folder):
            return f'#pragma once\n#include "daemon/server/{folder}/a.hpp"\n'
        tree = {"daemon/server/http/a.hpp": include("view"), "daemon/server/view/a.hpp": include("control"),
                "daemon/server/control/a.hpp": "#pragma once\n"}
        self.assertEqual(found_in(tree), [])
        tree["daemon/server/control/a.hpp"] = include("http")
        found = found_in(tree)
        self.assertEqual([f.split(":")[0] for f in found], sorted(tree), found)
        self.assertIn("daemon/server/control and daemon/server/http include each other", found[0])

    def test_folders_and_components_include_each_other_in_one_direction(self):
        def including(header):
            return f'#pragma once\n#include "{header}"\n'
        for first, second, parts in [("protocol/recording/a", "protocol/recording/pcap/b", "folders"),
                                     ("protocol/control/a", "protocol/control/b", "components"),
                                     ("core/scene/a", "core/scene/b", "components"),
                                     ("clients/bvtsdk/core/a", "clients/bvtsdk/core/b", "components")]:
            with self.subTest(first=first):
                tree = {f"{first}.hpp": "#pragma once\n", f"{second}.hpp": including(f"{first}.hpp")}
                self.assertEqual(found_in(tree), [])
                found = found_in({**tree, f"{first}.cpp": f'#include "{second}.hpp"\n'})
                self.assertEqual({f.split(":")[0] for f in found}, {f"{first}.cpp", f"{second}.hpp"}, found)
                self.assertIn(f"the {parts} ", found[0])

    def test_the_list_of_makes_is_not_part_of_a_cycle(self):
        tree = {"protocol/makes.cpp": '#include "protocol/oculus/a.hpp"\n',
                "protocol/oculus/a.hpp": '#pragma once\n#include "protocol/vendor.hpp"\n'}
        self.assertEqual(found_in(tree), [])
        found = found_in({**tree, "protocol/host.cpp": '#include "protocol/oculus/a.hpp"\n'})
        self.assertTrue(any("the folders protocol and protocol/oculus " in f for f in found), found)

    def test_include_paths_start_at_the_root(self):
        self.expect("core/base/a.cpp", '#include "units.hpp"\n', 1, "start at the root")

    def test_dependencies_enter_through_one_file(self):
        for name, header in [
                ("core/scene/scene.cpp", "embree3/rtcore.h"), ("core/pipeline/a.cpp", "embree4/rtcore.h"),
                ("core/pipeline/a.cpp", "fftw3.h"), ("daemon/config/a.cpp", "yaml-cpp/yaml.h"),
                ("core/scene/files/load_mesh.cpp", "assimp/scene.h"), ("protocol/oculus/a.cpp", "spdlog/spdlog.h"),
                ("daemon/a.cpp", "google/protobuf/message.h"), ("daemon/server/sonars/session.cpp", "boost/asio.hpp"),
                ("core/base/a.cpp", "boost/container/small_vector.hpp"), ("core/base/parallel.cpp", "tbb/parallel_for.h"),
                ("core/pipeline/a.cpp", "cuda_runtime.h"), ("core/base/a.hpp", "Eigen/Dense")]:
            with self.subTest(name=name, header=header):
                self.expect(name, f"#include <{header}>\n", 1, "may")

    def test_forbidden_words_are_found(self):
        for name, line, rule in [
                ("protocol/wire/a.hpp", "auto p = reinterpret_cast<Header*>(bytes);", "cast"),
                ("protocol/oculus/a.hpp", "#pragma pack(push, 1)", "packing"),
                ("protocol/oculus/a.hpp", "struct __attribute__((packed)) A {};", "packing"),
                ("core/pipeline/a.cpp", "auto t = std::chrono::steady_clock::now();", "clock"),
                ("protocol/oculus/a.cpp", "auto t = time(nullptr);", "clock"),
                ("core/scene/a.cpp", 'std::cerr << "loaded";', "log"),
                ("core/scene/a.cpp", 'printf("loaded");', "log"),
                ("core/pipeline/a.cpp", "std::thread worker(f);", "thread"),
                ("cuda/a.cpp", "std::async(f);", "thread"),
                ("clients/bvtsdk/core/sonar.cpp", "std::thread worker(f);", "thread"),
                ("protocol/oculus/a.cpp", "#include <sys/socket.h>", "socket"),
                ("protocol/recording/piece.cpp", "std::ifstream in(file);", "file"),
                ("protocol/oculus/a.cpp", 'auto* in = std::fopen(name, "rb");', "file"),
                ("clients/a.cpp", 'std::setlocale(LC_ALL, "");', "locale"),
                ("daemon/a.cpp", "std::locale::global(german);", "locale"),
                ("core/sonar/a.cpp", "const int fd = ::open(name, 0);", "file"),
                ("daemon/emulator/world/a.hpp", '#include "protocol/control/answers.hpp"', "answers"),
                ("daemon/a.cpp", "std::mutex guard;", "mutex"),
                ("core/scene/a.cpp", "std::mt19937 engine;", "global random"),
                ("daemon/a.cpp", "int x;  // TO" + "DO later", "mark"),
                ("tests/a_test.cpp", "namespace sonar::test" + "ing {\n}\n", "test namespace"),
                ("a.sh", "list | gr" + "ep -iq word", "quiet grep"),
                ("daemon/CMakeLists.txt", "target_precompile_headers(d PRIV" + "ATE <utility> server/asio.hpp)", "precompiled header"),
                (PAGE, "run it in " + SLASH + "ho" + "me/me/sonard", "machine path"),
                ("tests/daemon/a.cpp", 'open("' + SLASH + "t" + 'mp/x");', "machine path")]:
            with self.subTest(name=name, line=line):
                self.expect(name, line + "\n", 1, rule)

    def test_pages_that_are_cited_exist(self):
        page = {PAGE: "# Title\n\n## 2. Second\n\n### 2.1 Part of it\n\n## Named\n"}
        for name, line in [("core/base/a.cpp", f"int x;  // {PAGE}"), ("core/base/a.cpp", f"/* see\n{PAGE}, section 2 */"),
                           ("core/base/a.cpp", f'// "quoted" {PAGE}, 2.1'), ("scenes/a.yaml", f'# {PAGE}, "Named"'),
                           ("tests/a.py", f"# {PAGE}, section 2.1"), ("docs/b" + DOT + "md", "[link](a" + DOT + "md)"),
                           ("core/base/a.cpp", "f(\"nowhere" + DOT + "md\");")]:
            with self.subTest(name=name, line=line):
                self.assertEqual(found_in({**page, name: line + "\n"}), [])
        for name, line, words in [
                ("core/base/a.cpp", "int x;  // nowhere" + DOT + "md 4", "does not exist"),
                ("core/base/a.cpp", "int x;  // a" + DOT + "md, section 2", "does not exist"),  # its folder is missing
                ("core/base/a.cpp", f"int x;  // {PAGE}, section 3", "no heading 3"),
                ("core/base/a.cpp", f"int x;  // {PAGE} 2.2", "no heading 2.2"),
                ("core/base/a.cpp", f'int x;  // {PAGE}, "Lost"', "no heading Lost"),
                ("scenes/a.yaml", "# docs/nowhere" + DOT + "md", "does not exist"),
                ("docs/b" + DOT + "md", "[link](../a" + DOT + "md)", "does not exist")]:
            with self.subTest(name=name, line=line):
                found = found_in({**page, name: line + "\n"})
                self.assertEqual(len(found), 1, found)
                self.assertTrue(found[0].startswith(f"{name}:1: page: "), found)
                self.assertIn(words, found[0])

    def test_comments_are_sentences(self):
        for line, words in [("/// Of the last ping.", 'begins with "Of"'), ("  // What a ray met.", 'begins with "What"'),
                            ("int x;\n/// Nothing: no such field.", 'begins with "Nothing:"'),
                            ("int x;  // of each beam", 'begins with "of"'),
                            ("int x;  // the log is to" + "ld", '"to' + 'ld"'), ("/// nullopt: it is none.", '"is none"'),
                            ("// Bytes that are no frame.", '"are no frame"'), ("// The scan goes on.", '"goes on"'),
                            ("// Waits for so ma" + "ny pings.", '"so ma' + 'ny"'), ("/// Empty, or why n" + "ot.", '"or why n' + 'ot"'),
                            ("// To be cal" + "led once.", '"To be cal' + 'led"'), ("int x;  // kept for ev" + "er", '"for ev' + 'er"')]:
            with self.subTest(line=line):
                self.expect("core/base/a.cpp", line + "\n", line.count("\n") + 1, words)
        self.assertEqual(found_in({
            "core/base/a.cpp": "/// Statistics of the last ping.\n/// What follows continues a sentence.\nint Of = 1;\n",
            "core/base/b.cpp": 'f("What to' + 'ld");\n// Whatever comes.\n// Nothing is lost. There is no frame; it is no longer there.\n'}), [])

    def test_makes_are_named_in_their_folders_only(self):
        for name, line in [("daemon/server/a.cpp", "oculus::Framer framer;"), ("clients/sonarctl/a.cpp", '#include "protocol/ping/messages.hpp"'),
                           ("clients/python/a.py", "# of an ARIS"), ("protocol/recording/a.cpp", 'if (name == "blueview") return;'),
                           ("daemon/config/a.cpp", 'name = "m3";'), ("daemon/config/a.cpp", '#include "protocol/m3/settings.hpp"'),
                           ("daemon/a.cpp", "bool is_aris();"), ("daemon/a.cpp", "ArisFrame a;"), ("daemon/a.cpp", "int m3_packet;"),
                           ("daemon/a.cpp", "int dvl_port;"), ("core/pipeline/a.inl", "int s500;"), ("clients/web/a.css", ".norbit {}"),
                           ("protocol/control/a.proto", "string oculus = 1;"), ("clients/web/a.html", "<p>Micron"),
                           *((f"daemon/emulator/{make}.cpp", f"{make}::vendor();") for make in check_floors.MAKE_FOLDERS)]:
            with self.subTest(name=name):
                self.expect(name, line + "\n", 1, "only the make's folder")
        self.expect("daemon/commands/replay/replay_device.cpp", "int x;\n", 1, "take it out of NAME_MAKES")
        self.expect("protocol/makes.cpp", '#include "protocol/host.hpp"\n#include "protocol/eleventh/host.hpp"\n', 2, "add it")

    def test_missing_headers_and_large_files_are_found(self):
        found = found_in({"core/base/a.hpp": "int x;\n"})
        self.assertEqual(found, ["core/base/a.hpp:1: header without #pragma once"])
        self.expect("core/base/a.cpp", "int x;\n" * 401, 400, "split it")


class Innocent(unittest.TestCase):
    def test_what_is_allowed_is_not_reported(self):
        self.assertEqual(found_in({
            "core/base/parallel.cpp": "#include <thread>\nstd::thread worker(f);\n",
            "core/scene/embree_scene.cpp": '#include <embree3/rtcore.h>\n#include "core/scene/ray_scene.hpp"\n',
            "core/scene/import/import_mesh.cpp": "#include <assimp/scene.h>\n",
            "core/text/strict_yaml.cpp": "#include <yaml-cpp/parser.h>\n",
            "protocol/control/control.cpp": '#include "control.pb.h"\n',
            "protocol/oculus/a.cpp": "// reinterpret_cast is not for us\nchar t[9]; int n = std::snprintf(t, 9, \"%d\", 1);\n",
            "protocol/makes.cpp": '#include "protocol/oculus/oculus.hpp"\n',
            "protocol/m3/m3.cpp": "int m3;\n",
            "clients/python/b.py": "kg_per_m3 = 1025  # kg/m3, from a DVL\n",
            "protocol/control/a.proto": "// of an ARIS\n",
            "core/scene/a.cpp": "int comparison, arisen, microns;\n",
            "daemon/server/system/asio.hpp": "#pragma once\n#include <utility>\n#include <boost/asio.hpp>\n",
            "daemon/commands/banner.cpp": '#include "cuda/cuda_status.hpp"\n#include "core/pipeline/ping_engine.hpp"\n',
            "clients/sonarctl/a.cpp": '#include <nlohmann/json.hpp>\n#include "protocol/host.hpp"  // for an Oculus\n',
            "clients/bvtsdk/abi4/include/bvt_sdk.h": '#pragma once\n#include "bvt_sdk_classes.h"\n',
            "clients/bvtsdk/core/link.cpp": "#include <thread>\nstd::thread reader(f);\n",
            "tests/core/a.cpp": '#include <Eigen/Dense>\n#include "daemon/emulator/world/world.hpp"\nstd::thread t; // steady_clock\n',
            PAGE: "see https://example.org/wo" "rk/ho" "me and scenes/demo.yaml, /etc/sonard/sonard.yaml\n",
        }), [])


if __name__ == "__main__":
    unittest.main()
