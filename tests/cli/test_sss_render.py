"""What sss-render writes, prints and reports."""

import json
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.sss_render import main
from renderer.enough import LEAST
from sss_tools import shapes
from sss_tools.mesh import Mesh
from sss_tools.writing import write_mesh

EXR_MAGIC, PNG_MAGIC = b"\x76\x2f\x31\x01", b"\x89PNG"


def render(*arguments, source="scene.toml", out="out.npz", status=0):
    """Run the command, with the path shader if nothing else is asked for, and read the npz it wrote."""
    assert main([source, "-o", out, "--shader", "path", *map(str, arguments)]) == status
    if out.endswith(".npz") and status == 0:
        with np.load(out) as file:
            return dict(file)
    return None


def reported(*arguments, **options):
    render("--report", "report.json", *arguments, **options)
    return json.loads(Path("report.json").read_text())


def edit(old, new):
    """Change the scene file, where ``old`` must be."""
    text = Path("scene.toml").read_text()
    assert old in text
    Path("scene.toml").write_text(text.replace(old, new))


@pytest.mark.parametrize("source", ["scene.toml", "ball.ply"])
@pytest.mark.parametrize("kind", ["png", "exr", "npz"])
def test_a_scene_and_a_bare_mesh_become_a_picture_of_each_kind(workplace, source, kind):
    render("--size", "24x20", "--passes", 1, source=source, out=f"out.{kind}")
    magic = {"png": PNG_MAGIC, "exr": EXR_MAGIC, "npz": b"PK"}[kind]
    assert Path(f"out.{kind}").read_bytes().startswith(magic)
    assert sorted(path.name for path in workplace.iterdir()) == ["ball.ply", f"out.{kind}", "scene.toml"]


def test_npz_holds_the_arrays_of_the_contract(workplace):
    arrays = render("--passes", 3)
    assert arrays["image"].shape == arrays["stderr"].shape == (20, 24, 3)
    assert arrays["image"].dtype == arrays["stderr"].dtype == np.float32
    assert arrays["passes"] == 3 and arrays["seconds"] > 0
    for name in ("shader_id", "object_id"):
        assert arrays[name].shape == (20, 24)
        assert set(np.unique(arrays[name])) == {-1, 0}  # path, the first object; nothing in the corners
        assert arrays[name][0, 0] == -1 and arrays[name][10, 12] == 0
    np.testing.assert_array_equal(arrays["image"][0, 0], np.float32([0.5, 0.6, 0.7]))
    assert np.isfinite(arrays["stderr"]).all() and (arrays["stderr"][arrays["film_hits"] == 3] > 0).mean() > 0.9


def test_one_pass_and_biased_shaders_have_no_standard_error(workplace):
    assert np.isnan(render("--passes", 1)["stderr"]).all()
    arrays = render("--passes", 2, "--shader", "plumb")
    on_object = arrays["object_id"] == 0
    assert (arrays["shader_id"][on_object] == 1).all()
    assert np.isnan(arrays["stderr"][10, 12]).all() and np.isfinite(arrays["stderr"][0, 0]).all()


def test_a_bare_mesh_is_500_pixels_wide_and_high(workplace):
    assert render("--passes", 1, "--shader", "scalar", source="ball.ply")["image"].shape == (500, 500, 3)


def test_a_bare_mesh_takes_its_material_from_a_preset_or_a_file(workplace):
    """Either is turned into the mesh's unit."""
    Path("stone.toml").write_text('preset = "marble"\n')
    common = ("--passes", 1, "--size", "16x16", "--unit", "cm")
    named = render(*common, "--material", "marble", source="ball.ply")
    filed = render(*common, "--material", "stone.toml", source="ball.ply")
    default = render(*common, source="ball.ply")
    np.testing.assert_array_equal(named["image"], filed["image"])
    assert not np.array_equal(named["image"], default["image"])


def test_64_passes_are_the_default(workplace):
    assert render("--size", "6x5", "--shader", "scalar")["passes"] == 64


def test_aovs_are_written_beside_the_image(workplace):
    arrays = render("--passes", 1, "--aov", "depth,normal")
    assert arrays["depth"][0, 0] == np.inf and arrays["normal"].shape == (20, 24, 3)
    # the camera is sqrt(37) from the centre of a ball of radius 1
    assert arrays["depth"][10, 12] == pytest.approx(37**0.5 - 1, abs=0.02)


