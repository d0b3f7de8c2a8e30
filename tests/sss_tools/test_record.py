import json
import warnings

import numpy as np
import pytest

from sss_tools import shapes
from sss_tools.closedness import assess
from sss_tools.medium import Medium
from sss_tools.mesh import Mesh
from sss_tools.record import (
    RecordWarning,
    geometry_hash,
    read_record,
    read_repairs,
    read_waivers,
    record_path,
    write_record,
)
from sss_tools.validation.run import check_file, check_mesh
from sss_tools.validation.settings import Settings
from sss_tools.writing import write_mesh


@pytest.fixture
def recorded(tmp_path):
    mesh = shapes.punctured(shapes.icosphere(), [[0, 0, 1]], 0.3)
    path = tmp_path / "ball.ply"
    repairs = [{"name": "weld", "status": "applied"}]
    medium = Medium.preset("marble", "cm")
    write_record(path, mesh, check_mesh(mesh), "marble", medium, "cm", {"SSS101": "seen"}, repairs)
    return path, mesh


def test_a_record_lies_beside_its_mesh_and_says_what_was_found(recorded):
    path, mesh = recorded
    assert record_path(path).name == "ball.ply.sss.json"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        record = read_record(path, mesh)
    assert record.closedness == assess(mesh).closedness
    assert record.material == "marble"
    assert [finding["code"] for finding in record.findings] == ["SSS101"]
    assert [part["role"] for part in record.components] == ["solid"]
    assert record.waivers == {"SSS101": "seen"}
    assert record.repairs == [{"name": "weld", "status": "applied"}]


def test_a_record_holds_all_that_was_promised(recorded):
    path, _ = recorded
    data = json.loads(record_path(path).read_text())
    assert set(data) == {
        *("schema", "hash", "rules", "material", "medium", "unit"),
        *("closedness", "components", "findings", "waivers", "repairs"),
    }
    assert data["medium"]["sigma_s"] == Medium.preset("marble", "cm").sigma_s.tolist()


def test_waivers_outlive_the_rules_but_not_the_geometry(recorded):
    path, mesh = recorded
    sidecar = record_path(path)
    sidecar.write_text(json.dumps({**json.loads(sidecar.read_text()), "rules": "0"}))
    assert read_waivers(path, geometry_hash(mesh)) == ({"SSS101": "seen"}, [])
    assert read_waivers(path, "blake2b:other") == ({}, ["SSS101"])
    sidecar.write_text(json.dumps({**json.loads(sidecar.read_text()), "waivers": [{"code": "SSS101"}]}))
    with pytest.raises(ValueError, match="incomplete"):
        read_waivers(path, geometry_hash(mesh))
    sidecar.unlink()
    assert read_waivers(path, geometry_hash(mesh)) == ({}, [])


def test_repairs_belong_to_the_geometry_they_made(recorded):
    path, mesh = recorded
    assert read_repairs(path, geometry_hash(mesh)) == [{"name": "weld", "status": "applied"}]
    assert read_repairs(path, "blake2b:other") == []
    record_path(path).write_text("{")
    assert read_repairs(path, geometry_hash(mesh)) == []
    record_path(path).unlink()
    assert read_repairs(path, geometry_hash(mesh)) == []


def test_no_record_is_no_warning(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_record(tmp_path / "ball.ply", shapes.box()) is None


def test_a_record_of_other_geometry_is_ignored_with_a_warning(recorded):
    path, mesh = recorded
    moved = mesh.vertices.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 9)
    with pytest.warns(RecordWarning, match="other geometry"):
        assert read_record(path, Mesh(moved, mesh.faces)) is None
    with pytest.warns(RecordWarning, match="other geometry"):
        assert read_record(path, Mesh(mesh.vertices, mesh.faces[::-1])) is None


@pytest.mark.parametrize(
    ("tamper", "problem"),
    [
        (lambda data: {**data, "rules": "0"}, "other rules"),
        (lambda data: {**data, "schema": "sss-record/9"}, "schema"),
        (lambda data: {**data, "hash": None}, "other geometry"),
        (lambda data: {**data, "closedness": {}}, "incomplete"),
        (lambda data: {key: data[key] for key in data if key != "findings"}, "incomplete"),
        (lambda data: {key: data[key] for key in data if key != "waivers"}, "incomplete"),
        (lambda data: {key: data[key] for key in data if key != "repairs"}, "incomplete"),
        (lambda data: {**data, "repairs": "weld"}, "no list of objects"),
        (lambda data: {**data, "repairs": ["weld"]}, "no list of objects"),
        (lambda data: {**data, "repairs": [{"name": "weld"}]}, "incomplete.*status"),
        (lambda data: {**data, "findings": [{}]}, "incomplete.*code"),
        (lambda data: {**data, "components": {}}, "no list of objects"),
        (lambda data: {**data, "waivers": {}}, "no list of objects"),
        (lambda data: {**data, "material": 3}, "no name"),
        (lambda data: [data], "schema"),
    ],
)
def test_a_tampered_record_is_ignored_with_a_warning(recorded, tamper, problem):
    path, mesh = recorded
    sidecar = record_path(path)
    sidecar.write_text(json.dumps(tamper(json.loads(sidecar.read_text()))))
    with pytest.warns(RecordWarning, match=problem):
        assert read_record(path, mesh) is None


def test_half_a_record_is_ignored_with_a_warning(recorded):
    path, mesh = recorded
    sidecar = record_path(path)
    sidecar.write_bytes(sidecar.read_bytes()[:-40])
    with pytest.warns(RecordWarning, match="cannot be read"):
        assert read_record(path, mesh) is None


def test_the_hash_sees_geometry_alone():
    box = shapes.box()
    named = Mesh(box.vertices, box.faces, vertex_attributes={"uv": np.zeros((len(box.vertices), 2))})
    assert geometry_hash(box) == geometry_hash(named)
    assert geometry_hash(box) != geometry_hash(shapes.box(2.0))
    # a vertex more or less must not be made up for by the faces' bytes
    assert geometry_hash(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int))) != geometry_hash(
        Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    )


def test_a_record_is_not_written_through_a_link(tmp_path):
    """Whoever can put a link beside a mesh could otherwise choose what ``--record`` overwrites."""
    target, path = tmp_path / "precious", tmp_path / "ball.ply"
    target.write_text("as it was")
    write_mesh(shapes.icosphere(1.0, 1), path)
    record_path(path).symlink_to(target)
    report = check_file(path, Settings(record=True))
    assert target.read_text() == "as it was" and record_path(path).is_symlink()
    assert any("could not be written" in warning for warning in report.warnings)
