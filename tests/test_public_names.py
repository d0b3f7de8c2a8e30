"""What the packages promise is there."""

import importlib
import subprocess
import sys

import pytest


@pytest.mark.parametrize("package", ["sss_tools", "renderer"])
def test_every_promised_name_is_there(package):
    module = importlib.import_module(package)
    for name in module.__all__:
        assert getattr(module, name).__doc__ or isinstance(getattr(module, name), dict)
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = module.no_such_name


def test_importing_the_packages_imports_nothing_heavy():
    code = "import sys, sss_tools, renderer; print(*({'numpy', 'scipy', 'trimesh'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
