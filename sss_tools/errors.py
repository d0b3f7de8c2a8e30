"""What a command says when the user's input cannot be used."""

from __future__ import annotations

from pathlib import Path

MOST_SHOWN = 1000
"""Characters of each part of a message: what strangers write into files is quoted in them."""


def one_line(text: str, most: int | None = None) -> str:
    """The text on one line, and nothing in it that a terminal would obey: line breaks and the like become spaces,
    other control characters escapes. Of more than ``most`` characters the beginning."""
    text = printable(" ".join((text if most is None else text[: 2 * most]).split()))
    return text if most is None or len(text) <= most else f"{text[:most]}..."


def printable(text: str) -> str:
    """The text with escapes for all characters that move the cursor, change colours or turn the line round."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


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
        # the longest path of a system has 4096 characters
        return (
            f"{one_line(self.subject, 4096)}: {one_line(self.problem, MOST_SHOWN)}; {one_line(self.remedy, MOST_SHOWN)}"
        )

    def __reduce__(self):
        return type(self), (self.subject, self.problem, self.remedy)
