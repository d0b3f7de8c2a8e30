"""Whether VTK can draw is found out before it can end the process."""

import sys

import pytest

from renderer.inspection import gl


@pytest.fixture(autouse=True)
def no_memory(monkeypatch):
    monkeypatch.setenv(gl.WINDOW, "")
    monkeypatch.delenv(gl.WINDOW)


@pytest.mark.parametrize(
    "question",
    ["import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "pass"],
    ids=["crash", "silence"],
)
def test_no_picture_is_no_gl_and_the_packages_are_named(question):
    drawable = gl.preflight(question)
    assert drawable.window is None
    for package in ("libegl1", "mesa-libEGL", "mesalib"):
        assert package in drawable.problem
    assert "\n" not in drawable.problem


def test_wrong_colours_are_no_gl():
    assert "wrong colours" in gl.preflight("import sys; sys.exit('it draws wrong colours')").problem


def test_without_pyvista_its_installation_is_named():
    assert "pip install" in gl.preflight("import no_such_module_as_vtk").problem


def test_a_library_that_hangs_is_no_gl(monkeypatch):
    monkeypatch.setattr(gl, "PATIENCE", 0.3)
    assert "did not answer" in gl.preflight("import time; time.sleep(30)").problem


def test_what_works_is_remembered(monkeypatch):
    assert gl.preflight("print('drawn by vtkSomeWindow')").window == "vtkSomeWindow"
    import os

    assert os.environ[gl.WINDOW] == "vtkSomeWindow"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="libraries are hidden from the loader as on Linux")
def test_vtk_without_any_library_is_survived(tmp_path, monkeypatch):
    pytest.importorskip("vtkmodules")
    for name in ("libEGL.so.1", "libEGL.so", "libGL.so.1", "libGL.so", "libOSMesa.so", "libOSMesa.so.8",
                 "libOSMesa.so.6", "libGLX.so.0", "libOpenGL.so.0"):  # fmt: skip
        (tmp_path / name).write_text("no library")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    monkeypatch.delenv("DISPLAY", raising=False)
    assert gl.preflight().problem == gl.MISSING
