#!/usr/bin/env python3
"""Checks the floors of docs/architecture.md: which folders may include which, and what files must not contain.

usage: check_floors.py ROOT      prints one line per violation, exits 1 if there is any
"""
import pathlib
import re
import subprocess
import sys

# Folders of protocol/ that are makes of sonar.
MAKE_FOLDERS = ("aris", "blueview", "dvl", "m3", "micron", "norbit", "oculus", "ping", "waterlinked")
# Files that a make of sonar may include besides its own folder.
DEVICE = ["core/base/", "core/image/sonar_picture.hpp", "core/sonar/", "core/text/", "protocol/awaited_ping.hpp", "protocol/dialogue.hpp",
          "protocol/held_settings.hpp", "protocol/host.hpp", "protocol/limits.hpp",
          "protocol/message_fields.hpp", "protocol/recorded/", "protocol/serial_line.hpp",
          "protocol/line_pictures.hpp", "protocol/vendor.hpp", "protocol/wire/"]
# Folder -> prefixes of our own files that it may include. The longest matching folder counts.
FLOORS = {
    "core/base": ["core/base/"],
    "core/image": ["core/base/", "core/image/"],
    "core/text": ["core/base/", "core/text/"],
    "core/sonar": ["core/base/", "core/sonar/"],
    "core/motion": ["core/base/", "core/text/", "core/motion/"],
    "core/scene": ["core/base/", "core/text/", "core/sonar/", "core/scene/"],
    "core/pipeline": ["core/base/", "core/sonar/", "core/scene/", "core/pipeline/"],
    "core/pipeline/arithmetic": ["core/base/", "core/sonar/", "core/pipeline/arithmetic/"],
    "core/paper": ["core/base/", "core/sonar/", "core/scene/", "core/pipeline/", "core/paper/"],
    "cuda": ["core/base/", "core/sonar/", "core/scene/", "core/pipeline/", "cuda/"],
    "protocol": ["core/base/", "core/image/sonar_picture.hpp", "core/sonar/", "core/text/", "protocol/"],
    "protocol/wire": ["core/base/", "protocol/wire/"],
    "protocol/control": ["core/base/", "protocol/control/"],
    "protocol/doctor": ["core/base/", "core/text/", "protocol/control/", "protocol/doctor/", "protocol/host.hpp"],
    "protocol/mavlink": ["core/base/", "protocol/control/pose_sample.hpp", "protocol/wire/", "protocol/mavlink/"],
    **{f"protocol/{make}": [*DEVICE, f"protocol/{make}/"] for make in MAKE_FOLDERS},
    "protocol/recorded": ["core/base/", "core/sonar/", "protocol/wire/", "protocol/recorded/"],
    "protocol/recording": ["core/base/", "core/sonar/", "core/text/", "protocol/foxglove/", "protocol/host.hpp", "protocol/sender.hpp",
                           "protocol/wire/", "protocol/recorded/", "protocol/recording/"],
    "daemon": ["core/", "cuda/", "protocol/", "daemon/"],
    # Within the daemon: files of configuration < what is emulated < sockets, threads and clocks < commands.
    "daemon/config": ["core/", "protocol/", "daemon/config/"],
    "daemon/emulator": ["core/", "protocol/", "daemon/config/", "daemon/emulator/"],
    "daemon/server": ["core/", "cuda/", "protocol/", "daemon/config/", "daemon/emulator/", "daemon/server/"],
    "daemon/server/system": ["core/", "protocol/", "daemon/config/", "daemon/emulator/log_line.hpp", "daemon/server/system/"],
    "daemon/server/connections": ["core/", "protocol/", "daemon/config/", "daemon/emulator/", "daemon/server/connections/", "daemon/server/system/"],
    "daemon/server/engine": ["core/", "cuda/", "protocol/", "daemon/config/", "daemon/emulator/", "daemon/server/engine/", "daemon/server/system/"],
    "daemon/server/time": ["core/", "protocol/", "daemon/config/", "daemon/emulator/", "daemon/server/system/", "daemon/server/time/"],
    "clients": ["core/base/", "core/image/", "core/sonar/", "core/text/", "protocol/", "clients/"],
    "clients/scene_tools": ["core/base/", "core/scene/", "core/text/", "clients/scene_tools/"],  # docs/decisions/0013-scene-tools.md
    "clients/bvtsdk": ["clients/bvtsdk/", "protocol/blueview/link.hpp"],  # loaded into foreign processes: only constants are shared
    "tests": [""],
}
# In these folders, includes between folders go in one direction only, and so between components (header and source of one name).
ONE_DIRECTION = r"daemon/|protocol/|core/|clients/|cuda/"
# The list of makes includes all makes, and nothing includes the list.
LISTS = {"protocol/makes.cpp"}
# Headers that are installed for other programs include each other without a folder.
INSTALLED = r"clients/bvtsdk/(abi\d|codes)/include/"
# Header of a dependency -> the only files that may include it (tests may include anything).
DEPENDENCIES = {
    r"embree[34]?/": ["core/scene/embree_scene.cpp", "core/scene/embree_trees.hpp"],
    r"fftw": ["core/pipeline/pulses/spectral_transform.cpp"],
    r"yaml-cpp/": ["core/text/"],
    r"assimp/": ["core/scene/import/"],
    r"tinyxml2\.h": ["clients/scene_tools/xml_file.cpp"],
    r"png\.h|pngconf\.h": ["core/scene/", "core/image/raster.cpp"],
    r"tiffio\.h": ["core/scene/files/geo_tiff.cpp", "core/scene/files/tiff_file.cpp"],
    r"zlib\.h": ["protocol/blueview/frames.cpp", "protocol/waterlinked/messages.cpp", "protocol/recorded/byte_source.cpp", "clients/bvtsdk/", "core/image/"],
    r"boost/": ["daemon/"],
    r"boost/asio\.hpp": ["daemon/server/system/asio.hpp"],
    r"spdlog/|fmt/": ["daemon/", "clients/"],
    r"google/protobuf|.*\.pb\.h": ["protocol/control/", "protocol/foxglove/", "protocol/waterlinked/messages.cpp"],
    r"nats": ["daemon/commands/farm/nats_queue.cpp"],
    r"snappy\.h": ["protocol/waterlinked/messages.cpp"],
    r"nlohmann/": ["core/scene/import/", "protocol/control/", "protocol/dvl/", "protocol/foxglove/", "protocol/waterlinked/host.cpp", "protocol/waterlinked/http.cpp", "protocol/recording/mcap/", "daemon/", "clients/"],
    r"CLI/": ["core/text/arguments.cpp", "daemon/", "clients/"],
    r"cuda|nv[a-z]+\.h": ["cuda/"],
    r"ignition/": ["clients/gazebo_bridge/"],
    r"tbb/|oneapi/": [],
    r"Eigen/": [],
}
# Rules: name, searched files, excepted files, pattern that must not appear, reason.
FORBIDDEN = [
    ("cast", r"protocol/", None, r"\breinterpret_cast\b", "bytes are read and written through protocol/wire"),
    ("packing", r"protocol/", None, r"#\s*pragma\s+pack|__attribute__\s*\(\(\s*packed", "bytes go through protocol/wire"),
    ("clock", r"core/|protocol/", None, r"\b(system|steady|high_resolution)_clock\b|\b(clock_)?gettime(ofday)?\s*\(|\btime\s*\(\s*(nullptr|NULL|0)\s*\)",
     "time comes in as an argument; only daemon/ and clients/ read clocks"),
    ("emulator", r"daemon/emulator/", None,
     r"#\s*include\s*<(boost/|spdlog/|thread|future|fstream|sys/|netinet/|arpa/|poll|unistd|fcntl|signal)|\b(system|steady|high_resolution)_clock\b",
     "bytes, time and pings come in as arguments; sockets, threads, clocks and files are the server's"),
    ("log", r"core/|protocol/", None, r"\bstd::(cout|cerr|clog)\b|\b(f|v|vf)?printf\s*\(|\bf?puts\s*\(|\bperror\s*\(",
     "only daemon/ and clients/ print or log"),
    ("thread", r"core/|protocol/|cuda/|clients/", r"core/base/parallel\.|clients/bvtsdk/core/link\.|clients/sonarctl/net\.", r"\bstd::(j?thread|async)\b|\bpthread_create\b",
     "compute threads live in core/base/parallel.* only, the keep-alive thread of a link and the look-up of names in files of their own"),
    ("socket", r"core/|protocol/", r"core/base/program_start\.cpp", r"#\s*include\s*<(sys/socket|netinet/|arpa/|poll|netdb)", "only daemon/ and clients/ touch sockets"),
    ("file", r"core/|protocol/", r"core/base/(regular_file|memory_left|child_process|program_start)\.cpp|core/image/raster\.cpp|protocol/recorded/byte_source\.cpp",
     r"\bstd::[io]?fstream\b|(?<![\w:>.])(std::|::)?fopen\s*\(|(?<![\w>])::open(at)?\s*\(|#\s*include\s*<fcntl\.h>",
     "bytes come in as arguments; only the loaders named in this rule, and recordings through protocol/recorded/byte_source.cpp, open files "
     "(docs/decisions/0015-recording-files-behind-two-interfaces.md)"),
    ("mutex", r"daemon/|protocol/", None, r"\bstd::(mutex|shared_mutex|recursive_mutex|condition_variable)\b",
     "work crosses threads by value and asio::post"),
    ("global random", r"core/", None, r"\bstd::(mt19937|random_device|default_random_engine)|\bs?rand\s*\(", "random numbers are counter-based, core/base/random.hpp"),
    ("locale", r"core/|protocol/|daemon/|clients/", None, r"\b(set|use|new)locale\s*\(|\bstd::locale\s*(::global|[({])|\.imbue\s*\((?!\s*std::locale::classic\(\))",
     "printf, strtod and streams would read and write numbers as the user's language does: 1,5 for 1.5"),
    ("test namespace", r"tests/", None, r"\bnamespace\s+(\w+::)*testing\b(?!_)", "it hides GoogleTest's namespace from files compiled together: name it tests"),
    ("answers", r"(core|protocol/(?!control/)|daemon|clients|cuda)/.*\.hpp$", None, r'#\s*include\s*"protocol/control/answers\.hpp"',
     "protoc's classes take long to compile: headers name them only, and requests are structs"),
    ("quiet grep", r"", None, r"\| *gr" + r"ep -\w*q", "it ends before its input does, and under pipefail the pipe then fails: test \"$(command)\" instead"),
    ("precompiled header", r"", None, r"target_precompile_headers\(\w+ (PRIVATE|PUBLIC|INTERFACE)[^)]*\s[^<\s)][^)]*\)",
     "name headers of other packages, <...>: a compiler cache may return the precompiled header of an older comment of ours"),
    ("view", r".*\.(cpp|hpp)$", None, r"\bstd::(ranges::)?views::\w+", "clang 14 cannot compile the views of libstdc++ 12: use a loop or a projection"),
    ("iterator of a file", r"(core|protocol|daemon|clients)/", None, r"\bistreambuf_iterator\b",
     "it throws where reading fails, for example about a process that has ended: use read_regular()"),
    ("mark", r"", None, r"\b(TO" + r"DO|FIX" + r"ME|X" + r"XX)\b", "finish it, or write an issue"),
    ("machine path", r"", None, r"(?<![\w./~-])/(wo" + r"rk|ho" + r"me|ro" + r"ot|t" + r"mp|Users)/[\w.]", "paths of one machine do not belong in the tree"),
]
# A make of sonar is its folder and a line of makes.cpp. The files in NAME_MAKES still name one; that list only gets shorter.
ANY_FOLDER = "|".join(MAKE_FOLDERS)
# Also matches identifiers: is_aris, ArisFrame, m3_packet. "DVL" alone is a kind of instrument, and per_m3 a unit.
MAKE = re.compile(rf"protocol/({ANY_FOLDER})/|\b({ANY_FOLDER})::"
                  r"|(?i:oculus|blueview|waterlinked|ping360|ping1d|(?<![a-z])s500|surveyor|omniscan|3d-?15|dvl-a|norbit)"
                  r"|(?<![A-Za-z])(aris|micron|dvl)(?![a-z])|(Aris|Micron|Dvl)(?![a-z])|(?<![A-Za-z])(ARIS|MICRON)(?![a-z])"
                  r"|(?<![/\w])[mM]3(?![a-z0-9])")  # not kg/m3
