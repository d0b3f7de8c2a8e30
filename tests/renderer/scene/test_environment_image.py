"""Images of radiance."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.scene.environment_image import read_environment_image
from sss_tools.errors import InputError


def ramp() -> np.ndarray:
    """(2, 4, 3) float32, every number another."""
    return np.arange(24, dtype=np.float32).reshape(2, 4, 3) / 4


def write_exr(path, **channels):
    import OpenEXR

    OpenEXR.File({"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}, channels).write(str(path))


@pytest.mark.parametrize("dtype", [np.float32, np.float16])
def test_exr_is_read_with_row_0_on_top(tmp_path, dtype):
    write_exr(tmp_path / "sky.exr", RGB=ramp().astype(dtype))
    image = read_environment_image(tmp_path / "sky.exr")
    assert image.dtype == np.float32
    assert_array_equal(image, ramp())  # quarters up to 6 are exact in half precision


def test_alpha_and_other_layers_of_an_exr_are_passed_over(tmp_path):
    red, green, blue = np.moveaxis(ramp(), -1, 0).copy()
    write_exr(tmp_path / "sky.exr", R=red, G=green, B=blue, A=np.full((2, 4), 9, np.float32), **{"depth.Z": red})
    assert_array_equal(read_environment_image(tmp_path / "sky.exr"), ramp())


def test_exr_of_luminance_is_grey(tmp_path):
    write_exr(tmp_path / "sky.exr", Y=ramp()[..., 0].copy())
    assert_array_equal(read_environment_image(tmp_path / "sky.exr"), np.repeat(ramp()[..., :1], 3, axis=2))


def test_exr_without_colour_is_refused(tmp_path):
    write_exr(tmp_path / "sky.exr", **{"depth.Z": ramp()[..., 0].copy()})
    with pytest.raises(InputError, match="no channels R, G, B or Y"):
        read_environment_image(tmp_path / "sky.exr")


def test_npy_and_npz_are_read(tmp_path):
    np.save(tmp_path / "sky.npy", ramp().astype(np.float64))
    np.savez(tmp_path / "sky.npz", image=ramp())
    assert_array_equal(read_environment_image(tmp_path / "sky.npy"), ramp())
    assert_array_equal(read_environment_image(tmp_path / "sky.npz"), ramp())


def test_png_is_decoded_from_srgb(tmp_path):
    from PIL import Image

    Image.fromarray(np.array([[[0, 188, 255], [10, 0, 0]]], np.uint8)).save(tmp_path / "sky.PNG")
    image = read_environment_image(tmp_path / "sky.PNG")
    # 188 / 255 is the sRGB value nearest to one half; 10 / 255 is on the linear part, 12.92 times below
    assert_allclose(image[0, 0], [0, 0.5, 1], atol=0.003)
    assert_allclose(image[0, 1, 0], 10 / 255 / 12.92, rtol=1e-6)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.5, 1e39], ids=["nan", "inf", "negative", "beyond-float32"])
def test_impossible_radiance_is_refused_with_its_count(tmp_path, value):
    image = ramp().astype(np.float64)
    image[1, 2, 0] = value
    np.save(tmp_path / "sky.npy", image)
    with pytest.raises(InputError, match="1 values are negative or not finite"):
        read_environment_image(tmp_path / "sky.npy")


@pytest.mark.parametrize("shape", [(4, 3), (4,), (0, 4, 3), (2, 4, 4)])
def test_other_shapes_are_refused(tmp_path, shape):
    np.save(tmp_path / "sky.npy", np.ones((*shape, 1) if len(shape) == 2 else shape))
    with pytest.raises(InputError, match="shape"):
        read_environment_image(tmp_path / "sky.npy")


@pytest.mark.parametrize("suffix", [".exr", ".npy", ".npz", ".png", ".jpg"])
@pytest.mark.parametrize("content", [b"", b"nonsense " * 50], ids=["empty", "nonsense"])
def test_corrupt_image_is_refused(tmp_path, capfd, suffix, content):
    path = tmp_path / f"sky{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot be read") as caught:
        read_environment_image(path)
    assert str(path) in caught.value.line()
    assert capfd.readouterr() == ("", "")  # the libraries say nothing beside it


@pytest.mark.parametrize("suffix", [".exr", ".npy", ".npz", ".png"])
def test_truncated_image_is_refused(tmp_path, capfd, suffix):
    from PIL import Image

    noise = np.random.default_rng(1).random((32, 64, 3)).astype(np.float32)  # so that nothing compresses away
    path = tmp_path / f"sky{suffix}"
    if suffix == ".exr":
        write_exr(path, RGB=noise)
    elif suffix == ".png":
        Image.fromarray((255 * noise).astype(np.uint8)).save(path)
    else:
        (np.save if suffix == ".npy" else np.savez)(path, noise)
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(InputError, match="cannot be read"):
        read_environment_image(path)
    assert capfd.readouterr() == ("", "")


def test_missing_image_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such environment image"):
        read_environment_image(tmp_path / "sky.exr")


def test_unknown_kind_is_refused_naming_the_known(tmp_path):
    with pytest.raises(InputError, match=r"\.exr"):
        read_environment_image(tmp_path / "sky.gif")