def test_the_report_has_the_fields_of_the_contract(workplace):
    report = reported("--passes", 2)
    assert report["schema"] == "sss-render/1" and len(report["scene_hash"]) >= 32 and report["passes"] == 2
    (thing,) = report["objects"]
    wanted = {"name", "state", "hole_handling", "shader", "reason", "distance", "mean_free_path_px", "size_px",
              "predicted_error"}  # fmt: skip
    assert wanted <= set(thing)
    assert (thing["name"], thing["state"], thing["hole_handling"]) == ("ball", "closed", "strict")
    seconds = report["seconds"]
    assert set(seconds) == {"total", "load", "check", "close", "build", "render", "write", "frame"}
    assert seconds["frame"] == pytest.approx(seconds["render"] / 2)
    assert seconds["total"] >= sum(seconds[name] for name in ("load", "check", "build", "render", "write"))
    assert report["rays"] > 0 and report["bounces"] > 0 and report["peak_memory"] > 10_000_000
    assert report["rare_events"] == {
        "leaked_rays": 0,
        "parity_contradictions": 0,
        "terminated_at_holes": 0,
        "non_finite": 0,
    }


def test_the_mean_relative_standard_error_is_over_pixels_that_always_show_the_object(workplace):
    report = reported("--passes", 8)
    with np.load("out.npz") as arrays:
        whole = arrays["film_hits"] == 8
        ratio = arrays["stderr"][whole] / arrays["image"][whole]
    assert report["mean_relative_stderr"] == pytest.approx(float(ratio.mean()), rel=1e-5)  # float32 arrays
    assert reported("--passes", 2, "--shader", "plumb")["mean_relative_stderr"] is None


