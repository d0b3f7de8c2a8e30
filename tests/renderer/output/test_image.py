"""Pictures as files."""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from renderer.output.film import Film
from renderer.output.image import Picture, check_writable, linear_to_srgb, merge, read, write
from sss_tools.errors import InputError

from .conftest import HEIGHT, WIDTH, film_of


@pytest.fixture
def picture(film) -> Picture:
    shader = np.full((HEIGHT, WIDTH), -1, np.int32)
    shader[1:3, 2:5] = 0
    depth = np.arange(HEIGHT * WIDTH, dtype=np.float32).reshape(HEIGHT, WIDTH)
    return Picture(film, 1.5, shader, shader.copy(), {"depth": depth})


def constant_picture(rows) -> Picture:
    """One pass in which row i has the radiance rows[i]."""
    film = Film.blank((WIDTH, len(rows)))
    radiance = np.broadcast_to(np.array(rows, np.float32)[:, None, None], (len(rows), WIDTH, 3))
    film.add_pass(0, radiance, np.ones((len(rows), WIDTH), bool))
    ids = np.zeros((len(rows), WIDTH), np.int32)
    return Picture(film, 0.0, ids, ids)


def read_png(path) -> np.ndarray:
    from PIL import Image

    with Image.open(path) as file:
        assert file.mode == "RGB"
        return np.asarray(file)


def read_exr(path) -> dict[str, np.ndarray]:
    import OpenEXR

    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


# ---- round trips ----


def test_npz_holds_the_contracts_arrays(tmp_path, picture):
    write(tmp_path / "a.npz", picture)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as file:
        assert file["image"].dtype == np.float32
        assert_array_equal(file["image"], picture.film.mean().astype(np.float32))
        assert_array_equal(file["stderr"], picture.film.stderr().astype(np.float32))
        assert file["passes"] == 40
        assert file["seconds"] == 1.5
        assert_array_equal(file["shader_id"], picture.shader_id)
        assert_array_equal(file["object_id"], picture.object_id)
        assert_array_equal(file["depth"], picture.aovs["depth"])


def test_npz_is_read_back_as_the_same_picture(tmp_path, picture):
    write(tmp_path / "a.npz", picture)
    again = read(tmp_path / "a.npz")
    assert_array_equal(again.film.sum, picture.film.sum)
    assert again.film.ranges == picture.film.ranges
    assert again.seconds == 1.5
    assert again.aovs.keys() == {"depth"}
    assert_array_equal(again.shader_id, picture.shader_id)


def test_exr_holds_linear_radiance_and_a_layer_for_every_array(tmp_path, picture):
    write(tmp_path / "a.exr", picture)
    channels = read_exr(tmp_path / "a.exr")
    mean = picture.film.mean().astype(np.float32)
    for k, name in enumerate("RGB"):
        assert channels[name].dtype == np.float32
        assert_array_equal(channels[name], mean[..., k])
        assert_array_equal(channels[f"stderr.{name}"], picture.film.stderr()[..., k].astype(np.float32))
    assert_array_equal(channels["shader_id.Y"], picture.shader_id)
    assert_array_equal(channels["object_id.Y"], picture.object_id)
    assert_array_equal(channels["depth.Y"], picture.aovs["depth"])


def test_exr_is_read_back_as_an_environment(tmp_path, picture):
    from renderer.scene.environment_image import read_environment_image

    write(tmp_path / "a.exr", picture)
    assert_array_equal(read_environment_image(tmp_path / "a.exr"), picture.film.mean().astype(np.float32))


def test_png_is_srgb_cut_at_one(tmp_path):
    write(tmp_path / "a.png", constant_picture([0, 0.001, 0.2140, 0.5, 1, 7]))
    # 0.2140 is the linear value of sRGB one half; 0.001 lies on the linear part: 255 * 12.92 * 0.001 = 3.3
    assert read_png(tmp_path / "a.png")[:, 0, 0].tolist() == [0, 3, 127, 188, 255, 255]


