"""Tests the findings of the live view's doctor on drivers that get no pings."""
import contextlib
import socket
import time
import unittest

from foxglove_viewer import Viewer
from oculus_reader import Client, fire_message, reading
from running_sonard import Sonard


class Doctor(unittest.TestCase):
    """Tests that the reason why a driver gets no pings is named soon."""

    @contextlib.contextmanager
    def daemon_and_viewer(self, **options):
        with Sonard(**options) as daemon, Viewer(daemon.address) as viewer:
            viewer.greeted().subscribe("/doctor")
            start = time.monotonic()
            viewer.first_of("/doctor")
            self.assertLess(time.monotonic() - start, 50)
            yield daemon, viewer

    def named(self, viewer, check, *words):
        """Returns the first finding of the check, above level ok, that contains these words."""
        found = []

        def is_it(kind, value):
            if kind != "message":
                return False
            findings = viewer.decode("/doctor", value[2])["findings"]
            found[:] = [f for f in findings if f["check"] == check and f.get("level", 0) > 0 and all(w in f["text"] for w in words)]
            return bool(found) and findings[0].get("level", 0) > 0  # the worst come first

        viewer.wait_for(is_it)
        return found[0]

    @staticmethod
    def name_of(client):
        return "%s:%d" % client.socket.getsockname()

    def test_a_driver_that_never_fires_is_reported(self):
        with self.daemon_and_viewer() as (daemon, viewer):
            self.assertIn(f"point a driver at {daemon.address}, TCP port 52100", viewer.first_of("/doctor")["findings"][0]["cure"])
            with Client(daemon.address) as client:
                finding = self.named(viewer, "driver", self.name_of(client), "has not asked for pings", "sent nothing")
                self.assertEqual((finding["sonar"], finding["client"], finding["level"]), ("front", self.name_of(client), 2))
                client.send(b"PING\r\n")
                self.named(viewer, "driver", "it has sent 6 bytes, no valid fire message among them")
                client.send(fire_message())
                with reading(client):
                    viewer.wait_for(lambda kind, value: kind == "message" and  # a busy machine may make pings late
                                    all(f.get("level", 0) == 0 or f["check"] != "driver"
                                        for f in viewer.decode("/doctor", value[2])["findings"]))
            self.named(viewer, "driver", "No driver is connected to front", "left at")

    def test_a_driver_on_a_wrong_address_is_reported(self):
        with self.daemon_and_viewer() as (daemon, viewer):
            for port in (52100, 52101):
                with contextlib.suppress(ConnectionRefusedError):
                    socket.create_connection(("127.0.0.1" if port == 52100 else daemon.address, port)).close()
            finding = self.named(viewer, "address", " of programs of this computer failed")
            self.assertIn(f"point the driver at {daemon.address}, TCP port 52100", finding["cure"])
            with socket.create_server(("127.99.0.1", 52100)) as other, socket.create_connection(other.getsockname()):
                self.named(viewer, "address", "is connected to 127.99.0.1:52100, which is not a sonar")

    def test_a_driver_that_does_not_read_is_reported(self):
        with self.daemon_and_viewer() as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            self.named(viewer, "read", self.name_of(client), "has not read for")

    def test_a_refused_driver_is_reported(self):
        with self.daemon_and_viewer() as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            with reading(client), Client(daemon.address) as other:
                self.assertEqual(other.socket.recv(1), b"")
                finding = self.named(viewer, "places", self.name_of(other), "was refused", self.name_of(client))
                self.assertIn("clients.max", finding["cure"])

    def test_standby_and_faults_are_reported(self):
        with self.daemon_and_viewer(arguments=["--faults"]) as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message(rate_hz=0))
            self.named(viewer, "standby", "set by " + self.name_of(client))
            self.assertGreater(viewer.set("/faults/power_cycle", 20), 19)
            self.named(viewer, "fault", "power-cycle")

    def test_the_reason_why_stepped_time_waits_is_reported(self):
        with self.daemon_and_viewer(arguments=["--clock", "stepped"]) as (daemon, viewer), Client(daemon.address) as client:
            client.send(fire_message())
            self.named(viewer, "clock", "Time stands still at", f"it moves when {self.name_of(client)} has taken ping", "has not read for")


if __name__ == "__main__":
    unittest.main()
