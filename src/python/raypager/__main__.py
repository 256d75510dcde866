"""The command line: ``python -m raypager VERB ...``, which takes what the program takes, and surveys in LAZ, COPC, EPT and E57."""

from __future__ import annotations

import sys

from . import _raypager
from ._errors import Error
from ._surveys import Unpacked, is_survey


def main(arguments: list[str]) -> int:
    """Runs the program. Its exit status: 0 done, 1 failed, 2 bad usage, 3 stopped."""
    if arguments[:1] not in (["render"], ["bake"]):
        return _raypager.run_program(arguments)
    # Values of options that name such a file are none of the inputs, but no option has one.
    inputs = [number for number, argument in enumerate(arguments) if number > 0 and is_survey(argument)]
    try:
        unpacked = Unpacked([arguments[number] for number in inputs])
    except Error as error:
        print(f"raypager: {error}", file=sys.stderr)
        return error.exit_code
    try:
        for number, path in zip(inputs, unpacked.paths, strict=True):
            arguments[number] = path
        return _raypager.run_program(arguments)
    finally:
        unpacked.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
