"""Requirements for the judge's reader of each make. A test class has `make`, `messages` (two pings with different samples, each
a list of its datagrams or of one message) and `samples` (the forms in which a driver may publish the first ping)."""
import random
import zlib

import common  # noqa: F401  (the path)

JUNK = random.Random(7)


class Checks:
    step = 1  # bytes between the places where messages are cut
    junk_pieces = ()

    def found(self, *pieces):
        reader = self.reader()
        return [ping for piece in pieces for ping in reader.feed(piece)]

    def crcs(self, message):
        return [ping.crcs for ping in self.found(*message)]

    def shows(self, pings, message):
        """Returns whether `pings` contains a ping of this message."""
        wanted = self.crcs(message)
        assert wanted
        return any(ping.crcs in wanted for ping in pings)

    def junk(self, size):
        noise = bytes(JUNK.randrange(256) for _ in range(size))
        return b"".join(part for piece in (*self.junk_pieces, b"") for part in (noise, piece))

    def test_samples_are_compared(self):
        (ping, *_) = self.found(*self.messages[0])
        for samples in self.samples:
            self.assertIn(zlib.crc32(samples), ping.crcs)
        self.assertEqual(len(ping.crcs), len(self.samples))
        self.assertEqual((ping.rows, ping.beams), self.size)
        self.assertEqual((ping.begin, ping.end), (0, sum(map(len, self.messages[0]))))
        if self.numbers is not None:
            self.assertEqual([one.number for message in self.messages for one in self.found(*message)], self.numbers)
        else:
            twice = [one.number for one in self.found(*self.messages[0], *self.messages[0])]
            self.assertEqual((len(set(twice)), max(twice) < 0), (len(twice), True), "each is a ping of its own")

    def test_junk_is_no_ping(self):
        first, second = self.messages
        for size in (1, 3, 50, 3000):
            junk = self.junk(size)
            pings = self.found(*first, *(junk[at:at + 999] for at in range(0, len(junk), 999)), *second, *second)
            self.assertTrue(self.shows(pings, first) and self.shows(pings, second))
            known = self.crcs(first) + self.crcs(second)
            self.assertTrue(all(ping.crcs in known for ping in pings))


class StreamChecks(Checks):
    def reader(self):
        return self.make.stream()

    def test_every_split_gives_the_same_pings(self):
        (first,), (second,) = self.messages
        stream = self.junk(5) + first + second + self.junk(9) + first
        whole = self.found(stream)
        self.assertGreaterEqual(len(whole), 2)
        for size in (1, 7, 64, 1000):
            self.assertEqual(self.found(*(stream[at:at + size] for at in range(0, len(stream), size))), whole, size)

    def test_a_message_that_lacks_bytes_hides_none(self):
        (first,), (second,) = self.messages
        for cut in range(1, len(first), self.step):
            for whole in (first[:cut], first[:cut // 2] + first[len(first) - cut // 2 - 1:]):
                if len(whole) == len(first):
                    continue
                pings = self.found(whole, second, second)
                self.assertTrue(self.shows(pings, [second]), cut)
                self.assertFalse(self.shows(pings, [first]), cut)


class DatagramChecks(Checks):
    def reader(self):
        return self.make.datagrams()

    def test_datagrams_that_lack_bytes_are_no_pings(self):
        first, second = self.messages
        for place, datagram in enumerate(first):
            for cut in range(1, len(datagram), self.step):
                for cut_up in ([datagram[:cut]], [datagram[cut:]], [datagram[:cut], datagram[cut:]], []):
                    pings = self.found(*first[:place], *cut_up, *first[place + 1:], *second)
                    self.assertFalse(self.shows(pings, first), (place, cut))
                    self.assertTrue(self.shows(pings, second), (place, cut))
