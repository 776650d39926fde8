"""Tests notes on valid settings that are probably mistakes: in sonard check, the log, sonarctl doctor and status."""
import pathlib
import tempfile
import unittest

from running_sonard import SONARCTL, SONARD, Sonard, run


class Notes(unittest.TestCase):
    def test_check_notes_probable_mistakes_and_succeeds(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            ship = ["v 0 0 0", "v 1200 0 0", "v 0 300 0", "v 0 0 250", "f 1 2 3", "f 1 2 4"]
            (folder / "ship.obj").write_text("\n".join(ship) + "\n", encoding="utf-8")
            (folder / "scene.yaml").write_text(
                "objects:\n  - {name: bed, type: seabed, material: sand, size_m: [40, 40], pose: {xyz_m: [0, 0, -6]}}\n"
                "  - {name: ship, type: mesh, file: ship.obj, material: steel, pose: {xyz_m: [0, 0, -6]}}\n", encoding="utf-8")
            (folder / "dive.tum").write_text("# frame: ENU_FLU\n" + "".join(
                f"{i} 0 0 -3 0.9848 0 0 0.1736\n" for i in range(20)), encoding="utf-8")
            (folder / "sonard.yaml").write_text(
                "world: {scene: scene.yaml}\n"
                "vehicles: [{name: rov, trajectory: dive.tum}, {name: boat, initial_pose: {frame: ENU_FLU, xyz_m: [0, 0, 5]}}]\n"
                "sonars:\n"
                "  - {name: front, profile: oculus-m1200d, vehicle: rov, bind_ip: 127.0.0.2,\n"
                "     mount: {frame: FRD, rpy_deg: [180, 0, 0]}}\n"
                "  - {name: mast, profile: oculus-m750d, vehicle: boat, bind_ip: 127.0.0.3}\n", encoding="utf-8")
            checked = run(SONARD, "check", folder / "sonard.yaml")
        self.assertEqual(checked.returncode, 0, checked.stderr)
        notes = [line for line in checked.stdout.splitlines() if line.startswith("note: ")]
        self.assertEqual(len(notes), 4, checked.stdout)
        for words in ("sonar front is mounted upside down", "ship is 1200 m long", "the quaternions of dive.tum turn rov over",
                      "the sonar of boat is 5.0 m above the water's surface"):
            self.assertTrue(any(words in note for note in notes), (words, notes))

    def test_doctor_reports_the_notes_for_a_running_daemon(self):
        with Sonard(pose="{frame: NED_FRD, xyz_m: [0, 0, -4]}") as daemon:
            self.assertIn("the sonar of rov is 4.0 m above the water's surface (z = 0)", daemon.log())
            control = f"{daemon.address}:14770"
            result = run(SONARCTL, "doctor", daemon.address, "--status-on", daemon.address, "--control", control,
                         "--within", "40")
            self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
            self.assertIn("warn  the sonar of rov is 4.0 m above the water's surface", result.stdout)
            self.assertNotIn("ok    poses of rov", result.stdout)
            self.assertIn("note      the sonar of rov is 4.0 m above", run(SONARCTL, "status", "--control", control).stdout)


if __name__ == "__main__":
    unittest.main()
