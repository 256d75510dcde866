"""The command line: ``python -m raypager VERB ...``, which takes what the program takes, surveys in LAZ, COPC, EPT and E57, and scenes in USD.

Of USD: ``--subdivision N``, how often subdivision surfaces are subdivided, and ``--usd-camera NAME``, path or name of the camera.
"""

from __future__ import annotations

import os
import sys
from typing import Any

from . import _raypager
from ._errors import Error, usage
from ._surveys import Unpacked, is_survey
from ._usd import ENDINGS, LEVELS, is_usd, levels_of, read_usd


def main(arguments: list[str]) -> int:
    """Runs the program. Its exit status: 0 done, 1 failed, 2 bad usage, 3 stopped."""
    if arguments[:1] not in (["render"], ["bake"]):
        return _run(arguments, LEVELS, None)
    try:
        levels, camera = LEVELS, None
        if any(is_usd(argument) for argument in arguments):
            levels, camera = _take_usd_options(arguments)
        # Values of options that name such a file are none of the inputs, but no option has one.
        inputs = [number for number, argument in enumerate(arguments) if number > 0 and is_survey(argument)]
        unpacked = Unpacked([arguments[number] for number in inputs])
    except Error as error:
        print(f"raypager: {error}", file=sys.stderr)
        return error.exit_code
    try:
        for number, path in zip(inputs, unpacked.paths, strict=True):
            arguments[number] = path
        return _run(arguments, levels, camera)
    finally:
        unpacked.close()


def _run(arguments: list[str], levels: int, camera: str | None) -> int:
    def read(path: str | os.PathLike[str], look: _raypager.BareLook) -> Any:
        return read_usd(os.fspath(path), look, levels, camera)._core

    return _raypager.run_program(arguments, list(ENDINGS), read)


def _take_usd_options(arguments: list[str]) -> tuple[int, str | None]:
    """Takes them out of the arguments, since the program does not know them."""
    given = {name: _take_option(arguments, name) for name in ("--subdivision", "--usd-camera")}
    times = given["--subdivision"]
    if times is not None and not times.isdecimal():
        raise usage(f"--subdivision: a whole number from 0 to 6 is expected, not '{times}'")
    return levels_of(LEVELS if times is None else int(times), "--subdivision"), given["--usd-camera"]


def _take_option(arguments: list[str], name: str) -> str | None:
    for number, argument in enumerate(arguments):
        if argument == name:
            if number + 1 == len(arguments):
                raise usage(f"{name}: a value is missing")
            value = arguments[number + 1]
            del arguments[number : number + 2]
            return value
        if argument.startswith(f"{name}="):
            del arguments[number]
            return argument[len(name) + 1 :]
    return None


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
