import pytest

from sss_tools.configuration import Configurations, codes_of, size_of
from sss_tools.errors import InputError
from sss_tools.validation.outcome import Severity

EVERYTHING = """
select = ["SSS1", "SSS2, sss3"]
ignore = ["SSS103"]
severity = { SSS202 = "error", open-sheet = "info" }
per-path-ignores = { "scans/*" = ["SSS101"], "x.ply" = ["SSS2"] }
unit = "cm"
material = "marble"
jobs = 3
timeout = 12
max-memory = "1.5G"
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder with nothing above it that counts, apart from the working directory."""
    (tmp_path / "project" / "scans" / "old").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path / "project"


def test_every_key_is_read(project):
    (project / "sss.toml").write_text(EVERYTHING)
    found = Configurations().of(project / "a.ply")
    assert found.source == project / "sss.toml"
    assert (found.select, found.ignore) == (("SSS1", "SSS2", "SSS3"), ("SSS103",))
    assert found.severity == {"SSS202": Severity.ERROR, "SSS102": Severity.INFO}
    assert (found.unit, found.material, found.jobs, found.timeout) == ("cm", "marble", 3, 12.0)
    assert found.max_memory == 3 * 2**29


def test_the_nearest_file_above_the_mesh_counts_alone(project):
    (project / "pyproject.toml").write_text('[tool.sss-check]\nunit = "m"\njobs = 2\n')
    (project / "scans" / "sss.toml").write_text('unit = "cm"\n')
    (project / "scans" / "old" / "pyproject.toml").write_text("[tool.ruff]\n")
    configurations = Configurations()
    assert configurations.of(project / "a.ply").unit == "m"
    below = configurations.of(project / "scans" / "old" / "a.ply")
    assert (below.unit, below.jobs) == ("cm", None)


def test_sss_toml_comes_before_pyproject_toml(project):
    (project / "pyproject.toml").write_text('[tool.sss-check]\nunit = "m"\n')
    (project / "sss.toml").write_text("")
    assert Configurations().of(project / "a.ply").unit is None


def test_the_working_directory_serves_meshes_that_have_no_file_above_them(project, monkeypatch):
    (project / "sss.toml").write_text('unit = "cm"\n')
    stray = project.parent / "elsewhere" / "a.ply"
    assert Configurations().of(stray).source is None
    monkeypatch.chdir(project / "scans")
    assert Configurations().of(stray).unit == "cm"


def test_codes_are_ignored_by_path(project):
    (project / "sss.toml").write_text(EVERYTHING)
    found = Configurations().of(project / "a.ply")
    assert found.ignored_for(project / "a.ply") == ()
    assert found.ignored_for(project / "scans" / "old" / "a.ply") == ("SSS101",)
    assert found.ignored_for(project / "scans" / "x.ply") == ("SSS101", "SSS2")
    assert found.ignored_for(project / "rescans" / "a.ply") == ()


def test_rules_go_by_code_by_the_beginning_of_a_code_and_by_name():
    assert codes_of("sss1, Self-Intersection,SSS204") == ("SSS1", "SSS302", "SSS204")
    for text in ("SSS9", "self", "SSS3021"):
        with pytest.raises(ValueError, match=text):
            codes_of(text)


def test_a_material_file_is_named_relative_to_the_configuration(project):
    (project / "jade.toml").write_text("")
    (project / "sss.toml").write_text('material = "jade.toml"\n')
    assert Configurations().of(project / "scans" / "a.ply").material == str(project / "jade.toml")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("selct = []", 'unknown key "selct".*did you mean "select"'),
        ("per-file-ignores = {}", 'did you mean "per-path-ignores"'),
        ('select = "SSS1"', "a list of codes"),
        ('select = ["SSS9"]', "a list of codes"),
        ("severity = { SSS202 = 'fatal' }", "error.*warning.*info"),
        ("severity = { SSS999 = 'error' }", "severity"),
        ("per-path-ignores = { 'a' = 'SSS1' }", "pattern"),
        ('unit = "furlong"', "one of"),
        ("jobs = 0", "whole number"),
        ("jobs = true", "whole number"),
        ("timeout = -1", "seconds above 0"),
        ('max-memory = "much"', "500M"),
        ("jobs = ", "no valid TOML"),
    ],
)
def test_what_cannot_be_used_is_one_line_that_says_what_can(project, text, problem):
    (project / "sss.toml").write_text(text)
    with pytest.raises(InputError, match=problem):
        Configurations().of(project / "a.ply")
    if "TOML" not in problem:
        (project / "sss.toml").unlink()
        (project / "pyproject.toml").write_text(f"[tool.sss-check]\n{text}")
        with pytest.raises(InputError, match=problem):
            Configurations().of(project / "a.ply")


def test_sizes_are_of_1024():
    assert [size_of(text) for text in ("1", "2k", "500M", "1.5 GiB", "2GB")] == [
        *(1, 2048, 500 * 2**20, 3 * 2**29, 2**31)
    ]
    for text in ("", "G", "1T", "0", "1..5G", "-1G"):
        with pytest.raises(ValueError):
            size_of(text)
