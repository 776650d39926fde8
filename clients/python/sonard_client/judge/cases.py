"""The table of cases. run_case.py runs them; verdicts.py judges them.

row(NUMBER, given, DURATION, SENTENCE, ...). NUMBER begins with the code of the kind of fault. DURATION is "2 s", "3 pings",
"once" or "5 times".
at      when the fault begins: "ping 6" (the default), "every 5 pings", "start" (before the driver connects)
limit seconds after the fault's end within which the driver must have recovered
must    limits of this case in addition to those of all cases (verdicts.judge): {"rss_mib": 64}
given   parameters that `sonarctl fault kinds` lists; "byte" is an offset in the ping, which becomes a fraction of its size
should  limits that replace those of verdicts.SHOULD; None removes one
notice  the driver should notice the fault (by its log, a state or a new connection), because the outage is longer than 2 s
info    the result is shown but not counted, because real devices differ or are unknown
measured  the case is in the table of measured drivers
"""
from __future__ import annotations

import dataclasses
import random
from typing import Any, Dict, List, Mapping, Optional, Sequence

from .. import lab

FAMILIES = {"N": "Nothing wrong", "L": "Link and connection", "S": "Shaping of the stream", "F": "Framing and integrity",
            "D": "Device state and settings", "U": "Discovery and status", "T": "Time", "M": "Several clients",
            "P": "The picture", "B": "BlueView link", "G": "Pings as datagrams"}

NAMES = dict(item.split(" ") for item in """N00 nominal
L01 port-closed,L02 close-at-boundary,L03 close-mid-message,L04 reset,L05 silent-open,L06 vanished-peer,L07 accepted-not-served
L09 no-answer,L10 power-cycle,L11 flapping,L13 thin-link,L14 latency,L16 mtu-hole,L17 address-lost,L18 one-way,L19 loss-above-rate
S01 slices,S02 split-header,S03 coalesced,S04 burst,S06 pause-inside,S07 largest-frame
F01 garbage-between,F02 bad-magic,F03 length-short,F04 length-long,F05 length-absurd,F06 short-last-row,F07 image-size-lie
F08 image-offset-lie,F10 dimension-extremes,F11 sample-type-unknown,F12 unknown-message,F13 version-switch,F14 wrong-device-id
F15 duplicate,F16 gap,F19 bit-flip,F20 false-sync,F22 empty-payload,F24 mid-message-join
D01 config-ignored,D02 config-late,D03 config-clamped,D04 echo-missing-field,D05 config-forgotten,D06 rate-deviates,D07 id-wrap
D08 id-reset,D11 sample-width-switch,D12 gain-rows-switch,D13 beam-count-switch,D14 range-switch,D15 frequency-switch,D16 hot
D17 thermal-stop,D18 transmit-fail,D19 boot-or-paused,D21 part-number,D22 mute-until-fired,D26 env-values-wild,D27 scale-zero
D28 bearing-table,D31 announced-shutdown
U01 never-announced,U02 status-gap,U03 status-short,U04 status-long,U05 wrong-address-inside,U06 address-conflict,U07 two-devices
U08 foreign-status,U12 foreign-datagrams,U13 late-first-status
T01 jump-forward,T02 jump-back,T03 frozen,T04 constant-offset,T05 drift,T06 wrap,T08 restart-at-connect,T10 delayed-delivery
T11 slow,T12 pacing-jitter
M01 second-refused,M02 take-over,M03 queued-silently,M04 config-fight,M05 slow-reader-policy,M06 zero-window,M08 no-free-slot
M09 rejects-host-message,M10 reconnect-storm
P01 stuck,P02 blank,P03 saturated,P04 noise,P05 dead-beams,P06 spokes,P09 mirrored,P11 missing-ranges,P12 plausible-wrong
P13 intermittent
B01 open-refused,B02 open-silent,B04 ping-timeout,B05 link-lost-in-ping,B06 late-reply,B08 heads-changed,B09 set-clamped
B10 clock-skew,B12 version-or-type,B13 bad-compression,B15 recording-cut
G01 part-lost,G02 parts-reordered,G03 part-twice,G04 last-part-never,G05 part-of-older-frame,G06 ip-fragment-lost
G07 multicast-join-lost""".replace("\n", ",").split(","))

