"""extract(): arrays in, maps and mesh out, against geometry that is known."""

import copy
import pickle
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest

import meniscus
from conftest import ball_points

RADIUS = .025  # of the ball's particles
BALL = (len(ball_points()) * (2 * RADIUS) ** 3 * 3 / 4 / np.pi) ** (1 / 3)  # of as much fluid


def extract(points, camera, **options):
    options.setdefault("particle_radius", RADIUS)
    return meniscus.extract(points, camera, **options)


def same(a, b):
    return all(np.array_equal(getattr(a, name), getattr(b, name))
               for name in ("depth", "normal", "position", "group", "kind", "residual"))


def test_a_ball_is_where_it_is(points, camera):
    surface = extract(points, camera)
    assert surface.depth.shape == (72, 96) and surface.depth.dtype == np.float32
    assert surface.normal.shape == surface.position.shape == (72, 96, 3)
    assert surface.group.dtype == np.uint32 and surface.kind.dtype == np.uint8
    seen = np.isfinite(surface.depth)
    # The ball covers about pi r^2 of the screen: at distance 2, 72 pixels are 2 * 2 * tan(20 deg).
    pixels = np.pi * (BALL / (2 * 2 * np.tan(np.radians(20))) * 72) ** 2 / (1 - (BALL / 2) ** 2)
    assert seen.sum() == pytest.approx(pixels, rel=.1)
    distance = np.linalg.norm(surface.position[seen], axis=1)
    # A ball of lattice points is rough: its steps are one spacing, half of it either way. Six particles
    # stand alone on it: nothing lies farther out than they reach, .0273 from the ball.
    assert BALL - distance.min() < RADIUS
    assert distance.max() < np.linalg.norm(points, axis=1).max() + RADIUS
    outward = surface.position[seen] / distance[:, None]
    assert np.median((outward * surface.normal[seen]).sum(axis=1)) > .98
    assert np.allclose(np.linalg.norm(surface.normal[seen], axis=1), 1, atol=1e-5)
    # Depth is planar: the camera looks down -z from z = 2.
    assert np.allclose(surface.depth[seen], 2 - surface.position[seen][:, 2], atol=1e-5)
    assert (surface.kind[seen] > 0).all() and (surface.kind[~seen] == 0).all()
    assert surface.counts["particles"] == len(points)
    assert surface.counts["pixels"] == seen.sum()
    assert surface.warnings == []


def test_prompts_complete_all_names(points, camera):
    surface = extract(points, camera, mesh=False)
    assert {"depth", "normal", "exit", "notices", "mesh", "write"} <= set(dir(surface))
    assert all(hasattr(surface, name) for name in dir(surface))


def test_the_mesh_is_of_the_ball(points, camera):
    mesh = extract(points, camera, image=False).mesh
    assert mesh.positions.shape == mesh.normals.shape and mesh.velocities is None
    assert mesh.triangles.dtype == np.uint32 and mesh.triangles.max() < len(mesh.positions)
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(float) for k in range(3))
    facing = np.cross(b - a, c - a)
    towards = (mesh.normals[mesh.triangles].mean(axis=1) * facing).sum(axis=1)
    assert (towards >= -1e-9).mean() > .99  # counter-clockwise seen from outside
    assert np.abs(np.linalg.norm(mesh.positions, axis=1) - BALL).max() < 2 * RADIUS  # with its rim


