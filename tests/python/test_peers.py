"""What the study `peers` says on runs that are made up, and what its programs make of a scene, without PETSc and CalculiX."""

import io
import pathlib
import sys

import numpy as np
import pytest

from studies import peers
from studies.peers import records as recorded
from studies.peers import rubbing
from studies.peers import scenes

sys.path.insert(0, str(peers.FOLDER))
import calculix  # noqa: E402
import calculix_part  # noqa: E402
import ccx  # noqa: E402
import part  # noqa: E402
from plasticity import Material  # noqa: E402

SCENE = """
[material.steel]
young = 210000.0
poisson = 0.3
yield_stress = 250.0
[body.cube]
material = "steel"
element = "tet4"
gmsh = { file = "cube.msh" }
[support.side]
surface = "cube.left"
fix = ["x", "z"]
[load.top]
surface = "cube.top"
pressure = 3.0
[load.bottom]
surface = "cube.bottom"
traction = [0.0, 2.0, 0.0]
[contact.floor]
slave = "cube.bottom"
rigid = { plane = { point = [0.0, 0.0, -0.5], normal = [0.0, 0.0, 1.0] } }
"""


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    """A scene with a cube of edge 2 whose lowest corner is the origin."""
    gmsh = pytest.importorskip("gmsh")
    folder = tmp_path_factory.mktemp("cube")
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts/meshes"))
    import cad

    box = cad.start().addBox(0, 0, 0, 2, 2, 2)
    cad.name({"cube": box}, {"left": cad.flat(0, 0.0), "bottom": cad.flat(2, 0.0), "top": cad.flat(2, 2.0)})
    cad.write("0.7", folder / "cube.msh", 0.7)
    assert not gmsh.isInitialized()
    (folder / "cube.toml").write_text(SCENE)
    return folder / "cube.toml"


def test_a_scene_is_read_with_its_mesh(cube):
    given = part.load(cube)
    corners = given.points[given.bodies["cube"]]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert (volumes > 0).all() and volumes.sum() == pytest.approx(8.0)
    assert given.forces.sum(0) == pytest.approx([0.0, 8.0, -12.0]), "pressure is against the outward normal"
    assert (given.fixed == ((given.points[:, :1] == 0.0) & [True, False, True])).all()
    (floor,) = given.contacts
    assert (floor.axis, floor.sign, floor.place) == (2, 1.0, -0.5) and (given.points[floor.slave][..., 2] == 0.0).all()


@pytest.mark.parametrize(
    "key, other",
    [
        ('"tet4"', '"hex8"'),
        ("normal = [0.0, 0.0, 1.0]", "normal = [0.0, 0.6, 0.8]"),
        ('fix = ["x", "z"]', 'fix = ["x"]\ndisplacement = [1.0, 0.0, 0.0]'),
        ("[material", "[solver]\n[material"),
    ],
    ids=["element", "slanted plane", "displacement", "solver"],
)
def test_what_peers_do_not_know_is_refused(cube, key, other):
    scene = cube.parent / "other.toml"
    scene.write_text(SCENE.replace(key, other))
    with pytest.raises(ValueError, match="peers"):
        part.load(scene)


def test_faces_have_the_numbers_of_calculix():
    tetrahedron = np.array([[5, 6, 7, 8]])
    # Its manual: face 1 is 1-2-3, face 2 is 1-4-2, face 3 is 2-4-3, face 4 is 3-4-1.
    for side, corners in enumerate([(5, 6, 7), (5, 8, 6), (6, 8, 7), (7, 8, 5)], start=1):
        element, place = part.faces_of(np.array([corners]), tetrahedron)
        assert element == [0] and calculix_part.SIDES[place % 4] == [side]
        assert set(part.apexes(np.array([corners]), tetrahedron)) == {5, 6, 7, 8} - set(corners)


