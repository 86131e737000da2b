"""Meshes from objects of meshio and gmsh give the same results as files, bit by bit. Invalid objects are refused."""

import gc
import multiprocessing
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import types
from pathlib import Path

import numpy as np
import pytest
from conftest import missing, needed

import orthowear
from orthowear import mesh as meshes
from orthowear.mesh import files, meshio_reader

#: A block of 6 x 6 x 4 hexahedra, or of prisms.
BLOCK = """
Mesh.ElementOrder = %d;
Mesh.SecondOrderIncomplete = %d;
Point(1) = {-1, -1, 0};
line[] = Extrude {2, 0, 0} { Point{1}; Layers{6}; };
face[] = Extrude {0, 2, 0} { Curve{line[1]}; Layers{6}; %s };
block[] = Extrude {0, 0, -1} { Surface{face[1]}; Layers{ {2, 2}, {0.5, 1} }; %s };
Physical Surface("contact") = {face[1]};
Physical Surface("top", 40) = {face[1]};
Physical Surface("base") = {block[0]};
Physical Surface(70) = {block[2]};
Physical Volume("block") = {block[1]};
"""
KINDS = {"hexahedra": (1, 0, "Recombine;"), "hexahedra27": (2, 0, "Recombine;"), "wedges15": (2, 1, ""), "wedges18": (2, 0, "")}


def geometry(folder: Path, kind: str = "hexahedra") -> Path:
    order, incomplete, recombine = KINDS[kind]
    path = folder / "block.geo"
    path.write_text(BLOCK % (order, incomplete, recombine, "Recombine;"))
    return path


@pytest.fixture
def gmsh():
    """The gmsh package, between initialize and finalize."""
    module = needed("gmsh")
    module.initialize(interruptible=False)
    module.option.setNumber("General.Terminal", 0)
    yield module
    if module.isInitialized():
        module.finalize()


