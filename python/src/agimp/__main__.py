"""`python -m agimp`: the program itself, with the arguments as they are."""

import os
import sys

from ._errors import ProgramNotFound
from ._program import find


def main() -> None:
    """Becomes the program."""
    try:
        program = find(None)
    except ProgramNotFound as error:
        sys.exit(f"agimp: {error}")
    os.execv(program, [program, *sys.argv[1:]])


if __name__ == "__main__":
    main()
