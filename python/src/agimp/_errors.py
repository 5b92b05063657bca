"""What can go wrong, by name. All are `AgimpError`s."""


class AgimpError(Exception):
    """Base of all errors of this package."""


class FileRefused(AgimpError):
    """A file that cannot be trusted or is not of this program; the message says why."""


class ProgramNotFound(AgimpError, FileNotFoundError):
    """The program `agimp` or the launcher of its ranks is not on this machine."""


class JobError(AgimpError, ValueError):
    """The program refuses the job; the message is the program's, with line, key and what would be right."""


class RunFailed(AgimpError, RuntimeError):
    """A run ended without success.

    Attributes:
        exit_code: exit code of the program or of its launcher; negative for a signal.
        output: what was printed, errors included.
    """

    def __init__(self, message: str, exit_code: int, output: str) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        self.output = output


class RunStopped(RunFailed):
    """A run was told to stop and has written a checkpoint. Continue it with `agimp.run(job, restart="latest")`."""


def missing(package: str, extra: str, what: str) -> ImportError:
    """The error for an optional package that is not installed."""
    return ImportError(f"{what} needs {package}, which is not installed; install it with: pip install 'agimp[{extra}]'")