TROUBLES = {"bad-connector": "L11 S06", "thin-tether": "L13 L14 S04", "power-cycle": "L10", "wrong-subnet": "U05 L18",
            "lease-renewal": "L17", "second-operator": "M02 M04 U09", "other-firmware": "F13 D20 D21 F12", 
            "overheating": "D16 D17", "clock-step": "T01 T02 T08", "electrical-noise": "P06 F01 F19", "mounted-wrong": "P09",
            "deaf-head": "P02 P05 P13"}


@dataclasses.dataclass(frozen=True)
class Case:
    number: str
    kind: str                       # catalogue code
    sentence: str                   # what happens to the driver
    given: Mapping[str, str]        # parameters of the fault
    duration: str                   # "2 s", "3 pings", "once"
    at: str = "ping 6"
    limit: float = 15.0
    must: Mapping[str, float] = dataclasses.field(default_factory=dict)
    should: Mapping[str, Optional[float]] = dataclasses.field(default_factory=dict)
    notice: bool = False
    info: bool = False
    measured: bool = False

    @property
    def name(self) -> str:
        return NAMES[self.kind]

    @property
    def family(self) -> str:
        return self.number[0]

    @property
    def needs_lab(self) -> bool:
        return self.kind in lab.FAULTS

    @property
    def expectation(self) -> str:
        if self.info:
            return "INFO"
        return "MUST" + (", also of " + ", ".join(sorted(self.must)) if self.must else "") + "; SHOULD"

    def until(self) -> Dict[str, float]:
        """Returns the duration as a field of a fault record."""
        count, _, unit = self.duration.replace("once", "1 times").partition(" ")
        return {{"s": "seconds", "pings": "pings", "times": "count"}[unit]: float(count) if unit == "s" else int(count)}

    def begin(self) -> Dict[str, Any]:
        word, _, rest = self.at.partition(" ")
        if word == "every":
            return {"every": int(rest.split()[0])}
        return {"ping": {"ping": int(rest or 0)}, "start": {}}[word]

    @property
    def times(self) -> int:
        """How often the fault begins."""
        return int(self.until().get("count", 1)) if self.at.startswith("every") else 1

    @property
    def tail_s(self) -> float:
        """How long the fault still acts after its end in the journal. The journal ends a pause (S06) at the interrupted ping."""
        return float(self.given["seconds"]) if self.kind == "S06" else 0.0

    def record(self) -> Dict[str, Any]:
        """Returns the fault record for sonard."""
        return {"name": "case", "do": self.kind, "with": dict(self.given), "at": self.begin(), "for": self.until()}


def row(number: str, given: Dict[str, Any], duration: str, sentence: str, **more: Any) -> Case:
    return Case(number, number.partition(".")[0], sentence, {k: str(v) for k, v in given.items()}, duration, **more)


_FREE = {"lost": None}                        # the fault itself loses pings
_LONG = {"recover_s": 5.0, "lost": None}      # a reboot takes a few seconds
_CHANGED = {"lost": None, "rss_mib": 64.0}    # pings of another size need new buffers
_LEAN = {"rss_mib": 256.0}                    # for `must`: a driver must not allocate the size that a length field states

