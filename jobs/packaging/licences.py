"""Reads what `cargo metadata` prints and writes the licences of all crates in the program, with their texts, as Markdown."""

from __future__ import annotations

import json
import sys
from pathlib import Path

NAMES = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE")


def linked(metadata: dict) -> list[dict]:
    """The packages in the program: those that normal dependencies reach from it, by name."""
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    root = metadata["resolve"]["root"]
    reached, open_ends = {root}, [root]
    while open_ends:
        for dependency in nodes[open_ends.pop()]["deps"]:
            is_normal = any(kind["kind"] in (None, "build") for kind in dependency["dep_kinds"])
            if is_normal and dependency["pkg"] not in reached:
                reached.add(dependency["pkg"])
                open_ends.append(dependency["pkg"])
    others = (packages[name] for name in reached if packages[name]["source"])
    return sorted(others, key=lambda package: (package["name"], package["version"]))


def texts(package: dict) -> list[str]:
    """The files of licences beside the manifest, and of C libraries that the crate brings along."""
    root = Path(package["manifest_path"]).parent
    found = [path for path in sorted(root.iterdir()) if path.is_file() and path.name.upper().startswith(NAMES)]
    if package["name"] == "hdf5-metno-src":
        found += sorted(root.glob("ext/hdf5/LICENSE*")) + sorted(root.glob("ext/hdf5/COPYING*"))
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in found]


def main() -> None:
    packages = linked(json.load(sys.stdin))
    print("# Licences of the libraries inside this program\n")
    print("| crate | version | licence |\n|---|---|---|")
    for package in packages:
        print(f"| {package['name']} | {package['version']} | {package['license'] or package['license_file']} |")
    users: dict[str, list[str]] = {}
    for package in packages:
        for text in texts(package):
            users.setdefault(text, []).append(package["name"])
    for text, names in users.items():
        print(f"\n## {', '.join(dict.fromkeys(names))}\n\n```text\n{text}\n```")


if __name__ == "__main__":
    main()