@pytest.fixture
def temporary(monkeypatch, tmp_path):
    """Folder of temporary files for processes that may end without cleaning up."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def on(mesh, **more) -> dict:
    """Scene of a rigid sphere on a steel block with the given mesh."""
    return {
        "materials": {"steel": {"model": "isotropic", "E": 210e3, "nu": 0.3}},
        "body1": {"kind": "fe", "material": "steel", "mesh": mesh, "contact": "contact", "fixed": [{"group": "base"}], **more},
        "body2": {"kind": "rigid"},
        "frame": {"kind": "grid", "half_width": [0.3, 0.3], "cells": [8, 8]},
        "gap": {"kind": "sphere", "radius": 10.0},
        "friction": {"law": "coulomb", "mu": 0.3},
        "steps": [{"name": "press", "approach": 0.004, "shift": {"distance": 0.001, "angle": 0.0}}],
        "output": {"fields": []},
    }


def same(a, b) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("tractions", "gap", "slip", "contact"))


@pytest.mark.parametrize("kind", KINDS)
def test_objects_give_the_bits_of_the_file(gmsh, tmp_path, kind):
    """Truth: the objects and the file written by gmsh have the same elements, nodes and groups in the same order.
    Therefore, the results are equal bit by bit.
    """
    meshio = needed("meshio")
    path = geometry(tmp_path, kind)
    gmsh.open(str(path))
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.Binary", 1)  # A text file has 16 digits. Some numbers need 17 digits.
    file = tmp_path / "block.msh"
    gmsh.write(str(file))
    given = [gmsh, gmsh.model, meshes.from_gmsh(gmsh)]
    if kind != "wedges15":  # meshio 5.3.5 knows the name of this type, but cannot read it.
        read = meshio.read(file)
        assert read.cells[-1].type.startswith(kind[:5])
        given += [read, meshes.from_meshio(read)]
    named = orthowear.Scene.from_dict(on(file)).run(cache=False)
    assert named.status == "converged" and named.pressure.max() > 0
    for mesh in given:
        assert same(orthowear.Scene.from_dict(on(mesh)).run(cache=False), named), mesh


def test_program_of_gmsh_and_package(gmsh, tmp_path):
    """Truth: a mesh file of the gmsh program gives the same tractions. A program of another version than the package
    may number nodes differently, which changes the last bits.
    """
    path = geometry(tmp_path)
    program = shutil.which("gmsh") or missing("the program gmsh is missing: scripts/setup installs it")
    made = subprocess.run([program, "-3", path, "-o", tmp_path / "block.msh"], capture_output=True, check=False)
    assert made.returncode == 0
    gmsh.open(str(path))
    gmsh.model.mesh.generate(3)
    file, given = (orthowear.Scene.from_dict(on(mesh)).run(cache=False) for mesh in (tmp_path / "block.msh", gmsh.model))
    assert np.allclose(given.tractions, file.tractions, rtol=0, atol=1e-6 * file.pressure.max())


def test_groups(gmsh, tmp_path):
    """Truth: by the geometry, the top has 6 x 6 faces in two groups, and there are 144 solids."""
    meshio = needed("meshio")
    gmsh.open(str(geometry(tmp_path)))
    gmsh.model.mesh.generate(3)
    gmsh.write(str(tmp_path / "block.msh"))
    expected = {(2, "contact"): 36, (2, "top"): 36, (2, "base"): 36, (2, "70"): 24, (3, "block"): 144}
    for mesh in (meshes.from_gmsh(gmsh.model), meshes.from_meshio(meshio.read(tmp_path / "block.msh"))):
        assert mesh.groups == expected
        assert (mesh.n_nodes, mesh.n_solids) == (7 * 7 * 5, 144)
        mesh.write(tmp_path / "again.msh")
        gmsh.open(str(tmp_path / "again.msh"))
        found = {(dim, gmsh.model.getPhysicalName(dim, tag) or str(tag)) for dim, tag in gmsh.model.getPhysicalGroups()}
        assert found == set(expected)
        assert len(gmsh.model.mesh.getElementsByType(5)[0]) == 144


def cube(meshio, kind="hexahedron", **more):
    """Eight solids in a cube of edge 2 with the top at z = 0."""
    steps = np.arange(3.0) - 1
    x, y, z = np.meshgrid(steps, steps, steps - 1, indexing="ij")
    number = np.arange(27).reshape(3, 3, 3)

    def corners(i, j, k):
        return [number[i + a, j + b, k + c] for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]

    solids = [corners(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    top = [corners(i, j, 1)[4:] for i in (0, 1) for j in (0, 1)]
    base = [corners(i, j, 0)[:4] for i in (0, 1) for j in (0, 1)]
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    sets = {"contact": [[], range(4)], "base": [[], range(4, 8)]}
    arguments = {"cell_sets": {name: [np.array(part, dtype=int) for part in parts] for name, parts in sets.items()}, **more}
    return meshio.Mesh(points, [(kind, np.array(solids)), ("quad", np.array(top + base))], **arguments)


def test_cell_sets_and_physical_data():
    """Truth: cell sets and physical data describe the same groups."""
    meshio = needed("meshio")
    by_sets = cube(meshio)
    numbers = [np.zeros(8, dtype=int), np.array([1] * 4 + [2] * 4)]
    names = {"contact": np.array([1, 2]), "base": np.array([2, 2])}
    by_data = cube(meshio, cell_sets={}, cell_data={"gmsh:physical": numbers}, field_data=names)
    assert meshes.from_meshio(by_sets).groups == meshes.from_meshio(by_data).groups == {(2, "contact"): 4, (2, "base"): 4}
    a, b = (orthowear.Scene.from_dict(on(mesh)).run(cache=False) for mesh in (by_sets, by_data))
    assert same(a, b)


def test_fibres_by_element():
    """Truth: a fibre field with the same fibre in each element gives the tractions of the uniform fibre."""
    meshio = needed("meshio")
    cfrp = {"model": "transversely-isotropic", "E1": 140e3, "E2": 10e3, "G12": 5e3, "nu12": 0.3, "nu23": 0.4}
    tilt = np.radians(30.0)
    fibre = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    mesh = cube(meshio, cell_data={"fibre": [np.tile(fibre, (8, 1)), np.zeros((8, 3))]})
    scene = orthowear.Scene.from_dict({**on(mesh, fibre={"tilt": 30.0}, near_field="mesh"), "materials": {"steel": cfrp}})
    coarse = {"frame.half_width": [0.95, 0.95], "frame.cells": [2, 2], "steps.press.approach": 0.05}
    whole = scene.replace(coarse).run(cache=False)
    each = scene.replace({**coarse, "body1.fibre": {"field": "fibre"}})
    assert whole.pressure.min() > 0
    assert np.allclose(each.run(cache=False).tractions, whole.tractions, rtol=0, atol=1e-6 * whole.pressure.max())


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27", "wedge15", "wedge18", "pyramid13", "pyramid14"])
def test_nodes_of_second_order(kind):
    """Truth: for each node, the manuals of VTK and gmsh give the corners between which the node lies."""
    corners = {
        "tetra": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
        "hexahedron": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
        "wedge": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
        "pyramid": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)],
    }[kind.rstrip("0123456789")]
    vtk = {
        "tetra10": "01 12 02 03 13 23",
        "hexahedron20": "01 12 23 30 45 56 67 74 04 15 26 37",
        "hexahedron27": "01 12 23 30 45 56 67 74 04 15 26 37 0473 1265 0154 3267 0123 4567 01234567",
        "wedge15": "01 12 20 34 45 53 03 14 25",
        "wedge18": "01 12 20 34 45 53 03 14 25 0143 1254 2035",
        "pyramid13": "01 12 23 30 04 14 24 34",
        "pyramid14": "01 12 23 30 04 14 24 34 0123",
    }[kind]
    gmsh = {
        "tetra10": "01 12 20 30 32 31",
        "hexahedron20": "01 03 04 12 15 23 26 37 45 47 56 67",
        "hexahedron27": "01 03 04 12 15 23 26 37 45 47 56 67 0321 0154 0473 1265 2376 4567 01234567",
        "wedge15": "01 02 03 12 14 25 34 35 45",
        "wedge18": "01 02 03 12 14 25 34 35 45 0143 0352 1254",
        "pyramid13": "01 03 04 12 14 23 24 34",
        "pyramid14": "01 03 04 12 14 23 24 34 0321",
    }[kind]

    def places(order):
        corner = np.array(corners, dtype=float)
        return np.array([*corner, *(corner[[int(c) for c in between]].mean(axis=0) for between in order.split())])

    points = places(vtk)
    nodes = np.arange(len(points))[None, :]
    assert np.allclose(points[meshio_reader._gmsh_order(kind, nodes, points)[0]], places(gmsh), rtol=0, atol=1e-15)
    if kind in ("wedge18", "pyramid14"):  # meshio keeps the node order of gmsh's files for these types.
        assert np.array_equal(meshio_reader._gmsh_order(kind, nodes, places(gmsh)), nodes)


def test_equal_meshes_are_equal_scenes():
    """Truth: mesh files are named by content. Equal meshes share one file, which is removed with the last scene."""
    meshio = needed("meshio")
    a, b = orthowear.Scene.from_dict(on(cube(meshio))), orthowear.Scene.from_dict(on(cube(meshio)))
    assert a.to_dict() == b.to_dict()
    moved = cube(meshio)
    moved.points[0, 0] -= 0.1
    c = a.replace({"body1.mesh": moved})
    path, other = Path(a.to_dict()["body1"]["mesh"]), Path(c.to_dict()["body1"]["mesh"])
    assert path != other and path.exists() and other.exists()
    again = orthowear.Scene.from_dict(b.to_dict())
    back = c.with_(**{"body1.mesh": cube(meshio)})
    assert back.to_dict() == a.to_dict()
    del a, b, c, back
    gc.collect()
    assert path.exists() and not other.exists()
    assert again.replace({"body1.contact": "base"}).to_dict()["body1"]["mesh"] == str(path)
    # The finalizer of an older object does not remove the file of a newer object with the same mesh.
    files._remove(path, os.getpid())
    assert path.exists()
    del again
    gc.collect()
    assert not path.exists()


def test_steps_keep_the_file(tmp_path):
    """Truth: `steps` gives the same results after the scene is deleted. A run with an output directory reads the mesh
    file once more, so the file must still exist.
    """
    meshio = needed("meshio")
    expected = orthowear.Scene.from_dict(on(cube(meshio))).run(cache=False)
    scene = orthowear.Scene.from_dict(on(cube(meshio)))
    path = Path(scene.to_dict()["body1"]["mesh"])
    steps = scene.steps(tmp_path, cache=False)
    del scene
    gc.collect()
    assert path.exists()
    assert same(list(steps)[-1], expected)
    del steps
    gc.collect()
    assert not path.exists()


def test_what_becomes_of_the_object_changes_no_scene():
    """Truth: a scene gives the same results after its mesh object has changed."""
    meshio = needed("meshio")
    mesh = cube(meshio)
    scene = orthowear.Scene.from_dict(on(mesh))
    before = scene.run(cache=False)
    mesh.points *= 2.0
    assert same(scene.run(cache=False), before)


def test_refusals_of_meshio():
    """Truth: the message names key, value and allowed values."""
    meshio = needed("meshio")
    surface = cube(meshio)
    surface.cells = surface.cells[1:]
    surface.cell_sets = {name: parts[1:] for name, parts in surface.cell_sets.items()}
    lines = meshio.Mesh(np.eye(3), [("line", np.array([[0, 1]]))], cell_sets={"a": [np.array([0])]})
    strange = cube(meshio)
    strange.cells.append(meshio.CellBlock("tetra20", np.zeros((1, 20), dtype=int)))
    strange.cell_sets = {}
    wrong_node = cube(meshio)
    wrong_node.cells[0].data[0, 0] = 99
    beyond = cube(meshio)
    beyond.cell_sets["base"][1][0] = 99
    cases = [
        (surface, "has no solid elements but 8 surface elements"),
        (lines, "only points and lines: a body is made of solids"),
        (strange, "type tetra20 are not supported; allowed are .*hexahedron"),
        (cube(meshio, cell_sets={}), "no physical groups: .*addPhysicalGroup.*cell sets.*gmsh:physical"),
        (wrong_node, "refers to node 99, but the mesh has 27 nodes"),
        (beyond, "refers to element 99, but there are 8 of the type quad"),
        (cube(meshio, cell_sets={'a"b': [[0], []]}), "must not be empty or contain quotation marks"),
        (object(), "a object is not a mesh; allowed are a path to a .msh file, a meshio.Mesh, the module gmsh"),
        (3, "a int is not a mesh"),
    ]
    good = orthowear.Scene.from_dict(on(cube(meshio)))
    for mesh, message in cases:
        for make in (lambda mesh: orthowear.Scene.from_dict(on(mesh)), lambda mesh: good.replace({"body1.mesh": mesh})):
            with pytest.raises(orthowear.InputError, match=message) as caught:
                make(mesh)
            assert caught.value.exit_code == 2 and [wrong["key"] for wrong in caught.value.mistakes] == ["body1.mesh"]
    with pytest.raises(orthowear.InputError, match="is not a meshio.Mesh"):
        meshes.from_meshio("block.msh")
    with pytest.raises(orthowear.InputError, match="is neither the module gmsh nor gmsh.model"):
        meshes.from_gmsh(types.SimpleNamespace())


def test_refusals_of_gmsh(gmsh):
    """Truth: the message names the missing part and the call that creates it."""
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    with pytest.raises(orthowear.InputError, match=r"body1\.mesh: the current model of gmsh has no mesh: call .*generate"):
        orthowear.Scene.from_dict(on(gmsh))
    gmsh.model.mesh.generate(3)
    with pytest.raises(orthowear.InputError, match="the mesh has no physical groups: .*addPhysicalGroup"):
        orthowear.Scene.from_dict(on(gmsh))
    gmsh.model.addPhysicalGroup(2, [1], name="contact")
    with pytest.raises(orthowear.InputError, match="no solid elements but .* surface elements. All have the same x. .* gmsh saves only"):
        orthowear.Scene.from_dict(on(gmsh))
    gmsh.model.addPhysicalGroup(3, [-1], name="body")
    gmsh.model.addPhysicalGroup(2, [-2, 3], name="base")
    assert set(meshes.from_gmsh(gmsh).groups) == {(2, "contact"), (2, "base"), (3, "body")}
    gmsh.model.mesh.setOrder(3)
    with pytest.raises(orthowear.InputError, match=r"elements of gmsh's type .* are not supported; .* setOrder\(2\)"):
        orthowear.Scene.from_dict(on(gmsh))
    gmsh.finalize()
    with pytest.raises(orthowear.InputError, match=r"gmsh\.initialize\(\)"):
        orthowear.Scene.from_dict(on(gmsh))


def run_of(scene):
    return os.getpid(), scene.run(cache=False)


def test_scenes_with_meshes_travel(temporary):
    """Truth: a scene sent to another process, or a pickled scene, gives the results of this process."""
    meshio = needed("meshio")
    scene = orthowear.Scene.from_dict(on(cube(meshio)))
    expected = scene.run(cache=False)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        process, result = pool.apply(run_of, (scene,))
    assert process != os.getpid() and same(result, expected)
    packed = pickle.dumps(scene)
    path = Path(scene.to_dict()["body1"]["mesh"])
    del scene
    gc.collect()
    assert not path.exists()
    assert same(pickle.loads(packed).run(cache=False), expected)


KILLED = """
import os, signal, sys, time
import numpy as np
from orthowear import mesh
from orthowear.mesh import files
made = mesh.Mesh(np.eye(4, 3), [("tetra", np.array([[3, 0, 1, 2]]), (1,))], {(3, 1): "body"})
file = files._file(made)
print(file.path.parent, flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")
def test_folders_of_killed_processes_are_cleared(monkeypatch, temporary):
    """Truth: the folder of a running process stays. The folder of a killed process is removed when another process
    makes its own folder.
    """
    child = subprocess.Popen([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, text=True)
    folder = Path(child.stdout.readline().strip())
    assert folder.parent == temporary
    assert len(list(folder.glob("*.msh"))) == 1
    monkeypatch.setattr(files, "STALE_AFTER_SECONDS", -1.0)
    files._clear_stale()
    assert folder.exists()
    child.kill()
    child.wait(10)
    monkeypatch.setattr(files, "STALE_AFTER_SECONDS", 60.0)
    files._clear_stale()
    assert folder.exists()
    monkeypatch.setattr(files, "STALE_AFTER_SECONDS", -1.0)
    files._clear_stale()
    assert not folder.exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks of POSIX")
def test_forked_processes_leave_the_files_alone(temporary):
    """Truth: the mesh file and its scene survive a forked process that deletes its scenes with the same mesh."""
    meshio = needed("meshio")
    scene = orthowear.Scene.from_dict(on(cube(meshio)))
    path = Path(scene.to_dict()["body1"]["mesh"])
    child = os.fork()
    if child == 0:
        code = 1
        try:
            other = Path(orthowear.Scene.from_dict(on(cube(meshio))).to_dict()["body1"]["mesh"])
            del scene
            gc.collect()
            code = 0 if path.exists() and other.name == path.name else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert path.exists() and scene.run(cache=False).status == "converged"
