//! Output and restart files at several numbers of ranks. Each test launches its own binary under mpirun.

use crate::common::mpirun;
use crate::common::relaunch::full_name;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use agimp::io::hdf5_file::{Reader, Writer};
use agimp::io::snapshot::compare::{Difference, diff, digest};
use agimp::io::snapshot::directory::{AtStake, at_stake, candidates, checkpoint_path, output_path};
use agimp::io::snapshot::{self, Header, Limits, Options, Outputs, PointField, Scalars, View};
use agimp::particle::chunk::{Chunk, Layout, Tag};
use agimp::particle::followed::Followed;
use partition::comm::{Comm, World, is_launched};
use partition::{Brick, Octant};
use post::picture::{Scene, Settings, draw};

/// Runs `body` on each number of ranks in a directory shared by all of them, then `after` in the test
/// process. Each number of ranks is a new process group, as MPI starts once per process.
fn on_ranks(test: &str, ranks: &[usize], body: impl Fn(&Comm, &Path), after: impl Fn(&Path)) {
    launch(test, ranks, body, after, |_| {});
}

/// As [`on_ranks`]; what the ranks print goes to `tell`.
fn launch(
    test: &str,
    ranks: &[usize],
    body: impl Fn(&Comm, &Path),
    after: impl Fn(&Path),
    tell: impl Fn(&str),
) {
    if is_launched() {
        let world = World::init().expect("MPI starts");
        let directory = PathBuf::from(std::env::var_os("AGIMP_TEST_DIRECTORY").expect("set by the launcher"));
        body(world.comm(), &directory);
        return;
    }
    let directory = tempfile::tempdir().expect("temporary directory");
    for n in ranks {
        let mut command = mpirun::command(*n, 120);
        command
            .arg(std::env::current_exe().expect("own path"))
            .args([
                "--exact",
                &full_name(module_path!(), test),
                "--nocapture",
                "--test-threads=1",
                "--include-ignored",
            ])
            .env("AGIMP_TEST_DIRECTORY", directory.path());
        let output = mpirun::finish(&mut command);
        let text = mpirun::text(&output);
        assert!(output.status.success(), "{test} on {n} ranks:\n{text}");
        tell(&text);
    }
    after(directory.path());
}

/// A number that depends on all bits of its arguments.
fn scramble(a: u64, b: u64) -> u64 {
    let x = (a ^ b.rotate_left(32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) ^ x >> 7
}

/// Data that a run would own.
struct Run<const D: usize> {
    leaves: Vec<Octant<D>>,
    chunks: Vec<Chunk<D>>,
    leaf_fields: Vec<(String, Vec<f64>)>,
    materials: Vec<String>,
    bodies: Vec<String>,
    histories: Vec<String>,
    scalars: Scalars,
}

const ORIGIN: f64 = -0.375;
const ROOT_EDGE: f64 = 0.5;
const LIMITS: Limits = Limits { materials: 2, bodies: 2 };

impl<const D: usize> Run<D> {
    /// The leaves from `first` to `end` of a made-up run with `leaves` leaves.
    fn example(leaves: std::ops::Range<usize>, crowd: u64) -> Self {
        let octant = |i: usize| Octant {
            level: 2 + (scramble(i as u64, 1) % 3) as u8,
            coord: std::array::from_fn(|axis| (scramble(i as u64, 2 + axis as u64) % 4) as u32),
        };
        let chunk = |i: usize| {
            let mut chunk = Chunk::new();
            for k in 0..scramble(i as u64, 9) % crowd {
                let id = (i as u64) << 8 | k;
                let tag = Tag { material: (id % 2) as u16, body: 1, level: 3 };
                let p = chunk.push_zeroed(id, tag);
                let (leaf, edge) = (octant(i), ROOT_EDGE / f64::from(1 << octant(i).level));
                for column in 0..Layout::<D>::REALS {
                    let value = (scramble(id, column as u64) >> 11) as f64 / (1_u64 << 53) as f64;
                    chunk.column_mut(column)[p] = match column {
                        axis if axis < D => (f64::from(leaf.coord[axis]) + value) * edge,
                        column if column == Layout::<D>::MASS || column == Layout::<D>::HALF => value + 0.25,
                        _ => value - 0.25,
                    };
                }
                // A stress-free shape with a positive volume.
                for component in 0..3 {
                    chunk.column_mut(Layout::<D>::LEFT_CAUCHY_GREEN + component)[p] = 4.0;
                }
            }
            chunk
        };
        let wear = leaves.clone().map(|i| scramble(i as u64, 77) as f64).collect();
        Self {
            leaves: leaves.clone().map(octant).collect(),
            chunks: leaves.map(chunk).collect(),
            leaf_fields: vec![("wear".into(), wear)],
            materials: vec!["sand".into(), "steel".into()],
            bodies: vec!["heap".into(), "wall".into()],
            histories: vec!["plastic_strain".into(), "volume_gain".into()],
            scalars: Scalars {
                reals: vec![("mass at start".into(), 0.1)],
                counts: vec![("next id".into(), u64::MAX)],
                exact: vec![("work".into(), vec![1, -2, i64::MAX]), ("impulse".into(), vec![])],
            },
        }
    }

    fn view(&self) -> View<'_, D> {
        View {
            leaves: &self.leaves,
            chunks: &self.chunks,
            followed: Followed::default(),
            leaf_fields: &self.leaf_fields,
            maps: &[],
            maxima: &[],
            origin: [ORIGIN; D],
            root_edge: ROOT_EDGE,
            brick: Brick { roots: [1; D] },
            materials: &self.materials,
            water_moduli: &[],
            water: None,
            bodies: &self.bodies,
            histories: &self.histories,
            job_digest: 0xfeed_face_dead_beef,
            job_text: "title = \"a job\"\n",
            job_file: Path::new(""),
            step: 120,
            time: 0.1 + 0.2,
            dt: 1e-5,
            scalars: &self.scalars,
        }
    }
}