def test_what_calculix_prints_is_read(tmp_path):
    (tmp_path / "a.dat").write_text(
        " displacements (vx,vy,vz) for set NALL and time  0.5\n\n 1 0.1 0.2 0.3\n"
        " displacements (vx,vy,vz) for set NALL and time  1.0\n\n 1 3.0 4.0 0.0\n 2 0.0 0.0 1.0\n"
        " equivalent plastic strain (elem, integ.pnt.,pe)for set EALL and time  1.0\n\n 1 1 0.0\n 2 1 1e-3\n"
        " statistics for slave set S-FLOOR, master set M-FLOOR and time  1.0\n\n"
        "   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)\n\n  1.0 2.0 -3.0 4.0 5.0 6.0\n\n"
        "   area,  normal force (+ = tension) and shear force (size)\n\n 7.0 8.0 9.0\n"
    )
    floor = part.Floor("floor", None, 2, 1.0, 0.0)
    found = calculix_part.found(ccx.printed(tmp_path / "a.dat"), [floor])
    assert found == {"max_displacement": 5.0, "plastic_elements": 1, "contact_forces": {"floor": [1.0, 2.0, -3.0]}}


def test_stress_is_the_derivative_of_the_energy_and_the_tangent_that_of_the_stress():
    material = Material(young=200.0, poisson=0.3, yield_stress=1.0, hardening=20.0)
    strain = np.random.default_rng(1).normal(scale=0.01, size=(40, 6))
    response, h = material.respond(strain), 1e-6
    assert 5 < len(response.plastic) < 40
    tangent = np.repeat(material.elastic[None], len(strain), 0)
    tangent[response.plastic] += material.softening(response, slice(None))
    for k, change in enumerate(h * np.eye(6)):
        after, before = material.respond(strain + change), material.respond(strain - change)
        assert (after.dense - before.dense) / (2 * h) == pytest.approx(response.stress[:, k], abs=1e-6)
        assert (after.stress - before.stress) / (2 * h) == pytest.approx(tangent[:, :, k], abs=1e-3)


def record(program, seconds, **more):
    summary = {"nodes": 29955, "max_displacement": 2.0, "plastic_elements": 7, "peak_rss_mb": 100.0, "newton_iterations": 4} | more
    provenance = {"commit": "0" * 12, "date": "2026-01-01T00:00:00Z", "quiet": True}
    label = {"scene": "housing-floor", "nodes": 30, "variant": f"peers/{program}", "ranks": 2}
    return label | {"exit_code": 0, "seconds": seconds, "summary": summary, "provenance": provenance}


OURS = record(
    "fetiplast", 2.0, hessian_multiplications=80, contact_forces={"floor": [0.0, 0.0, 4.0]},
    time={"dual operator": 0.5, "coarse problem": 0.125, "discretisation": 0.25},
    communication={"collectives": {"seconds": 0.1}, "neighbour exchange": {"seconds": 0.025}, "set-up messages": {"seconds": 1.0}},
)
EXACT = record(scenes.EXACT, 9.0, contact_forces={"floor": [0.0, 3.0, 4.0]}, hessian_multiplications=90)
GAMG = record("petsc-gamg", 6.0, iterations=30, linear_seconds={"set-up": 0.5, "solve": 1.0}, peak_rss_mb=250.0, max_displacement=2.2)
CALCULIX = record("calculix", 9.0, iterations=11, time_total=8.0)
del CALCULIX["summary"]["newton_iterations"]


def told(records, made):
    found = recorded.read(records(made))
    return "\n".join(scenes.sections(found)), scenes.short(found)