MAY_NAME_MAKES = (rf"protocol/({ANY_FOLDER})/|protocol/makes\.cpp$|clients/(bvtsdk|ros2_bridge)/|clients/python/sonard_client/judge/makes/"
                  r"|(.*/)?tests/|docs/")  # the bridge: other people's drivers
NAME_MAKES = {
    "clients/python/sonard_client/__init__.py", "clients/python/sonard_client/__main__.py",
    "clients/python/sonard_client/judge/cases.py",
    "clients/python/sonard_client/layouts.py", "clients/python/sonard_client/oculus.py",
    "clients/python/sonard_client/status.py", "clients/python/sonard_client/stream.py",
    "daemon/commands/replay/replay_device.cpp", "daemon/commands/replay/replay_device.hpp",
}
CODE = {".hpp", ".cpp", ".cu", ".cuh", ".h", ".cc", ".inl"}
TEXT = CODE | {".py", ".sh", ".md", ".yaml", ".yml", ".json", ".txt", ".cmake", ".proto", ".lua", ".service", ".js", ".css", ".html", ""}
# A page of ours, and the cited part of it: docs/acoustics.md, section 8; docs/protocols/oculus.md, 5.1; docs/architecture.md, "Errors".
PAGE = re.compile(r"""(?<![\w/.:*>-])(?P<page>(?:\.{1,2}/)*\w[\w./-]*\.md)\b
                      (?:,?\ section\ (?P<section>\d+(?:\.\d+)*)|,?\ (?P<number>\d+(?:\.\d+)*)|,\ "(?P<title>[^"\n]+)")?""", re.X)
