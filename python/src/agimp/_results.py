"""The results of a run: its outputs in order of time, its history, telemetry and checkpoints."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from . import _frames, _paths
from ._errors import FileRefused
from ._output import Output

if TYPE_CHECKING:
    import pandas

_HEADING = re.compile(r"(?P<name>.*?)(?: \[(?P<unit>.*)\])?")


class Results(Sequence[Output]):
    """The outputs of a run as a sequence, and what else it wrote.

    A run that is still going on can be opened: what has a name is complete. `reload()` looks for newer outputs.
    """

    def __init__(self, directory: Path, name: str, log: str = "") -> None:
        self.directory = directory
        self.name = name
        self.log = log
        """What the run printed; empty unless `agimp.run` made it."""
        self._place = _paths.Place(directory, name)
        self._listed = _paths.outputs(self._place)

    def __repr__(self) -> str:
        return f"Results({str(self.directory)!r}, {self.name!r}): {len(self)} outputs"

    def reload(self) -> Results:
        """The same run with the outputs that are there now."""
        return Results(self.directory, self.name, self.log)

    @property
    def paths(self) -> tuple[Path, ...]:
        """The output files."""
        return tuple(path for path, _ in self._listed)

    @cached_property
    def times(self) -> NDArray[np.float64]:
        """Times of the outputs, s."""
        return np.array([Output(path).time if time is None else time for path, time in self._listed])

    @property
    def checkpoints(self) -> tuple[Path, ...]:
        """The checkpoint files, by step; open them with `agimp.read`."""
        return tuple(_paths.checkpoints(self._place))

    def __len__(self) -> int:
        return len(self._listed)

    @overload
    def __getitem__(self, index: int) -> Output: ...
    @overload
    def __getitem__(self, index: slice) -> list[Output]: ...
    def __getitem__(self, index: int | slice) -> Output | list[Output]:
        if isinstance(index, slice):
            return [Output(path) for path in self.paths[index]]
        if not -len(self) <= index < len(self):
            raise IndexError(f"{self.directory}: output {index} of {len(self)}")
        return Output(self.paths[index])

    def __iter__(self) -> Iterator[Output]:
        return (Output(path) for path in self.paths)

    def at(self, time: float) -> Output:
        """The output nearest to a time, s."""
        if not self._listed:
            raise IndexError(f"{self.directory}: no outputs yet")
        return self[int(np.abs(self.times - time).argmin())]

    @property
    def materials(self) -> tuple[str, ...]:
        """Names of the materials."""
        return self[0].materials

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies; empty if the files do not name them."""
        return self[0].bodies

    def history(self) -> pandas.DataFrame:
        """The table of scalars (`NAME.history.csv`), a row for each step recorded; `attrs["units"]` has the units."""
        path = self.directory / f"{self.name}.history.csv"
        rows = list(csv.reader(_lines(path)))
        columns = _frames.Columns()
        for number, heading in enumerate(rows[0] if rows else []):
            match = _HEADING.fullmatch(heading)
            name, unit = (match["name"], match["unit"] or "") if match else (heading, "")
            values = np.array([_number(path, line, row, number) for line, row in enumerate(rows[1:], 2)])
            if not unit and np.all(values == np.round(values)):
                values = values.astype(np.int64)
            columns.add(name, values, unit, name.replace("_", " "))
        return columns.table().set_index("step") if rows else columns.table()

    def telemetry(self) -> pandas.DataFrame:
        """Measurements of the run itself (`NAME.telemetry.jsonl`), a row for each record; nested entries have
        columns with dots, such as `per_rank.particles.max`, and phases such as `phases.gather.seconds.mean`."""
        path = self.directory / f"{self.name}.telemetry.jsonl"
        records = [_record(path, number, line) for number, line in enumerate(_lines(path), 1)]
        for record in records:
            if isinstance(record.get("phases"), list):
                record["phases"] = {entry.pop("phase"): entry for entry in record["phases"]}
        table: pandas.DataFrame = _frames.library().json_normalize(records)
        return table

    def track(self, ids: Iterable[int], fields: Iterable[str] | None = None) -> pandas.DataFrame:
        """The particles with these identifiers in all outputs, with an index of time and id. Particles that split or
        merge are there as long as they exist."""
        wanted = np.asarray(list(ids), dtype=np.uint64)
        chosen = None if fields is None else ["id", *(name for name in fields if name != "id")]
        tables: list[Any] = []
        for output in self:
            table = output.particles(chosen)
            tables.append(table[table["id"].isin(wanted)].assign(time=output.time))
        if not tables:
            raise IndexError(f"{self.directory}: no outputs yet")
        attributes = dict(tables[0].attrs)
        for table in tables:
            table.attrs.clear()
        joined: pandas.DataFrame = _frames.library().concat(tables).set_index(["time", "id"]).sort_index()
        joined.attrs.update({key: attributes[key] for key in ("units", "descriptions")})
        return joined


def _lines(path: Path) -> list[str]:
    """The whole lines of a file of text; the last one may just be written."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    except UnicodeDecodeError as error:
        raise FileRefused(f"{path}: the file is damaged: {error}") from error
    return [line for line in lines if line.endswith("\n")]


def _number(path: Path, line: int, row: list[str], column: int) -> float:
    try:
        return float(row[column])
    except (ValueError, IndexError) as error:
        raise FileRefused(f"{path}: the file is damaged: line {line} has no number in column {column + 1}") from error


def _record(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        record = json.loads(line)
    except ValueError as error:
        raise FileRefused(f"{path}: the file is damaged: line {number} is no JSON: {error}") from error
    if not isinstance(record, dict):
        raise FileRefused(f"{path}: the file is damaged: line {number} is no record")
    return record


def open(path: str | PathLike[str], name: str | None = None) -> Results:
    """Opens the results of a run: its directory, the index of its outputs (`NAME.hdf.series`) or its job file, whose
    directory of outputs is taken relative to the current one. `name` chooses among several runs in a directory."""
    return Results(*_paths.locate(Path(path), name))
