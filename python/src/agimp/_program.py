"""Finding the program and the launcher of its ranks, and calling them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import IO, NamedTuple

from ._errors import ProgramNotFound

VARIABLE = "AGIMP"
"""Environment variable with the path of the program."""
BAD_INPUT, STOPPED = 2, 3
"""Exit codes of the program."""


class Called(NamedTuple):
    """What a call gave."""

    exit_code: int
    output: str
    errors: str


def find(binary: str | os.PathLike[str] | None) -> str:
    """The program: as given, or of the environment variable AGIMP, or on the PATH, or of this package's own wheel."""
    given, whence = (binary, "binary=") if binary is not None else (os.environ.get(VARIABLE), f"{VARIABLE}=")
    if given:
        if found := shutil.which(given):
            return str(Path(found).absolute())
        raise ProgramNotFound(f"{whence}{os.fspath(given)}: no such program; expected the path of the built 'agimp'")
    if found := shutil.which("agimp"):
        return found
    # An environment that is not activated: its scripts are not on the PATH.
    if found := shutil.which("agimp", path=sysconfig.get_path("scripts")):
        return found
    raise ProgramNotFound(
        f"the program 'agimp' was not found: not on the PATH, and {VARIABLE} is not set. Build it with 'cargo build "
        f"--release', then add target/release to the PATH, set {VARIABLE}=/path/to/agimp, or give binary='/path/to/agimp'"
    )


def launcher(ranks: int, given: Sequence[str] | None) -> list[str]:
    """The words before the program that start its ranks."""
    if ranks < 1:
        raise ValueError(f"found {ranks} ranks; expected at least 1")
    if given is None and ranks == 1:
        return []
    words = list(given) if given is not None else ["mpirun", "-n", str(ranks), "--bind-to", "none"]
    if not words or not shutil.which(words[0]):
        raise ProgramNotFound(
            f"the launcher '{words[0] if words else ''}' was not found; install MPI (Debian: openmpi-bin), give another "
            "one, such as launcher=['srun', '-n', '4'], or run on one rank"
        )
    return words


def environment() -> dict[str, str]:
    """The environment for a run: as it is, and settings for Open MPI that hold on workstations and in containers."""
    settings = dict(os.environ)
    if hasattr(os, "geteuid") and os.geteuid() == 0:  # Open MPI asks for both before it runs as root
        settings.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
        settings.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
    settings.setdefault("OMPI_MCA_btl_vader_single_copy_mechanism", "none")
    settings.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
    return settings


def call(words: Sequence[str], directory: Path | None = None, *, echo: bool = False) -> Called:
    """Runs a command to its end. An interrupt (Ctrl-C, a stopped notebook cell) asks it to finish its step and write
    a checkpoint, and waits for that; a second one ends it."""
    process = subprocess.Popen(
        words,
        cwd=directory,
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,  # an interrupt at the terminal is for Python alone, which hands it on
    )
    assert process.stdout is not None and process.stderr is not None
    texts: tuple[list[str], list[str]] = ([], [])
    readers = [
        threading.Thread(target=_collect, args=(stream, into, echo))
        for stream, into in zip((process.stdout, process.stderr), texts)
    ]
    for reader in readers:
        reader.start()
    try:
        process.wait()
    except KeyboardInterrupt:
        process.send_signal(signal.SIGUSR1)
        try:
            process.wait()
        except KeyboardInterrupt:
            process.terminate()
            process.wait()
            raise
    for reader in readers:
        reader.join()
    return Called(process.returncode, *("".join(lines) for lines in texts))


def _collect(stream: IO[str], into: list[str], echo: bool) -> None:
    for line in stream:
        into.append(line)
        if echo:
            sys.stdout.write(line)
            sys.stdout.flush()
