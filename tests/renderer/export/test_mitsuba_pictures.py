"""Small pictures by Mitsuba 3 of exported scenes, against ours: every light, boundary and material means the same.

The family of all tests here raises a false alarm with probability ``FAMILY``. Skipped where Mitsuba is not installed.
"""

import numpy as np
import pytest

from renderer.export.files import folder_name, write
from renderer.export.mitsuba import to_mitsuba
from renderer.scene.admission import admit
from renderer.scene.description import DirectionalLight, EnvironmentLight, PointLight, RectangleLight, SphereLight
from renderer.study.judges import Estimate, compare_tiles, sidak
from sss_tools.shapes import box, icosphere, moved
from tests.assertions import seed
from tests.renderer.scenes import WHITE_SKY, bumpy_ball, camera, diffuse, mirror, picture, placed, scene, translucent

mitsuba = pytest.importorskip("mitsuba")

FAMILY = 1e-3
RESOLUTION = (16, 12)
RENDERS, SPP = 16, 32
FINER = 8
"""Our pictures have so many times the width and height, and are averaged: full blocks, and the same mean."""


def sky():
    """Smooth, different everywhere, so that a turned or mirrored picture would show."""
    random = np.random.default_rng(3)
    return EnvironmentLight(image=random.random((3, 5, 3)).astype(np.float32), rotation=40.0)


POINT = PointLight(np.array([-1.5, 2.5, 1.0]), np.array([9.0, 7, 5]))
BEAM = DirectionalLight(np.array([0.5, -1, -0.7]), np.array([3.0, 2, 1]))
RECTANGLE = RectangleLight(
    np.array([1.0, 2.5, 1.5]), np.zeros(3), np.array([0.0, 1, 0]), (1.2, 0.6), np.array([5.0, 6, 7])
)
SPHERE = SphereLight(np.array([1.5, 2.0, 1.0]), 0.6, np.array([9.0, 8, 7]))
SMOOTH = translucent((0.9, 0.7, 0.5), 4.0)
ROUGH = translucent((0.9, 0.7, 0.5), 4.0, roughness=0.4, ior=1.4)
MATCHED = translucent((0.9, 0.7, 0.5), 4.0, g=0.6, ior=1.0)
CHROMATIC = translucent(0.8, (2.0, 4.0, 8.0), roughness=0.3)

CASES = {
    "smooth, white sky": ([SMOOTH], [WHITE_SKY]),
    "smooth, rectangle": ([SMOOTH], [RECTANGLE]),
    "smooth, sphere": ([SMOOTH], [SPHERE]),
    "rough, image": ([ROUGH], [sky()]),
    "rough, point": ([ROUGH], [POINT]),
    "rough, beam": ([ROUGH], [BEAM]),
    "rough, rectangle": ([ROUGH], [RECTANGLE]),
    "matched, beam": ([MATCHED], [BEAM]),
    "matched, point": ([MATCHED], [POINT]),
    "matched, sphere": ([MATCHED], [SPHERE]),
    "matched, image": ([MATCHED], [sky()]),
    "chromatic, image": ([CHROMATIC], [sky()]),
    "diffuse and mirror": ([ROUGH, diffuse((0.8, 0.5, 0.3)), mirror((0.9, 0.8, 0.7))], [sky(), POINT]),
}


def of_case(name, finer=1, lights=None):
    materials, lit = CASES[name]
    meshes = [bumpy_ball(2), moved(box((6, 0.2, 6)), (0, -1.4, 0)), moved(icosphere(0.5, 2), (1.2, -0.6, 1))]
    objects = [placed(meshes[k], material, name=f"thing {k}") for k, material in enumerate(materials)]
    width, height = RESOLUTION
    view = camera((0.3, 1.5, 6), fov=32, resolution=(finer * width, finer * height))
    return scene(objects, lit if lights is None else lights, view)


def by_mitsuba(of, folder):
    """The mean of independent pictures and its standard error."""
    mitsuba.set_variant("scalar_rgb")
    path = folder / "scene.xml"
    write(to_mitsuba(admit(of)[0], folder_name(path), SPP), path)
    loaded = mitsuba.load_file(str(path), spp=SPP)
    images = np.array([np.array(mitsuba.render(loaded, seed=seed(k))) for k in range(RENDERS)], float)
    return Estimate(images.mean(axis=0), images.std(axis=0, ddof=1) / np.sqrt(RENDERS), RENDERS)


def by_us(of, passes=12):
    width, height = RESOLUTION
    samples = picture(of, passes, seed=seed(1)).samples.reshape(passes, 3, height, FINER, width, FINER)
    samples = samples.transpose(0, 3, 5, 2, 4, 1).reshape(-1, height, width, 3)
    return Estimate(samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(len(samples)), len(samples))


def judged(ours, theirs):
    # 4 x 4 pixels: a standard error from 16 pictures a pixel is too rough for single ones
    return compare_tiles(ours, theirs, (theirs.mean > 0).any(axis=-1), size=4, false_alarm=sidak(FAMILY, len(CASES)))


@pytest.mark.parametrize("name", CASES)
def test_mitsuba_sees_the_same(name, tmp_path):
    test = judged(by_us(of_case(name, FINER)), by_mitsuba(of_case(name), tmp_path))
    assert test.agrees, f"{name}: {test.summary()}"


def test_sky_turned_by_twenty_degrees_is_caught(tmp_path):
    light = EnvironmentLight(image=sky().image, rotation=sky().rotation + 20)
    turned = of_case("rough, image", FINER, [light])
    assert not judged(by_us(turned), by_mitsuba(of_case("rough, image"), tmp_path)).agrees
