"""Jobs: keys, TOML, and what the program says to them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import agimp
import numpy as np
import pytest
from conftest import PLANE, REPOSITORY


def test_paths_of_keys() -> None:
    job = agimp.job(PLANE)
    job.set("materials.sand.young", 2e5).set("bodies[1].velocity[0]", 0.5).set("telemetry.every_steps", 7)
    assert job.get_at("materials[1].young") == 2e5
    assert job["bodies"][1]["velocity"] == [0.5, -1.0]
    assert job["telemetry"] == {"every_steps": 7}
    assert PLANE["materials"][1]["young"] == 1e5, "the source stays as it is"
    for path, message in [
        ("materials.clay.young", "no entry 'clay' in a list of 2"),
        ("materials[2].young", "no entry '2' in a list of 2"),
        ("time.end.x", "'x' is asked of the value 0.02"),
        ("tree.depth", "no 'depth'; there are base_level, regions"),
        ("a..b", "expected keys with dots between"),
    ]:
        with pytest.raises(KeyError, match=message):
            job.get_at(path)


def test_numbers_and_arrays_of_numpy_become_toml() -> None:
    job = agimp.job(dimension=2, gravity=np.array([0.0, -9.81]), a={"b": np.float32(0.5), "c": (np.int64(3), True)})
    keys = tomllib.loads(job.to_toml())
    assert keys == {"version": 1, "dimension": 2, "gravity": [0.0, -9.81], "a": {"b": 0.5, "c": [3, True]}}
    with pytest.raises(agimp.JobError, match=r"a\.b\[1\]: found None; expected a number"):
        agimp.job(a={"b": [1, None]}).to_toml()


def test_a_file_comes_back_as_it_was(tmp_path: Path) -> None:
    every_key = REPOSITORY / "tests" / "jobs" / "good" / "every_key.toml"
    job = agimp.job(every_key)
    again = agimp.job(job.save(tmp_path / "sub" / "again.toml"))
    assert dict(again) == dict(job) == tomllib.loads(every_key.read_text())
    assert (again.name, job.name) == ("again", "every_key")


def test_names_are_names_of_files() -> None:
    for name in ("", "a/b", ".."):
        with pytest.raises(agimp.JobError, match="can be the name of a file"):
            agimp.job(PLANE, name=name)


def test_the_program_checks(needs_program: str) -> None:
    assert "sand" in agimp.job(PLANE).check(ranks=2)
    assert "sand" in agimp.check(REPOSITORY / "jobs" / "column_collapse_2d.toml")
    with pytest.raises(agimp.JobError, match=r"plane\.toml:\d+:\d+: materials\[1\]\.yuong.*young") as error:
        agimp.job(PLANE, name="plane").set("materials.sand.yuong", 1e5).check()
    assert "tmp" not in str(error.value), "the place is that in the job, not of a temporary file"


def told(checked: str) -> list[str]:
    """The lines of a check without the measured one."""
    return [line for line in checked.splitlines() if not line.startswith("wall time")]


def test_every_shipped_job_survives_being_read_and_written(needs_program: str) -> None:
    for path in sorted((REPOSITORY / "jobs").glob("column_collapse_2d.toml")) + [REPOSITORY / "jobs" / "cylinder_in_sand.toml"]:
        assert told(agimp.job(path).check()) == told(agimp.check(path))


def test_templates(needs_program: str) -> None:
    job = agimp.template("elastic_cubes", name="cubes")
    assert job.name == "cubes" and job["dimension"] == 3
    with pytest.raises(agimp.JobError, match="elastic_cubes"):
        agimp.template("elastic_cube")
    with pytest.raises(agimp.JobError, match="reads files in meshes/"):
        agimp.template("bunny")
