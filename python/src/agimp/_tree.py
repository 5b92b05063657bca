"""The leaves of the tree at one time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _fields, _frames, _meshes
from ._errors import FileRefused
from ._header import Header, opened, read_header

if TYPE_CHECKING:
    import pandas
    import pyvista

CELLS = 4
"""Cells along the edge of a leaf."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Leaves in the order of the curve."""

    header: Header
    """Header of the file that they are from."""
    lower: NDArray[np.float64]
    """Lower corners, m: leaves x dimensions."""
    edge: NDArray[np.float64]
    """Edges, m."""
    fields: dict[str, NDArray[Any]]
    """Values of each leaf: `level`, `particles` and what else the run has."""
    described: dict[str, _fields.Field]
    """Units and descriptions of these."""

    @classmethod
    def read(cls, path: Path) -> Tree:
        """The leaves in a tree file, or in an output or checkpoint with restart state."""
        with opened(path) as file:
            header = read_header(path, file)
            group = next((name for name in ("VTKHDF/CellData", "state/tree") if f"{name}/level" in file), None)
            if group is None:
                raise FileRefused(f"{path}: holds no tree")
            extra = group if group != "state/tree" else "state/leaf"
            sets = {name: file[group][name] for name in ("level", "particles")}
            sets |= {name: values for name, values in file.get(extra, {}).items() if name not in sets}
            fields = {name: np.asarray(values[()]) for name, values in sets.items()}
            described = {name: _fields.describe(name, values) for name, values in sets.items()}
            edge = header.root_edge / np.exp2(fields["level"].astype(np.float64))
            if group == "state/tree":
                lower = np.asarray(header.origin) + np.asarray(file[group]["coord"][()]) * edge[:, None]
            else:
                corners = 1 << header.dimension
                lower = np.asarray(file["VTKHDF/Points"][()])[::corners, : header.dimension]
            if any(len(values) != header.leaves for values in (lower, edge, *fields.values())):
                raise FileRefused(f"{path}: the file is damaged: data of leaves do not have the {header.leaves} rows of the header")
        return cls(header, lower, edge, fields, described)

    def __len__(self) -> int:
        """Number of leaves."""
        return len(self.edge)

    def __repr__(self) -> str:
        levels, counts = np.unique(self.fields["level"], return_counts=True)
        by_level = ", ".join(f"level {level}: {count}" for level, count in zip(levels, counts))
        return f"Tree: t = {self.header.time:g} s, {len(self)} leaves ({by_level})"

    @property
    def level(self) -> NDArray[Any]:
        """Levels of the leaves."""
        return self.fields["level"]

    @property
    def cell_size(self) -> NDArray[np.float64]:
        """Edges of the cells, m; a leaf has four along each axis."""
        return self.edge / CELLS

    def leaves(self) -> pandas.DataFrame:
        """A table with a row for each leaf: lower corner, edge and fields. Needs pandas."""
        columns = _frames.Columns()
        for axis, values in zip(_fields.AXES, self.lower.T):
            columns.add(axis, values, "m", f"lower corner along {axis}")
        for name, array in {"edge": self.edge, **self.fields}.items():
            columns.add(name, array, *{"edge": _fields.Field("m", "edge of the leaf"), **self.described}[name])
        return columns.table(time=self.header.time, step=self.header.step)

    def mesh(self) -> pyvista.UnstructuredGrid:
        """The leaves as cells of a pyvista mesh. Needs pyvista."""
        return _meshes.boxes(self.lower, self.edge, self.fields, self.header)
