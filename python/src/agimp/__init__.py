"""Write, check and run jobs of agimp, and read their results.

| name | what it does |
|---|---|
| `job`, `template`, `Job` | write a job; `Job.check` lets the program check it |
| `check`, `run` | check or run a job file or a `Job` |
| `open`, `Results` | a run: outputs by number and time, history, telemetry, checkpoints |
| `read`, `Output` | one file: particles as arrays, table or mesh, units, names |
| `Tree` | the leaves of the tree as arrays, table or mesh |

All quantities are in SI units.
"""

from ._errors import AgimpError, FileRefused, JobError, ProgramNotFound, RunFailed, RunStopped
from ._header import Header
from ._job import Job, check, job, template
from ._output import Output, read
from ._results import Results, open
from ._run import run
from ._tree import Tree

__version__ = "0.1.0"
__all__ = [
    "AgimpError",
    "FileRefused",
    "Header",
    "Job",
    "JobError",
    "Output",
    "ProgramNotFound",
    "Results",
    "RunFailed",
    "RunStopped",
    "Tree",
    "check",
    "job",
    "open",
    "read",
    "run",
    "template",
]
