"""Tests a host whose daemon stops, starts again, or hangs: the error codes, and that opening the sonar again is sufficient."""
import ctypes
import signal
import time
import unittest

from prefixes import l_targets, prefix

SUCCESS, READ_TIMEOUT, CLOSED, CONNECTION_TIMEDOUT = 0, 1017, 1020, 1015


class Host:
    """One sonar through the 4.x library."""

    def __init__(self, address):
        self.sdk = ctypes.CDLL(prefix(4) / "lib/libbvtsdk.so.4")
        self.sdk.BVTSonar_Create.restype = ctypes.c_void_p
        self.sonar = ctypes.c_void_p(self.sdk.BVTSonar_Create())
        self.head, self.address = ctypes.c_void_p(), address.encode()

    def open(self):
        code = self.sdk.BVTSonar_Open(self.sonar, b"NET", self.address)
        if code == SUCCESS:
            self.sdk.BVTHead_Destroy(self.head)
            code = self.sdk.BVTSonar_GetHead(self.sonar, 0, ctypes.byref(self.head))
        return code

    def ping(self):
        """Returns the code of GetPing; there must be a ping exactly if the code is 0."""
        ping = ctypes.c_void_p(1)
        code = self.sdk.BVTHead_GetPing(self.head, -1, ctypes.byref(ping))
        assert (code == SUCCESS) == bool(ping.value), (code, ping)
        self.sdk.BVTPing_Destroy(ping)
        return code

    def connected(self):
        out = ctypes.c_int(7)
        assert self.sdk.BVTSonar_IsConnected(self.sonar, ctypes.byref(out)) == SUCCESS
        return out.value

    def destroy(self):
        self.sdk.BVTSonar_Destroy(self.sonar)
        self.sdk.BVTHead_Destroy(self.head)


class LostAndBack(unittest.TestCase):
    def test_a_host_continues_after_a_kill_and_a_restart(self):
        with l_targets() as daemon:
            host = Host(daemon.address)
            self.assertEqual(host.open(), SUCCESS)
            self.assertEqual(host.ping(), SUCCESS)
            self.assertEqual(host.connected(), 1)
            daemon.process.kill()
            daemon.process.wait()
            self.assertEqual(host.ping(), CLOSED)
            self.assertEqual(host.ping(), CLOSED)
            self.assertEqual(host.connected(), 0)
            self.assertEqual(host.open(), CONNECTION_TIMEDOUT)
            daemon.restart()
            self.assertEqual(host.open(), SUCCESS)
            self.assertEqual(host.ping(), SUCCESS)
            self.assertEqual(host.connected(), 1)
            host.destroy()

    def test_a_host_notices_a_frozen_sonar(self):
        with l_targets() as daemon:
            host, late = Host(daemon.address), Host(daemon.address)
            self.assertEqual(host.open(), SUCCESS)
            self.assertEqual(host.ping(), SUCCESS)
            daemon.process.send_signal(signal.SIGSTOP)
            try:
                start = time.monotonic()
                self.assertEqual(host.ping(), READ_TIMEOUT)
                self.assertGreater(time.monotonic() - start, 5)
                self.assertEqual(host.connected(), 0)
                self.assertEqual(late.open(), CONNECTION_TIMEDOUT)  # the kernel accepts the connection, no greeting arrives
            finally:
                daemon.process.send_signal(signal.SIGCONT)
            self.assertEqual(host.open(), SUCCESS)
            self.assertEqual(host.ping(), SUCCESS)
            host.destroy()
            late.destroy()

    def test_an_idle_host_keeps_its_connection(self):
        with l_targets() as daemon:
            host = Host(daemon.address)
            self.assertEqual(host.open(), SUCCESS)
            time.sleep(12)  # longer than the sonar waits for a silent host
            self.assertEqual(host.connected(), 1)
            self.assertEqual(host.ping(), SUCCESS)
            host.destroy()


if __name__ == "__main__":
    unittest.main()