CASES: List[Case] = [
    row("N00.1", {}, "2 s", "Nothing is wrong.", measured=True),

    row("L01.1", {}, "2 s", "The TCP port closes while the status continues; connections are refused for 2 s.",
        measured=True),
    row("L01.2", {}, "6 s", "The TCP port closes while the status continues; connections are refused for 6 s.", notice=True),
    row("L01.3", {}, "2 s", "The port is closed when the driver starts.", at="start"),
    row("L02.1", {}, "once", "The sonar closes the connection between two pings (FIN).", measured=True),
    row("L02.2", {}, "5 times", "The sonar closes five connections (FIN), one every 8 pings: no descriptor may leak.",
        at="every 8 pings", must={"descriptors": 2}),
    row("L03.1", {"fraction": 0.5}, "once",
        "The connection ends in the middle of a ping: a driver must not join it with later bytes."),
    row("L03.2", {"byte": 8}, "once", "The connection ends inside a header."),
    row("L03.3", {"fraction": 0.999}, "once", "The connection ends just before the end of a ping."),
    row("L04.1", {}, "once", "The sonar resets the connection between two pings (RST).", measured=True),
    row("L04.2", {"fraction": 0.5}, "once", "The sonar resets the connection in the middle of a ping."),
    row("L05.1", {}, "2 s", "The connection stays open but silent for 2 s."),
    row("L05.2", {}, "6 s", "The connection stays open but silent for 6 s; the status continues.", notice=True),
    row("L05.3", {"keep-status": "no"}, "4.5 s", "The connection stays open, stream and status are silent for 4.5 s.",
        notice=True),
    row("L05.4", {}, "12 s", "The connection stays open but silent for 12 s.", notice=True, measured=True),
    row("L06.1", {}, "4 s", "The cable is pulled for 4 s: no packet passes.", notice=True),
    row("L06.2", {}, "11 s", "The cable is pulled for 11 s.", notice=True),
    row("L07.1", {}, "2.5 s", "The sonar accepts the connection but serves nothing for 2.5 s after start.", at="start"),
    row("L09.1", {}, "2.5 s", "Connections are not answered for 2.5 s while the driver starts.", at="start"),
    row("L09.2", {"answer": "unreachable"}, "2.5 s", "The host is reported unreachable for 2.5 s while the driver starts.",
        at="start"),
    row("L10.1", {"boot-s": 5, "gap-s": 1.5}, "once",
        "The sonar reboots: it resets connections, is silent for 5 s, sends status, accepts TCP 1.5 s later, with its own settings.",
        should=_LONG, notice=True, measured=True),
    row("L10.2", {"boot-s": 5, "gap-s": 7}, "once",
        "The sonar reboots: it resets connections, is silent for 5 s, sends status, accepts TCP 7 s later, with its own settings.",
        should=_LONG, notice=True, measured=True),
    row("L10.3", {"boot-s": 3, "gap-s": -1}, "once",
        "The sonar reboots: it resets connections, is silent for 2 s, accepts TCP, sends status 1 s later, with its own settings.",
        should=_LONG, notice=True),
    row("L13.1", {"mbit-per-s": 2}, "3 s", "The link carries only 2 Mbit/s for 3 s.", should=_FREE),
    row("L14.1", {"ms": 400}, "2 s", "Everything arrives 400 ms late."),
    row("L14.2", {"ms": 200, "jitter-ms": 150}, "2 s", "Everything arrives 50 to 350 ms late."),
    row("L16.1", {"bytes": 600}, "3 s",
        "Packets above 600 bytes vanish for 3 s, small ones pass: the sonar gives the connection up, unknown to the driver.",
        notice=True),
    row("L17.1", {"side": "device"}, "3 s", "The sonar loses its address for 3 s and gets it back.", notice=True),
    row("L17.2", {"side": "host"}, "3 s", "The driver's computer loses its address for 3 s and gets it back.", notice=True),
    row("L18.1", {"what": "all"}, "3 s", "For 3 s nothing from the driver reaches the sonar.", notice=True),
    row("L18.2", {"what": "commands"}, "2.5 s", "For 2.5 s after start commands do not reach the sonar, everything else does.",
        at="start", should=_FREE),
    row("L19.1", {"mbit": 2}, "3 s", "Traffic above 2 Mbit/s is lost for 3 s.", should=_FREE),

    row("S01.1", {"bytes": 701}, "2 s", "The stream arrives in slices of 701 bytes.", measured=True),
    row("S01.2", {"bytes": 67}, "1 s", "The stream arrives in slices of 67 bytes."),
    row("S02.1", {"offset": 1}, "5 pings", "Each header arrives in two parts, the first of 1 byte."),
    row("S02.2", {"offset": 10}, "5 pings", "Each header arrives in two parts, cut before the length."),
    row("S02.3", {"offset": 15}, "5 pings", "Each header arrives in two parts, the second of 1 byte."),
    row("S03.1", {"pings": 3}, "2 s", "Three messages arrive in one piece."),
    row("S04.1", {}, "1 s", "Pings are held back for 1 s and arrive at once.", should=_FREE),
    row("S06.1", {"seconds": 0.2}, "5 pings", "The stream pauses for 0.2 s inside a ping."),
    row("S06.2", {"seconds": 1}, "once", "The stream pauses for 1 s inside a ping."),
    row("S06.3", {"seconds": 3}, "once", "The stream pauses for 3 s inside a ping."),
    row("S06.4", {"seconds": 11}, "once", "The stream pauses for 11 s inside a ping.", notice=True),
    row("S07.1", {}, "2 s", "The largest pings of the product, back to back.", should={"lost": None, "rss_mib": 128.0}),

    row("F01.1", {"bytes": 1, "fill": "zero"}, "once", "One byte 00 between two pings.", measured=True),
    row("F01.2", {"bytes": 16, "fill": "zero"}, "once", "16 bytes 00 between two pings.", measured=True),
    row("F01.3", {"bytes": 1, "fill": "S"}, "once", "One byte 53, half of the magic, between two pings.", measured=True),
    row("F01.4", {"bytes": 2, "fill": "SO"}, "once", "The magic alone between two pings."),
    row("F01.5", {"bytes": 4096, "fill": "random"}, "once", "4096 random bytes between two pings."),
    row("F01.6", {"bytes": 80, "fill": "ascii"}, "10 pings", "A line of text before each of ten pings.", should=_FREE),
    row("F02.1", {}, "once", "A ping with a wrong magic."),
    row("F03.1", {"add": -100}, "once", "The header of a ping states 100 bytes too few."),
    row("F03.2", {"add": -1}, "once", "The header of a ping states 1 byte too few."),
    row("F04.1", {"add": 100}, "once", "The header of a ping states 100 bytes too many."),
    row("F04.2", {"add": 65536}, "once", "The header of a ping states 65,536 bytes too many."),
    row("F05.1", {"value": 0xFFFFFFF0}, "once", "A length of FFFFFFF0.", must=_LEAN, measured=True),
    row("F05.2", {"value": 0xFFFFFFFF}, "once", "A length of FFFFFFFF.", must=_LEAN),
    row("F05.3", {"value": 0x7FFFFFFF}, "once", "A length of 7FFFFFFF.", must=_LEAN),
    row("F05.4", {"value": 0}, "once", "A length of 0 before a whole ping.", must=_LEAN),
    row("F05.5", {"value": 1}, "once", "A length of 1 before a whole ping.", must=_LEAN),
    row("F06.1", {"lengths": "undeclared"}, "once", "The last row of a ping is missing, but its lengths include it.",
        measured=True),
    row("F06.2", {"lengths": "declared"}, "once", "The last row of a ping is missing, and its lengths exclude it."),
    row("F07.1", {}, "once", "The size of the image does not fit its rows and beams."),
    row("F08.1", {"value": 0}, "once", "The header states that the image begins at offset 0."),
    row("F08.2", {"value": 0xFFFFFF00}, "once", "The header states that the image begins far after the end."),
    row("F10.1", {"field": "rows", "value": 65535}, "once", "A ping states that it has 65535 rows.", must=_LEAN, measured=True),
    row("F10.2", {"field": "rows", "value": 0}, "once", "A ping states that it has no rows."),
    row("F10.3", {"field": "beams", "value": 65535}, "once", "A ping states that it has 65535 beams.", must=_LEAN),
    row("F10.4", {"field": "beams", "value": 0}, "once", "A ping states that it has no beams."),
    row("F10.5", {"field": "beams", "value": 1}, "once", "A ping states that it has one beam."),
    row("F11.1", {"value": 9}, "once", "A ping with an unknown type of samples."),
    row("F12.1", {"type": 0x99, "bytes": 100}, "5 times", "Messages of an unknown type, 100 bytes.", at="every 3 pings"),
    row("F12.2", {"type": 0x99, "bytes": 0}, "once", "A message of an unknown type without content."),
    row("F12.3", {"type": 0x99, "bytes": 65536}, "once", "A message of an unknown type, 64 KiB."),
    row("F13.1", {"value": 3}, "10 pings", "Pings of an unknown version 3.", should=_FREE),
    row("F14.1", {}, "10 pings", "Ten pings from a wrong device id.", should=_FREE, measured=True),
    row("F15.1", {}, "once", "A ping arrives twice."),
    row("F15.2", {}, "10 pings", "Ten pings arrive twice each."),
    row("F16.1", {}, "5 pings", "Five pings are missing; ping numbers count them."),
    row("F19.1", {"region": "header", "bits": 1}, "5 times", "A flipped bit in the header of five pings.", at="every 4 pings",
        should=_FREE),
    row("F19.2", {"region": "metadata", "bits": 8}, "5 times", "Flipped bits in the fields of five pings.", at="every 4 pings",
        should=_FREE),
    row("F19.3", {"region": "image", "bits": 64}, "5 pings", "Flipped bits in the image: not detectable, the stream must continue."),
    row("F20.1", {"bytes": 16, "fill": "FF"}, "once", "16 bytes that begin with the magic, then FF: a false header.", must=_LEAN,
        measured=True),
    row("F20.2", {"bytes": 512, "fill": "magic"}, "once", "512 bytes full of the magic between two pings."),
    row("F22.1", {}, "5 times", "Headers without content.", at="every 3 pings"),
    row("F24.1", {"fraction": 0.5}, "2 s", "New connections begin in the middle of a ping.", at="start"),

    row("D01.1", {}, "3 s", "Commands are ignored for 3 s after start.", at="start", should=_FREE),
    row("D02.1", {"seconds": 6.5}, "8 s", "Commands take effect after 6.5 s.", at="start",
        should={"recover_s": 8.0, "lost": None}),
    row("D03.1", {"range-m": 3}, "2 s", "The sonar limits the range that the driver requests.", at="start", should=_CHANGED),
    row("D04.1", {}, "10 pings", "The echo of the ping rate is missing."),
    row("D05.1", {}, "once", "The sonar forgets its settings and returns to the factory's, on the same connection.",
        should=_CHANGED),
    row("D06.1", {"factor": 0.4}, "2.5 s", "The sonar pings at 40 % of the requested rate."),
    row("D07.1", {}, "10 pings", "The ping number wraps around 32 bits."),
    row("D08.1", {}, "10 pings", "The ping number begins again at 0, on the same connection.", measured=True),
    row("D11.1", {"value": 16}, "2 s", "Samples change from 8 to 16 bits and back.", should=_CHANGED),
    row("D11.2", {"value": 32}, "2 s", "Samples change from 8 to 32 bits and back.", should=_CHANGED),
    row("D12.1", {}, "2 s", "For 2 s each row begins with a gain.", should=_CHANGED),
    row("D13.1", {"value": 512}, "2 s", "The number of beams changes for 2 s.", should=_CHANGED),
    row("D14.1", {"value": 4}, "2 s", "Another range for 2 s.", should=_CHANGED),
    row("D15.1", {}, "2 s", "The other frequency for 2 s.", should=_CHANGED),
    row("D16.1", {}, "2.5 s", "The status reports over-temperature and pings come slower."),
    row("D17.1", {}, "3 s", "Thermal shutdown: no pings for 3 s, the connection stays.", notice=True),
    row("D18.1", {}, "2.2 s", "The status reports a failed transmitter."),
    row("D19.1", {}, "2.2 s", "The status reports the boot loader.", measured=True),
    row("D19.2", {"set-bits": "0x13"}, "2.2 s", "The status reports a pause, with its reason."),
    row("D21.1", {"value": 65535}, "2.2 s", "The status reports an unknown product."),
    row("D22.1", {}, "2.5 s", "The sonar sends only dummy messages for 2.5 s after start.", at="start", should=_FREE),
    row("D26.1", {"value": "nan"}, "5 pings", "Temperature and pressure are not numbers."),
    row("D26.2", {"value": "huge"}, "5 pings", "Temperature and pressure are 1e308."),
    row("D27.1", {"field": "range_resolution", "value": "zero"}, "5 pings", "The size of a row is 0 m.", should=_FREE),
    row("D27.2", {"field": "sound_speed", "value": "nan"}, "5 pings", "The speed of sound is not a number.", should=_FREE),
    row("D28.1", {"how": "reversed"}, "5 pings", "The bearings are reversed."),
    row("D28.2", {"how": "zero"}, "5 pings", "All bearings are 0."),

    row("U01.1", {}, "2.5 s", "No status at all for 2.5 s, TCP works."),
    row("U02.1", {}, "4.5 s", "No status for 4.5 s, pings continue."),
    row("U02.2", {}, "8 s", "No status for 8 s, pings continue.", measured=True),
    row("U03.1", {}, "2.5 s", "Every status is 1 byte too short for 2.5 s.", measured=True),
    row("U03.2", {}, "1 s", "One status is 1 byte too short.", measured=True),
    row("U03.3", {}, "3 s", "Every status is 1 byte too short when the driver starts.", at="start"),
    row("U04.1", {}, "2.2 s", "Every status is 1 byte too long for 2.2 s.", measured=True),
    row("U05.1", {"address": "zero"}, "2.2 s", "The status names the address 0.0.0.0."),
    row("U06.1", {}, "2.2 s", "Two devices announce the same address."),
    row("U07.1", {}, "2.2 s", "A second device announces itself."),
    row("U08.1", {}, "2.2 s", "A foreign sender sends the status."),
    row("U12.1", {}, "2.2 s", "Datagrams of other protocols arrive on the status port."),
    row("U13.1", {}, "2.5 s", "The first status comes 2.5 s late.", at="start"),

    row("T01.1", {"seconds": 3600}, "2 s", "The sonar's clock jumps an hour ahead, and back after 2 s."),
    row("T02.1", {"seconds": -5}, "2 s", "The sonar's clock jumps back by 5 s."),
    row("T03.1", {}, "2 s", "The sonar's clock stops for 2 s."),
    row("T04.1", {"seconds": 37}, "2 s", "The sonar's clock is 37 s ahead."),
    row("T05.1", {"ppm": 500}, "2 s", "The sonar's clock drifts by 500 ppm."),
    row("T06.1", {}, "2 s", "The sonar's clock wraps around."),
    row("T08.1", {}, "once", "The sonar's clock begins again at 0."),
    row("T10.1", {"ms": 800}, "2.2 s", "Pings arrive 0.8 s late with right stamps.", should=_FREE),
    row("T11.1", {"factor": 0.25}, "2.5 s", "Pings come at a quarter of the rate."),
    row("T12.1", {}, "2 s", "Pings come unevenly."),

    row("M01.1", {}, "2 s", "The sonar refuses new clients for 2 s after start.", at="start"),
    row("M02.1", {}, "2 s", "Another client takes the connection over.", info=True),
    row("M03.1", {}, "2 s", "The sonar queues new clients silently for 2 s after start.", at="start"),
    row("M04.1", {}, "2 s", "Another client commands other settings.", should=_CHANGED),
    row("M05.1", {}, "2.2 s", "The sonar drops pings of slow readers.", should=_FREE),
    row("M06.1", {}, "2 s", "The sonar limits the data that wait for a client that does not read.", should=_FREE),
    row("M08.1", {}, "2 s", "No slot is free: new connections are reset for 2 s after start.", at="start"),
    row("M09.1", {}, "2 s", "For 2 s after start the sonar closes the connection on every command.", at="start"),
    row("M10.1", {}, "3 s", "For 3 s after start every connection ends after half a second.", at="start",
        must={"descriptors": 2}, should=_FREE),

    row("P01.1", {}, "10 pings", "The picture does not change; the numbers continue."),
    row("P02.1", {}, "5 pings", "The picture is black."),
    row("P03.1", {}, "5 pings", "The picture is saturated."),
    row("P04.1", {}, "5 pings", "The picture is noise."),
    row("P05.1", {}, "5 pings", "Some beams are dead."),
    row("P06.1", {}, "5 pings", "Some beams are bright over all ranges."),
    row("P09.1", {}, "5 pings", "The picture is mirrored."),
    row("P11.1", {}, "5 pings", "The far rows are empty."),
    row("P12.1", {"factor": 0.97}, "5 pings", "All ranges are 3 % wrong."),
    row("P13.1", {}, "10 pings", "The picture comes and goes."),

    row("B01.1", {}, "3 s", "The head refuses connections for 3 s.", at="start"),
    row("B02.1", {}, "3 s", "The head accepts but never greets for 3 s.", at="start"),
    row("B04.1", {}, "3 s", "Replies come after the time-out."),
    row("B05.1", {}, "once", "The link is lost inside a ping."),
    row("B06.1", {}, "once", "A reply arrives during the next request."),
    row("B08.1", {}, "once", "The heads have changed after a reconnection."),
    row("B09.1", {}, "3 s", "Settings are clamped."),
    row("B10.1", {"seconds": 3}, "3 s", "The head's clock is 3 s off."),
    row("B12.1", {}, "once", "A message of an unknown version."),
    row("B13.1", {}, "once", "The compressed size is wrong.", must=_LEAN),
    row("B15.1", {}, "once", "A recording is cut."),

    *(row(f"{code}.1", {}, "5 pings", sentence) for code, sentence in (
        ("G01", "A part of a ping is lost."), ("G02", "Parts of a ping are out of order."), ("G03", "A part arrives twice."),
        ("G04", "The last part never comes."), ("G05", "A part belongs to an older ping."))),
    row("G06.1", {}, "3 s", "Fragments of datagrams are lost."),
    row("G07.1", {}, "3 s", "The driver's membership in the multicast group is lost."),
]