# Programs that only the build runs.
BUILD_TOOLS = r"clients/web/print_colour_maps\.cpp|clients/bvtsdk/core/make_colour_maps\.cpp"
LONGEST_FILE = 400  # lines; tests may be longer
# A comment is a sentence, or a noun phrase that names the thing. These beginnings make fragments, and these words are for
# persons.
FRAGMENT = re.compile(r"[ \t]*//+<?[ \t]*([Oo]f|What|Nothing:)(?=[\s,])")
PERSONS = re.compile(r"\b(to" + r"ld|no" + r"body|some" + r"body|who" + r"ever|ow" + r"ed|new" + r"comers?|turned aw" + r"ay)\b", re.I)
# Idioms that have a plain word: "this many", "call it", "the reason if not", "always", "successive", "via", "only C++17".
IDIOMS = re.compile(r"\b(so ma" + r"ny|to be cal" + r"led|(?:or|else) why n" + r"ot|for ev" + r"er|back to ba" + r"ck|and the li" + r"ke|by way o" + r"f"
                    r"|C\+\+17-cle" + r"an)\b", re.I)
# "is no frame" for "is not a frame", "goes on" for "continues".
RIDDLES = re.compile(r"(?<!there )\b((?:is|are) none|(?:is|are) no (?!longer|more|less|farther)\w+|go(?:es)? on)\b", re.I)


