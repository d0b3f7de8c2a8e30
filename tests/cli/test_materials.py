import numpy as np
import pytest

from cli.materials import medium_of
from sss_tools.errors import InputError
from sss_tools.medium import Medium


def test_a_preset_is_in_the_meshs_unit():
    np.testing.assert_allclose(medium_of("marble", "cm").sigma_t, 10 * Medium.preset("marble").sigma_t)


@pytest.mark.parametrize(
    "text",
    [
        "sigma_a = 0.1\nsigma_s = 2.0\ng = 0.5",
        'type = "translucent"\nunit = "cm"\nsigma_a = 1.0\nsigma_s = 20.0\ng = 0.5',
    ],
)
def test_a_file_has_the_keys_of_a_material_and_a_unit_of_its_own(tmp_path, text):
    path = tmp_path / "jade.toml"
    path.write_text(text)
    for unit, factor in (("mm", 1), ("m", 1000)):
        medium = medium_of(str(path), unit)
        np.testing.assert_allclose(medium.sigma_a, 0.1 * factor)
        np.testing.assert_allclose(medium.sigma_s, 2.0 * factor)
        assert medium.g == 0.5


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('type = "mirror"', "opaque"),
        ("sigma_q = 1", 'unknown key "sigma_q"'),
        ('unit = "ell"\npreset = "marble"', "unit"),
        ("preset = ", "no valid TOML"),
        ("sigma_a = -1\nsigma_s = 1", "sigma_a"),
    ],
)
def test_a_file_that_cannot_be_used_is_an_input_error_that_names_it(tmp_path, text, problem):
    path = tmp_path / "jade.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=problem) as caught:
        medium_of(str(path))
    assert caught.value.subject == str(path)


def test_a_name_that_is_nothing_has_the_nearest_preset_named():
    with pytest.raises(InputError, match='did you mean "marble"'):
        medium_of("marbel")
