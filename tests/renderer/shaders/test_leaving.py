"""``auto`` leaves every fast shader before it is more wrong than it may be, along the axes of docs/limits.md.

By predictions alone, nothing is rendered: what the shaders are wrong by was measured by ``sss-chart stability``.
``tests/renderer/study/test_auto_leaves.py`` measures some of it again.
"""

import pytest

from renderer.scene.admission import admit
from renderer.scene.scene_file import load_scene
from renderer.shaders.selection import select
from renderer.study.studies import STUDIES

QUALITIES = (0.25, 0.5, 0.75, 1.0)
FAILURES = [
    # study, value, what diffuse, scalar and plumb are wrong by
    ("mean-free-path", 0.001, (0.125, 0.053, 0.053)),
    ("mean-free-path", 0.3, (0.435, 0.078, 0.078)),
    ("mean-free-path", 1.0, (0.511, 0.353, 0.357)),
    ("mean-free-path", 10.0, (0.491, 0.526, 0.526)),
    ("g", -0.9, (0.258, 0.253, 0.255)),
    ("g", 0.8, (0.253, 0.136, 0.143)),
    ("g", 0.97, (0.501, 0.347, 0.346)),
    ("noise", 0.4, (0.196, 0.195, 0.132)),
    ("noise", 0.8, (0.330, 0.263, 0.267)),
    ("hole-position", 0.0, (0.218, 0.033, 0.033)),
    ("view-distance", 0.6, (0.063, 0.068, 0.071)),
    ("light-distance", 0.2, (0.234, 0.168, 0.116)),
    ("light-distance", 1.05, (0.242, 0.220, 0.221)),
    ("terminator", 120.0, (0.339, 0.031, 0.055)),
    ("corner", 20.0, (0.294, 0.260, 0.179)),
    ("wall", 1.0, (0.411, 0.326, 0.183)),
]


def plans(tmp_path, study, value, qualities=QUALITIES):
    scene, _ = admit(load_scene(STUDIES[study].scene(value).write(tmp_path, "case")))
    return [select(scene, quality)[0] for quality in qualities]


@pytest.mark.parametrize(("study", "value", "errors"), FAILURES, ids=lambda one: str(one) if one in STUDIES else None)
def test_no_shader_is_chosen_that_is_more_wrong_than_allowed(tmp_path, study, value, errors):
    wrong = dict(zip(("diffuse", "scalar", "plumb"), errors, strict=True)) | {"path": 0.0}
    for plan in plans(tmp_path, study, value):
        assert wrong[plan.shader] <= plan.tolerance


@pytest.mark.parametrize(
    ("study", "value"), [("mean-free-path", 0.03), ("g", 0.0), ("noise", 0.003), ("light-distance", 16.0)]
)
def test_there_is_something_to_leave(tmp_path, study, value):
    assert any(plan.shader != "path" for plan in plans(tmp_path, study, value, (0.25, 0.4)))
