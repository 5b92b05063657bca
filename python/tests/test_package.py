"""The package itself: version, types, and the README, whose example runs."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import agimp
import pytest
from conftest import REPOSITORY

PACKAGE = Path(__file__).resolve().parents[1]


def test_one_version() -> None:
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    cargo = tomllib.loads((REPOSITORY / "Cargo.toml").read_text())["workspace"]["package"]
    assert project["version"] == agimp.__version__ == cargo["version"]


def test_example_of_the_readme_runs(
    needs_program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    example, meshes, *_ = re.findall(r"```python\n(.*?)```", (PACKAGE / "README.md").read_text(), re.DOTALL)
    assert len([line for line in example.splitlines() if line]) <= 10
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "Pa " in printed and "J" in printed
    assert len(agimp.open("out/steep")) == 3
    pyvista = pytest.importorskip("pyvista")
    shown: list[int] = []
    monkeypatch.setattr(pyvista, "OFF_SCREEN", True)
    monkeypatch.setattr(pyvista.Plotter, "show", lambda plotter: shown.append(len(plotter.actors)))
    exec(compile(meshes, "README.md", "exec"), {})
    assert len(shown) == 1 and shown[0] >= 2, "particles and leaves"


def test_types() -> None:
    pytest.importorskip("mypy")
    checked = subprocess.run([sys.executable, "-m", "mypy"], cwd=PACKAGE, capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout + checked.stderr
