"""Reading described tables."""

from pathlib import Path

import pytest

from sss_tools.errors import InputError
from sss_tools.keys import (
    Key,
    Kind,
    Place,
    did_you_mean,
    one_of,
    read_keys,
    read_variant,
    to_colour,
    to_number,
    to_text,
    to_whole_numbers,
)

PLACE = Place(Path("a.toml"), "[thing]")
NUMBER = Key(Kind("a number", to_number))


def test_given_values_are_converted_and_others_take_their_default():
    assert read_keys({"a": 1}, {"a": NUMBER, "b": Key(NUMBER.kind, "none")}, PLACE) == {"a": 1.0, "b": "none"}


def test_message_names_file_key_place_value_and_what_to_give():
    with pytest.raises(InputError) as caught:
        read_keys({"a": "x"}, {"a": NUMBER}, PLACE)
    assert caught.value.line() == 'a.toml: "a" in [thing] is "x"; give a number'


def test_long_values_are_shortened_in_messages():
    with pytest.raises(InputError) as caught:
        read_keys({"a": "x" * 10_000}, {"a": NUMBER}, PLACE)
    assert len(caught.value.line()) < 100


def test_variant_says_its_type_in_messages():
    with pytest.raises(InputError, match=r"\[thing\] \(ball\)"):
        read_variant({"type": "ball", "edge": 1}, {"ball": {"radius": NUMBER}, "cube": {"edge": NUMBER}}, PLACE)


def test_variant_that_is_no_table_is_refused():
    with pytest.raises(InputError, match=r"\[thing\] is 3"):
        read_variant(3, {"ball": {"radius": NUMBER}}, PLACE)


@pytest.mark.parametrize(
    ("name", "nearest"), [("postion", "position"), ("FOV", "fov"), ("colour", "color"), ("radii", "radius")]
)
def test_nearest_valid_name_is_proposed(name, nearest):
    assert did_you_mean(name, ["position", "fov", "color", "radius"]) == f'did you mean "{nearest}"?'


@pytest.mark.parametrize("name", ["", "%", "zzz"])
def test_some_valid_name_is_proposed_however_far(name):
    assert "a" in did_you_mean(name, ["position", "radius"])


@pytest.mark.parametrize("value", [True, "1", None, [1], float("nan"), float("-inf"), 10**400])
def test_what_is_no_finite_number_is_refused(value):
    with pytest.raises((TypeError, ValueError, OverflowError)):
        to_number(value)


@pytest.mark.parametrize("value", [[1, 2], [], [[1, 2, 3]], "red", [1, 2, True]])
def test_what_is_no_colour_is_refused(value):
    with pytest.raises((TypeError, ValueError)):
        to_colour(value)


def test_one_number_is_a_grey():
    assert to_colour(0.5).tolist() == [0.5, 0.5, 0.5]


@pytest.mark.parametrize("value", [[1.0, 2], [True, 2], 3, "12"])
def test_what_are_no_whole_numbers_is_refused(value):
    with pytest.raises(TypeError):
        to_whole_numbers(value)


@pytest.mark.parametrize("value", ["", "  ", 3, None])
def test_blank_text_is_refused(value):
    with pytest.raises(ValueError):
        to_text(value)


def test_only_listed_words_are_accepted():
    kind = one_of(["flat", "smooth"])
    assert kind.read("flat") == "flat"
    with pytest.raises(ValueError):
        kind.read("fla")