def test_the_seed_decides_the_noise_and_nothing_else_does(workplace):
    first, again, other = (render("--passes", 2, "--seed", seed)["image"] for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_one_thread_and_two_make_the_same_picture_bit_for_bit(workplace):
    one, two = (render("--passes", 3, "--threads", threads) for threads in (1, 2))
    for name in ("image", "stderr", "film_sum", "film_sum_of_squares"):
        np.testing.assert_array_equal(one[name], two[name])


def test_ranges_of_passes_merge_into_the_whole(workplace):
    whole = render("--passes", 6)
    render("--pass-range", "4:6", out="c.npz")
    render("--pass-range", "0:1", out="a.npz")
    render("--pass-range", "1:4", out="b.npz")
    assert main(["merge", "c.npz", "a.npz", "b.npz", "-o", "merged.npz"]) == 0
    with np.load("merged.npz") as merged:
        assert merged["passes"] == 6
        np.testing.assert_allclose(merged["film_sum"], whole["film_sum"], rtol=1e-12, atol=0)
        np.testing.assert_allclose(merged["film_sum_of_squares"], whole["film_sum_of_squares"], rtol=1e-12, atol=0)
    assert main(["merge", "a.npz", "a.npz", "-o", "twice.npz"]) == 2 and not Path("twice.npz").exists()
    assert main(["merge", "a.npz", "b.npz", "-o", "merged.png"]) == 0
    assert Path("merged.png").read_bytes().startswith(PNG_MAGIC)


@pytest.mark.parametrize("other", [["--seed", "1"], ["--size", "20x20"], ["--shader", "plumb"], []],
                         ids=["seed", "size", "shader", "the same passes"])  # fmt: skip
def test_parts_of_different_renders_do_not_merge(workplace, capsys, other):
    render("--passes", 1, out="a.npz")
    render("--pass-range", "1:2" if other else "0:1", *other, out="b.npz")
    capsys.readouterr()
    assert main(["merge", "a.npz", "b.npz", "-o", "merged.npz"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("sss-render: error: b.npz: ") and error.count("\n") == 1
    assert not Path("merged.npz").exists()


def test_resume_goes_on_to_the_same_picture(workplace):
    whole = render("--passes", 5)
    render("--passes", 2, out="resumed.npz")
    resumed = render("--passes", 5, "--resume", out="resumed.npz")
    assert resumed["passes"] == 5
    np.testing.assert_allclose(resumed["film_sum"], whole["film_sum"], rtol=1e-12, atol=0)


def test_resume_refuses_another_scene_and_leaves_what_is_there(workplace, capsys):
    render("--passes", 2)
    before = Path("out.npz").read_bytes()
    edit("sigma_t = 6.0", "sigma_t = 6.5")
    capsys.readouterr()
    render("--passes", 5, "--resume", status=2)
    error = capsys.readouterr().err
    assert "out.npz: belongs to another render" in error and error.count("\n") == 1
    assert Path("out.npz").read_bytes() == before


def test_resume_without_anything_to_resume_is_refused(workplace, capsys):
    render("--passes", 2, "--resume", status=2)
    assert "nothing to resume" in capsys.readouterr().err
    assert not Path("out.npz").exists()


def test_a_time_too_short_for_anything_still_gives_one_pass(workplace):
    # this process began long ago, so the time was over before the start
    assert render("--time", 0.001)["passes"] == 1


def test_time_counts_from_process_start_and_overshoots_by_one_pass_at_most(workplace, start):
    budget = 4.0
    begun = time.monotonic()
    process = start(
        "import sys; from cli.sss_render import main; sys.exit(main(sys.argv[1:]))",
        *("scene.toml", "-o", "out.npz", "--time", str(budget), "--report", "report.json"),
        *("--shader", "path", "--size", "64x64", "--threads", "1"),
    )
    assert process.wait() == 0
    took = time.monotonic() - begun
    report = json.loads(Path("report.json").read_text())
    seconds = report["seconds"]
    assert report["passes"] >= 1 and seconds["total"] <= took
    # on a busy machine even set-up may outlast the budget; beyond both there is one pass, half a second for passes
    # that are not all alike, and the writing
    before = seconds["total"] - seconds["render"] - seconds["write"]
    assert seconds["total"] <= max(budget, before) + seconds["frame"] + 0.5 + seconds["write"]
    # nor does it stop long before
    assert seconds["total"] >= budget - 2 * seconds["frame"] - 1.0


def test_an_interrupt_does_not_wait_for_long_passes(workplace, start):
    """A pass of this scene takes tens of seconds. Nothing is done by then, and nothing is written."""
    edit("albedo = [0.9, 0.8, 0.7]", "albedo = [0.99999, 0.9999, 0.999]")
    edit("sigma_t = 6.0", "sigma_t = [300.0, 500.0, 600.0]")
    process = start(
        "import sys; from cli.sss_render import main; sys.exit(main(sys.argv[1:]))",
        *("scene.toml", "-o", "out.npz", "--shader", "path", "--size", "200x200"),
    )
    process.stdout.readline()  # what will be done, said before the first pass
    time.sleep(2)
    asked = time.monotonic()
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 130
    assert time.monotonic() - asked < 10
    assert not Path("out.npz").exists()


@pytest.mark.parametrize("size", ["8x8", "96x96"])
def test_time_is_kept_where_passes_are_slow(workplace, start, size):
    """Some 20 mean free paths to the centre and 100 collisions a path: 64 passes would take minutes."""
    edit("albedo = [0.9, 0.8, 0.7]", "albedo = [0.99, 0.98, 0.97]")
    edit("sigma_t = 6.0", "sigma_t = [20.0, 30.0, 40.0]")
    begun = time.monotonic()
    process = start(
        "import sys; from cli.sss_render import main; sys.exit(main(sys.argv[1:]))",
        *("scene.toml", "-o", "out.npz", "--time", "6", "--report", "report.json", "--shader", "path", "--size", size),
    )
    assert process.wait() == 0
    took = time.monotonic() - begun
    report = json.loads(Path("report.json").read_text())
    assert report["passes"] >= 1
    # with one pass done, what is under way is dropped: half a second for the steps, the writing and the exit
    assert took <= 6.5 if report["passes"] > 1 else took <= 6.5 + report["seconds"]["render"]


@pytest.mark.parametrize("kind", ["png", "exr", "npz"])
def test_the_preview_ends_as_the_picture(workplace, kind):
    render("--passes", 2, "--preview", f"preview.{kind}", out=f"out.{kind}")
    if kind == "npz":
        with np.load("preview.npz") as preview, np.load("out.npz") as out:
            np.testing.assert_array_equal(preview["image"], out["image"])
    else:
        assert Path(f"preview.{kind}").read_bytes() == Path(f"out.{kind}").read_bytes()


@pytest.mark.parametrize("name", ["out.npz", "out.npz.unfinished.npz", "preview.jpg", "missing/preview.png"])
def test_previews_that_would_harm_the_picture_or_cannot_be_written_are_refused(workplace, name):
    render("--preview", name, status=2)
    assert not Path("out.npz").exists()


def test_adaptive_passes_cannot_be_split(workplace, capsys):
    render("--adaptive", "--pass-range", "0:4", status=2)
    assert "--adaptive: decides later passes by earlier ones" in capsys.readouterr().err


def test_a_target_error_is_met(workplace):
    report = reported("--target-error", 0.2)
    assert report["mean_relative_stderr"] <= 0.2 and report["target_error"] == 0.2 and report["target_met"]
    # one pass fewer would not have done: the error falls with the root of the passes
    assert report["mean_relative_stderr"] > 0.2 * 0.8 or report["passes"] == 4


@pytest.mark.parametrize("ended_by", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_leaves_a_picture_of_whole_passes_and_status_130(workplace, start, ended_by):
    process = start(
        "import sys; from cli.sss_render import main; sys.exit(main(sys.argv[1:]))",
        *("scene.toml", "-o", "out.npz", "--passes", "1000000", "--shader", "path", "--size", "64x64"),
        *("--preview", "preview.png"),
    )
    checkpoint, patience = Path("out.npz.unfinished.npz"), time.monotonic() + 60
    while not checkpoint.exists() and process.poll() is None and time.monotonic() < patience:
        time.sleep(0.05)
    assert Path("preview.png").read_bytes().startswith(PNG_MAGIC) and not Path("out.npz").exists()
    process.send_signal(ended_by)
    _, error = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in error and error.strip().count("\n") == 0
    with np.load("out.npz") as arrays:
        done = int(arrays["passes"])
        assert 1 <= done < 1_000_000
        interrupted = arrays["film_sum"]
    whole = render("--passes", done, "--size", "64x64", out="whole.npz")
    np.testing.assert_allclose(interrupted, whole["film_sum"], rtol=1e-12, atol=0)


@pytest.mark.parametrize(
    ("mesh", "state", "handling", "because"),
    [
        (shapes.icosphere(1.0, 2), "closed", "strict", "closed, manifold and oriented"),
        (
            shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 0.2),
            "holes",
            "cap",
            "1 hole to close for light by caps",
        ),
        (shapes.with_internal(shapes.icosphere(1.0, 2), (0, 0, 0), 0.4, 1), "closed", "terminate", "with flaws"),
        (shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 1.85), "open", "surface", "encloses no volume"),
    ],
    ids=["closed", "a hole", "a shell inside", "a saucer"],
)
def test_closedness_decides_what_is_done_at_holes_and_the_command_says_why(
    workplace, capsys, mesh, state, handling, because
):
    write_mesh(mesh, "ball.ply")
    report = reported("--passes", 1)
    out = capsys.readouterr().out
    (thing,) = report["objects"]
    assert (thing["state"], thing["hole_handling"]) == (state, handling)
    capped = handling == "cap"
    assert (thing["holes"]["loops"], thing["holes"]["capped"]) == (capped, capped)
    assert (f", {100 * (thing['holes']['expected_error'] or 0):.2g} % error expected of it" in out) == capped
    assert f"ball: {state}" in out and f"hole handling {handling}" in out and because in out


def test_a_shader_forced_on_what_has_no_inside_becomes_the_diffuse_fallback_with_a_warning(workplace, capsys):
    write_mesh(shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 1.85), "ball.ply")
    report = reported("--passes", 1)
    assert report["objects"][0]["shader"] == "diffuse"
    error = capsys.readouterr().err
    assert error.startswith("sss-render: warning: ball: path needs an inside") and error.count("\n") == 1
    with np.load("out.npz") as arrays:
        assert set(np.unique(arrays["shader_id"])) == {-1, 3}


def test_paths_that_leave_through_a_hole_are_counted(workplace):
    write_mesh(shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 0.4), "ball.ply")
    rule = ("--hole-handling", "terminate")
    assert reported("--passes", 4, "--shader", "path", *rule)["rare_events"]["terminated_at_holes"] > 0
    forced = reported("--passes", 4, "--shader", "path", "--hole-handling", "strict")
    assert forced["objects"][0]["hole_handling"] == "strict" and forced["rare_events"]["leaked_rays"] > 0


