"""The counter hash: even, unpredictable from its neighbours, and the same in every order."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderer.tracing.streams import GOLDEN, Uniforms, mix, stream_keys
from tests.assertions import assert_distribution, assert_mean, seed, shared_rate

SAMPLES = 2**18
PIXELS = np.arange(SAMPLES, dtype=np.int64)
RATE = shared_rate(1e-3, 40)
"""Of each chi-square test here: one false alarm in a thousand runs of the file on fresh seeds."""


def draws(pass_index: int = 0, dimensions: int = 4, *, pixels=PIXELS, seed_number: int = 1):
    """(2 * dimensions, n) uniforms in the order in which the streams give them."""
    state = stream_keys(seed(seed_number), pass_index, pixels)
    source = Uniforms(len(pixels))
    return np.concatenate([np.stack(source.draw(state)) for _ in range(dimensions)])


def pairs(first, second, bins: int = 16):
    """(bins, bins) counts of pairs."""
    return np.bincount((first * bins).astype(int) * bins + (second * bins).astype(int), minlength=bins * bins)


def test_uniforms_are_even_in_every_dimension():
    """256 bins: sees relative errors of the density of 2.7 % (rms)."""
    for dimension, u in enumerate(draws(dimensions=5)):
        counts = np.bincount((u * 256).astype(int), minlength=256)
        assert_distribution(counts, np.ones(256), false_alarm=RATE, detects=0.025, what=f"dimension {dimension}")
        assert_mean(u, 0.5, false_alarm=RATE, detects=0.005)


def test_last_bits_are_as_even_as_the_first():
    """The low 8 of the 24 bits of a uniform."""
    for u in draws(dimensions=2):
        counts = np.bincount((u.astype(float) * 2**24).astype(np.int64) & 255, minlength=256)
        assert_distribution(counts, np.ones(256), false_alarm=RATE, detects=0.025)


def test_uniforms_are_multiples_of_2_to_the_minus_24_below_one():
    u = draws(dimensions=4).astype(float)
    assert_array_equal(u * 2**24, np.floor(u * 2**24))
    assert u.min() >= 0
    assert u.max() < 1


NEIGHBOURS = {
    "the two of one draw": lambda: draws()[:2],
    "draws in a row": lambda: draws()[[0, 2]],
    "draws in a row, other halves": lambda: draws()[[1, 2]],
    "pixels in a row": lambda: (draws()[0, :-1], draws()[0, 1:]),
    "pixels one below the other": lambda: (draws()[0, :-512], draws()[0, 512:]),
    "passes in a row": lambda: (draws(0)[0], draws(1)[0]),
    "seeds in a row": lambda: (draws(seed_number=1)[0], draws(seed_number=2)[0]),
    "next pixel, previous draw": lambda: (draws()[2, :-1], draws()[0, 1:]),
    "next pass, previous draw": lambda: (draws(0)[2], draws(1)[0]),
    "next pass, previous pixel": lambda: (draws(0)[0, 1:], draws(1)[0, :-1]),
    "next seed, previous pass": lambda: (draws(1, seed_number=1)[0], draws(0, seed_number=2)[0]),
}


@pytest.mark.parametrize("name", NEIGHBOURS)
def test_neighbours_are_independent(name):
    """Pairs in 16 x 16 bins, and their correlation: sees dependence of 2.5 % (rms), correlations of 0.012."""
    first, second = NEIGHBOURS[name]()
    assert_distribution(pairs(first, second), np.ones(256), false_alarm=RATE, detects=0.025, what=name)
    # of independent uniforms the product of deviations, scaled by its standard deviation 1/12, has mean 0
    product = 12 * (first.astype(float) - 0.5) * (second.astype(float) - 0.5)
    assert_mean(product, 0, false_alarm=RATE, detects=0.012, what=name)


@pytest.mark.parametrize("name", ["pixels in a row", "passes in a row", "next pass, previous pixel"])
def test_keys_that_are_only_added_up_are_caught(name, monkeypatch):
    """The companion: seed + pass + pixel as the key, or a walk along the golden ratio, share their draws."""

    def summed(seed_, pass_index, pixels):
        return (np.asarray(pixels).astype(np.uint64) + np.uint64(seed_ + pass_index)) * GOLDEN

    monkeypatch.setitem(globals(), "stream_keys", summed)
    if name == "pixels in a row":  # the next pixel's first draw is this one's second
        first, second = draws()[2, :-1], draws()[0, 1:]
    elif name == "passes in a row":
        first, second = draws(0)[2], draws(1)[0]
    else:
        first, second = draws(0)[0, 1:], draws(1)[0, :-1]
    with pytest.raises(AssertionError, match="wrong distribution"):
        assert_distribution(pairs(first, second), np.ones(256), false_alarm=RATE, detects=0.025)


def flipped_share(function, words, bit: int):
    """(64,) share of samples in which flipping ``bit`` of the word flips each bit of the result."""
    difference = function(words) ^ function(words ^ np.uint64(1 << bit))
    return np.unpackbits(difference.view(np.uint8).reshape(-1, 8), axis=1, bitorder="little").mean(axis=0)


def test_each_input_bit_flips_each_output_bit_half_the_time():
    """4096 pairs of bits, 16384 words each: standard deviation 0.0039, alarms beyond six (one in 10^5 runs).

    SplitMix64's mix 13 is itself not perfect: its worst pair of bits is off by about 0.003 (Stafford 2011).
    """

    def hashed(words):
        return mix(words, np.empty_like(words), np.empty_like(words))

    words = np.random.default_rng(seed(2)).integers(0, 2**64, 16384, dtype=np.uint64)
    share = np.stack([flipped_share(hashed, words, bit) for bit in range(64)])
    assert np.abs(share - 0.5).max() < 6 * 0.0039 + 0.003


@pytest.mark.parametrize("part", ["seed", "pass", "pixel"])
def test_each_bit_of_seed_pass_and_pixel_flips_half_the_key(part):
    """The low 12 bits of each: standard deviation 0.0156 (1024 keys), alarms beyond six."""
    numbers = np.random.default_rng(seed(3)).integers(0, 2**20, 1024)
    for bit in range(12):
        if part == "pixel":
            one, other = (stream_keys(5, 7, n) for n in (numbers, numbers ^ (1 << bit)))
        else:
            keys = {"seed": lambda n: stream_keys(int(n), 7, np.array([11])),
                    "pass": lambda n: stream_keys(5, int(n), np.array([11]))}[part]  # fmt: skip
            one, other = (np.concatenate([keys(n) for n in ns]) for ns in (numbers, numbers ^ (1 << bit)))
        flips = np.unpackbits((one ^ other).view(np.uint8).reshape(-1, 8), axis=1).mean(axis=0)
        assert np.abs(flips - 0.5).max() < 6 * 0.0156


def test_no_two_streams_of_many_pictures_share_a_key():
    keys = [stream_keys(s, p, PIXELS[: 2**14]) for s, p in itertools.product(range(4), range(8))]
    # a birthday among 2^19 of 2^64 keys: one chance in 10^8
    assert len(np.unique(np.concatenate(keys))) == 4 * 8 * 2**14


def test_any_seed_is_a_seed():
    for number in (0, -1, 2**63, 2**64 - 1, 2**70 + 3):
        assert len(np.unique(stream_keys(number, 0, PIXELS[:100]))) == 100
    assert (stream_keys(-1, 0, PIXELS[:9]) != stream_keys(1, 0, PIXELS[:9])).all()


def test_draws_do_not_depend_on_the_batch():
    """Forwards, backwards, one by one, through a small or a large source."""
    n = 300
    expected = draws(dimensions=3, pixels=PIXELS[:n])
    backwards = draws(dimensions=3, pixels=PIXELS[:n][::-1])
    assert_array_equal(backwards[:, ::-1], expected)
    one_by_one = np.concatenate([draws(dimensions=3, pixels=PIXELS[k : k + 1]) for k in range(n)], axis=1)
    assert_array_equal(one_by_one, expected)
    state, source = stream_keys(seed(1), 0, PIXELS[:n]), Uniforms(5 * n)
    assert_array_equal(np.concatenate([np.stack(source.draw(state)) for _ in range(3)]), expected)


def test_draws_of_some_streams_advance_those_alone():
    expected = draws(dimensions=2, pixels=PIXELS[:10])
    state, source = stream_keys(seed(1), 0, PIXELS[:10]), Uniforms(10)
    some = np.array([7, 2, 3])
    assert_array_equal(np.stack(source.draw_at(state, some)), expected[:2, some])
    after = np.stack(source.draw(state))
    rest = np.setdiff1d(np.arange(10), some)
    assert_array_equal(after[:, rest], expected[:2, rest])
    assert_array_equal(after[:, some], expected[2:, some])


def test_a_draw_stays_valid_through_the_next():
    state, source = stream_keys(0, 0, PIXELS[:10]), Uniforms(10)
    kept = source.draw(state)
    copies = [u.copy() for u in kept]
    source.draw(state)
    for u, copy in zip(kept, copies, strict=True):
        assert_array_equal(u, copy)
