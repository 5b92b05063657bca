"""Units and descriptions of the data sets, and names for their components."""

from __future__ import annotations

from typing import Any, NamedTuple

from ._header import text


class Field(NamedTuple):
    """What a data set holds."""

    unit: str
    """SI unit, empty for pure numbers."""
    description: str


def describe(name: str, dataset: Any) -> Field:
    """Unit and description of a data set, as its file has them; else its name in words."""
    words = name.replace("_", " ")
    return Field(text(dataset.attrs.get("units", "")), text(dataset.attrs.get("description", words)))


AXES = ("x", "y", "z")
SYMMETRIC = ("xx", "yy", "zz", "xy", "yz", "xz")
"""Components of a symmetric tensor in the order of VTK."""


def components(name: str, count: int) -> tuple[str, ...]:
    """Names for the columns of a field with `count` components: `velocity_x`, `stress_xy`."""
    if count in (2, 3):
        return tuple(f"{name}_{axis}" for axis in AXES[:count])
    if count == len(SYMMETRIC):
        return tuple(f"{name}_{pair}" for pair in SYMMETRIC)
    return tuple(f"{name}_{number}" for number in range(count))
