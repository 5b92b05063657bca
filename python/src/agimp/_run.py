"""Running jobs with the program."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from . import _paths, _program
from ._errors import JobError, RunFailed, RunStopped
from ._job import Job
from ._results import Results


def run(
    job: Job | str | os.PathLike[str],
    name: str | None = None,
    *,
    ranks: int = 1,
    threads: int | None = None,
    restart: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
    where: str | os.PathLike[str] = ".",
    binary: str | os.PathLike[str] | None = None,
    launcher: Sequence[str] | None = None,
    progress: bool = False,
) -> Results:
    """Runs a job to its end and opens its results.

    Args:
        job: a `Job`, or the path of a job file. The file of a `Job` is written beside its outputs.
        name: what the files of the run are called, for a `Job`; by default its own name.
        ranks: ranks of MPI. With one, no launcher is used.
        threads: threads of each rank; by default the cores of the machine shared out to its ranks.
        restart: "latest" or a file of this job, from which to go on.
        overwrite: whether a new run may replace checkpoints, or the results of another job of that name.
        where: directory in which the program is started; outputs go to `output.directory` of the job, relative to
            it, by default `out/NAME`.
        binary: the program; by default that of the environment variable AGIMP, or on the PATH.
        launcher: words that start the ranks, for example `["srun", "-n", "4"]`, in place of `mpirun -n RANKS`.
        progress: whether to print what the program prints, as it comes.

    An interrupt lets the run finish its step and write a checkpoint.

    Raises:
        ProgramNotFound: program or launcher are not there.
        JobError: the program refuses the job, or what was asked of it; nothing was written.
        RunStopped: told to stop, after writing a checkpoint.
        RunFailed: anything else that went wrong.
    """
    program = _program.find(binary)
    start = _program.launcher(ranks, launcher)
    where = Path(where)
    if isinstance(job, Job):
        job = job.copy(name)
        output = job.get("output", {})
        directory = Path(output.get("directory") or Path("out") / job.name)
        path, job_name = (where / directory / f"{job.name}.toml").absolute(), job.name
        saved: contextlib.AbstractContextManager[None] = _saved(job, path)
    else:
        if name is not None:
            raise ValueError("found a name beside a job file; the run is named after the file")
        path = Path(job).absolute()
        if not path.is_file():
            raise FileNotFoundError(f"{job}: no such job file")
        directory, job_name = _paths.output_directory(path), path.stem
        saved = contextlib.nullcontext()
    words = [*start, program, "run", str(path)]
    if threads is not None:
        words += ["--threads", str(threads)]
    if restart is not None:
        words += ["--restart", os.fspath(restart)]
    if overwrite:
        words += ["--overwrite"]
    with saved:
        called = _program.call(words, where, echo=progress)
        if called.exit_code != 0:
            raise _failure(words, called)
    return Results(where / directory, job_name, called.output + called.errors)


@contextlib.contextmanager
def _saved(job: Job, path: Path) -> Iterator[None]:
    """The job file of a run. If the job is refused, all is as it was: an earlier file, or no directory."""
    before = path.read_bytes() if path.exists() else None
    made = [parent for parent in path.parents if not parent.exists()]
    job.save(path)
    try:
        yield
    except JobError:
        if before is not None:
            path.write_bytes(before)
        else:
            path.unlink()
            with contextlib.suppress(OSError):  # not empty
                for directory in made:
                    directory.rmdir()
        raise


def _failure(words: list[str], called: _program.Called) -> Exception:
    message = called.errors.strip() or called.output.strip()
    if called.exit_code == _program.BAD_INPUT:
        return JobError(message)
    printed = called.output + called.errors
    if called.exit_code == _program.STOPPED:
        return RunStopped(message, called.exit_code, printed)
    return RunFailed(f"{' '.join(words)}: exit code {called.exit_code}\n{message}", called.exit_code, printed)
