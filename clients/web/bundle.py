#!/usr/bin/env python3
"""Bundles the page with esbuild and embeds it, each file compressed, in a C++ file.

usage: bundle.py ESBUILD THREE_DIR GENERATED_DIR OUT_DIR

THREE_DIR holds three.module.js, GENERATED_DIR generated/colour-maps.js. OUT_DIR gets index.html, icon.svg
and app-HASH.js, scene-HASH.js, graphics-HASH.js, app-HASH.css as they are served, page_files.cpp with their gzip bytes, and sizes.txt. The hash is that of the content, so names change with it.
"""
import gzip
import hashlib
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
# Served file -> its main source file. The scene has a separate script, which is loaded after the first picture.
SOURCES = {"app.js": "src/main.js", "scene.js": "src/scene/scene.js", "graphics.js": "src/graphics.js", "app.css": "style/app.css"}
TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
         ".svg": "image/svg+xml"}


def bundled(esbuild, source, three, generated, *options):
    # three.js is found by its name, so that any release of it can be bundled.
    # es2021: esbuild 0.14 of Ubuntu 22.04 supports no later language version.
    command = [esbuild, str(source), "--bundle", "--minify", "--target=es2021", "--legal-comments=inline", *options]
    environment = dict(os.environ, NODE_PATH=os.pathsep.join([str(three), str(generated)]))
    return subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE).stdout


def hashed(name, content):
    stem, dot, extension = name.partition(".")
    return f"{stem}-{hashlib.sha256(content).hexdigest()[:10]}{dot}{extension}"


def bytes_of(content):
    lines = [content[i:i + 40] for i in range(0, len(content), 40)]
    return ",\n  ".join(",".join(str(b) for b in line) for line in lines)


def cpp_of(files):
    parts = ['// Made by clients/web/bundle.py.\n#include "daemon/server/http/page.hpp"\n\nnamespace sonar {\nnamespace {\n']
    rows = []
    for i, (name, content) in enumerate(files.items()):
        packed = gzip.compress(content, 9, mtime=0)
        parts.append(f"constexpr unsigned char bytes_{i}[] = {{\n  {bytes_of(packed)}}};\n")
        path = "/" if name == "index.html" else "/" + name
        rows.append(f'  {{"{path}", "{TYPES[pathlib.Path(name).suffix]}", "{hashlib.sha256(content).hexdigest()[:16]}", bytes_{i}}},')
    table = "\n".join(rows)
    parts.append(f"constexpr PageFile files[] = {{\n{table}\n}};\n\n}}  // namespace\n")
    parts.append("\nstd::span<const PageFile> page_files() { return files; }\n\n}  // namespace sonar\n")
    return "".join(parts)


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    esbuild, three, generated, out = sys.argv[1], *map(pathlib.Path, sys.argv[2:])
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("*-??????????.*"):
        old.unlink()
    files = {}
    html = (HERE / "index.html").read_text(encoding="utf-8")
    for name, source in SOURCES.items():
        content = bundled(esbuild, HERE / source, three, generated, *(["--format=esm"] if name.endswith(".js") else []))
        files[hashed(name, content)] = content
        html = html.replace(f'"/{name}"', f'"/{hashed(name, content)}"')
    files = {"index.html": html.encode(), "icon.svg": (HERE / "icon.svg").read_bytes(), **files}
    for name, content in files.items():
        (out / name).write_bytes(content)
    (out / "page_files.cpp").write_text(cpp_of(files), encoding="utf-8")
    sizes = {name: len(gzip.compress(content, 9, mtime=0)) for name, content in files.items()}
    (out / "sizes.txt").write_text("".join(f"{size} {name}\n" for name, size in sizes.items()), encoding="utf-8")


if __name__ == "__main__":
    main()
