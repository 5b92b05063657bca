"""Runs: ranks, errors, interruption and restart."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import agimp
import pytest
from conftest import PLANE

needs_mpirun = pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is not installed")


def digest(binary: str, path: Path) -> str:
    return subprocess.run([binary, "digest", path], check=True, capture_output=True, text=True).stdout.split()[0]


@needs_mpirun
def test_two_ranks_give_the_bits_of_one(plane: agimp.Results, needs_program: str, tmp_path: Path) -> None:
    version = subprocess.run([needs_program, "--version"], check=True, capture_output=True, text=True).stdout
    if "no MPI" in version:
        pytest.skip("the program is built without MPI")
    two = agimp.run(agimp.job(PLANE, name="plane"), ranks=2, threads=1, where=tmp_path)
    assert "2 ranks" in two.log
    assert digest(needs_program, two.paths[-1]) == digest(needs_program, plane.paths[-1])


def test_a_job_file_runs_where_it_is_told(needs_program: str, tmp_path: Path) -> None:
    job = agimp.job(PLANE, name="short").set("time.end", 0.001).set("output.directory", "elsewhere/x")
    path = job.save(tmp_path / "jobs" / "short.toml")
    run = agimp.run(path, where=tmp_path)
    assert run.directory == tmp_path / "elsewhere" / "x" and 0.001 <= run[-1].time < 0.0013
    with pytest.raises(ValueError, match="named after the file"):
        agimp.run(path, "other", where=tmp_path)
    with pytest.raises(FileNotFoundError, match="no such job file"):
        agimp.run(tmp_path / "none.toml")


def test_progress_is_printed_as_it_comes(needs_program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = agimp.run(agimp.job(PLANE).set("time.end", 0.001), "shown", where=tmp_path, progress=True)
    assert run.name == "shown" and run.log.strip() and sorted(capsys.readouterr().out) == sorted(run.log)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=needs_mpirun)])
def test_a_refused_job_leaves_nothing_behind(needs_program: str, tmp_path: Path, ranks: int) -> None:
    job = agimp.job(PLANE, name="bad").set("materials.sand.poisson", 0.7)
    with pytest.raises(agimp.JobError, match=r"bad\.toml:\d+:\d+: materials\[1\]\.poisson"):
        agimp.run(job, ranks=ranks, where=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_refused_job_leaves_the_files_of_an_earlier_one(needs_program: str, tmp_path: Path) -> None:
    job = agimp.job(PLANE, name="same").set("time.end", 0.001)
    agimp.run(job, where=tmp_path)
    text = (tmp_path / "out" / "same" / "same.toml").read_text()
    with pytest.raises(agimp.JobError):
        agimp.run(job.copy().set("materials.sand.poisson", 0.7), where=tmp_path)
    assert (tmp_path / "out" / "same" / "same.toml").read_text() == text


def test_failure_of_a_run_has_its_reason(needs_program: str, tmp_path: Path) -> None:
    # Sand at 1 km/s is pressed through a face that holds nodes alone.
    job = agimp.job(PLANE, name="gone").set("bodies.fallen.velocity", [1000.0, 0.0])
    job = job.set("boundaries.x_max", {"kind": "symmetric"})
    with pytest.raises(agimp.RunFailed, match="(?s)exit code 1.*left the domain") as failed:
        agimp.run(job, where=tmp_path)
    assert failed.value.exit_code == 1 and failed.value.output.strip() in str(failed.value) + failed.value.output
    assert (tmp_path / "out" / "gone" / "gone.toml").exists()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=needs_mpirun)])
def test_an_interrupt_stops_with_a_checkpoint_from_which_a_run_goes_on(
    plane: agimp.Results, needs_program: str, tmp_path: Path, ranks: int
) -> None:
    # What a shell has put into the background ignores it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    job = agimp.job(PLANE, name="plane").set("time.end", 5.0)
    history = tmp_path / "out" / "plane" / "plane.history.csv"

    def interrupt() -> None:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if history.exists() and len(history.read_bytes().splitlines()) > 20:
                return os.kill(os.getpid(), signal.SIGINT)  # as Ctrl-C does
            time.sleep(0.02)

    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(agimp.RunStopped) as stopped:
        agimp.run(job, ranks=ranks, threads=1, where=tmp_path)
    assert stopped.value.exit_code == 3
    assert agimp.open(tmp_path / "out" / "plane").checkpoints
    # Continued to the end of the session's run on the other number of ranks: the same bits.
    reached = agimp.read(agimp.open(tmp_path / "out" / "plane").checkpoints[-1]).time
    if reached < 0.02:
        run = agimp.run(job.set("time.end", 0.02), restart="latest", where=tmp_path)
        assert digest(needs_program, run.paths[-1]) == digest(needs_program, plane.paths[-1])


def test_a_program_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("AGIMP", raising=False)
    with pytest.raises(agimp.ProgramNotFound, match="not on the PATH, and AGIMP is not set.*cargo build"):
        agimp.run(agimp.job(PLANE), where=tmp_path)
    monkeypatch.setenv("AGIMP", "/none/agimp")
    with pytest.raises(agimp.ProgramNotFound, match="AGIMP=/none/agimp: no such program"):
        agimp.job(PLANE).check()
    with pytest.raises(agimp.ProgramNotFound, match="binary=/other: no such program"):
        agimp.check("x.toml", binary="/other")
    assert list(tmp_path.iterdir()) == []


def test_a_launcher_that_is_not_there_is_told(needs_program: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(agimp.ProgramNotFound, match="launcher 'mpirun' was not found; install MPI"):
        agimp.run(agimp.job(PLANE), ranks=2, binary=needs_program, where=tmp_path)
    with pytest.raises(ValueError, match="found 0 ranks; expected at least 1"):
        agimp.run(agimp.job(PLANE), ranks=0, binary=needs_program, where=tmp_path)