def tracked_files(root):
    """Returns the files that git would commit; without git every file outside build folders."""
    listing = subprocess.run(["git", "-C", str(root), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                             capture_output=True, check=False)
    if listing.returncode == 0:
        names = [n for n in listing.stdout.decode().split("\0") if n]
    else:
        names = [p.relative_to(root).as_posix() for p in root.rglob("*")]
        names = [n for n in names if not n.startswith(("build/", "out/", ".git/"))]
    return sorted(n for n in names if (root / n).is_file())


def blank(text):
    return "\n".join(" " * len(line) for line in text.split("\n"))


def without_comments(text):
    """Returns the text with blank lines in place of comments; strings stay."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)
    return pattern.sub(lambda m: m.group() if m.group().startswith('"') else blank(m.group()), text)


def comments_of(text):
    """Returns the text with only its comments; other lines become blank."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|[^"/]+|.', re.S)
    return pattern.sub(lambda m: m.group() if m.group().startswith(("//", "/*")) else blank(m.group()), text)


def citation_violations(root, name, text):
    """Checks cited pages: their paths start at the root or at the file's own folder, and the cited place must exist."""
    for match in PAGE.finditer(text):
        place = next((p for p in (root / match["page"], (root / name).parent / match["page"]) if p.is_file()), None)
        if place is None:
            yield match.start(), f"page: {match['page']} does not exist; name it from the root, or say here what it would say"
            continue
        section, title = match["section"] or match["number"], match["title"]
        heading = rf"{re.escape(section)}\.? " if section else re.escape(title) if title else None
        if heading and not re.search(rf"^#+ {heading}", place.read_text(encoding="utf-8"), re.M):
            yield match.start(), f"page: {match['page']} has no heading {section or title}"


