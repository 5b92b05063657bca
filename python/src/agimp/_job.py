"""Jobs: written as nested keys, saved as TOML, checked by the program."""

from __future__ import annotations

import copy
import os
import tempfile
from collections.abc import Iterator, Mapping, MutableMapping
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from . import _program, _toml
from ._errors import AgimpError, JobError


class Job(MutableMapping[str, Any]):
    """The keys of a job file, by name as in docs/job-file.md: a mapping of nested mappings, lists and values.

    Values may be numpy numbers and arrays. Only the program knows which keys are right: `check()` asks it.
    """

    def __init__(self, keys: Mapping[str, Any], name: str = "job") -> None:
        if name in ("", "..") or Path(name).name != name:
            raise JobError(f"found the name {name!r} of a job; expected one that can be the name of a file")
        self.name = name
        """What the files of its run are called."""
        self._keys: dict[str, Any] = copy.deepcopy(dict(keys))
        self._keys.setdefault("version", 1)

    def __getitem__(self, key: str) -> Any:
        return self._keys[key]

    def __setitem__(self, key: str, value: Any) -> None:
        self._keys[key] = value

    def __delitem__(self, key: str) -> None:
        del self._keys[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._keys)

    def __len__(self) -> int:
        return len(self._keys)

    def __repr__(self) -> str:
        return f"Job({self.name!r}): {', '.join(self)}"

    def get_at(self, path: str) -> Any:
        """The value at a path of keys, such as `materials[0].young`, `materials.sand.young` or `time.end`. An entry of
        a list is meant by its number or by its `name`."""
        place: Any = self._keys
        for key in _words(path):
            place = place[_entry(place, key, path)]
        return place

    def set(self, path: str, value: Any) -> Job:
        """Sets the value at a path of keys (see `get_at`); tables on the way are made. Returns the job itself."""
        *way, last = _words(path)
        place: Any = self._keys
        for key in way:
            if isinstance(place, dict):
                place.setdefault(key, {})
            place = place[_entry(place, key, path)]
        place[last if isinstance(place, dict) else _entry(place, last, path)] = value
        return self

    def copy(self, name: str | None = None) -> Job:
        """An independent copy, perhaps with another name."""
        return Job(self._keys, self.name if name is None else name)

    def to_toml(self) -> str:
        """The job file."""
        return tomli_w.dumps({key: _plain(value, key) for key, value in self._keys.items()})

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the job file, over one that is there."""
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(self.to_toml(), encoding="utf-8")
        return target

    def check(self, ranks: int = 1, *, binary: str | os.PathLike[str] | None = None) -> str:
        """Lets the program check the job. Returns what it tells of size, memory, time step and outputs; raises
        `JobError` with the program's message if it refuses the job."""
        with tempfile.TemporaryDirectory() as directory:
            path = self.save(Path(directory) / f"{self.name}.toml")
            return _check([path.name], ranks, binary, path.parent)


def job(source: Mapping[str, Any] | str | os.PathLike[str] | None = None, name: str | None = None, **keys: Any) -> Job:
    """A job from nested keys or from a job file; further keys replace those of the source.

    ```python
    job = agimp.job("my_column.toml", gravity=[0, -1.62])
    ```
    Comments of a file are not kept.
    """
    if source is None or isinstance(source, Mapping):
        return Job({**(source or {}), **keys}, "job" if name is None else name)
    path = Path(source)
    try:
        read = _toml.loads(path.read_text(encoding="utf-8"))
    except _toml.TOMLDecodeError as error:
        raise JobError(f"{path}: not TOML: {error}") from error
    return Job({**read, **keys}, path.stem if name is None else name)


def template(template: str, name: str | None = None, *, binary: str | os.PathLike[str] | None = None) -> Job:
    """A job to start from, one of those that `agimp new --list` shows and that read no other files; its run is called `name`."""
    program = _program.find(binary)
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "template.toml"
        called = _program.call([program, "new", template, str(path)])
        if called.exit_code == _program.BAD_INPUT:
            raise JobError(called.errors.strip())
        if called.exit_code != 0:
            raise AgimpError(f"agimp new: exit code {called.exit_code}: {called.errors.strip()}")
        files = sorted(each.name for each in Path(directory).iterdir() if each.name not in (path.name, "agimp.schema.json"))
        if files:
            raise JobError(
                f"found the template '{template}', which reads files in {', '.join(files)}/; expected one without: "
                f"write it with `agimp new {template}` and run it with `agimp run`"
            )
        return job(path, template if name is None else name)


def check(path: str | os.PathLike[str], ranks: int = 1, *, binary: str | os.PathLike[str] | None = None) -> str:
    """Lets the program check a job file; see `Job.check`."""
    return _check([os.fspath(path)], ranks, binary, None)


def _check(words: list[str], ranks: int, binary: str | os.PathLike[str] | None, directory: Path | None) -> str:
    called = _program.call([_program.find(binary), "check", *words, "--ranks", str(ranks)], directory)
    if called.exit_code == _program.BAD_INPUT:
        raise JobError(called.errors.strip())
    if called.exit_code != 0:
        raise AgimpError(f"agimp check: exit code {called.exit_code}: {called.errors.strip()}")
    return called.output


def _words(path: str) -> list[str]:
    words = path.replace("[", ".").replace("]", "").split(".")
    if not all(words):
        raise KeyError(f"found the path '{path}'; expected keys with dots between, such as 'materials[0].young'")
    return words


def _entry(place: Any, key: str, path: str) -> str | int:
    """The key, or the number of the entry of a list."""
    if isinstance(place, dict):
        if key in place:
            return key
        raise KeyError(f"'{path}': found no '{key}'; there are {', '.join(place) or 'no keys'}")
    if isinstance(place, list):
        names = [entry.get("name") for entry in place if isinstance(entry, Mapping)]
        if key in names:
            return names.index(key)
        if key.isdigit() and int(key) < len(place):
            return int(key)
        raise KeyError(f"'{path}': found no entry '{key}' in a list of {len(place)}")
    raise KeyError(f"'{path}': '{key}' is asked of the value {place!r}, which has no keys")


def _plain(value: Any, path: str) -> Any:
    """The value in types that TOML has."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, f"{path}.{key}") for key, inner in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist(), path)
    if isinstance(value, (list, tuple)):
        return [_plain(inner, f"{path}[{number}]") for number, inner in enumerate(value)]
    if isinstance(value, np.generic):
        return _plain(value.item(), path)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, (bool, int, float, str)):
        return value
    raise JobError(f"{path}: found {value!r}; expected a number, text, true or false, a list or a table")
