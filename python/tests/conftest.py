"""A small run in plane strain and one in space, made once with the program, and where the program is."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

import agimp
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]

# A block of sand falls on another of rubber; cells of two sizes; 2D.
PLANE: dict[str, Any] = {
    "title": "Sand on rubber",
    "dimension": 2,
    "gravity": [0, -9.81],
    "domain": {"min": [-0.16, 0.0], "size": [0.32, 0.16], "root_edge": 0.08},
    "boundaries": {"y_min": {"kind": "sticky"}},
    "tree": {
        "base_level": 1,
        "regions": [{"level": 2, "shape": {"kind": "box", "min": [-0.04, 0.0], "max": [0.04, 0.1]}}],
    },
    "materials": [
        {"name": "rubber", "density": 1000, "model": "neo_hookean", "young": 1e5, "poisson": 0.3},
        {"name": "sand", "density": 1600, "model": "drucker_prager", "young": 1e5, "poisson": 0.2, "friction_angle": 30},
    ],
    "bodies": [
        {"name": "base", "material": "rubber", "shape": {"kind": "box", "min": [-0.06, 0], "max": [0.06, 0.04]}},
        {
            "name": "fallen",
            "material": "sand",
            "shape": {"kind": "box", "min": [-0.03, 0.04], "max": [0.03, 0.1]},
            "velocity": [0.2, -1.0],
        },
    ],
    "time": {"end": 0.02},
    "output": {"every": 0.005},
    "history": {"every_steps": 1},
    "checkpoint": {"every_steps": 40},
}

# An elastic ball in flight; 3D.
SPACE: dict[str, Any] = {
    "dimension": 3,
    "domain": {"size": [0.4, 0.4, 0.4], "root_edge": 0.2},
    "tree": {"base_level": 1},
    "materials": [{"name": "rubber", "density": 1000, "model": "hencky", "young": 1e5, "poisson": 0.3}],
    "bodies": [
        {
            "name": "ball",
            "material": "rubber",
            "shape": {"kind": "sphere", "centre": [0.2, 0.2, 0.2], "radius": 0.1},
            "velocity": [1.0, 0.5, 0.0],
            "angular_velocity": [0.0, 0.0, 5.0],
        }
    ],
    "time": {"end": 0.004},
    "output": {"fields": ["velocity", "stress", "volume_ratio", "speed"], "restart": False, "picture": False},
}


# A ring of rubber that widens and sinks; a body of revolution.
RINGS: dict[str, Any] = {
    "dimension": 2,
    "geometry": "axisymmetric",
    "domain": {"size": [0.2, 0.2], "root_edge": 0.1},
    "materials": [{"name": "rubber", "density": 1000, "model": "hencky", "young": 1e5, "poisson": 0.3}],
    "bodies": [
        {
            "name": "ring",
            "material": "rubber",
            "shape": {"kind": "box", "min": [0.025, 0.05], "max": [0.1, 0.1]},
            "velocity": [1.0, -0.5],
        }
    ],
    "time": {"end": 0.002},
    "output": {"fields": ["velocity", "stress", "volume_ratio"], "picture": False},
}


def program() -> str | None:
    """The program: of the environment, of this repository, or on the PATH."""
    built = [REPOSITORY / "target" / profile / "agimp" for profile in ("release", "debug")]
    found = [os.environ.get("AGIMP"), *(str(path) for path in built if path.exists()), shutil.which("agimp")]
    return next((path for path in found if path), None)


@pytest.fixture(scope="session", autouse=True)
def binary() -> str | None:
    """The program, also for code that finds it by itself."""
    path = program()
    if path is not None:
        os.environ["AGIMP"] = path
    return path


@pytest.fixture(scope="session")
def needs_program(binary: str | None) -> str:
    """Skips tests where the program is not built."""
    if binary is None:
        pytest.skip("the program agimp is not built; cargo build, or set AGIMP")
    return binary


@pytest.fixture(scope="session")
def plane(needs_program: str, tmp_path_factory: pytest.TempPathFactory) -> agimp.Results:
    """The run in plane strain."""
    return agimp.run(agimp.job(PLANE, name="plane"), where=tmp_path_factory.mktemp("plane"))


@pytest.fixture(scope="session")
def space(needs_program: str, tmp_path_factory: pytest.TempPathFactory) -> agimp.Results:
    """The run in space, whose outputs carry no restart state."""
    return agimp.run(agimp.job(SPACE, name="space"), where=tmp_path_factory.mktemp("space"))


@pytest.fixture(scope="session")
def rings(needs_program: str, tmp_path_factory: pytest.TempPathFactory) -> agimp.Results:
    """The run of a body of revolution."""
    return agimp.run(agimp.job(RINGS, name="rings"), where=tmp_path_factory.mktemp("rings"))
