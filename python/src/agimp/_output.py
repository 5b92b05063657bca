"""One output or checkpoint file: particles and tree at one time."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _fields, _frames, _meshes, _paths, _revolve
from ._errors import FileRefused
from ._header import checksums, Header, opened, read_header
from ._tree import Tree

if TYPE_CHECKING:
    import pandas
    import pyvista

_POINTS = "VTKHDF/PointData"
_PLACES = "VTKHDF/Points"
_STATE = "state/particles"
_OF_STATE = ("id", "mass", "half_width", "plastic_work")
"""Data sets of the restart state that are fields of their own, whatever the job asked for."""


class Output:
    """The particles and the tree in one output or checkpoint file. Nothing is read until it is asked for."""

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = Path(path)
        with opened(self.path) as file:
            self.header: Header = read_header(self.path, file)
            if _POINTS not in file or "CellData/level" in file["VTKHDF"]:
                raise FileRefused(f"{self.path}: holds no particles; is it a tree file? Open the output beside it")
            sets = {name: f"{_POINTS}/{name}" for name in file[_POINTS]}
            sets |= {name: f"{_STATE}/{name}" for name in _OF_STATE if f"{_STATE}/{name}" in file and name not in sets}
            self._sets = sets
            self._info = {name: _fields.describe(name, file[path]) for name, path in sets.items()}

    def __repr__(self) -> str:
        return f"Output({str(self.path)!r}): t = {self.time:g} s, step {self.step}, {len(self)} particles"

    def __len__(self) -> int:
        """Number of particles."""
        return self.header.particles

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.header.time

    @property
    def step(self) -> int:
        """Steps done."""
        return self.header.step

    @property
    def dimension(self) -> int:
        """2 (plane strain) or 3."""
        return self.header.dimension

    @property
    def materials(self) -> tuple[str, ...]:
        """Names of the materials, by number."""
        return self.header.materials

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies, by number; empty in files that do not name them."""
        return self.header.bodies

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that the file has."""
        return tuple(self._sets)

    def unit(self, field: str) -> str:
        """SI unit of a field, empty for pure numbers."""
        return self._known(field).unit

    def description(self, field: str) -> str:
        """What a field is."""
        return self._known(field).description

    def field(self, name: str) -> NDArray[Any]:
        """Values of a field, one row per particle. Velocities have as many components as the job has dimensions;
        stress has xx, yy, zz, xy, yz, xz."""
        self._known(name)
        values = self._read(self._sets[name], 3 if name == "velocity" else None)
        return values[:, : self.dimension] if name == "velocity" else values

    def positions(self) -> NDArray[np.float64]:
        """Positions, m: particles x dimensions."""
        return self._read(_PLACES, 3)[:, : self.dimension].astype(np.float64)

    def state(self, name: str) -> NDArray[Any]:
        """A data set of the restart state as it is (see docs/guide/files.md), for example `left_cauchy_green`."""
        with opened(self.path) as file:
            group = file.get(_STATE)
            if group is None:
                raise FileRefused(f"{self.path}: the file holds no restart state")
            known = list(group)
            if name in known:
                return np.asarray(group[name][()])
        raise KeyError(f"{self.path}: the state has no '{name}'; it has {', '.join(known)}")

    def select(self, *, material: str | None = None, body: str | None = None) -> NDArray[np.bool_]:
        """A mask of the particles of a material or body, by name."""
        mask = np.ones(len(self), dtype=np.bool_)
        for field, name, names in (("material", material, self.materials), ("body", body, self.bodies)):
            if name is None:
                continue
            if name not in names:
                known = ", ".join(names) or "no names"
                raise KeyError(f"{self.path}: found the {field} '{name}'; the file has {known}")
            mask &= self.field(field) == names.index(name)
        return mask

    def particles(self, fields: Iterable[str] | None = None, *, names: bool = True) -> pandas.DataFrame:
        """A table with a row for each particle: position and the given fields, by default all.

        Vectors and tensors have a column for each component. `attrs["units"]` and `attrs["descriptions"]` tell of
        each column. With `names`, materials and bodies are categories named as in the job. Needs pandas.
        """
        chosen = self.fields if fields is None else tuple(fields)
        columns = _frames.Columns()
        for axis, values in zip(_fields.AXES, self.positions().T):
            columns.add(axis, values, "m", f"position along {axis}")
        for name in chosen:
            columns.add(name, self.field(name), self.unit(name), self.description(name))
        table = columns.table(time=self.time, step=self.step)
        if names:
            for column, known in (("material", self.materials), ("body", self.bodies)):
                if column in table and known:
                    table[column] = _frames.categories(table[column], known)
        return table

    def mesh(self, fields: Iterable[str] | None = None, *, revolve: str | None = None) -> pyvista.PolyData:
        """The particles as points of a pyvista mesh, with the given fields, by default all. Needs pyvista.

        With `revolve`, "whole" or "open", bodies of revolution are in space: each particle next to itself about the axis,
        all around or without the quarter where x > 0 and y < 0.
        """
        chosen = self.fields if fields is None else tuple(fields)
        for name in chosen:
            self._known(name)
        points = self._read(_PLACES, 3)
        arrays = {name: self._read(self._sets[name]) for name in chosen}
        if revolve is not None:
            copies = self._copies(points[:, 0].astype(np.float64), revolve)
            points, arrays = copies.places(points), {name: copies.values(of) for name, of in arrays.items()}
        return _meshes.points(points, arrays, self.header)

    def _copies(self, radii: NDArray[np.float64], revolve: str) -> _revolve.Copies:
        if not self.header.of_revolution:
            raise ValueError(f'{self.path}: found no bodies of revolution; expected the output of a job with geometry = "axisymmetric"')
        if revolve not in _revolve.SPANS:
            raise ValueError(f"found revolve = {revolve!r}; expected one of {', '.join(map(repr, _revolve.SPANS))}")
        if "half_width" not in self._sets:
            raise FileRefused(f"{self.path}: holds no half widths; expected an output with `output.restart = true`")
        # The state has half of the root of the volume of the undeformed ring.
        halves = self._read(self._sets["half_width"]) / np.sqrt(2.0 * np.pi * radii)
        return _revolve.Copies(radii, halves, _revolve.SPANS[revolve])

    @cached_property
    def tree(self) -> Tree:
        """The leaves of the tree: of the tree file beside this one, or of the restart state."""
        if beside := _paths.tree_beside(self.path):
            return Tree.read(beside)
        if self.header.restart:
            return Tree.read(self.path)
        raise FileNotFoundError(f"{self.path}: there is no tree file beside it, and it holds no restart state")

    def verify(self) -> None:
        """Reads the whole file and compares the checksums of its data sets; raises `FileRefused` if one differs."""

        with opened(self.path) as file:
            for name, expected in checksums(self.path, file):
                if name not in file:
                    raise FileRefused(f"{self.path}: data set {name} is missing")
                if zlib.crc32(np.ascontiguousarray(file[name][()]).tobytes()) != expected:
                    raise FileRefused(f"{self.path}: wrong checksum of {name}: the file is damaged")

    def _known(self, field: str) -> _fields.Field:
        if field not in self._info:
            raise KeyError(f"{self.path}: the file does not show '{field}'; it shows {', '.join(self.fields)}")
        return self._info[field]

    def _read(self, dataset: str, components: int | None = None) -> NDArray[Any]:
        """A data set with a row for each particle, of so many numbers if that is known."""
        with opened(self.path) as file:
            values = np.asarray(file[dataset][()])
        rows, *rest = values.shape or (0,)
        if rows != len(self) or len(rest) > 1 or (components is not None and rest != [components]):
            found = " x ".join(map(str, values.shape)) or "one"
            raise FileRefused(f"{self.path}: the file is damaged: {dataset} holds {found} numbers for {len(self)} particles")
        return values


def read(path: str | PathLike[str]) -> Output:
    """Opens one output or checkpoint file."""
    return Output(path)
