"""Runs as a whole: what the tables say agrees with what the particles say."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import agimp
import numpy as np
import pytest


def copy(run: agimp.Results, to: Path) -> agimp.Results:
    """The same run in another directory."""
    shutil.copytree(run.directory, to)
    return agimp.open(to)


def test_sums_over_particles_are_those_of_the_history(plane: agimp.Results) -> None:
    history = plane.history()
    assert history.attrs["units"]["kinetic_energy"] == "J"
    for out in plane:
        row = history.loc[out.step]
        mass, velocity, half = out.field("mass"), out.field("velocity"), out.field("half_width")
        sums = {
            "time": out.time,
            "mass": mass.sum(),
            "kinetic_energy": (0.5 * mass * (velocity**2).sum(axis=1)).sum(),
            "momentum_x": mass @ velocity[:, 0],
            "momentum_y": mass @ velocity[:, 1],
            "plastic_work": (out.field("plastic_work") * (2 * half) ** 2).sum(),
        }
        for name, value in sums.items():
            assert value == pytest.approx(row[name], rel=1e-10, abs=1e-15), (out.step, name)
        assert len(out) == row["particles"]


def test_times_come_from_the_index_and_are_those_of_the_files(plane: agimp.Results) -> None:
    assert len(plane) == 5
    assert plane.times.tolist() == [out.time for out in plane]
    assert plane.times[0] == 0.0 and 0.02 <= plane.times[-1] < 0.021
    assert plane.at(0.0101).path == plane[2].path
    assert plane[-1].path == plane[4].path
    assert [out.step for out in plane[1:3]] == [plane[1].step, plane[2].step]
    with pytest.raises(IndexError, match="output 5 of 5"):
        plane[5]


def test_a_run_is_found_by_directory_index_and_job_file(plane: agimp.Results, monkeypatch: pytest.MonkeyPatch) -> None:
    ending = plane.paths[0].suffix
    index = plane.directory / f"plane{ending}.series"
    assert agimp.open(plane.directory).paths == plane.paths
    assert agimp.open(index).paths == plane.paths
    assert agimp.open(plane.directory / f"plane.tree{ending}.series").paths == plane.paths
    monkeypatch.chdir(plane.directory.parents[1])
    assert [path.absolute() for path in agimp.open(plane.directory / "plane.toml").paths] == list(plane.paths)


def test_a_run_is_found_without_its_index(plane: agimp.Results, tmp_path: Path) -> None:
    run = copy(plane, tmp_path / "run")
    for index in run.directory.glob("*.series"):
        index.unlink()
    without_index = agimp.open(run.directory)
    assert without_index.paths == run.paths
    assert without_index.times.tolist() == plane.times.tolist()


def test_several_runs_in_a_directory_need_a_name(plane: agimp.Results, tmp_path: Path) -> None:
    run = copy(plane, tmp_path / "run")
    shutil.copy(run.directory / "plane.hdf.series", run.directory / "other.run.hdf.series")
    with pytest.raises(ValueError, match="several runs, 'other.run', 'plane'; choose one with name="):
        agimp.open(run.directory)
    assert agimp.open(run.directory, "plane").paths == run.paths
    with pytest.raises(FileNotFoundError, match="no outputs of 'plain'; found 'other.run', 'plane'"):
        agimp.open(run.directory, "plain")


def test_what_is_not_a_run_is_told(tmp_path: Path, plane: agimp.Results) -> None:
    with pytest.raises(FileNotFoundError, match="no outputs of agimp"):
        agimp.open(tmp_path)
    with pytest.raises(FileNotFoundError, match="no such directory or file"):
        agimp.open(tmp_path / "nothing")
    with pytest.raises(ValueError, match=r"agimp\.read\(FILE\)"):
        agimp.open(plane.paths[0])
    (tmp_path / "a.hdf.series").write_text("{")
    with pytest.raises(agimp.FileRefused, match="not an index"):
        agimp.open(tmp_path)


def test_a_row_that_is_being_written_is_left_out(plane: agimp.Results, tmp_path: Path) -> None:
    run = copy(plane, tmp_path / "run")
    rows = len(run.history())
    with (run.directory / "plane.history.csv").open("a") as file:
        file.write("999,0.3")
    assert len(run.history()) == rows
    with (run.directory / "plane.telemetry.jsonl").open("a") as file:
        file.write('{"step":')
    assert len(run.telemetry()) == len(plane.telemetry())


def test_telemetry_has_phases_by_name(plane: agimp.Results) -> None:
    last = plane.telemetry().iloc[-1]
    assert last["phases.gather.seconds.mean"] > 0
    assert last["per_rank.particles.max"] == len(plane[-1])


def test_track_follows_particles(plane: agimp.Results) -> None:
    track = plane.track([3, 8], ["velocity"])
    assert len(track) == 2 * len(plane)
    assert track.attrs["units"]["velocity_y"] == "m/s"
    third = track.xs(3, level="id")
    for out in plane:
        mine = out.field("id") == 3
        assert third.loc[out.time, ["x", "y"]].tolist() == out.positions()[mine][0].tolist()


def test_files_written_since_are_seen_by_reload(plane: agimp.Results, tmp_path: Path) -> None:
    run = copy(plane, tmp_path / "run")
    index = run.directory / "plane.hdf.series"
    whole = json.loads(index.read_text())
    index.write_text(json.dumps({**whole, "files": whole["files"][:2]}))
    early = agimp.open(run.directory)
    index.write_text(json.dumps(whole))
    assert len(early) == 2 and len(early.reload()) == 5
    assert np.allclose(early.times, plane.times[:2])


def test_a_damaged_table_is_refused_with_its_line(plane: agimp.Results, tmp_path: Path) -> None:
    run = copy(plane, tmp_path / "run")
    history = run.directory / "plane.history.csv"
    text = history.read_bytes()
    lines = text.count(b"\n")
    for damage, told in ((b"12,what\n", rf"line {lines + 1} has no number in column 2"), (b"\xff\xfe\n", "damaged")):
        history.write_bytes(text + damage)
        with pytest.raises(agimp.FileRefused, match=told):
            run.history()
    telemetry = run.directory / "plane.telemetry.jsonl"
    telemetry.write_text("{\n")
    with pytest.raises(agimp.FileRefused, match="line 1 is no JSON"):
        run.telemetry()