HEAD_BYTES = (*range(1, 17), *range(20, 128, 6))  # the header; the fields after it
TORTURES = (("L03", "The connection ends (FIN) at byte {} of a ping.", {}),
            ("L04", "The connection is reset at byte {} of a ping.", {}),
            ("S06", "The stream pauses for 0.3 s at byte {} of a ping.", {"seconds": "0.3"}))


def torture(seed: int, shallow: Optional[int] = None) -> List[Case]:
    """Makes cases that cut, reset or pause the stream at each byte of the header and in the fields, bearings and image. `shallow`
    limits their number; the seed selects them."""
    fractions = [f"{tenth / 10:g}" for tenth in range(1, 10)]
    found = []
    for kind, sentence, given in TORTURES:
        for place in [*map(str, HEAD_BYTES), *fractions]:
            where = {"fraction" if "." in place else "byte": place}
            words = sentence.replace("byte {}", f"{float(place) * 100:g} %") if "." in place else sentence.format(place)
            found.append(Case(f"{kind}.T{place}", kind, words, {**given, **where}, "once"))
    if shallow is not None and shallow < len(found):
        keep = sorted(random.Random(f"torture {seed}").sample(range(len(found)), shallow))
        found = [found[i] for i in keep]
    return found


def select(wanted: Sequence[str], cases: Sequence[Case] = ()) -> List[Case]:
    """Returns the cases with the wanted numbers, codes, family letters or names; all if `wanted` is empty. Raises ValueError."""
    cases = cases or CASES
    if not wanted:
        return list(cases)
    chosen = set()
    for word in wanted:
        key = word.strip()
        codes = TROUBLES.get(key.lower(), "").split() or [key.upper()]
        hits = [c.number for c in cases if c.number.upper() == key.upper() or c.kind in codes or c.family in codes or
                c.name == key.lower()]
        if not hits:
            raise ValueError(f"--case {word}: no such case; `--list` shows numbers (L05.2), codes (L05), families (L) and names "
                             f"(silent-open)")
        chosen.update(hits)
    return [case for case in cases if case.number in chosen]


def listing(cases: Sequence[Case]) -> str:
    """Returns a line for each case: number, name, expectation, sentence."""
    lines = []
    family = ""
    for case in cases:
        if case.family != family:
            family = case.family
            lines.append(f"{family}  {FAMILIES[family]}")
        marks = ("  [measured]" if case.measured else "") + ("  [needs namespaces]" if case.needs_lab else "")
        lines.append(f"  {case.number:<8} {case.name:<22} {'INFO' if case.info else 'MUST SHOULD':<12} {case.sentence}{marks}")
    lines.append(f"{len(cases)} cases of {len({c.kind for c in cases})} kinds")
    return "\n".join(lines)