LAYOUTS = {
    "float32": lambda p: p.astype(np.float32),
    "float64": lambda p: p,
    "columns after each other": lambda p: np.asfortranarray(p.astype(np.float32)),
    "every second row": lambda p: np.repeat(p, 2, axis=0)[::2],
    "backwards": lambda p: p[::-1],
    "of wider rows": lambda p: np.hstack([np.ones((len(p), 2)), p, p])[:, 2:5],
    "axes turned round": lambda p: np.ascontiguousarray(p[:, ::-1])[:, ::-1],
    "read only": lambda p: np.frombuffer(p.tobytes()).reshape(-1, 3),
    "unaligned": lambda p: np.frombuffer(b"x" + p.tobytes(), np.uint8)[1:].view(float).reshape(-1, 3),
    "other endian": lambda p: p.astype(">f8"),
    "lists": lambda p: p.tolist(),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_gives_the_same_surface(points, camera, layout):
    assert same(extract(LAYOUTS[layout](points), camera), extract(points, camera))


def test_integers_and_half_floats_are_converted():
    whole = np.round(ball_points() / .05)
    far = meniscus.Camera.look_at((0, 0, 40), (0, 0, 0), size=(64, 48))
    expected = extract(whole, far, particle_radius=.5)
    for kind in (np.int8, np.int64, np.float16):
        assert same(extract(whole.astype(kind), far, particle_radius=.5), expected)


def test_velocities_come_out_and_move_pixels(points, camera):
    spin = np.stack([points[:, 2], 0 * points[:, 0], -points[:, 0]], axis=1)
    surface = extract(points, camera, velocities=spin)
    seen = np.isfinite(surface.depth)
    assert surface.velocity.shape == (72, 96, 3) and surface.mesh.velocities.shape[1] == 3
    x, _, z = np.moveaxis(surface.position, -1, 0)
    expected = np.stack([z, 0 * z, -x], axis=-1)
    # Means over neighbours within a few spacings of a velocity that is linear in space.
    assert np.abs(surface.velocity - expected)[seen].max() < 3 * 2 * RADIUS
    assert surface.forward is None
    surface.set_forward(frames_per_second=24)
    # The front moves to the right; half the image's height is tan(20 degrees) at distance 1.
    speed, depth = surface.velocity[36, 48, 0], surface.depth[36, 48]
    assert surface.forward[36, 48, 0] == pytest.approx(
        speed / 24 / depth * 36 / np.tan(np.radians(20)), rel=.01)
    assert extract(points, camera, velocities=spin, motion=False).velocity is None


def test_layers_are_where_rays_leave(points, camera, tmp_path):
    front = extract(points, camera)
    assert front.layers is None and front.exit is None
    surface = extract(points, camera, layers=2)
    assert same(surface, front)
    assert surface.entry.shape == surface.exit.shape == (2, 72, 96)
    assert surface.layers.shape == surface.thickness.shape == (72, 96)
    assert np.array_equal(surface.entry[0], surface.depth)
    seen = np.isfinite(surface.depth)
    assert np.array_equal(surface.layers > 0, seen)
    assert (surface.exit[0] > surface.entry[0])[seen].all()
    # A ball: through its middle the ray crosses its diameter.
    width = surface.position[seen][:, 0].max() - surface.position[seen][:, 0].min()
    assert surface.thickness[36, 48] == pytest.approx(width, rel=.1)
    assert surface.exit[0, 36, 48] - surface.depth[36, 48] == pytest.approx(
        surface.thickness[36, 48], rel=.01)
    # Around the middle: at the pole of a ball of a lattice one particle stands out.
    middle = np.s_[30:42, 42:54, 2]
    assert np.median(surface.back_normal[middle]) < -.9 < .9 < np.median(surface.normal[middle])
    surface.write(tmp_path / "a.exr")
    back = meniscus.read_exr(tmp_path / "a.exr")
    assert np.array_equal(back.exit[0], surface.exit[0])
    assert np.array_equal(back.thickness, surface.thickness)
    surface.write(tmp_path / "a.deep.exr")
    surface.write(tmp_path / "a.png", preview="glass")
    with pytest.raises(meniscus.InvalidArgument, match="no layers"):
        front.write(tmp_path / "b.deep.exr")
    with pytest.raises(meniscus.InvalidArgument, match="one layer"):
        extract(points, camera, layers=1, method="ssm")
    with pytest.raises(meniscus.InvalidArgument, match="layers is 9"):
        extract(points, camera, layers=9)


def test_radii_are_taken(points, camera):
    surface = extract(points, camera, radii=np.full(len(points), RADIUS), particle_radius=0)
    assert surface.particle_radius == pytest.approx(RADIUS)
    with pytest.raises(meniscus.InvalidArgument, match="radius of particle 3 is -1"):
        bad = np.full(len(points), RADIUS)
        bad[3] = -1
        extract(points, camera, radii=bad)


def test_warnings_are_warnings(points, camera):
    points[5] = np.nan
    with pytest.warns(meniscus.MeniscusWarning, match="1 of .* NaN or infinite") as caught:
        surface = extract(points, camera)
    assert caught[0].filename == __file__.replace(".pyc", ".py")  # whose line it is
    assert len(surface.warnings) == 1
    with pytest.warns(meniscus.MeniscusWarning, match="no particle radius"):
        extract(ball_points(), camera, particle_radius=0)
    with pytest.raises(meniscus.InputError, match="NaN"):
        extract(points, camera, strict=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(meniscus.MeniscusWarning):
            extract(points, camera)


def test_notices_and_errors_are_for_programs_too(points, camera):
    points[[5, 9]] = np.nan
    with pytest.warns(meniscus.MeniscusWarning) as caught:
        surface = extract(points, camera)
    notice, = surface.notices
    assert notice == caught[0].message.notice and notice.text == str(caught[0].message)
    assert (notice.code, notice.place, notice.count, notice.of) == ("not_finite", 5, 2, len(points))
    assert notice.found is None and notice.subject == ""
    with pytest.raises(meniscus.InputError) as error:
        extract(points, camera, strict=True)
    assert error.value.notice.code == "not_finite" and error.value.notice.text == str(error.value)
    assert "leave strict away" in str(error.value)
    with pytest.raises(meniscus.InvalidArgument) as error:
        extract(points, camera, support=51)
    notice = error.value.notice
    assert (notice.code, notice.subject) == ("parameter_out_of_range", "support")
    assert (notice.found, notice.wanted) == (51, 50)
    with pytest.warns(meniscus.MeniscusWarning):
        notices = extract(points[10:], camera, particle_radius=0).notices
    assert [n.code for n in notices] == ["radius_estimated"]
    assert notices[0].found == pytest.approx(RADIUS, rel=.2) and "--" not in notices[0].text


def test_a_frame_can_be_cancelled_from_another_thread(points, camera):
    device = meniscus.Device()
    expected = extract(points, camera, device=device).depth
    stages = []

    def progress(stage):
        stages.append(stage)
        if len(stages) == 2:
            other = threading.Thread(target=device.cancel)
            other.start()
            other.join()

    with pytest.raises(meniscus.Cancelled):
        extract(points, camera, device=device, progress=progress)
    assert len(stages) == 2
    assert np.array_equal(extract(points, camera, device=device).depth, expected)


def test_nothing_gives_an_empty_surface(camera):
    with pytest.warns(meniscus.MeniscusWarning, match="no particles"):
        surface = meniscus.extract(np.empty((0, 3)), camera, particle_radius=1)
    assert not np.isfinite(surface.depth).any() and len(surface.mesh.triangles) == 0


@pytest.mark.parametrize("what, wrong", [
    (r"points has shape \(5, 2\), must be \(n, 3\)", lambda p, c: extract(np.zeros((5, 2)), c)),
    (r"points has shape \(3,\)", lambda p, c: extract(np.zeros(3), c)),
    ("points has dtype complex128", lambda p, c: extract(p.astype(complex), c)),
    ("points is a masked array", lambda p, c: extract(np.ma.masked_less(p, 0), c)),
    ("velocities has 4 rows for", lambda p, c: extract(p, c, velocities=np.zeros((4, 3)))),
    (r"radii has shape .*must be \(n,\)", lambda p, c: extract(p, c, radii=p)),
    ("nearest name is support", lambda p, c: extract(p, c, suport=8)),
    ("no parameter radius, did you mean particle_radius", lambda p, c: extract(p, c, radius=.1)),
    ("no parameter velocity, did you mean velocities", lambda p, c: extract(p, c, velocity=p)),
    ("no parameter attribute, did you mean attributes",
     lambda p, c: meniscus.extract_closed(p, attribute={})),
    ("there is no parameter foo; named_parameters", lambda p, c: meniscus.extract_closed(p, foo=1)),
    ("there is no parameter camera", lambda p, c: meniscus.extract_closed(p, camera=c)),
    ("support is 'wide', must be a number", lambda p, c: extract(p, c, support="wide")),
    ("support is 51, must be", lambda p, c: extract(p, c, support=51)),
    ("passes is 1.5, must be a whole number", lambda p, c: extract(p, c, passes=1.5)),
    ("method is fitt", lambda p, c: extract(p, c, method="fitt")),
    ('maps has "nonsense", must be .* maps beside depth: N, .*, e.g. "N,id"',
     lambda p, c: extract(p, c, maps="N,nonsense")),
    ("maps has .depth", lambda p, c: extract(p, c, maps=["depth"])),
    (r"maps is \[1\], must be names", lambda p, c: extract(p, c, maps=[1])),
    ("maps is 3, must be names", lambda p, c: extract(p, c, maps=3)),
    ("whitewater is ndarray, must be types and their particles",
     lambda p, c: extract(p, c, whitewater=p)),
    (r"points has shape \(3, .*turn it: points.T", lambda p, c: extract(p.T, c)),
    ("the file's name is empty", lambda p, c: meniscus.Camera.read("")),
    ("points is a file's name.*read_particles", lambda p, c: extract("dam.ply", c)),
    ("layers is 1.5, must be a whole number", lambda p, c: extract(p, c, layers=1.5)),
    (r"device is 'gpu', must be a meniscus.Device.*Device\('gpu'\)",
     lambda p, c: extract(p, c, device="gpu")),
    ("method is 3", lambda p, c: extract(p, c, method=3)),
    ("particle_radius is None, must be a number", lambda p, c: extract(p, c, particle_radius=None)),
    ("cell is 'fine', must be a number", lambda p, c: meniscus.extract_closed(p, cell="fine")),
    ("attributes must be names", lambda p, c: extract(p, c, attributes=["heat"])),
    ("attributes must be names", lambda p, c: extract(p, c, attributes={1: np.ones(len(p))})),
    ("eye is .*, must be three numbers", lambda p, c: meniscus.Camera.look_at((0, 2), (0, 0, 0))),
    (r"size is \(1.5, 2\), must be \(width", lambda p, c: meniscus.Camera.frame(p, size=(1.5, 2))),
    ("camera is a str", lambda p, c: extract(p, "front")),
    ("particle_radius is -1", lambda p, c: extract(p, c, particle_radius=-1)),
    ("memory", lambda p, c: extract(np.tile(p, (150, 1)), c, memory=10)),
    ("memory is -1, must be a number of bytes", lambda p, c: extract(p, c, memory=-1)),
    ("memory is '1GB', must be", lambda p, c: extract(p, c, memory="1GB")),
    ("memory is '1GB', must be", lambda p, c: meniscus.extract_closed(p, memory="1GB")),
    ("progress is 3, must be callable", lambda p, c: extract(p, c, progress=3)),
    ("on_notice is 3, must be callable", lambda p, c: extract(p, c, on_notice=3)),
    ("on_notice is 3, must be callable", lambda p, c: meniscus.extract_closed(p, on_notice=3)),
    ("size is .*, must be 1 to 16384", lambda p, c: meniscus.Camera.frame(p, size=(1 << 40, 2))),
    ("size is .*, must be .width, height", lambda p, c: meniscus.Camera("4", 4, c.view, c.view)),
    ("view is 'abc', must be", lambda p, c: meniscus.Camera(4, 4, "abc", c.view)),
])
def test_bad_arguments_are_named(points, camera, what, wrong):
    with pytest.raises(meniscus.InvalidArgument, match=what) as caught:
        wrong(points, camera)
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, meniscus.Error)


def test_maps_are_names_in_a_text_or_a_list(points, camera):
    for maps in ("N,id", ["N", "id"], ("id", "N")):
        surface = extract(points, camera, maps=maps)
        assert surface.normal is not None and surface.group is not None
        assert surface.residual is None
    assert extract(points, camera, maps=[]).normal is None


def test_what_cannot_be_pickled_says_what_to_pass_on(points, camera):
    surface = extract(points, camera)
    for what, instead in ((surface, "surface.depth"), (surface.mesh, "mesh.positions"),
                          (meniscus.default_device(), "open one in each process")):
        for work in (pickle.dumps, copy.deepcopy):
            with pytest.raises(TypeError, match=f"cannot be pickled.*{instead}"):
                work(what)


def test_parameters_are_those_of_the_program(points, camera):
    names = {entry["name"]: entry for entry in meniscus.named_parameters()}
    assert names["support"]["default"] == 10 and names["support"]["unit"] == "particle radii"
    assert isinstance(names["passes"]["default"], int)
    surface = extract(points, camera, contour_density=.1, maps="N", mesh=False)
    assert "contour-density=0.1\n" in surface.parameters
    assert surface.normal is not None and surface.position is None and surface.group is None
    assert len(surface.mesh.triangles) == 0
    smoother = extract(points, camera, support=14)
    assert not np.array_equal(smoother.depth, surface.depth)
    assert list(meniscus.methods())[0] == "fit"
    for method in meniscus.methods():
        assert np.isfinite(extract(points, camera, method=method).depth).any(), method


def test_attributes_reach_maps_and_mesh(points, camera):
    # A linear one: the weighted mean over particles around is close to it at the surface.
    temperature = 300 + 100 * points[:, 0]
    force = np.stack([np.full(len(points), k) for k in (1, 2, 3)], axis=1)
    pair = force[:, :2].astype(np.float32)
    surface = extract(points, camera, attributes={"temperature": temperature,
                                                  "force": force, "pair": pair})
    names = ["temperature", "force.X", "force.Y", "force.Z", "pair.0", "pair.1"]
    assert list(surface.attributes) == list(surface.mesh.attributes) == names
    seen = np.isfinite(surface.depth)
    warm = surface.attributes["temperature"]
    assert warm.shape == surface.depth.shape and warm.dtype == np.float32
    assert not warm.flags.owndata
    error = warm[seen] - (300 + 100 * surface.position[seen][:, 0])
    assert np.abs(error).max() < 100 * 4 * RADIUS  # of the support, two spacings
    assert np.corrcoef(warm[seen], surface.position[seen][:, 0])[0, 1] > .99
    assert (warm[~seen] == 0).all() and seen.any() and not seen.all()
    mesh = surface.mesh
    at_vertices = mesh.attributes["temperature"]
    assert at_vertices.shape == (len(mesh.positions),)
    assert np.abs(at_vertices - (300 + 100 * mesh.positions[:, 0])).max() < 100 * 4 * RADIUS
    for name, value in zip(names[1:], (1, 2, 3, 1, 2)):
        assert np.allclose(surface.attributes[name][seen], value, rtol=1e-6), name  # rounding
        assert np.allclose(mesh.attributes[name], value, rtol=1e-6), name
    assert same(extract(points, camera), surface)
    assert extract(points, camera).attributes == {}
    del surface, mesh
    assert np.abs(at_vertices - 300).max() < 100  # lives on


def test_attributes_are_checked(points, camera):
    for given, what in ((np.zeros(3), "attribute heat has 3 rows"),
                        (np.zeros((len(points), 2, 2)), "heat has shape"),
                        (np.array(["a"] * len(points)), "heat has dtype"),
                        (np.ma.masked_array(points, points > 0), "heat is a masked array")):
        with pytest.raises(meniscus.InvalidArgument, match=what):
            extract(points, camera, attributes={"heat": given})
    with pytest.raises(meniscus.InvalidArgument, match="two attributes are named force.X"):
        extract(points, camera, attributes={"force": points, "force.X": points[:, 0]})
    unknown = np.zeros(len(points))
    unknown[5] = np.nan
    with pytest.warns(meniscus.MeniscusWarning, match="heat is NaN, infinite or absurd in 1 of"):
        surface = extract(points, camera, attributes={"heat": unknown})
    assert (surface.attributes["heat"] == 0).all()

def test_maps_share_the_surfaces_memory(points, camera):
    surface = extract(points, camera)
    assert surface.depth.ctypes.data == surface.depth.ctypes.data
    assert not surface.depth.flags.owndata
    depth, normals = surface.depth, surface.mesh.normals
    before = depth.copy()
    del surface
    extract(points[::-1], camera, support=14)  # takes memory that were free, if it were
    assert np.array_equal(depth, before) and np.isfinite(normals).all()


def test_progress_names_the_stages_and_can_end_it(points, camera):
    stages = []
    extract(points, camera, progress=stages.append)
    assert "project" in stages and "blend" in stages and stages[-1] == "download"
    timed = extract(points, camera, timings=True)
    assert [name for name, _, _ in timed.timings] == stages
    assert sum(host for _, host, _ in timed.timings) > 0

    class Enough(Exception):
        pass

    def stop(stage):
        if stage == "blend":
            raise Enough

    with pytest.raises(Enough):
        extract(points, camera, progress=stop)
    assert same(extract(points, camera), timed)  # the device can be used on


def test_notices_are_told_as_soon_as_they_are_known(points, camera):
    def made_of(make):
        order, warned = [], []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            made = make(particle_radius=.25, progress=order.append, on_notice=order.append)
            warned = [warning.message.notice for warning in caught]
        return made, order, warned

    foam = np.vstack([points[:9], [[np.nan, 0, 0]]])
    surface, order, warned = made_of(
        lambda **options: meniscus.extract(points, camera, whitewater={"foam": foam}, **options))
    told = [one for one in order if isinstance(one, meniscus.Notice)]
    assert told == surface.notices == warned
    assert told[0].code == "radius_too_large" and told[-1].code == "not_finite"
    assert order.index(told[0]) < order.index("project") and order.index("blend") < order.index(told[-1])

    mesh, order, warned = made_of(lambda **options: meniscus.extract_closed(points, **options))
    told = [one for one in order if isinstance(one, meniscus.Notice)]
    assert told == warned and told[0].code == "radius_too_large"
    assert order.index(told[0]) < order.index("fit")


def test_on_notice_can_end_it(points, camera, device):
    class Enough(Exception):
        pass

    def stop(notice):
        raise Enough(notice.code)

    stages = []
    for make in (lambda **options: meniscus.extract(points, camera, **options),
                 lambda **options: meniscus.extract_closed(points, **options)):
        with pytest.raises(Enough, match="radius_too_large"):
            make(particle_radius=.25, device=device, on_notice=stop, progress=stages.append)
    assert stages == ["order", "order"]
    with pytest.raises(meniscus.InvalidArgument, match="on_notice calls extract"):
        meniscus.extract(points, camera, particle_radius=.25, device=device,
                         on_notice=lambda notice: extract(points, camera, device=device))
    extract(points, camera, device=device)  # it can be used on


def test_ctrl_c_ends_it():
    program = """
import os, signal, sys, numpy as np, meniscus
from conftest import ball_points
camera = meniscus.Camera.look_at((0, 0, 2), (0, 0, 0), size=(96, 72))
seen = []
def progress(stage):
    seen.append(stage)
    if stage == "trust": os.kill(os.getpid(), signal.SIGINT)
try:
    meniscus.extract(ball_points(), camera, particle_radius=.025, progress=progress)
except KeyboardInterrupt:
    print(seen[-1])
    surface = meniscus.extract(ball_points(), camera, particle_radius=.025)
    print(np.isfinite(surface.depth).sum() > 100)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                         cwd=__file__.rpartition("/")[0])
    assert run.stdout.split() == ["trust", "True"], run


def test_other_threads_run_meanwhile(points, camera):
    ticks, done = [0], threading.Event()

    def count():
        while not done.is_set():
            ticks[0] += 1

    during = []
    thread = threading.Thread(target=count)
    thread.start()
    # Within one stage the lock is free: the other thread counts on between two calls of progress.
    extract(np.tile(points, (40, 1)) + np.repeat(np.arange(40), len(points))[:, None] * .9, camera,
            progress=lambda stage: during.append(ticks[0]))
    done.set()
    thread.join()
    assert during[-1] > during[0]


def test_threads_share_a_device(points, camera, device):
    results = [None] * 4

    def work(k):
        results[k] = extract(points, camera, device=device)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(same(result, results[0]) for result in results)


def test_progress_cannot_extract_on_its_own_device(points, camera, device):
    within = lambda stage: extract(points, camera, device=device)
    with pytest.raises(meniscus.InvalidArgument, match="progress calls extract"):
        extract(points, camera, device=device, progress=within)
    extract(points, camera, device=device)


def test_a_forked_process_is_told_to_start_anew():
    """It waited for ever: threads of the OpenCL runtime do not live in a child of fork()."""
    program = """
import multiprocessing, meniscus
from conftest import ball_points
camera = meniscus.Camera.look_at((0, 0, 2), (0, 0, 0), size=(96, 72))
device = meniscus.default_device()
def frame(device):
    try:
        meniscus.extract(ball_points(), camera, particle_radius=.025, device=device)
    except meniscus.DeviceError as error:
        print(error, flush=True)
for given in (None, device):
    child = multiprocessing.get_context("fork").Process(target=frame, args=(given,))
    child.start()
    child.join()
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60,
                         cwd=__file__.rpartition("/")[0])
    assert run.stdout.count("forked from one that uses OpenCL") == 2, run


