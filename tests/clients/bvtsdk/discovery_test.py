"""Tests which sonars the discovery agent finds: those of this machine always, others if BVE_DISCOVERY names them."""
import ctypes
import os
import socket
import threading
import time
import unittest

from prefixes import l_targets, prefix

DISCOVERY_PORT = 14751


class Discovery(unittest.TestCase):
    def setUp(self):
        os.environ.pop("BVE_DISCOVERY", None)
        self.sdk = ctypes.CDLL(prefix(4) / "lib/libbvtsdk.so.4")

    def found(self, wanted, patience_s):
        """Returns the agent's addresses as soon as all wanted ones are known, or when the time is over."""
        agent = self.sdk.BVTSonarDiscoveryAgent_Create()
        self.assertEqual(self.sdk.BVTSonarDiscoveryAgent_Start(agent), 0)
        addresses, deadline = set(), time.monotonic() + patience_s
        while not wanted <= addresses and time.monotonic() < deadline:
            time.sleep(0.1)
            count = ctypes.c_int()
            self.sdk.BVTSonarDiscoveryAgent_GetSonarCount(agent, ctypes.byref(count))
            for i in range(count.value):
                text = ctypes.create_string_buffer(20)
                self.assertEqual(self.sdk.BVTSonarDiscoveryAgent_GetSonarInfo(agent, i, text, 20), 0)
                addresses.add(text.value.decode())
        self.sdk.BVTSonarDiscoveryAgent_Destroy(agent)
        return addresses

    def test_sonars_of_this_machine_are_found_without_being_named(self):
        with l_targets() as first, l_targets() as second:
            wanted = {first.address, second.address}
            self.assertLessEqual(wanted, self.found(wanted, 20))

    def test_a_sonar_without_broadcasts_is_found_by_its_name(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sonar:
            address = "127.0.0.9"
            sonar.bind((address, DISCOVERY_PORT))
            sonar.settimeout(30)

            def answer():
                question, host = sonar.recvfrom(100)
                self.assertEqual(question, b"BVE?\x01\0")
                sonar.sendto(b"BVE!\x01\0\x9e\x39", host)

            self.assertNotIn(address, self.found({address}, 1.5))
            thread = threading.Thread(target=answer)
            thread.start()
            os.environ["BVE_DISCOVERY"] = f"127.0.0.99, {address}"
            self.assertIn(address, self.found({address}, 20))
            thread.join()


if __name__ == "__main__":
    unittest.main()
