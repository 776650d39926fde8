"""Tests sonarctl scene: a Gazebo world is converted to a scene, and its box has an echo at the position of its poses."""
import base64
import json
import math
import os
import pathlib
import struct
import subprocess
import tempfile
import unittest

from render_test import read_npy
from running_sonard import ROOT, SONARCTL, SONARD, run

WORLDS = ROOT / "tests/clients/scene_tools/worlds"

CONFIG = """\
world: {scene: quay.yaml}
vehicles: [{name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, -2]}}]
sonars: [{name: front, profile: oculus-m1200d, bind_ip: 127.0.0.2}]
"""


class SceneCommand(unittest.TestCase):
    def setUp(self):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.scene = self.path / "quay.yaml"

    def ctl(self, *arguments, code=0):
        result = run(SONARCTL, "scene", *arguments)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        if code:
            self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
        return result.stdout if code == 0 else result.stderr

    def import_quay(self, *more):
        return self.ctl("import", WORLDS / "quay.world", "--out", self.scene, *more)

    def test_a_grid_in_utm_lies_below_a_vehicle_at_the_origin_of_the_world(self):
        cells = " ".join(["-4"] * 441)
        (self.path / "bed.asc").write_text("ncols 21\nnrows 21\nxllcenter 499990\nyllcenter 6651401.2\ncellsize 1\n" + cells,
                                           encoding="utf-8")
        self.scene.write_text("objects: [{name: bed, type: heightmap, file: bed.asc, material: sand, utm: 33N}]\n", encoding="utf-8")
        config = self.path / "sonard.yaml"
        checked = []
        for latitude in (60, 61):
            place = f"quay.yaml, origin: {{lat: {latitude}, lon: 15}}}}"
            config.write_text(CONFIG.replace("quay.yaml}", place), encoding="utf-8")
            checked.append(run(SONARD, "check", config).stdout)
        self.assertIn("note: bed.asc: its position is relative to world.origin, latitude 60.000000, longitude 15.000000", checked[0])
        self.assertNotIn("from everything", checked[0])
        self.assertIn("note: the scene is 111.4 km from world.origin; vehicles", checked[1])
        self.assertIn("m from everything in the scene", checked[1])

    def checked(self, keys, code=0):
        """Returns the output for a scene of one object with these keys."""
        self.scene.write_text(f"objects: [{{name: bed, material: sand, {keys}}}]\n", encoding="utf-8")
        return self.ctl("check", self.scene, code=code)

    def test_values_far_from_all_heights(self):
        """Usual fill values are missing heights. Others remain, with a note."""
        def with_one(value):
            (self.path / "g.asc").write_text("ncols 10\nnrows 10\nxllcorner 0\nyllcorner 0\ncellsize 1\n" +
                                             "-10 " * 45 + value + " -10" * 53 + " -9.5\n", encoding="utf-8")
            return self.checked("type: heightmap, file: g.asc")
        for fill in ("9999", "-999.99", "-9999.9", "99999.99", "65535"):
            text = with_one(fill)
            self.assertIn(f"1 cell of {fill}, far from all heights, treated as missing", text)
            self.assertIn("z -10..-9.5 m", text)
        for odd in ("-888", "-12345.6", "5000"):
            self.assertIn(f"1 cell of {odd}, ", with_one(odd))
            self.assertIn("away from all other heights: missing values?", with_one(odd))
        self.assertNotIn("cell of", with_one("8"))

    def test_the_content_of_a_height_map_counts_not_its_name(self):
        (self.path / "t.png").write_bytes(b"II*\0")
        self.assertIn("TIFF", self.checked("type: heightmap, file: t.png", 65))
        (self.path / "p.tif").write_bytes(b"\x89PNG\r\n\x1a\n")
        self.assertIn("size_m", self.checked("type: heightmap, file: p.tif", 65))
        self.assertIn("cut short", self.checked("type: heightmap, file: p.tif, size_m: [1, 1], height_m: [0, 1]", 65))
        (self.path / "j.png").write_bytes(b"\xff\xd8\xff\xe0")
        self.assertIn("is a JPEG picture", self.checked("type: heightmap, file: j.png, size_m: [1, 1], height_m: [0, 1]", 65))

    def test_the_unit_of_a_geotiffs_heights(self):
        def with_unit(unit):
            text = f'<GDALMetadata><Item name="UNITTYPE" sample="0" role="unittype">{unit}</Item></GDALMetadata>\0'.encode()
            tags = [(256, 3, [2]), (257, 3, [2]), (258, 3, [32]), (262, 3, [1]), (273, 4, [8]), (277, 3, [1]), (278, 3, [2]),
                    (279, 4, [16]), (339, 3, [3]), (33550, 12, [1, 1, 0]), (33922, 12, [0, 0, 0, 500, 500, 0]), (42112, 2, text)]
            data, entries = struct.pack("<4f", -300, -200, -100, -100), b""
            for tag, kind, values in tags:
                packed = struct.pack(f"<{len(values)}{'?BBHI???????d'[kind]}", *values)
                place = packed.ljust(4, b"\0") if len(packed) <= 4 else struct.pack("<I", 8 + len(data))
                data += packed if len(packed) > 4 else b""
                entries += struct.pack("<HHI", tag, kind, len(values)) + place
            (self.path / "g.tif").write_bytes(struct.pack("<2sHI", b"II", 42, 8 + len(data)) + data +
                                              struct.pack("<H", len(tags)) + entries + bytes(4))
            return self.checked("type: heightmap, file: g.tif")
        for unit, low, high in (("Metres", "-300", "-100"), ("cm", "-3", "-1"), ("mm", "-0.3", "-0.1"), ("fathoms", "-549", "-183")):
            self.assertIn(f"z {low}..{high} m", with_unit(unit))
        text = with_unit("cubits")
        self.assertIn("z -300..-100 m", text)
        self.assertIn("the unit of its heights, cubits, is not known: they are read as metres", text)

    def test_a_skin_without_matrices_is_read(self):
        """glTF defines the matrices that are left out; the importer crashed without them."""
        data = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
        (self.path / "m.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"mesh": 0, "skin": 0, "translation": [1, 2, 3]}, {"name": "bone"}], "skins": [{"joints": [1]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": "data:;base64," + base64.b64encode(data).decode()}]}), encoding="utf-8")
        self.assertIn("1 triangle", self.checked("type: mesh, file: m.gltf"))
        self.assertIn("x 1..2, y -3..-3, z 2..3 m", self.checked("type: mesh, file: m.gltf"))

    def test_small_files_take_little_memory(self):
        """Loads a grid with one distant point, and a missing scene beside a file of 64 GiB whose name is similar."""
        (self.path / "far.xyz").write_text("0 0 1\n1 1 1\n2 2 1\n3 3 1\n19000000 19000000 1\n", encoding="utf-8")
        self.scene.write_text("objects: [{name: bed, type: heightmap, file: far.xyz, material: sand}]\n", encoding="utf-8")
        with open(self.path / "quax.yaml", "wb") as holes:
            holes.truncate(1 << 36)
        config = self.path / "sonard.yaml"
        config.write_text(CONFIG.replace("quay", "quai"), encoding="utf-8")
        for command, code, words in (([SONARCTL, "scene", "check", self.scene], 65, "19000001 x 19000001 cells"),
                                     ([SONARD, "check", config], 78, "quai.yaml")):
            with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
                error = process.stderr.read()
                _, status, used = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
            self.assertIn(words, error)
            self.assertEqual(process.returncode, code, error)
            self.assertLess(used.ru_maxrss, 300_000, "kB")

    def test_an_imported_box_has_its_echo_where_its_poses_put_it(self):
        said = self.import_quay("--material", "left_rig=concrete")
        for words in ["2 shapes of 3 models", '2 lights: without an echo', 'sensor "eye"', 'plugin "winch"', "rig/rig.sdf:16", ": ok: 2 objects"]:
            self.assertIn(words, said)
        written = self.scene.read_text(encoding="utf-8")
        self.assertIn('#   rig/rig.sdf:16: sensor "eye"', written)
        self.assertIn("material: mud", written)
        self.assertIn(": ok: 2 objects, 2 materials", self.ctl("check", self.scene, "--strict"))

        (self.path / "sonard.yaml").write_text(CONFIG, encoding="utf-8")
        rendered = run(SONARD, "render", self.path / "sonard.yaml", "--out", self.path / "out", "--format", "npy", "--noise", "off")
        self.assertEqual(rendered.returncode, 0, rendered.stderr)
        side = json.loads((self.path / "out/000001.json").read_text(encoding="utf-8"))
        (rows, beams), _, pressure = read_npy(self.path / "out/000001_pressure.npy")
        loudest = max(range(rows * beams), key=pressure.__getitem__)
        true_over_believed = side["water"]["true_sound_speed_mps"] / side["settings"]["device_sound_speed_mps"]
        distance = (side["row_0_m"] + loudest // beams * side["row_spacing_m"]) * true_over_believed
        azimuth = math.degrees(side["beam_azimuth_rad"][loudest % beams])
        self.assertAlmostEqual(distance, 4 - 0.25, delta=0.05)
        self.assertAlmostEqual(azimuth, 15, delta=5)  # half of the plate is 4.6 degrees wide
        middle = min(range(beams), key=lambda b: abs(math.degrees(side["beam_azimuth_rad"][b]) - 15))
        self.assertAlmostEqual(side["truth"]["first_hit_m"][middle], 3.75, delta=0.01)
        self.assertEqual(side["truth"]["object_name"][middle], "left_rig/arm")

    def test_info_is_the_same_for_people_and_programs(self):
        self.import_quay()
        table = self.ctl("info", self.scene)
        self.assertIn("left_rig/arm", table)
        self.assertIn("0.5 x 0.6 x 0.6", table)
        described = json.loads(self.ctl("info", self.scene, "--json"))
        box = next(o for o in described["objects"] if o["name"] == "left_rig/arm")
        for found, wanted in zip(box["centre_m"], (3.863703, 1.035276, -2)):
            self.assertAlmostEqual(found, wanted, places=5)
        self.assertEqual(described["triangles"], sum(o["triangles"] for o in described["objects"]))
        self.assertIn("harbour: ", self.ctl("info", "demo.yaml"))

    def test_a_urdf_moves_as_one(self):
        self.ctl("import", WORLDS / "arm.urdf", "--out", self.scene, "--moving", "arm", "--material", "steel", "--offset", "0,0,-5")
        described = json.loads(self.ctl("info", self.scene, "--json"))
        self.assertEqual(described["moving"], ["arm"])
        fore = next(o for o in described["objects"] if o["name"] == "arm/fore")
        for found, wanted in zip(fore["centre_m"], (0.4, 0, -4.5)):
            self.assertAlmostEqual(found, wanted, places=5)
        self.assertEqual(fore["moves_with"], "arm")

    def test_mistakes_are_one_sentence(self):
        self.assertIn("none.yaml", self.ctl("check", self.path / "none.yaml", code=66))
        self.scene.write_text("objects: [{type: bix}]\n", encoding="utf-8")
        error = self.ctl("check", self.scene, code=65)
        self.assertIn("quay.yaml:1:", error)
        config = self.path / "sonard.yaml"
        config.write_text(CONFIG, encoding="utf-8")
        self.assertIn(error.split("quay.yaml:1:")[1].strip(), run(SONARD, "check", config).stderr)  # the daemon's own words
        self.assertIn("--overwrite", self.ctl("import", WORLDS / "quay.world", "--out", self.scene, code=64))
        world = self.path / "w.sdf"
        world.write_text('<sdf version="1.9"><world name="w">\n<include><uri>model://gone</uri></include></world></sdf>', encoding="utf-8")
        self.assertIn("w.sdf:2: include: models were not found", self.ctl("import", world, "--out", self.path / "o.yaml", code=65))
        self.assertIn("nothing in it has a shape that a scene can hold; left out: w.sdf:2: include of model://gone: not found",
                      self.ctl("import", world, "--out", self.path / "o.yaml", "--skip-missing", code=65))
        self.assertFalse((self.path / "o.yaml").exists())
        (self.path / "o.yaml").write_text("objects: []\n", encoding="utf-8")
        self.assertIn("and --strict", self.ctl("check", self.path / "o.yaml", "--strict", code=65))


if __name__ == "__main__":
    unittest.main()