def test_leaks_and_losses_are_warned_of_beyond_their_budgets(workplace, capsys):
    """Planted by a hole: some percent of the paths."""
    write_mesh(shapes.punctured(shapes.icosphere(1.0, 3), [[0, 1, 0]], 0.4), "ball.ply")
    report = reported("--passes", 8, "--hole-handling", "strict")
    events = report["rare_events"]
    assert 0 < events["parity_contradictions"] <= events["leaked_rays"]
    error = capsys.readouterr().err
    assert f"warning: ball: {events['leaked_rays']} of {8 * 480} paths (" in error and "taken for closed" in error
    assert "in the mean at (" in error and "light there is wrong" in error
    lost = reported("--passes", 8, "--hole-handling", "terminate")["rare_events"]["terminated_at_holes"]
    assert f"warning: {lost} of {8 * 480} paths (" in capsys.readouterr().err
    write_mesh(shapes.icosphere(1.0, 3), "ball.ply")
    reported("--passes", 8)
    assert capsys.readouterr().err == ""


def _judge(mesh):
    """A record beside ``ball.ply`` that says what no check would."""
    from sss_tools.record import write_record
    from sss_tools.validation.run import check_mesh

    report = check_mesh(mesh)
    lie = replace(report, closedness={**report.closedness, "state": "open", "hole_handling": "surface"})
    write_record("ball.ply", mesh, lie)


