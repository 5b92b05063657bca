"""Meshes for pyvista. The only module that imports it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import missing
from ._header import Header

if TYPE_CHECKING:
    import pyvista

PIXEL, VOXEL = 8, 11
"""Cell types of VTK: a square and a cube, corners with the first axis fastest."""


def library() -> Any:
    """pyvista, or an error that tells how to get it."""
    try:
        import pyvista
    except ImportError as error:
        raise missing("pyvista", "pyvista", "a mesh") from error
    return pyvista


def points(positions: NDArray[Any], arrays: dict[str, NDArray[Any]], header: Header) -> pyvista.PolyData:
    """Particles as points."""
    mesh: pyvista.PolyData = library().PolyData(positions)
    for name, values in arrays.items():
        mesh.point_data[name] = values
    _tell(mesh, header)
    return mesh


def boxes(
    lower: NDArray[np.float64], edge: NDArray[np.float64], arrays: dict[str, NDArray[Any]], header: Header
) -> pyvista.UnstructuredGrid:
    """Leaves as squares or cubes."""
    dimension = lower.shape[1]
    corners = 1 << dimension
    offsets = np.array([[number >> axis & 1 for axis in range(dimension)] for number in range(corners)])
    vertices = np.zeros((len(edge) * corners, 3))
    vertices[:, :dimension] = (lower[:, None, :] + offsets * edge[:, None, None]).reshape(-1, dimension)
    cells = np.empty((len(edge), corners + 1), dtype=np.int64)
    cells[:, 0] = corners
    cells[:, 1:] = np.arange(len(vertices)).reshape(-1, corners)
    types = np.full(len(edge), PIXEL if dimension == 2 else VOXEL, dtype=np.uint8)
    mesh: pyvista.UnstructuredGrid = library().UnstructuredGrid(cells.ravel(), types, vertices)
    for name, values in arrays.items():
        mesh.cell_data[name] = values
    _tell(mesh, header)
    return mesh


def _tell(mesh: Any, header: Header) -> None:
    mesh.field_data["time"] = [header.time]
    mesh.field_data["step"] = [header.step]
    for name, names in (("materials", header.materials), ("bodies", header.bodies)):
        if names:
            mesh.field_data[name] = list(names)