def test_png_decodes_to_what_was_written(tmp_path):
    from renderer.scene.environment_image import read_environment_image

    values = np.linspace(0, 1, 64)
    write(tmp_path / "a.png", constant_picture(values))
    # half a step of 8 bits, at most 1/510 in sRGB, where the curve's slope is at most 2.3
    assert_allclose(read_environment_image(tmp_path / "a.png")[:, 0, 0], values, atol=2.3 / 510)


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npz"])
def test_row_0_is_on_top(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    write(path, constant_picture([1, 0, 0]))
    if suffix == ".png":
        column = read_png(path)[:, 0, 0] / 255
    elif suffix == ".exr":
        column = read_exr(path)["R"][:, 0]
    else:
        column = np.load(path)["image"][:, 0, 0]
    assert column.tolist() == [1, 0, 0]


def test_pixel_without_a_sample_is_magenta(tmp_path):
    picture = constant_picture([np.nan, 0.0])
    write(tmp_path / "a.png", picture)
    assert read_png(tmp_path / "a.png")[:, 0].tolist() == [[255, 0, 255], [0, 0, 0]]


def test_suffix_counts_in_any_case(tmp_path):
    write(tmp_path / "a.PNG", constant_picture([1]))
    assert (read_png(tmp_path / "a.PNG") == 255).all()


def test_srgb_curve_is_continuous_and_ends_at_one():
    assert linear_to_srgb(np.array([0.0, 1.0])) == pytest.approx([0, 1])
    below, above = linear_to_srgb(np.array([0.0031308, 0.0031309]))
    assert 0 < above - below < 1e-5


# ---- merging ----


def test_parts_merge_to_the_whole(tmp_path, samples, picture):
    for name, start, stop in (("b", 15, 40), ("a", 0, 15)):
        write(
            tmp_path / f"{name}.npz", Picture(film_of(*samples, start, stop), 1.0, picture.shader_id, picture.object_id)
        )
    paths = [tmp_path / "a.npz", tmp_path / "b.npz"]
    merged = merge({path: read(path) for path in paths})
    assert merged.film.ranges == ((0, 40),)
    assert merged.seconds == 2
    assert_allclose(merged.film.mean(), picture.film.mean(), rtol=1e-12)
    assert_array_equal(merged.object_id, picture.object_id)


def test_part_of_another_scene_is_refused_by_name(tmp_path, picture):
    stranger = Picture(Film.blank((WIDTH, HEIGHT), "other", 3), 0, picture.shader_id, picture.object_id)
    with pytest.raises(InputError, match=r"b\.npz: does not go with .*a\.npz: the scene hash differs"):
        merge({tmp_path / "a.npz": picture, tmp_path / "b.npz": stranger})


def test_parts_with_passes_in_common_are_refused(tmp_path, picture):
    with pytest.raises(InputError, match="twice"):
        merge({tmp_path / "a.npz": picture, tmp_path / "b.npz": picture})


def test_merging_nothing_is_refused():
    with pytest.raises(InputError):
        merge({})


@pytest.mark.parametrize("content", [b"", b"nonsense" * 100, None], ids=["empty", "nonsense", "truncated"])
def test_corrupt_part_is_refused(tmp_path, picture, content):
    path = tmp_path / "a.npz"
    write(path, picture)
    path.write_bytes(path.read_bytes()[:-200] if content is None else content)
    with pytest.raises(InputError, match="holds no film"):
        read(path)


def test_npz_without_a_film_is_refused(tmp_path):
    np.savez(tmp_path / "a.npz", image=np.ones((2, 2, 3)))
    with pytest.raises(InputError, match="holds no film"):
        read(tmp_path / "a.npz")


def test_npy_for_a_part_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.ones(3))
    with pytest.raises(InputError, match="holds no film"):
        read(tmp_path / "a.npy")


def test_missing_part_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "a.npz")


# ---- where nothing can be written ----


@pytest.mark.parametrize(
    ("name", "said"),
    [
        pytest.param("a.jpg", '".jpg" is no kind of picture; end it in .png, .exr, .npz', id="unknown-suffix"),
        pytest.param("a", "the name has no suffix", id="no-suffix"),
        pytest.param("missing/a.png", "there is no folder", id="no-folder"),
        pytest.param("file.txt/a.png", "there is no folder", id="file-for-a-folder"),
        pytest.param("folder.png", "is a folder", id="folder"),
        pytest.param("x" * 300 + ".png", "cannot be written", id="name-too-long"),
        pytest.param("x" * 250 + ".png", "cannot be written", id="no-name-beside-it"),
    ],
)
@pytest.mark.parametrize(
    "act", [check_writable, lambda path: write(path, constant_picture([1]))], ids=["check", "write"]
)
def test_output_that_cannot_be_written_is_refused(tmp_path, act, name, said):
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file.txt").write_text("")
    with pytest.raises(InputError) as caught:
        act(tmp_path / name)
    assert said in caught.value.line()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file.txt", "folder.png"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind here")
def test_folder_without_permission_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(InputError, match="cannot be written"):
            check_writable(tmp_path / "a.png")
    finally:
        tmp_path.chmod(0o700)


def test_write_protected_file_is_refused(tmp_path, monkeypatch):
    (tmp_path / "a.png").write_bytes(b"old")
    monkeypatch.setattr(os, "access", lambda *_: False)  # permissions do not bind the superuser
    with pytest.raises(InputError, match="write-protected"):
        check_writable(tmp_path / "a.png")


def test_check_leaves_an_existing_file_and_nothing_else(tmp_path):
    (tmp_path / "a.png").write_bytes(b"old")
    check_writable(tmp_path / "a.png")
    check_writable(tmp_path / "b.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    assert (tmp_path / "a.png").read_bytes() == b"old"


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npz"])
def test_failed_write_is_one_line_and_keeps_the_old_file(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(InputError, match="No space left on device"):
        write(path, constant_picture([1]))
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"old"


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npz"])
def test_existing_file_is_replaced(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")
    write(path, constant_picture([1]))
    assert path.stat().st_size > 50
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@pytest.mark.skipif(os.name == "nt", reason="links need privileges there")
def test_symbolic_link_is_written_through(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "a.png").symlink_to(tmp_path / "there" / "b.png")
    write(tmp_path / "a.png", constant_picture([1]))
    assert (tmp_path / "a.png").is_symlink()
    assert (read_png(tmp_path / "there" / "b.png") == 255).all()


@pytest.mark.skipif(os.name == "nt", reason="umask is POSIX")
def test_file_has_the_permissions_of_any_new_file(tmp_path):
    write(tmp_path / "a.png", constant_picture([1]))
    (tmp_path / "plain").write_text("")
    assert (tmp_path / "a.png").stat().st_mode == (tmp_path / "plain").stat().st_mode
