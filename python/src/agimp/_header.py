"""The header that every file of agimp carries in the attributes of its group `state`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ._errors import AgimpError, FileRefused

MAGIC = "agimp state"
GROUP = "state"


@dataclass(frozen=True)
class Header:
    """What a file says about itself."""

    program: str
    """Version of the program that wrote it."""
    format: int
    """Version of the layout of its restart state."""
    dimension: int
    """2 (plane strain, or bodies of revolution) or 3."""
    job_digest: int
    """Digest of the job."""
    origin: tuple[float, ...]
    """Lower corner of the domain, m."""
    root_edge: float
    """Edge of a root octant, m."""
    roots: tuple[int, ...]
    """Root octants along each axis."""
    step: int
    """Steps done."""
    time: float
    """Simulated time, s."""
    dt: float
    """Last time step, s."""
    leaves: int
    """Leaves of the tree."""
    particles: int
    """Particles."""
    restart: bool
    """Whether a run can restart from the file."""
    materials: tuple[str, ...]
    """Names of the materials, by number."""
    bodies: tuple[str, ...]
    """Names of the bodies, by number; empty in files that do not name them."""
    job: str
    """Text of the job file; empty in files without it."""
    title: str
    """Title of the job; empty in files without it."""
    of_revolution: bool
    """Whether bodies are those of revolution: x is the radius, y the height."""

    @property
    def domain(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Lower and upper corner of the domain, m."""
        upper = (low + self.root_edge * count for low, count in zip(self.origin, self.roots))
        return self.origin, tuple(upper)


def text(value: Any) -> str:
    """An attribute that holds text."""
    if isinstance(value, np.ndarray):
        value = value.item()
    return value.decode() if isinstance(value, bytes) else str(value)


_OF_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, MemoryError)
"""What h5py and numpy raise where a file is not as a program wrote it."""


@contextlib.contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The HDF5 file, for reading. A file that has its name is complete, so no lock is needed. Whatever goes wrong while it
    is read is raised as `FileRefused`."""
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        file = h5py.File(path, "r", locking=False)
    except OSError as error:
        kind = "is still being written, or its writer failed" if path.suffix == ".part" else "is not a whole HDF5 file"
        raise FileRefused(f"{path}: {kind} ({error})") from error
    with file:
        try:
            yield file
        except AgimpError:
            raise
        except _OF_DAMAGE as error:
            raise FileRefused(f"{path}: the file is damaged: {type(error).__name__}: {error}") from error


def read_header(path: Path, file: Any) -> Header:
    """The header of an open file; refuses files that are not of agimp or not complete."""
    if GROUP not in file or text(file[GROUP].attrs.get("magic", "")) != MAGIC:
        raise FileRefused(f"{path}: not a file written by agimp (no group 'state' with its mark)")
    attributes = file[GROUP].attrs
    if "complete" not in attributes:
        raise FileRefused(f"{path}: incomplete; its writer did not finish")

    def numbers(name: str, kind: type) -> list[Any]:
        if name not in attributes:
            raise FileRefused(f"{path}: the header has no '{name}'")
        found: list[Any] = np.ravel(attributes[name]).tolist()
        if not found or not all(isinstance(number, kind) for number in found):
            raise FileRefused(f"{path}: the file is damaged: the header holds {found} as '{name}'")
        return found

    def whole(name: str) -> int:
        number: int = numbers(name, int)[0]
        if number < 0:
            raise FileRefused(f"{path}: the file is damaged: the header holds {number} as '{name}'")
        return number

    def real(name: str) -> float:
        number: float = numbers(name, float)[0]
        return number

    def names(name: str) -> tuple[str, ...]:
        joined = text(attributes.get(name, ""))
        return tuple(joined.split("\n")) if joined else ()

    header = Header(
        program=text(attributes["program"]),
        format=whole("format"),
        dimension=whole("dimension"),
        job_digest=whole("job_digest"),
        origin=tuple(numbers("origin", float)),
        root_edge=real("root_edge"),
        roots=tuple(numbers("roots", int)),
        step=whole("step"),
        time=real("time"),
        dt=real("dt"),
        leaves=whole("leaves"),
        particles=whole("particles"),
        restart=bool(whole("restart")),
        materials=names("materials"),
        bodies=names("bodies"),
        job=_job_text(file),
        title=text(attributes.get("title", "")),
        of_revolution="axisymmetric" in names("count_names"),
    )
    if header.dimension not in (2, 3) or not len(header.origin) == len(header.roots) == header.dimension:
        raise FileRefused(f"{path}: the file is damaged: its header has {header.dimension} dimensions, {len(header.roots)} roots")
    return header


def checksums(path: Path, file: Any) -> list[tuple[str, int]]:
    """Names of all data sets of an open file, with the CRC-32 of their contents."""
    attributes = file[GROUP].attrs
    if "data_sets_crc32" not in attributes:
        raise FileRefused(f"{path}: the header has no checksums; an older program wrote it")
    names = text(attributes["data_sets"]).split("\n")
    return list(zip(names, np.ravel(attributes["data_sets_crc32"]).tolist()))


def _job_text(file: Any) -> str:
    group = file[GROUP]
    if "job" in group:
        return bytes(np.ravel(group["job"][()]).tobytes()).rstrip(b"\0").decode()
    return text(group.attrs.get("job", ""))
