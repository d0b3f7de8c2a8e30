"""Words on pictures are in letters that the typeface has."""

import string

from renderer.inspection.lettering import font, legible, wrapped


def missing(letter: str) -> bool:
    """Whether the typeface draws the box that stands for any letter it lacks."""
    return bytes(font(20).getmask(letter)) == bytes(font(20).getmask("\uffff"))


def test_names_in_other_letters_are_written_without_boxes():
    assert missing("ö") and missing("Ж")
    assert legible("Möbius, groß, ½ 日.ply") == "Mobius, gross, 1?2 ?.ply"
    assert wrapped("Möbius strip", 400, 13) == ["Mobius strip"]


def test_what_the_typeface_has_stays_as_it_is():
    plain = string.ascii_letters + string.digits + string.punctuation
    assert legible(plain) == plain and not any(missing(letter) for letter in plain)
