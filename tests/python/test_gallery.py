"""The scenes of the gallery, and its arithmetic on a load cycle that is made up, so that the answers are known."""

import pathlib
import tomllib

import pytest

pytest.importorskip("vtk")
import gallery  # noqa: E402
import hysteresis  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
CYCLE = hysteresis.Cycle("a block that is dragged", "pull", (2, 4), 0.0, (0, 1), copies=2)
SCENE = {
    "support": {"pull": {"displacement": [0.5, 0.0, 0.0]}},
    "step": [{"amplitude": 0.0}, {"amplitude": 1.0}, {"amplitude": 0.0, "support": {"pull": -1.0}}, {"amplitude": 1.0}],
}


def step(time, force, dissipation):
    friction = {"floor": {"dissipation": dissipation}, "wall": {"dissipation": 0.0}}
    return {"time": time, "reactions": {"pull": [force, 9.0, 9.0]}, "friction": friction}


def test_a_rigid_block_dissipates_the_area_of_its_loop():
    forward, back = (3.0, -3.0)
    steps = [step(1.0, 0.0, 0.0), step(2.0, forward, 1.5), step(2.0 + 1e-9, back, 0.0), step(2.5, back, 1.5), step(3.0, back, 1.5)]
    steps += [step(3.0 + 1e-9, forward, 0.0), step(4.0, forward, 3.0)]
    history = hysteresis.History({"steps": steps}, SCENE, CYCLE)
    assert history.displacement == pytest.approx([0.0, 0.5, 0.5, 0.0, -0.5, -0.5, 0.5], abs=1e-8)
    assert list(history.loop) == [1, 2, 3, 4, 5, 6]
    # Twice 3 over a length of 1, to and fro, of two halves.
    assert history.area() == pytest.approx(12.0) and history.dissipated() == pytest.approx(12.0)


def test_cycles_are_closed_in_their_scenes():
    for name, cycle in gallery.CYCLES.items():
        scene = tomllib.loads((ROOT / f"scenes/{name}.toml").read_text())
        first, last = (scene["step"][end - 1].get("amplitude", 1.0) for end in cycle.closed)
        assert first == last and scene["support"][cycle.support]["displacement"][1:] == [0.0, 0.0]


def test_what_the_gallery_shows_is_in_its_page():
    page = (ROOT / "docs/gallery.md").read_text()
    for name in [*gallery.SCENES, *gallery.CYCLES]:
        assert f"]({name}.png)" in page and (ROOT / f"docs/{name}.png").exists()