def test_a_second_device_gives_the_same(points, camera, device):
    other = meniscus.Device(device.info["index"])
    assert other.name == device.name
    assert same(other.extract(points, camera, particle_radius=RADIUS), extract(points, camera))
    with pytest.raises(meniscus.DeviceError, match="no such device"):
        meniscus.Device("no such device")
    assert any(entry["name"] == device.name for entry in meniscus.devices())


def test_a_closed_mesh_has_two_triangles_at_every_edge(tmp_path):
    points = ball_points()
    spin = np.cross([0, 0, 2], points)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mesh = meniscus.extract_closed(points, cell=.8, velocities=spin, particle_radius=RADIUS)
    corners = mesh.triangles.astype(np.int64)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges}
    assert len(forward) == len(edges)
    assert forward == {(b, a) for a, b in forward}
    a, b, c = (mesh.positions[corners[:, k]].astype(float) for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert volume == pytest.approx(len(points) * (2 * RADIUS) ** 3, rel=.1)
    assert mesh.velocities.shape == mesh.positions.shape
    mesh.write(tmp_path / "ball.ply")
    assert (tmp_path / "ball.ply").stat().st_size > 12 * len(mesh.positions)
    with pytest.raises(meniscus.InvalidArgument, match="cell is 9, must be"):
        meniscus.extract_closed(points, cell=9, particle_radius=RADIUS)
    fewer = meniscus.extract_closed(points, cell=.8, adaptive=.05, memory=1 << 24,
                                    particle_radius=RADIUS)
    assert 0 < len(fewer.triangles) < len(mesh.triangles) / 2
    as_the_program = meniscus.extract_closed(points, cell=.8, adaptive=True, particle_radius=RADIUS)
    assert np.array_equal(as_the_program.positions, fewer.positions)
    assert f"{len(fewer.triangles)} triangles" in repr(fewer) and len(repr(fewer)) < 80
    with pytest.raises(meniscus.InvalidArgument, match="adaptive is -1, must be 0 to 1 particle"):
        meniscus.extract_closed(points, adaptive=-1, particle_radius=RADIUS)


def test_whitewater_is_drawn_with_the_water(points, camera, tmp_path):
    water = extract(points, camera)
    assert water.whitewater == {}
    # A drop before the middle of the picture and one behind the ball.
    drops = np.array([[0, 0, 1.5], [0, 0, -1.5]])
    surface = extract(points, camera, whitewater={
        "foam": drops,
        "bubble": {"points": drops, "velocities": np.ones((2, 3)), "radii": np.full(2, .02)}})
    assert same(surface, water)
    assert sorted(surface.whitewater) == ["bubble", "foam"]
    foam, bubble = surface.whitewater["foam"], surface.whitewater["bubble"]
    assert foam.coverage.shape == foam.depth.shape == (72, 96) and foam.velocity is None
    assert np.isfinite(foam.depth).sum() == (foam.density > 0).sum() > 0
    assert foam.depth[np.isfinite(foam.depth)].max() < bubble.depth.min()
    assert np.allclose(bubble.velocity[bubble.density > 1e-3], 1, atol=1e-4)
    seen = bubble.density > 0
    assert np.allclose(bubble.depth[seen] - surface.depth[seen], bubble.behind[seen], atol=1e-5)
    assert (foam.coverage <= foam.density + 1e-6).all()
    assert surface.counts["whitewater"] == 4
    surface.write(tmp_path / "a.exr")
    back = meniscus.read_exr(tmp_path / "a.exr").whitewater["bubble"]
    assert np.array_equal(back.behind, bubble.behind)
    surface.write(tmp_path / "a.png")
    with pytest.raises(meniscus.InvalidArgument, match="type is mist"):
        extract(points, camera, whitewater={"mist": drops})
    with pytest.raises(meniscus.InvalidArgument, match="whitewater foam has points, size"):
        extract(points, camera, whitewater={"foam": {"points": drops, "size": 1}})
    with pytest.raises(meniscus.InvalidArgument, match="radius"):
        extract(points, camera, whitewater={"foam": drops}, whitewater_radius=-1)