def floor_of(name):
    folders = [f for f in FLOORS if name.startswith(f + "/")]
    return max(folders, key=len) if folders else None


def include_violations(name, code):
    floor = floor_of(name)
    for number, line in enumerate(code.splitlines(), 1):
        match = re.match(r'\s*#\s*include\s*(["<])([^">]+)[">]', line)
        if not match:
            continue
        quoted, header = match.group(1) == '"', match.group(2)
        if not name.startswith("tests/"):
            for pattern, allowed in DEPENDENCIES.items():
                if re.match(pattern, header) and not header.startswith("cuda/") and not any(name.startswith(a) for a in allowed):
                    yield number, f"includes <{header}>; only {', '.join(allowed) or 'nobody'} may"
        if quoted and not header.endswith(".pb.h"):
            if "/" not in header and re.match(INSTALLED, name):
                continue
            if "/" not in header:
                yield number, f'includes "{header}": include paths start at the root'
            elif floor is not None and not any(header.startswith(p) for p in FLOORS[floor]):
                yield number, f'{floor} must not include "{header}" (floors of docs/architecture.md)'


def folder_of(name):
    return name.rpartition("/")[0]


def component_of(name):
    return name.rpartition(".")[0]


def circle_violations(includes, part_of, parts):
    """Yields a message for every include (file, line, header) that closes a circle; `parts` is the word for its members."""
    below = {}
    for name, _, header in includes:
        below.setdefault(part_of(name), set()).add(part_of(header))

    def reaches(start, goal):
        seen, left = set(), [start]
        while left:
            part = left.pop()
            if part == goal:
                return True
            left += below.get(part, set()) - seen
            seen.add(part)
        return False

    for name, number, header in includes:
        here, there = part_of(name), part_of(header)
        if here != there and reaches(there, here):
            yield f'{name}:{number}: includes "{header}": the {parts} {here} and {there} include each other; give them one direction'


def wording_violations(comments):
    """The first line of a comment must not begin as a fragment; no line may have a word of PERSONS, IDIOMS or RIDDLES."""
    before = ""
    for number, line in enumerate(comments.splitlines(), 1):
        if not line.strip():
            before = ""
            continue
        if not before.startswith("//") and (match := FRAGMENT.match(line)):
            yield number, f'comment: begins with "{match[1]}"; write a sentence, or a noun phrase that names the thing'
        if match := PERSONS.search(line):
            yield number, f'comment: "{match[1]}"; name the event: sent, reported, logged, refused'
        if match := IDIOMS.search(line):
            yield number, f'comment: "{match[1]}"; write the plain word: this many, call it, the reason if not, always, successive, via'
        if match := RIDDLES.search(line):
            yield number, f'comment: "{match[1]}"; write "is not a ...", or "continues"'
        before = line.strip()