def test_a_record_that_matches_is_trusted(workplace, capsys):
    from sss_tools.loading import load_mesh

    _judge(load_mesh("ball.ply"))
    assert reported("--passes", 1, "--shader", "auto")["objects"][0]["state"] == "open"
    captured = capsys.readouterr()
    assert "ball: open (record)" in captured.out and captured.err == ""


def test_a_record_of_other_geometry_is_ignored_with_a_warning(workplace, capsys):
    from sss_tools.loading import load_mesh

    mesh = load_mesh("ball.ply")
    _judge(mesh)
    write_mesh(Mesh(mesh.vertices * [1, 1, 1.001], mesh.faces), "ball.ply")
    assert reported("--passes", 1)["objects"][0]["state"] == "closed"
    captured = capsys.readouterr()
    assert "(checked now)" in captured.out
    assert "ball.ply.sss.json: the record belongs to other geometry" in captured.err
    assert captured.err.count("\n") == 1


def test_a_farther_camera_gets_a_cheaper_shader_and_the_command_says_why(workplace, capsys):
    edit('"environment"\nradiance = [0.5, 0.6, 0.7]', '"directional"\ndirection = [1, 0, 0]\nirradiance = 3')
    edit("sigma_t = 6.0", "sigma_t = 2.0")
    place, chosen = "position = [0, 1, 6]", []
    for distance in (4, 16, 40, 80, 200, 800, 4000):
        edit(place, place := f"position = [0, 0, {distance}]")
        report = reported("--passes", 1, "--size", "160x160", "--shader", "auto", "--quality", 0.7)
        chosen.append(report["objects"][0]["shader"])
        assert f"shader {chosen[-1]} at distance {distance - 1}" in capsys.readouterr().out
    order = ["path", "plumb", "scalar", "diffuse"]
    assert sorted(chosen, key=order.index) == chosen
    # on a ball scalar is as right as plumb, which may then have no place between path and scalar
    assert set(chosen) | {"plumb"} == set(order)


def test_quiet_prints_nothing(workplace, capsys):
    render("--passes", 1, "--quiet")
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["bunny_stanford.obj", "spot.obj", "beetle_vw.obj"])
def test_real_meshes_are_checked_and_rendered(shared, tmp_path, capsys, name):
    from cli.sss_check import main as check

    mesh = str(shared / "meshes" / name)
    assert check([mesh, "--format", "json"]) in (0, 1)
    (verdict,) = json.loads(capsys.readouterr().out)["meshes"]
    report_path, out = tmp_path / "report.json", tmp_path / "out.npz"
    assert main([mesh, "-o", str(out), "--size", "32x32", "--passes", "2", "--report", str(report_path)]) == 0
    (thing,) = json.loads(report_path.read_text())["objects"]
    assert thing["state"] == verdict["closedness"]["state"]
    assert thing["hole_handling"] == verdict["closedness"]["hole_handling"]
    with np.load(out) as arrays:
        assert np.isfinite(arrays["image"]).all()
        # the mesh is framed: it fills a good part of the picture, and is not black
        assert (arrays["object_id"] == 0).mean() > 0.1
        assert arrays["image"][arrays["object_id"] == 0].mean() > 0.01