/// The share of `total` leaves that a rank holds in distribution `pattern`; bit `r` of it leaves rank
/// `r` empty, except that the last rank takes what is left.
fn share(comm: &Comm, total: usize, pattern: usize) -> std::ops::Range<usize> {
    let (mut start, ranks) = (0, comm.size());
    for rank in 0..ranks {
        let even = total * (rank + 1) / ranks;
        let end = if rank + 1 == ranks {
            total
        } else if pattern >> rank & 1 == 1 {
            start
        } else {
            even
        };
        if rank == comm.rank() {
            return start..end;
        }
        start = end;
    }
    start..total
}

fn options() -> Options {
    Options { fields: PointField::ALL.to_vec(), single: false, restart: true }
}

fn bytes(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn write_read_write<const D: usize>(comm: &Comm, directory: &Path) {
    let n = comm.size();
    let path = |kind: &str| directory.join(format!("{kind}{D}_{n}.hdf"));
    let run = Run::<D>::example(share(comm, 40, 0b0010), 20);
    snapshot::write(comm, &path("run"), &run.view(), &options()).expect("written");
    snapshot::write_tree(comm, &path("tree"), &run.view()).expect("written");

    // Back from the file that the first launch has written, on this number of ranks.
    let source = directory.join(format!("run{D}_1.hdf"));
    let back = snapshot::read::<D>(comm, &source, Some(0xfeed_face_dead_beef), LIMITS).expect("read");
    let header = back.header;
    let again = Run {
        leaves: back.leaves,
        chunks: back.chunks,
        leaf_fields: back.leaf_fields,
        materials: header.materials,
        bodies: header.bodies,
        histories: header.histories,
        scalars: header.scalars,
    };
    snapshot::write(comm, &path("again"), &again.view(), &options()).expect("written");

    // Shares of about the same number of particles; a leaf has at most 20.
    let mine: usize = again.chunks.iter().map(Chunk::len).sum::<usize>() + again.leaves.len();
    let mut total = [mine as u64];
    comm.sum_u64(&mut total);
    assert!((mine as f64 - total[0] as f64 / n as f64).abs() <= 21.0, "{mine} of {total:?} on {n} ranks");
}

#[test]
fn files_are_the_same_on_any_ranks_and_come_back() {
    on_ranks(
        "files_are_the_same_on_any_ranks_and_come_back",
        &[1, 2, 3, 4],
        |comm, directory| {
            write_read_write::<2>(comm, directory);
            write_read_write::<3>(comm, directory);
        },
        |directory| {
            for d in [2, 3] {
                let path = |kind: &str, n: usize| directory.join(format!("{kind}{d}_{n}.hdf"));
                for n in 1..=4 {
                    for (kind, like) in [("run", "run"), ("tree", "tree"), ("again", "run")] {
                        assert!(
                            bytes(&path(kind, n)) == bytes(&path(like, 1)),
                            "{kind} in {d}D on {n} ranks differs from {like} on one"
                        );
                    }
                }
                let whole = digest(&path("run", 1)).expect("digest").whole;
                assert_eq!(whole, digest(&path("again", 4)).expect("digest").whole);
                assert_eq!(diff(&path("run", 1), &path("again", 3)).expect("compared"), []);
            }
        },
    );
}

/// Whoever opens a file with nothing but HDF5 learns what is in it: each data set stands in the guide, each
/// field of the particles and each column of the state says its unit and what it is, and the job is there as
/// text.
#[test]
fn files_explain_themselves() {
    on_ranks(
        "files_explain_themselves",
        &[2],
        |comm, directory| {
            let run = Run::<3>::example(share(comm, 12, 0), 9);
            snapshot::write(comm, &directory.join("run.hdf"), &run.view(), &options()).expect("written");
            let light = Options { restart: false, ..options() };
            snapshot::write(comm, &directory.join("light.hdf"), &run.view(), &light).expect("written");
            snapshot::write_tree(comm, &directory.join("tree.hdf"), &run.view()).expect("written");
        },
        |directory| {
            let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/files.md");
            let guide = std::fs::read_to_string(guide).expect("the guide");
            for name in ["run.hdf", "light.hdf", "tree.hdf"] {
                let file = Reader::open_alone(&directory.join(name)).expect("opened");
                let header = Header::read(&file).expect("header");
                assert_eq!(header.bodies, ["heap", "wall"]);
                for (set, _) in &header.checksums {
                    let last = set.rsplit('/').next().expect("a name");
                    assert!(
                        [format!("`{last}`"), format!("/{last}`")]
                            .iter()
                            .any(|name| last == "wear" || guide.contains(name)),
                        "{set} is not in the guide"
                    );
                    if ["PointData", "CellData", "state/particles"].iter().any(|group| set.contains(group))
                        && last != "wear"
                    {
                        let units = file.text(set, "units").expect("units");
                        assert!(!file.text(set, "description").expect("description").is_empty(), "{set}");
                        assert!(
                            units.is_empty() || guide.contains(&format!("| {units} |")),
                            "{set}: {units}"
                        );
                    }
                }
            }
            let light = Reader::open_alone(&directory.join("light.hdf")).expect("opened");
            assert_eq!(light.text("VTKHDF/PointData/density", "units").expect("units"), "kg/m³");
            assert_eq!(light.text("VTKHDF/PointData/body", "names").expect("names"), "heap\nwall");
            let text = snapshot::job_text(&directory.join("light.hdf"));
            assert_eq!(text.as_deref(), Some("title = \"a job\"\n"));
        },
    );
}

#[test]
fn ranks_without_rows_do_no_harm() {
    on_ranks(
        "ranks_without_rows_do_no_harm",
        &[1, 4],
        |comm, directory| {
            let reference = directory.join("reference.hdf");
            for repetition in 0..if comm.size() == 1 { 1 } else { 48 } {
                let run = Run::<3>::example(share(comm, 9, repetition % 8), 6);
                let path = if comm.size() == 1 { reference.clone() } else { directory.join("part.hdf") };
                snapshot::write(comm, &path, &run.view(), &options()).expect("written");
                if comm.rank() == 0 {
                    assert!(bytes(&path) == bytes(&reference), "repetition {repetition}");
                }
                comm.barrier();
            }
        },
        |_| {},
    );
}

#[test]
fn a_step_without_particles_or_leaves() {
    on_ranks(
        "a_step_without_particles_or_leaves",
        &[1, 3],
        |comm, directory| {
            for (kind, leaves) in [("bare", 0), ("unused", 5)] {
                let run = Run::<2>::example(share(comm, leaves, 0), 1);
                let path = directory.join(format!("{kind}_{}.hdf", comm.size()));
                snapshot::write(comm, &path, &run.view(), &options()).expect("written");
                snapshot::write_tree(comm, &path.with_extension("tree.hdf"), &run.view()).expect("written");
                let back = snapshot::read::<2>(comm, &path, None, LIMITS).expect("read");
                assert_eq!(back.header.leaves, leaves as u64);
                assert_eq!(back.header.particles, 0);
            }
        },
        |directory| {
            for kind in ["bare", "unused"] {
                let path = |n: usize| directory.join(format!("{kind}_{n}.hdf"));
                assert!(bytes(&path(1)) == bytes(&path(3)));
                for python in pythons() {
                    let found = vtk(&python, &[&path(1), &path(1).with_extension("tree.hdf")]);
                    assert_eq!(found[0]["points"], 0, "{python}");
                    assert_eq!(found[1]["cells"], if kind == "bare" { 0 } else { 5 }, "{python}");
                }
            }
        },
    );
}

#[test]
fn damaged_and_foreign_files_are_refused() {
    const NAME: &str = "damaged_and_foreign_files_are_refused";
    on_ranks(
        NAME,
        &[1, 2],
        |comm, directory| {
            let path = directory.join("good.hdf");
            if comm.size() == 1 {
                let run = Run::<3>::example(share(comm, 12, 0), 9);
                snapshot::write(comm, &path, &run.view(), &options()).expect("written");
                let light = Options { restart: false, ..options() };
                snapshot::write(comm, &directory.join("light.hdf"), &run.view(), &light).expect("written");
                damage(directory);
                return;
            }
            let refused = |file: &str, job, reason: &str| {
                let path = directory.join(file);
                let error = snapshot::read::<3>(comm, &path, job, LIMITS).expect_err(file).to_string();
                assert!(error.contains(reason) && error.contains(file), "{file}: {error}");
            };
            refused("missing.hdf", None, "No such file");
            refused("text.hdf", None, "not an HDF5 file");
            refused("tiny.hdf", None, "cut short");
            refused("cut.hdf", None, "cut short");
            refused("flipped.hdf", None, "wrong checksum of state/particles/position");
            refused("flipped_header.hdf", None, "");
            refused("flipped_mark.hdf", None, "");
            let file = Writer::create(comm, &directory.join("format.hdf")).expect("created");
            file.create_group("state").expect("group");
            file.set_text("state", "magic", "agimp state").expect("text");
            file.set_text("state", "program", "7.0.0").expect("text");
            file.set_attribute("state", "format", &[99_u64]).expect("number");
            file.close().expect("closed");
            refused("format.hdf", None, "written in format 99 by agimp 7.0.0");
            let file = Writer::create(comm, &directory.join("foreign.hdf")).expect("created");
            file.close().expect("closed");
            refused("foreign.hdf", None, "not a file written by agimp");
            refused("light.hdf", None, "no restart state");
            refused("good.hdf", Some(7), "belongs to another job");
            let error = snapshot::read::<2>(comm, &path, None, LIMITS).expect_err("dimension").to_string();
            assert!(error.contains("3D run, but the job is 2D"), "{error}");
            snapshot::read::<3>(comm, &path, Some(0xfeed_face_dead_beef), LIMITS)
                .expect("the whole file is read");
        },
        |_| {},
    );
}

/// Makes damaged copies of `good.hdf`.
fn damage(directory: &Path) {
    let good = bytes(&directory.join("good.hdf"));
    let save = |name: &str, contents: &[u8]| std::fs::write(directory.join(name), contents).expect("saved");
    save("text.hdf", b"# a text that is longer than eight bytes\n");
    save("tiny.hdf", &good[..5]);
    save("cut.hdf", &good[..good.len() - good.len() / 3]);
    let flip = |needle: &[u8]| {
        let at: Vec<usize> =
            (0..good.len() - needle.len()).filter(|&i| good[i..].starts_with(needle)).collect();
        assert_eq!(at.len(), 1, "found once");
        let mut copy = good.clone();
        copy[at[0]] ^= 0x10;
        copy
    };
    // Positions without the origin stand in the state only.
    let run = Run::<3>::example(0..12, 9);
    let chunk = run.chunks.iter().find(|chunk| !chunk.is_empty()).expect("particles");
    let position: Vec<u8> = chunk.position(0).iter().flat_map(|x| x.to_le_bytes()).collect();
    save("flipped.hdf", &flip(&position));
    // The library's own checksum of metadata notices these.
    save("flipped_header.hdf", &flip(&0.1_f64.to_le_bytes()));
    save("flipped_mark.hdf", &flip(b"agimp state"));
}

#[test]
fn a_failing_rank_leaves_no_file() {
    on_ranks(
        "a_failing_rank_leaves_no_file",
        &[3],
        |comm, directory| {
            let path = directory.join("never.hdf");
            let mut run = Run::<2>::example(share(comm, 12, 0), 9);
            if comm.rank() == 1 {
                run.chunks.pop();
            }
            let error =
                snapshot::write(comm, &path, &run.view(), &options()).expect_err("chunks are missing");
            assert!(error.to_string().starts_with("rank 1: "), "{error}");
            let nowhere = directory.join("nowhere/never.hdf");
            snapshot::write(comm, &nowhere, &run.view(), &options()).expect_err("no such directory");
            comm.barrier();
            let left = std::fs::read_dir(directory).expect("listed").count();
            assert_eq!(left, 0, "no file and no temporary file");
        },
        |_| {},
    );
}

/// A state that has blown up gets no file: the message names particle and quantity, and the file of that name
/// stays as it was.
#[test]
fn numbers_that_are_not_finite_are_not_written() {
    on_ranks(
        "numbers_that_are_not_finite_are_not_written",
        &[1, 2, 3],
        |comm, directory| {
            let path = directory.join("kept.hdf");
            let run = Run::<2>::example(share(comm, 12, 0), 9);
            snapshot::write(comm, &path, &run.view(), &options()).expect("written");
            let before = bytes(&path);
            comm.barrier();
            for (column, name) in
                [(Layout::<2>::MASS, "mass"), (Layout::<2>::LEFT_CAUCHY_GREEN, "left_cauchy_green")]
            {
                for value in [f64::NAN, f64::INFINITY] {
                    let mut run = Run::<2>::example(share(comm, 12, 0), 9);
                    if comm.rank() + 1 == comm.size() {
                        let chunk =
                            run.chunks.iter_mut().rfind(|chunk| !chunk.is_empty()).expect("particles");
                        chunk.column_mut(column)[0] = value;
                    }
                    let error =
                        snapshot::write(comm, &path, &run.view(), &options()).expect_err("not finite");
                    let message = error.to_string();
                    assert!(message.contains(&format!("not written: {name} of particle ")), "{message}");
                }
            }
            comm.barrier();
            assert_eq!(bytes(&path), before, "on rank {}", comm.rank());
            assert_eq!(std::fs::read_dir(directory).expect("listed").count(), 1, "no temporary file");
        },
        |_| {},
    );
}

/// A real full disk: a file system of 1 MB in an own mount namespace. Left out where the system grants
/// none.
#[test]
fn a_full_disk_leaves_the_old_file() {
    const NAME: &str = "a_full_disk_leaves_the_old_file";
    if let Some(directory) = std::env::var_os("AGIMP_TEST_DIRECTORY").map(PathBuf::from) {
        // As the program does, which survives files that cannot be closed.
        agimp::io::hdf5_file::prepare();
        let world = World::init().expect("MPI starts");
        let comm = world.comm();
        let path = directory.join("kept.hdf");
        let small = Run::<3>::example(share(comm, 2, 0), 3);
        snapshot::write(comm, &path, &small.view(), &options()).expect("small enough");
        let before = bytes(&path);
        comm.barrier();
        let large = Run::<3>::example(share(comm, 400, 0), 200);
        let error = snapshot::write(comm, &path, &large.view(), &options()).expect_err("too large");
        assert!(
            error.to_string().contains("kept.hdf.part: cannot write: no space left on device"),
            "{error}"
        );
        comm.barrier();
        assert!(bytes(&path) == before, "the old file is untouched");
        assert!(!path.with_added_extension("part").exists());
        snapshot::write(comm, &path, &small.view(), &options()).expect("small enough, again");
        full_at_any_point(comm, &directory);
        return;
    }
    let directory = tempfile::tempdir().expect("temporary directory");
    let launch = |script: &str| {
        Command::new("unshare")
            .args(["-rm", "bash", "-c", &format!("mount -t tmpfs -o size=1m none \"$0\" && {script}")])
            .arg(directory.path())
            .arg(std::env::current_exe().expect("own path"))
            .arg(mpirun::environment())
            .env("AGIMP_TEST_DIRECTORY", directory.path())
            .output()
    };
    if !launch("true").is_ok_and(|output| output.status.success()) {
        return;
    }
    let mpirun = format!(
        "source \"$2\" && mpirun --bind-to none -n 3 \"$1\" --exact {} --nocapture --test-threads=1",
        full_name(module_path!(), NAME)
    );
    let output = launch(&mpirun).expect("unshare starts");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
}

/// Room for none, some and all but the last page of a file: wherever it fails, all ranks get the reason, and
/// nothing stays.
fn full_at_any_point(comm: &Comm, directory: &Path) {
    const PAGE: u64 = 4096;
    let (path, ballast) = (directory.join("later.hdf"), directory.join("ballast"));
    let run = Run::<3>::example(share(comm, 40, 0b010), 30);
    snapshot::write(comm, &path, &run.view(), &options()).expect("small enough");
    let whole = bytes(&path).len().next_multiple_of(PAGE as usize) as u64;
    comm.barrier();
    if comm.rank() == 0 {
        std::fs::remove_file(&path).expect("removed");
    }
    for room in [0, PAGE, 2 * PAGE, whole / 2, whole - 3 * PAGE, whole - 2 * PAGE, whole - PAGE] {
        let room = room / PAGE * PAGE;
        if comm.rank() == 0 {
            // As much as the disk holds, then less by the room.
            let filler = std::fs::File::create(&ballast).expect("created");
            let mut held = 0;
            while (&filler).write_all(&[1; PAGE as usize]).is_ok() {
                held += PAGE;
            }
            filler.set_len(held - room).expect("shortened");
        }
        comm.barrier();
        let written = snapshot::write(comm, &path, &run.view(), &options());
        let error = written.expect_err("one page is missing at least").to_string();
        assert!(error.contains("no space left on device"), "{room} of {whole}: {error}");
        comm.barrier();
        if comm.rank() == 0 {
            assert!(!path.exists() && !path.with_added_extension("part").exists(), "{room} of {whole}");
            std::fs::remove_file(&ballast).expect("removed");
        }
        comm.barrier();
    }
    snapshot::write(comm, &path, &run.view(), &options()).expect("small enough");
}

#[test]
fn outputs_checkpoints_and_the_latest() {
    on_ranks(
        "outputs_checkpoints_and_the_latest",
        &[2],
        |comm, directory| {
            let directory = directory.join("results");
            let light = Options { restart: false, single: true, ..options() };
            let mut outputs = Outputs::create(comm, &directory, "col", light.clone()).expect("created");
            let run = Run::<3>::example(share(comm, 8, 0), 9);
            for i in 0..4 {
                let view = View { step: 10 * i, time: 0.1 * i as f64, ..run.view() };
                outputs.write(comm, &view).expect("written");
                outputs.checkpoint(comm, &view, 2).expect("written");
            }
            outputs.settle(comm).expect("on disk");
            let mut resumed = Outputs::resume(comm, &directory, "col", light, 2, 0.1).expect("resumed");
            resumed.write(comm, &View { step: 20, time: 0.2, ..run.view() }).expect("written");
            assert_eq!(resumed.next(), 3);
        },
        |directory| {
            let directory = &directory.join("results");
            let latest = checkpoint_path(directory, "col", 30);
            let found = candidates(directory, "col", None).expect("listed");
            assert_eq!((&found.whole[0], found.damaged.len()), (&(latest.clone(), 30), 0));
            assert!(!checkpoint_path(directory, "col", 10).exists());
            assert!(candidates(directory, "co", None).expect("listed").whole.is_empty());
            let found = candidates(directory, "col", Some(1)).expect("listed");
            assert!(found.whole.is_empty() && found.other.is_some(), "{found:?}");
            assert_eq!(snapshot::job_text(&latest).as_deref(), Some("title = \"a job\"\n"));
            let at_stake = |digest| at_stake(directory, "col", digest).expect("listed");
            assert_eq!(at_stake(0xfeed_face_dead_beef), Some(AtStake::Checkpoint(latest.clone())));
            // A damaged newest file is passed over.
            let whole = bytes(&latest);
            std::fs::write(&latest, &whole[..whole.len() / 2]).expect("cut");
            let found = candidates(directory, "col", None).expect("listed");
            assert_eq!((found.whole[0].1, found.damaged.len()), (20, 1));
            for step in [20, 30] {
                std::fs::remove_file(checkpoint_path(directory, "col", step)).expect("removed");
            }
            assert_eq!(at_stake(0xfeed_face_dead_beef), None);
            assert_eq!(at_stake(1), Some(AtStake::OtherJob(output_path(directory, "col", 0))));
            let series = directory.join("col.hdf.series");
            let text = std::fs::read_to_string(&series).expect("series");
            assert!(text.contains("\"time\": 0.2") && !text.contains("000003"), "{text}");
            for python in pythons() {
                let tree = directory.join("col.tree.hdf.series");
                let found = vtk(&python, &[&series, &tree, &output_path(directory, "col", 1)]);
                assert_eq!(found[0]["times"].as_array().map(Vec::len), Some(3), "{python}");
                assert_eq!(found[2]["point_data"]["velocity"]["type"], "float", "{python}");
            }
        },
    );
}

#[test]
fn differences_are_named() {
    on_ranks(
        "differences_are_named",
        &[1],
        |comm, directory| {
            let mut run = Run::<2>::example(0..6, 9);
            snapshot::write(comm, &directory.join("a.hdf"), &run.view(), &options()).expect("written");
            let leaf = run.chunks.iter().rposition(|chunk| chunk.len() > 2).expect("crowded leaf");
            let column = Layout::<2>::STRESS + 1;
            run.chunks[leaf].column_mut(column)[1] += 1.0;
            run.chunks[leaf].ids_mut()[0] = 1 << 40;
            snapshot::write(comm, &directory.join("c.hdf"), &run.view(), &options()).expect("written");
            run.leaves[3].level += 1;
            snapshot::write(comm, &directory.join("b.hdf"), &run.view(), &options()).expect("written");
        },
        |directory| {
            let paths = ["a.hdf", "b.hdf", "c.hdf"].map(|name| directory.join(name));
            let found = diff(&paths[0], &paths[1]).expect("compared");
            assert_ne!(digest(&paths[0]).expect("digest"), digest(&paths[2]).expect("digest"));
            let error = digest(&paths[1]).expect_err("a leaf has shrunk").to_string();
            assert!(error.contains("is not in its leaf of level"), "{error}");
            assert!(matches!(found[0], Difference::Tree { leaf: 3, .. }), "{found:?}");
            assert!(matches!(found[1], Difference::Missing { only_in: 0, count: 1, .. }), "{found:?}");
            assert!(matches!(found[2], Difference::Missing { only_in: 1, id: 0x100_0000_0000, count: 1 }));
            let Difference::Field { name, component, count, largest, .. } = found[3] else {
                panic!("{found:?}")
            };
            assert_eq!((name, component, count), ("stress", 1, 1));
            assert!((largest - 1.0).abs() < 1e-15);
            assert_eq!(found.len(), 4);
        },
    );
}

#[test]
fn a_picture_is_the_same_on_any_ranks() {
    on_ranks(
        "a_picture_is_the_same_on_any_ranks",
        &[1, 3],
        |comm, directory| {
            let path = |d: usize| directory.join(format!("{d}_{}.png", comm.size()));
            let settings = Settings::new("made up");
            let solid = Run::<3>::example(share(comm, 40, 0b10), 20);
            draw(comm, &solid.view(), PointField::Speed, &settings, Scene::default(), &path(3))
                .expect("drawn");
            let plane = Run::<2>::example(share(comm, 40, 0b10), 20);
            draw(comm, &plane.view(), PointField::Speed, &settings, Scene::default(), &path(2))
                .expect("drawn");
        },
        |directory| {
            for d in [2, 3] {
                let path = |n: usize| directory.join(format!("{d}_{n}.png"));
                assert!(bytes(&path(1)) == bytes(&path(3)), "{d}D");
            }
        },
    );
}

/// Interpreters with VTK, from `AGIMP_VTK_PYTHON` (separated by colons); the checks with VTK are left
/// out where there is none.
fn pythons() -> Vec<String> {
    let list = std::env::var("AGIMP_VTK_PYTHON").unwrap_or_default();
    list.split(':').filter(|path| !path.is_empty()).map(str::to_owned).collect()
}

fn vtk(python: &str, files: &[&Path]) -> Vec<serde_json::Value> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vtk_check.py");
    let output = Command::new(python).arg(script).args(files).output().expect("python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{python}: {text}{}", String::from_utf8_lossy(&output.stderr));
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn vtk_reads_particles_and_tree() {
    on_ranks(
        "vtk_reads_particles_and_tree",
        &[2],
        |comm, directory| {
            let run = Run::<3>::example(share(comm, 10, 0), 9);
            snapshot::write(comm, &directory.join("p.hdf"), &run.view(), &options()).expect("written");
            snapshot::write_tree(comm, &directory.join("t.hdf"), &run.view()).expect("written");
            let flat = Run::<2>::example(share(comm, 10, 0), 9);
            snapshot::write_tree(comm, &directory.join("f.hdf"), &flat.view()).expect("written");
        },
        |directory| {
            let run = Run::<3>::example(0..10, 9);
            let particles: usize = run.chunks.iter().map(Chunk::len).sum();
            let ids: u64 = run.chunks.iter().flat_map(|chunk| chunk.ids()).sum();
            let x: Vec<f64> =
                run.chunks.iter().flat_map(|chunk| chunk.column(0)).map(|x| ORIGIN + x).collect();
            for python in pythons() {
                let paths = ["p.hdf", "t.hdf", "f.hdf"].map(|name| directory.join(name));
                let found = vtk(&python, &paths.each_ref().map(PathBuf::as_path));
                let points = &found[0];
                assert_eq!(points["points"], particles);
                assert_eq!(points["cells"], particles);
                assert_eq!(points["cell_types"], serde_json::json!([1]));
                assert_eq!(points["bounds"][0].as_f64(), x.iter().copied().reduce(f64::min));
                assert_eq!(points["bounds"][1].as_f64(), x.iter().copied().reduce(f64::max));
                for field in PointField::ALL {
                    assert_eq!(points["point_data"][field.name()]["tuples"], particles, "{}", field.name());
                }
                assert_eq!(points["point_data"]["id"]["sum"].as_f64(), Some(ids as f64));
                assert_eq!(points["point_data"]["stress"]["components"], 6);
                assert_eq!(points["point_data"]["velocity"]["components"], 3);
                assert_eq!(points["field_data"]["TimeValue"]["sum"].as_f64(), Some(0.1 + 0.2));
                for (tree, corners, cell_type) in [(&found[1], 8, 11), (&found[2], 4, 8)] {
                    assert_eq!(tree["cells"], 10);
                    assert_eq!(tree["points"], 10 * corners);
                    assert_eq!(tree["cell_types"], serde_json::json!([cell_type]));
                    assert_eq!(tree["cell_data"]["wear"]["tuples"], 10);
                }
                let levels: u32 = run.leaves.iter().map(|leaf| u32::from(leaf.level)).sum();
                assert_eq!(found[1]["cell_data"]["level"]["sum"].as_f64(), Some(f64::from(levels)));
                assert_eq!(found[1]["cell_data"]["particles"]["sum"].as_f64(), Some(particles as f64));
            }
        },
    );
}

/// Speed of checkpoints, a few MB and many, by ranks:
/// `cargo test --release --test all -- --ignored --nocapture speed_of_checkpoints`.
#[test]
#[ignore = "measures; checks nothing but that the files are written"]
fn speed_of_checkpoints() {
    const NAME: &str = "speed_of_checkpoints";
    launch(
        NAME,
        &[1, 2, 3, 4],
        |comm, directory| {
            for (leaves, crowd, times) in [(400, 100, 20), (40_000, 100, 5)] {
                let run = Run::<3>::example(share(comm, leaves, 0), crowd);
                let path = directory.join("speed.vtkhdf");
                let (mut handed, mut on_disk) = (Vec::new(), Vec::new());
                for _ in 0..times {
                    comm.barrier();
                    let start = std::time::Instant::now();
                    let file = snapshot::start_write(comm, &path, &run.view(), &options()).expect("written");
                    handed.push(start.elapsed().as_secs_f64());
                    file.finish(comm).expect("on disk");
                    on_disk.push(start.elapsed().as_secs_f64());
                }
                let least = |times: &[f64]| times.iter().copied().fold(f64::INFINITY, f64::min);
                if comm.rank() == 0 {
                    let size = bytes(&path).len() as f64 / 1e6;
                    println!(
                        "\nspeed: {} ranks, {size:.1} MB: {:.1} ms to hand over, {:.1} ms until on disk",
                        comm.size(),
                        1e3 * least(&handed),
                        1e3 * least(&on_disk)
                    );
                }
            }
        },
        |_| {},
        |text| text.lines().filter(|line| line.starts_with("speed:")).for_each(|line| println!("{line}")),
    );
}