def test_programs_stand_beside_fetiplast(records):
    page, short = told(records, [EXACT, OURS, GAMG, CALCULIX])
    assert "### housing-floor, 29 955 nodes" in page
    # The contact force of 5 is 1 off.
    assert "| fetiplast | 2 | 1.00 | 0.75 | 1.00 | 100 | 1.00 | 0.0e+00 | 2.0e-01 | 7 | 4 | 80 | 20.0 |" in page
    assert "| petsc-gamg | 6 | 3.00 | 1.5 | 2.00 | 250 | 2.50 | 1.0e-01 |  | 7 | 4 | 30 | 7.5 |" in page
    assert "| calculix | 8 | 4.00 |  |  | 100 | 1.00 | 0.0e+00 |  | 7 | 11 |  |  |" in page, "the seconds are those of ccx"
    assert "| housing-floor | 29 955 | 20.0 | 2 | petsc-gamg | 3.00 | 2.00 | 2.50 |" in short


def test_what_was_ended_for_its_time_is_told(records):
    page, short = told(records, [OURS, GAMG | {"exit_code": None, "summary": None, "seconds": 50.0}])
    assert "| petsc-gamg | no result after 50 | > 25 |" in page and "| petsc-gamg | > 25 |  |  |" in short


def test_fetiplast_alone_is_told_too(records):
    page, short = told(records, [OURS])
    assert "| fetiplast | 2 | 1.00 | 0.75 |" in page and "| housing-floor | 29 955 | 20.0 | 2 |  |  |  |  |" in short


def test_times_are_not_told_of_a_busy_machine(records):
    busy = [made | {"provenance": made["provenance"] | {"quiet": False}} for made in (OURS, GAMG)]
    page, _ = told(records, busy)
    assert "| petsc-gamg |  |  |  |  | 250 | 2.50 |" in page


def test_without_runs_of_the_scenes_nothing_is_told(records):
    assert told(records, [{**OURS, "exit_code": 1}]) == ("", "")


def rubbed(program, element, level, force, seconds, **more):
    made = record(program, seconds, contact_force=force, hessian_multiplications=50, **more)
    del made["nodes"]
    return made | {"scene": rubbing.case(element), "level": level}


def test_programs_with_friction_stand_beside_a_fine_mesh(records):
    fine = rubbed("fetiplast", *rubbing.FINE, [3.0, 0.0, 10.0], 90.0)
    ours = rubbed("fetiplast", "tet4", 1, [2.7, 0.0, 10.5], 2.0, max_displacement=1.8)
    theirs = rubbed("calculix", "tet4", 1, [2.97, 0.0, 10.5], 30.0, max_displacement=1.8, time_total=20.0, iterations=32)
    page = "\n".join(rubbing.sections(recorded.read(records([fine, ours, theirs]))))
    assert "trilinear hexahedra at level 5:\nnormal force 10, friction force 3, largest displacement 2." in page
    assert "| fetiplast | tet4 | 1 | 2 | 1.00 | 5.0e-02 | 1.0e-01 | 1.0e-01 |  | 100 | 4 Newton steps, 50 applications of F |" in page
    assert "| calculix | tet4 | 1 | 20 | 10.00 | 5.0e-02 | 1.0e-02 | 1.0e-01 | 1.0e-01 | 100 | 32 iterations |" in page
    assert rubbing.sections(recorded.read(records([ours, theirs]))) == [], "nothing without the fine mesh"


def test_friction_is_written_for_calculix():
    plain, rough = io.StringIO(), io.StringIO()
    calculix.write(plain, 1, calculix.ELEMENTS["tet4"], None)
    calculix.write(rough, 1, calculix.ELEMENTS["hex8"], 0.3)
    assert "*PLASTIC" in plain.getvalue() and "*FRICTION" not in plain.getvalue()
    assert "*FRICTION\n0.3,10000\n" in rough.getvalue() and "*PLASTIC" not in rough.getvalue()
    # One layer of 240 faces of the upper block touches, and as many lie below; 300 carry the load.
    assert rough.getvalue().count("TYPE=C3D8") == 2 and rough.getvalue().count(",S1\n") == 240
    assert rough.getvalue().count(",S2\n") == 240 and rough.getvalue().count(",P2,150.0\n") == 300
