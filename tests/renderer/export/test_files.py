"""Nothing that is not ours is replaced."""

from pathlib import Path

import pytest

from renderer.export.files import folder_name, write
from renderer.export.mitsuba import to_mitsuba
from renderer.scene.admission import admit
from sss_tools.errors import InputError
from sss_tools.shapes import icosphere
from tests.renderer.scenes import WHITE_SKY, camera, placed, scene, translucent


def export(radius=1.0, path=Path("scene.xml")):
    admitted, _ = admit(scene([placed(icosphere(radius, 1), translucent())], [WHITE_SKY], camera((0, 0, 6))))
    return to_mitsuba(admitted, folder_name(path), 4)


@pytest.fixture
def target(tmp_path):
    path = tmp_path / "scene.xml"
    write(export(), path)
    return path


def mesh_of(target):
    (mesh,) = (target.parent / "scene_files").iterdir()
    return mesh


def test_export_replaces_its_own_files(target):
    before = target.read_bytes(), mesh_of(target).read_bytes()
    write(export(), target)
    assert (target.read_bytes(), mesh_of(target).read_bytes()) == before
    write(export(radius=2.0), target)
    assert target.read_bytes() != before[0] and mesh_of(target).read_bytes() != before[1]


def test_folder_takes_the_documents_name_without_what_mitsuba_would_substitute():
    assert folder_name(Path("there/my scene$x.xml")) == "my-scene-x_files"


@pytest.mark.parametrize("edit", [lambda text: "<scene/>", lambda text: text.replace('value="4"', 'value="5"')])
def test_document_of_others_or_edited_since_is_left_alone(target, edit):
    changed = edit(target.read_text())
    target.write_text(changed)
    with pytest.raises(InputError, match="not written by sss-render"):
        write(export(), target)
    assert target.read_text() == changed


def test_mesh_of_others_is_left_alone_and_the_document_with_it(target):
    before = target.read_bytes()
    mesh_of(target).write_bytes(b"ply of somebody else")
    with pytest.raises(InputError, match="not written by sss-render"):
        write(export(), target)
    assert mesh_of(target).read_bytes() == b"ply of somebody else" and target.read_bytes() == before


def test_interrupted_export_can_be_repeated(target):
    target.unlink()  # files come before the document
    write(export(), target)
    target.unlink()
    with pytest.raises(InputError, match="not written by sss-render"):
        write(export(radius=2.0), target)


def test_wrong_names_are_refused(tmp_path):
    for name in ("scene.txt", "missing/scene.xml"):
        with pytest.raises(InputError):
            write(export(), tmp_path / name)
