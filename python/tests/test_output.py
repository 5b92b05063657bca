"""Single files: arrays, tables, meshes, units, names, damage."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import agimp
import h5py
import numpy as np
import pytest


def test_table_has_units_and_names(plane: agimp.Results) -> None:
    out = plane[-1]
    table = out.particles()
    units = table.attrs["units"]
    assert list(table.columns[:2]) == ["x", "y"]
    assert {"velocity_x", "velocity_y"} < set(table.columns) and "velocity_z" not in table.columns
    assert units["x"] == "m" and units["pressure"] == "Pa" and units["density"] == "kg/m³" and units["id"] == ""
    assert set(units) == set(table.columns) == set(table.attrs["descriptions"])
    assert table["material"].cat.categories.tolist() == ["rubber", "sand"] == list(out.materials)
    # The base lies lower at the start and fills twice the area of the other: 0.12 x 0.04 and 0.06 x 0.06 m².
    area = plane[0].particles().assign(area=lambda t: t["mass"] / t["density"]).groupby("material", observed=True)["area"].sum()
    assert area["rubber"] == pytest.approx(0.12 * 0.04, rel=0.05)
    assert area["sand"] == pytest.approx(0.06 * 0.06, rel=0.05)
    assert out.particles(["pressure"], names=False).columns.tolist() == ["x", "y", "pressure"]


def test_selection_by_name(plane: agimp.Results) -> None:
    out = plane[0]
    sand = out.select(material="sand")
    assert np.all(out.positions()[sand][:, 1] > 0.04) and np.all(out.positions()[~sand][:, 1] < 0.04)
    assert np.all(out.field("velocity")[sand] == [0.2, -1.0])
    with pytest.raises(KeyError, match="found the material 'sandy'; the file has rubber, sand"):
        out.select(material="sandy")


def test_stress_in_space_has_six_components(space: agimp.Results) -> None:
    out = space[-1]
    table = out.particles()
    names = [f"stress_{pair}" for pair in ("xx", "yy", "zz", "xy", "yz", "xz")]
    assert set(names) < set(table.columns)
    assert np.array_equal(table[names].to_numpy(), out.field("stress"))
    velocity = table[["velocity_x", "velocity_y", "velocity_z"]].to_numpy()
    assert np.allclose(np.linalg.norm(velocity, axis=1), table["speed"])
    assert out.description("volume_ratio") and out.unit("stress") == "Pa"


def test_unknown_field_is_told(plane: agimp.Results) -> None:
    with pytest.raises(KeyError, match="does not show 'presure'; it shows .*pressure"):
        plane[0].field("presure")


@pytest.mark.parametrize("which", ["plane", "space"])
def test_leaves_fill_the_domain_and_hold_the_particles(which: str, request: pytest.FixtureRequest) -> None:
    run: agimp.Results = request.getfixturevalue(which)
    out = run[-1]
    tree, points = out.tree, out.positions()
    low, high = (np.array(corner) for corner in out.header.domain)
    assert (tree.edge**out.dimension).sum() == pytest.approx(np.prod(high - low), rel=1e-12)
    assert np.allclose(tree.lower.min(axis=0), low) and np.allclose((tree.lower + tree.edge[:, None]).max(axis=0), high)
    inside = np.all((points >= tree.lower[:, None]) & (points < (tree.lower + tree.edge[:, None])[:, None]), axis=2)
    assert np.array_equal(inside.sum(axis=1), tree.fields["particles"])
    leaves = tree.leaves()
    assert leaves.attrs["units"]["edge"] == "m" and len(leaves) == out.header.leaves
    assert np.array_equal(tree.cell_size, tree.edge / 4)


def test_tree_of_the_state_is_that_of_the_tree_file(plane: agimp.Results, tmp_path: Path) -> None:
    alone = tmp_path / plane.paths[-1].name
    shutil.copy(plane.paths[-1], alone)
    a, b = agimp.read(alone).tree, plane[-1].tree
    assert np.allclose(a.lower, b.lower, atol=1e-15) and np.array_equal(a.level, b.level)
    # The tree file has averages of stress besides.
    assert {"level", "particles"} == set(a.fields) < set(b.fields)
    for name in a.fields:
        assert np.array_equal(a.fields[name], b.fields[name]), name


def test_no_tree_is_told(space: agimp.Results, tmp_path: Path) -> None:
    alone = tmp_path / space.paths[-1].name
    shutil.copy(space.paths[-1], alone)
    with pytest.raises(FileNotFoundError, match="no tree file beside it, and it holds no restart state"):
        agimp.read(alone).tree  # noqa: B018
    with pytest.raises(agimp.FileRefused, match="no restart state"):
        agimp.read(alone).state("affine")


def test_checkpoints_open_like_outputs(plane: agimp.Results) -> None:
    out = agimp.read(plane.checkpoints[-1])
    assert {"velocity", "leaf_level", "id", "mass"} <= set(out.fields)
    assert out.state("left_cauchy_green").shape == (len(out), 4)
    assert len(out.tree) == out.header.leaves
    with pytest.raises(KeyError, match="the state has no 'afine'; it has .*affine"):
        out.state("afine")


@pytest.mark.parametrize("which", ["plane", "space"])
def test_meshes_show_particles_and_leaves(which: str, request: pytest.FixtureRequest) -> None:
    pytest.importorskip("pyvista")
    run: agimp.Results = request.getfixturevalue(which)
    out = run[-1]
    points = out.mesh()
    assert points.n_points == points.n_cells == len(out)
    assert np.array_equal(points.points[:, : out.dimension], out.positions())
    assert np.array_equal(points["speed" if which == "space" else "pressure"], out.field("speed" if which == "space" else "pressure"))
    assert points.field_data["time"][0] == out.time
    assert list(points.field_data["materials"]) == list(out.materials)
    leaves = out.tree.mesh()
    sizes = leaves.compute_cell_sizes()["Area" if out.dimension == 2 else "Volume"]
    assert np.allclose(sizes, out.tree.edge**out.dimension)
    assert np.array_equal(leaves["level"], out.tree.level)


def test_bodies_of_revolution_are_shown_in_space(rings: agimp.Results, plane: agimp.Results) -> None:
    pytest.importorskip("pyvista")
    out = rings[-1]
    assert out.header.of_revolution and not plane[-1].header.of_revolution
    section, whole, half = out.positions(), out.mesh(revolve="whole"), out.mesh(revolve="open")
    radii = np.hypot(whole.points[:, 0], whole.points[:, 1])
    assert set(np.round(radii, 6)) == set(np.round(section[:, 0], 6))
    # As many as boxes of the section fill the volume of the ring: 0.05 m high, from 0.025 to 0.1 m.
    edge = np.sqrt(0.075 * 0.05 / len(out))
    assert whole.n_points * edge**3 == pytest.approx(np.pi * (0.1**2 - 0.025**2) * 0.05, rel=0.1)
    assert np.all((half.points[:, 0] < 1e-12) | (half.points[:, 1] > -1e-12)) and half.n_points < 0.8 * whole.n_points
    # Velocities point away from the axis as positions do, and traces of stress stay.
    velocity, stress = whole["velocity"], whole["stress"]
    across = whole.points[:, 0] * velocity[:, 1] - whole.points[:, 1] * velocity[:, 0]
    assert np.allclose(across, 0.0, atol=1e-6)
    traces = out.field("stress")[:, :3].sum(axis=1)
    assert stress[:, :3].sum(axis=1).min() == pytest.approx(traces.min(), abs=1e-3 * np.abs(traces).max())
    with pytest.raises(ValueError, match="found no bodies of revolution"):
        plane[-1].mesh(revolve="whole")
    with pytest.raises(ValueError, match="found revolve = 'half'; expected one of 'open', 'whole'"):
        out.mesh(revolve="half")


def test_damage_is_found(plane: agimp.Results, tmp_path: Path) -> None:
    whole = plane[-1]
    whole.verify()
    damaged = tmp_path / whole.path.name
    shutil.copy(whole.path, damaged)
    with h5py.File(damaged, "r+") as file:
        file["VTKHDF/PointData/pressure"][7] += 1.0
    with pytest.raises(agimp.FileRefused, match="wrong checksum of VTKHDF/PointData/pressure: the file is damaged"):
        agimp.read(damaged).verify()


def _read_all(path: Path) -> None:
    """All that can be asked of a file."""
    out = agimp.read(path)
    assert repr(out) and out.header.domain
    for name in out.fields:
        out.field(name)
    out.positions()
    out.particles()
    assert repr(out.tree) and len(out.tree.leaves())
    out.state("left_cauchy_green")
    out.verify()


def test_whatever_is_damaged_the_error_is_one_of_this_package(plane: agimp.Results, tmp_path: Path) -> None:
    whole = plane.paths[-1]
    damaged = tmp_path / "damaged_000000.hdf"
    with h5py.File(whole) as file:
        sets: list[str] = []
        file.visititems(lambda name, entry: sets.append(name) if isinstance(entry, h5py.Dataset) else None)
        attributes = [name for name in file["state"].attrs if name not in ("job_file", "job_file_relative", "title")]
    put: list[tuple[str, object]] = [(name, value) for name in sets for value in (None, np.float64(1), b"text", np.zeros((2, 5)))]
    put += [(f"state@{name}", value) for name in attributes for value in (None, b"text", np.zeros(0), -1)]
    for name, value in put:
        shutil.copy(whole, damaged)
        with h5py.File(damaged, "r+") as file:
            group, _, attribute = name.partition("@")
            place = file[group].attrs if attribute else file
            del place[attribute or name]
            if value is not None:
                place[attribute or name] = value
        try:
            _read_all(damaged)
        except agimp.AgimpError as error:
            assert str(damaged) in str(error), f"{name} = {value}: {error}"
        except FileNotFoundError as error:
            assert "no tree file beside it" in str(error), f"{name} = {value}: {error}"
        except KeyError as error:
            assert value is None and "has no 'left_cauchy_green'" in str(error), f"{name} = {value}: {error}"


def test_what_is_not_an_output_is_refused(plane: agimp.Results, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no such file"):
        agimp.read(tmp_path / "a.hdf")
    cut = tmp_path / "cut.hdf"
    cut.write_bytes(plane.paths[0].read_bytes()[:5000])
    with pytest.raises(agimp.FileRefused, match="not a whole HDF5 file"):
        agimp.read(cut)
    part = tmp_path / "a_000000.hdf.part"
    part.write_bytes(b"")
    with pytest.raises(agimp.FileRefused, match="still being written"):
        agimp.read(part)
    with h5py.File(tmp_path / "other.hdf", "w") as file:
        file["x"] = 1
    with pytest.raises(agimp.FileRefused, match="not a file written by agimp"):
        agimp.read(tmp_path / "other.hdf")
    unfinished = tmp_path / "unfinished.hdf"
    shutil.copy(plane.paths[0], unfinished)
    with h5py.File(unfinished, "r+") as file:
        del file["state"].attrs["complete"]
    with pytest.raises(agimp.FileRefused, match="incomplete"):
        agimp.read(unfinished)
    tree = next(path for path in plane.directory.iterdir() if ".tree." in path.name and path.suffix != ".series")
    with pytest.raises(agimp.FileRefused, match="no particles; is it a tree file"):
        agimp.read(tree)


@pytest.mark.parametrize(("package", "call"), [("pandas", "particles"), ("pyvista", "mesh")])
def test_optional_packages_are_asked_for_by_name(
    plane: agimp.Results, monkeypatch: pytest.MonkeyPatch, package: str, call: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf"pip install 'agimp\[{package}\]'"):
        getattr(plane[0], call)()
