"""What can go wrong."""

from __future__ import annotations


class Error(Exception):
    """The engine could not do what it was asked for.

    The message is the command line's: one line that names what, where and what to do. It calls options what the command line calls them, so
    ``--memory-limit`` is the argument ``memory_limit``.
    """

    exit_code: int
    """What the command line would end with: 1 failed, 2 wrong usage, 3 interrupted."""

    def __init__(self, message: str, exit_code: int = 1) -> None:
        super().__init__(message)
        self.exit_code = exit_code


class RaypagerWarning(UserWarning):
    """Something about a scene or a render that its user should know."""


def usage(message: str) -> Error:
    return Error(message, 2)