def test_export_writes_the_scene_for_mitsuba_and_renders_nothing(workplace, capsys):
    assert main(["scene.toml", "--export", "mitsuba", "-o", "other.xml", "--passes", "7", "--size", "30x20"]) == 0
    document = Path("other.xml").read_text()
    assert '<default name="spp" value="7" />' in document and '<integer name="width" value="30" />' in document
    assert sorted(path.name for path in workplace.iterdir()) == ["ball.ply", "other.xml", "other_files", "scene.toml"]
    assert "written for Mitsuba 3" in capsys.readouterr().out
    assert main(["ball.ply", "--export", "mitsuba", "-o", "bare.xml", "-q"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("option", [["--time", "3"], ["--shader", "path"], ["--resume"], ["--report", "r.json"]])
def test_export_refuses_options_that_it_would_ignore(workplace, capsys, option):
    assert main(["scene.toml", "--export", "mitsuba", "-o", "other.xml", *option]) == 2
    assert f"{option[0]}: says nothing to --export mitsuba" in capsys.readouterr().err
    assert not Path("other.xml").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory as Linux keeps them")
def test_too_little_memory_is_one_line(workplace, capsys):
    """The sums of 9000 x 7000 pixels alone take 3 GB."""
    render("--size", "9000x7000", "--passes", 1, "--max-memory", "2G", status=2)
    error = capsys.readouterr().err
    assert "out of memory" in error and "--max-memory" in error and error.count("\n") == 1
    assert not Path("out.npz").exists()


# ---- explanation, quality, pilots ----


def explained(*arguments, status=0):
    assert main(["scene.toml", "--explain-only", "--report", "report.json", *map(str, arguments)]) == status
    return json.loads(Path("report.json").read_text())


def test_explain_only_says_everything_and_renders_nothing(workplace, capsys, monkeypatch):
    def never(*_arguments, **_options):
        raise AssertionError("nothing is to be traced")

    monkeypatch.setattr("renderer.render.TracedScene", never)
    report = explained("--quality", 0.3)
    text = capsys.readouterr().out
    for part in ("ball: closed", "hole handling strict", "distance", "pixels across", "mean free path", "diffuse",
                 "scalar", "plumb", "path", "tolerance", "passes"):  # fmt: skip
        assert part in text
    (thing,) = report["objects"]
    assert [one["shader"] for one in thing["candidates"]] == ["diffuse", "scalar", "plumb", "path"]
    for one in thing["candidates"]:
        assert one["predicted_error"] > 0 and one["predicted_seconds"] > 0 and one["passes"] >= 1
    assert report["explained_only"] and report["passes"] == thing["passes"]
    assert sorted(path.name for path in workplace.iterdir()) == ["ball.ply", "report.json", "scene.toml"]


def test_without_explain_only_an_output_must_be_named(workplace, capsys):
    assert main(["scene.toml"]) == 2
    assert "-o/--output" in capsys.readouterr().err


def test_the_quality_decides_the_passes_unless_they_are_given(workplace):
    few, more = (explained("--shader", "path", "--quality", q)["passes"] for q in (0, 0.3))
    assert 1 <= few < more
    planned = explained("--shader", "path", "--quality", 0, "--size", "6x5")["passes"]
    # a single pass would not tell its noise
    assert render("--quality", 0, "--size", "6x5")["passes"] == max(planned, LEAST)
    assert render("--quality", 0, "--passes", 3, "--size", "6x5")["passes"] == 3
    # without --quality as ever
    assert explained("--shader", "scalar")["passes"] == 64


def test_a_target_error_chooses_the_shader_unless_a_quality_does(workplace):
    assert main(["scene.toml", "--explain-only", "--target-error", "10", "--report", "report.json"]) == 0
    report = json.loads(Path("report.json").read_text())
    assert report["objects"][0]["shader"] == "diffuse" and report["objects"][0]["tolerance"] == 10
    report = explained("--target-error", 10, "--quality", 1)
    assert report["objects"][0]["shader"] == "path" and "quality 1" in report["objects"][0]["reason"]


def test_a_pilot_replaces_the_prediction(workplace, monkeypatch):
    monkeypatch.setattr("renderer.pilot.PASSES", 2)
    report = explained("--pilot", "--threads", 1)
    assert all(one["measured"] for one in report["objects"][0]["candidates"])
    assert report["seconds"]["pilot"] > 0


def test_predicted_error_is_an_array_and_in_the_report(workplace):
    arrays = render("--passes", 4, "--aov", "predicted_error,shader_id", "--report", "report.json")
    (thing,) = json.loads(Path("report.json").read_text())["objects"]
    assert arrays["predicted_error"][10, 12] == pytest.approx(thing["predicted_error"], rel=1e-6)
    assert np.isnan(arrays["predicted_error"][0, 0]) and arrays["shader_id"].dtype == np.int32


def test_the_report_says_what_was_built_for_whom(workplace):
    assert reported("--passes", 1)["built"]["objects"] == {}
    built = reported("--passes", 1, "--shader", "scalar")["built"]
    assert set(built["objects"]["ball"]) == {"curvature", "table of balls"}
    assert built["scene"]["triangles and beams of light"] > 0
