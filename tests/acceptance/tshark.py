"""Runs tshark with the Oculus dissector and reads its output."""
import os
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree as ElementTree

from running_sonard import ROOT

DISSECTOR = ROOT / "protocol/oculus/oculus.lua"
# The dissector makes these from other fields, or from parts of a field; other code checks them.
DERIVED = ("oculus.length", "oculus.ping.bits", "oculus.ping.firstBearing", "oculus.ping.lastBearing", "oculus.ping.bearing",
           "oculus.ping.filler", "oculus.ping.image", "oculus.ping.rowGain", "oculus.log.text", "oculus.payload", "oculus.junk")
DERIVED_PARTS = ("oculus.fire.flags.", "oculus.fire.extFlags.", "oculus.status.status.")


def tshark(*arguments, dissector=DISSECTOR):
    """Returns the standard output; fails after an error message of Lua or tshark. Ignores the user's preferences and plug-ins."""
    with tempfile.TemporaryDirectory() as empty:
        done = subprocess.run(["tshark", *[str(a) for a in arguments], "-n", "-X", f"lua_script:{dissector}"],
                              env=os.environ | {"HOME": empty, "XDG_CONFIG_HOME": empty, "TZ": "UTC"}, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=120, check=False)
    for text in (done.stdout, done.stderr):
        for complaint in ("Lua Error:", "Lua: ", "[Dissector bug", "[Malformed Packet"):
            place = text.find(complaint)
            assert place < 0, text[max(0, place - 300):place + 700]
    assert done.returncode == 0, f"tshark ended with {done.returncode}: {done.stderr}"
    return done.stdout


def why_not():
    """Returns the reason if no tshark with Lua can run here; else None."""
    if shutil.which("tshark") is None:
        return "tshark is not installed (Debian: apt-get install tshark)"
    with tempfile.NamedTemporaryFile("w", suffix=".lua") as probe:
        probe.write('print("Lua runs")\n')
        probe.flush()
        if "Lua runs" not in tshark("-v", dissector=probe.name):
            return "this tshark runs no Lua scripts: built without Lua, or set to refuse them to root in its init.lua"
    return None


class Message:
    """One message (or run of junk) in tshark's tree."""

    def __init__(self, element):
        self.title = element.get("showname")
        self.fields, self.derived, self.experts = [], {}, []
        for field in element.iter("field"):
            name = field.get("name")
            if name.startswith("oculus.expert."):
                self.experts.append((name.removeprefix("oculus.expert."), field.get("showname")))
            elif name in DERIVED or name.startswith(DERIVED_PARTS):
                self.derived.setdefault(name, []).append(field)
            elif name.startswith("oculus."):
                self.fields.append((name.removeprefix("oculus."), bytes.fromhex(field.get("value")), field.get("show")))

    def is_junk(self):
        return "oculus.junk" in self.derived

    def shown(self, name):
        return [field.get("show") for field in self.derived.get("oculus." + name, [])]

    def raw(self, name):
        return bytes.fromhex(self.derived["oculus." + name][0].get("value"))


def messages(capture, *arguments):
    """Returns every message of a capture file in order, from tshark's detailed tree."""
    tree = ElementTree.fromstring(tshark("-r", capture, "-T", "pdml", "-J", "oculus", *arguments))
    protocols = (proto for packet in tree.iter("packet") for proto in packet.findall("proto"))
    return [Message(proto) for proto in protocols if proto.get("name") == "oculus"]
