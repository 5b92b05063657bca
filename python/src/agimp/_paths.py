"""Names of the files of a run, and how its outputs are found.

    NAME_000000.hdf          particles          NAME.hdf.series          times of these
    NAME_000000.tree.hdf     leaves             NAME.tree.hdf.series
    NAME.checkpoint_000001000.hdf               NAME.history.csv, NAME.telemetry.jsonl
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from . import _toml
from ._errors import FileRefused

_SERIES = re.compile(rf"(?P<name>.+?)(?P<tree>\.tree)?\.hdf\.series")
_OUTPUT = re.compile(rf"(?P<name>.+)(?<!\.checkpoint)_(?P<number>\d{{6,}})\.hdf")
_CHECKPOINT = re.compile(rf"(?P<name>.+)\.checkpoint_(?P<step>\d+)\.hdf")


class Place(NamedTuple):
    """Where the files of a run are and what their names start with."""

    directory: Path
    name: str


def locate(path: Path, name: str | None) -> Place:
    """The run that `path` means: its directory, the index of its outputs, or its job file."""
    if path.suffix == ".toml" and path.is_file():
        return Place(output_directory(path), name or path.stem)
    if path.is_dir():
        names = sorted(_names(path))
        if name is not None:
            if name not in names:
                raise FileNotFoundError(f"{path}: no outputs of '{name}'; found {_listed(names)}")
            return Place(path, name)
        if len(names) == 1:
            return Place(path, names[0])
        if names:
            raise ValueError(f"{path}: outputs of several runs, {_listed(names)}; choose one with name=...")
        raise FileNotFoundError(f"{path}: no outputs of agimp (files NAME_000000.hdf) in this directory")
    if match := _SERIES.fullmatch(path.name):
        if not path.exists():
            raise FileNotFoundError(f"{path}: no such file")
        return Place(path.parent, match["name"])
    if path.exists():
        raise ValueError(f"{path}: expected a directory, an index (.series) or a job file (.toml); "
                         "a single file is opened by agimp.read(FILE)")
    raise FileNotFoundError(f"{path}: no such directory or file")


def output_directory(job: Path) -> Path:
    """The directory that a run of this job file, started here, writes to."""
    try:
        keys = _toml.loads(job.read_text(encoding="utf-8"))
    except _toml.TOMLDecodeError as error:
        raise FileRefused(f"{job}: not TOML: {error}") from error
    output = keys.get("output")
    directory = output.get("directory") if isinstance(output, dict) else None
    return Path(directory) if isinstance(directory, str) else Path("out") / job.stem


def outputs(place: Place) -> list[tuple[Path, float | None]]:
    """The outputs in order, with their times as the index tells; without an index all that are there."""
    index = place.directory / f"{place.name}.hdf.series"
    if index.exists():
        return _index(index)
    numbered = _matching(place.directory, _OUTPUT, place.name)
    return [(path, None) for _, path in sorted((int(match["number"]), path) for path, match in numbered)]


def checkpoints(place: Place) -> list[Path]:
    """The checkpoints, by step."""
    found = _matching(place.directory, _CHECKPOINT, place.name)
    return [path for _, path in sorted((int(match["step"]), path) for path, match in found)]


def tree_beside(output: Path) -> Path | None:
    """The tree file that belongs to an output, if there is one."""
    tree = output.with_name(f"{output.stem}.tree{output.suffix}")
    return tree if tree.exists() else None


def _index(path: Path) -> list[tuple[Path, float | None]]:
    try:
        files = json.loads(path.read_text(encoding="utf-8"))["files"]
        return [(path.parent / entry["name"], float(entry["time"])) for entry in files]
    except (ValueError, KeyError, TypeError) as error:
        raise FileRefused(f"{path}: not an index of outputs ({error}); open the directory without it") from error


def _names(directory: Path) -> set[str]:
    found = {match["name"] for _, match in _matching(directory, _SERIES, None)}
    return found or {match["name"] for _, match in _matching(directory, _OUTPUT, None)}


def _matching(directory: Path, pattern: re.Pattern[str], name: str | None) -> Iterator[tuple[Path, re.Match[str]]]:
    for path in sorted(directory.iterdir()):
        match = pattern.fullmatch(path.name)
        if match and name in (None, match["name"]):
            yield path, match


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names) or "none"
