"""What a command says when the user's input cannot be used."""

from __future__ import annotations

from pathlib import Path


class InputError(Exception):
    """Something the user gave cannot be used; the commands print it as one line and exit with status 2.

    subject  the file, option or object in question
    problem  what is wrong with it
    remedy   what the user can do
    """

    def __init__(self, subject: str | Path, problem: str, remedy: str):
        self.subject, self.problem, self.remedy = str(subject), problem, remedy
        super().__init__(self.line())

    def line(self) -> str:
        """``SUBJECT: problem; remedy``, on one line whatever the parts contain."""
        text = f"{self.subject}: {self.problem}; {self.remedy}"
        return " ".join(text.split())

    def __reduce__(self):
        return type(self), (self.subject, self.problem, self.remedy)
