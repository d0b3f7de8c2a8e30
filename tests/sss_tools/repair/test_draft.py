from dataclasses import fields

import numpy as np

from sss_tools.closedness import assess
from sss_tools.mesh import Mesh
from sss_tools.repair.draft import Draft
from sss_tools.shapes import icosphere, joined, moved


def opened():
    """A ball with two holes beside a closed one."""
    ball = icosphere(1.0, 2)
    return joined(Mesh(ball.vertices, ball.faces[7:-5]), moved(ball, [3, 0, 0]))


def with_copies(mesh):
    """The same surface with a vertex that no face uses and one that is there twice."""
    faces = mesh.faces.copy()
    faces[-1, 0] = len(mesh.vertices) + 1
    copied = mesh.vertices[mesh.faces[-1, 0]]
    return Mesh(np.concatenate([mesh.vertices, [[9.0, 9, 9]], [copied]]), faces)


def test_a_draft_that_is_all_of_its_source_is_its_source():
    used = opened()
    mesh = Mesh(used.vertices[np.unique(used.faces)], np.unique(used.faces, return_inverse=True)[1].reshape(-1, 3))
    assert Draft.of(mesh).mesh is mesh


def test_a_draft_has_no_copies_and_no_unused_points():
    draft = Draft.of(with_copies(opened()))
    assert len(draft.mesh.vertices) == len(np.unique(opened().faces))
    np.testing.assert_array_equal(draft.mesh.vertices[draft.mesh.faces], draft.source.vertices[draft.source.faces])


def test_the_sources_assessment_is_that_of_the_bare_geometry():
    """Which is what makes it right to ask for it once."""
    draft = Draft.of(with_copies(opened()))
    bare = Mesh(draft.mesh.vertices.copy(), draft.mesh.faces)
    expected = assess(bare)
    assert draft.assessment is assess(draft.source)
    for field in fields(expected):
        mine, theirs = getattr(draft.assessment, field.name), getattr(expected, field.name)
        if isinstance(theirs, np.ndarray):
            np.testing.assert_array_equal(mine, theirs)
        elif field.name != "interior":
            assert mine == theirs
    assert len(expected.closedness.holes) > 0


def test_other_faces_are_assessed_anew():
    draft = Draft.of(opened())
    changed = draft.with_faces(draft.topology.faces[:-1], "one face less")
    assert len(changed.assessment.closedness.holes) == len(draft.assessment.closedness.holes) + 1