def make_violations(name, code):
    """Checks that product files name no make. Files in NAME_MAKES must name one; LISTS may have only folders of MAKE_FOLDERS."""
    if name in LISTS:
        for match in re.finditer(r'^#include "protocol/(\w+)/', code, re.M):
            if match[1] not in MAKE_FOLDERS:
                yield line_of(code, match.start()), f"make: protocol/{match[1]} is not among the MAKE_FOLDERS of check_floors.py: add it"
    if re.match(MAY_NAME_MAKES, name):
        return
    found = MAKE.search(code)
    if found and name not in NAME_MAKES:
        yield line_of(code, found.start()), (f'make: "{found.group()}"; only the make\'s folder and protocol/makes.cpp name a make: '
                                             "ask protocol::Make (protocol/host.hpp)")
    if not found and name in NAME_MAKES:
        yield 1, "make: does not name one any longer: take it out of NAME_MAKES"


def program_violations(name, code):
    """Checks that every program makes room for its stacks. With a small limit it would otherwise be killed, without a message."""
    found = re.search(r"\bint main\(", code)
    if found and re.match(ONE_DIRECTION, name) and not re.match(BUILD_TOOLS, name) and "make_room_for_stacks()" not in code:
        yield line_of(code, found.start()), "program: main() does not call make_room_for_stacks() (core/base/program_start.hpp)"


def line_of(text, position):
    return text.count("\n", 0, position) + 1


def violations(root):
    includes = []
    for name in tracked_files(root):
        path = root / name
        if path.suffix not in TEXT:
            continue
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # a binary without an extension
        is_code = path.suffix in CODE
        code, comments = (without_comments(text), comments_of(text)) if is_code or path.suffix == ".proto" else (text, text)
        if is_code:
            for number, what in [*include_violations(name, code), *wording_violations(comments), *program_violations(name, code)]:
                yield f"{name}:{number}: {what}"
            if re.match(ONE_DIRECTION, name) and name not in LISTS:
                includes += [(name, line_of(code, m.start(1)), m[1])
                             for m in re.finditer(rf'^#include "((?:{ONE_DIRECTION})[^"]+)"', code, re.M)]
            if path.suffix in {".hpp", ".cuh", ".h"} and not re.search(r"^#pragma once$", text, re.M):
                yield f"{name}:1: header without #pragma once"
            if not name.startswith("tests/") and text.count("\n") > LONGEST_FILE:
                yield f"{name}:{LONGEST_FILE}: longer than {LONGEST_FILE} lines: split it"
        if is_code or path.suffix in {".py", ".lua", ".js", ".proto", ".css", ".html"}:
            for number, what in make_violations(name, code):
                yield f"{name}:{number}: {what}"
        for position, what in citation_violations(root, name, comments):
            yield f"{name}:{line_of(text, position)}: {what}"
        for rule, where, excepted, pattern, why in FORBIDDEN:
            if not re.match(where, name) or (where and not is_code) or (excepted and re.match(excepted, name)):
                continue
            searched = code if where else text  # these rules apply to comments too
            for match in re.finditer(pattern, searched):
                yield f"{name}:{line_of(searched, match.start())}: {rule}: \"{match.group().strip()}\"; {why}"
    yield from circle_violations(includes, folder_of, "folders")
    in_one_folder = [i for i in includes if folder_of(i[0]) == folder_of(i[2])]  # others: circles of folders
    yield from circle_violations(in_one_folder, component_of, "components")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = pathlib.Path(sys.argv[1]).resolve()
    found = list(violations(root))
    print("\n".join(found) if found else "floors hold")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
