//! The page of counts: memory, messages and bytes as functions of ranks and leaves.
use std::path::Path;

use agimp::job::{self, AnyProblem};
use agimp::setup;
use partition::comm::World;
use serde_json::Value;

use crate::curve::{Curve, surface};
use crate::plot::{Chart, Series};
use crate::{Block, Failure, fit, markdown, number, run};

/// Counts of the last record of one run.
struct Count {
    ranks: f64,
    /// Leaves of a rank, mean.
    leaves: f64,
    /// Greatest value of a rank, but for the three means.
    ghosts: f64,
    neighbours: f64,
    mean_neighbours: f64,
    messages: f64,
    arena_bytes: f64,
    mean_arena_bytes: f64,
    mean_surface_bytes: f64,
    memory: f64,
    particles: f64,
    grid_bytes: f64,
}

impl Count {
    fn read(record: &Value) -> Self {
        let of = |name: &str, kind: &str| number(record, &format!("/per_rank/{name}/{kind}"));
        Self {
            ranks: number(record, "/ranks"),
            leaves: of("leaves", "mean"),
            ghosts: of("ghost_leaves", "max"),
            neighbours: of("neighbours", "max"),
            mean_neighbours: of("neighbours", "mean"),
            messages: of("messages_per_step", "max"),
            arena_bytes: of("arena_bytes", "max"),
            mean_arena_bytes: of("arena_bytes", "mean"),
            mean_surface_bytes: of("surface_bytes", "mean"),
            memory: number(record, "/memory/max"),
            particles: of("particles", "max"),
            grid_bytes: of("grid_bytes", "max"),
        }
    }

    fn row(&self) -> Vec<String> {
        vec![
            format!("{}", self.ranks),
            format!("{:.1}", self.leaves),
            format!("{}", self.ghosts),
            format!("{:.1} / {}", self.mean_neighbours, self.neighbours),
            format!("{:.1}", self.messages),
            kilobytes(self.mean_arena_bytes),
            kilobytes(self.arena_bytes),
            match self.mean_surface_bytes {
                0.0 => "–".into(),
                surface => format!("{:.2}", self.mean_arena_bytes / surface),
            },
            format!("{:.1}", self.grid_bytes / 1e6),
            format!("{:.1}", self.memory / 1e6),
        ]
    }
}

const HEADS: [&str; 10] = [
    "ranks",
    "leaves per rank",
    "ghost leaves, max",
    "neighbours, mean / max",
    "messages per step, max",
    "kB per step, mean",
    "kB per step, max",
    "bytes / surface",
    "grid, MB, max",
    "memory, MB, max",
];

fn kilobytes(bytes: f64) -> String {
    format!("{:.1}", bytes / 1e3)
}

/// Surface and edges of a compact piece of `n` leaves.
fn surface_terms(count: &Count) -> [f64; 2] {
    [count.leaves.powf(2.0 / 3.0), count.leaves.cbrt()]
}

/// Bytes of a particle.
const PARTICLE: f64 = 272.0;

/// Leaves in a cube of `n` with a layer of `thickness` leaves around, without the cube.
fn layer(leaves: f64, thickness: f64) -> f64 {
    (leaves.cbrt() + 2.0 * thickness).powi(3) - leaves
}

/// One run of the page: kind, block, ranks.
type Case = (&'static str, Block, usize);

fn cases(is_quick: bool) -> Vec<Case> {
    // Of a quick page all levels are one lower, and no more than 16 ranks.
    let (lower, most) = if is_quick { (1, 16) } else { (0, 64) };
    let block = Block { roots: [1, 1], level: 4 - lower, per_cell: 1, steps: 4, every: 2 };
    let strong = [1, 2, 4, 8, 16, 32, 64].map(|ranks| ("strong", block, ranks));
    let fine = [16, 64].map(|ranks| ("fine", Block { level: 5 - lower, ..block }, ranks));
    let weak =
        [1, 4, 16, 64].map(|ranks| ("weak", Block { roots: Block::roots(ranks), level: 2, ..block }, ranks));
    strong.into_iter().chain(fine).chain(weak).filter(|(.., ranks)| *ranks <= most).collect()
}

/// Runs all cases and writes the page.
pub(crate) fn write_page(page: &Path, is_quick: bool) -> Result<(), Failure> {
    let mut counts = Vec::new();
    for (kind, block, ranks) in cases(is_quick) {
        let records = run(&block, &format!("counts_{kind}_{ranks}"), ranks, 1)?;
        // The last that follows on steps; the end of a run writes one more.
        let last = records.iter().rfind(|record| number(record, "/steps") > 0.0);
        let count = Count::read(last.ok_or("a run without records")?);
        println!("{kind} {ranks}: {}", count.row().join(" | "));
        counts.push((kind, count));
    }
    let text = page_text(page, &counts)? + &curves()?;
    std::fs::write(page, text).map_err(|error| format!("{}: {error}", page.display()))?;
    println!("{} written", page.display());
    Ok(())
}

/// The functions that describe the counts.
struct Fits {
    /// Ghost leaves as a layer of this thickness.
    thickness: f64,
    /// Bytes per step: surface and edges.
    bytes: [f64; 2],
    bytes_off: f64,
    /// Memory beside particles: fixed, and per leaf or ghost leaf.
    memory: [f64; 2],
    memory_off: f64,
    /// Memory for each rank of the job.
    per_rank: f64,
    neighbours: f64,
}

impl Fits {
    fn of(counts: &[(&str, Count)]) -> Self {
        let cubes: Vec<&Count> = counts
            .iter()
            .filter(|(kind, count)| *kind != "weak" && count.ranks >= 8.0)
            .map(|(_, c)| c)
            .collect();
        let mut thickness: Vec<f64> = cubes
            .iter()
            .map(|count| 0.5 * ((count.ghosts + count.leaves).cbrt() - count.leaves.cbrt()))
            .collect();
        thickness.sort_by(f64::total_cmp);
        let rows: Vec<[f64; 2]> = cubes.iter().map(|count| surface_terms(count)).collect();
        let values: Vec<f64> = cubes.iter().map(|count| count.arena_bytes).collect();
        let bytes = fit::positive(&rows, &values);
        let all: Vec<&Count> = counts.iter().map(|(_, count)| count).collect();
        let memory_rows: Vec<[f64; 2]> = all.iter().map(|count| [1.0, count.leaves + count.ghosts]).collect();
        let beside: Vec<f64> = all.iter().map(|count| count.memory - PARTICLE * count.particles).collect();
        let memory = fit::positive(&memory_rows, &beside);
        let weak = |ranks: f64| counts.iter().find(|(kind, count)| *kind == "weak" && count.ranks == ranks);
        let per_rank = match (weak(16.0), weak(64.0)) {
            (Some((_, few)), Some((_, many))) => (many.memory - few.memory) / (many.ranks - few.ranks),
            _ => f64::NAN,
        };
        Self {
            thickness: thickness.get(thickness.len() / 2).copied().unwrap_or(f64::NAN),
            bytes_off: fit::worst(&bytes, &rows, &values),
            bytes,
            memory_off: fit::worst(&memory, &memory_rows, &beside),
            memory,
            per_rank: per_rank.max(0.0),
            neighbours: all.iter().map(|count| count.neighbours).fold(0.0, f64::max),
        }
    }

    fn bytes_at(&self, leaves: f64) -> f64 {
        self.bytes[0] * leaves.powf(2.0 / 3.0) + self.bytes[1] * leaves.cbrt()
    }

    /// A row of the extrapolation: eight particles per cell, every second leaf empty.
    fn row(&self, ranks: f64, particles: f64) -> Vec<String> {
        let leaves = particles / ranks / 512.0 * 2.0;
        let ghosts = layer(leaves, self.thickness);
        let grid = self.memory[0] + self.memory[1] * (leaves + ghosts);
        vec![
            format!("{ranks:.0}"),
            format!("{particles:.0e}"),
            format!("{leaves:.0}"),
            format!("{ghosts:.0}"),
            format!("{:.0}", 2.0 * self.neighbours + ranks.log2().ceil()),
            format!("{:.1}", self.bytes_at(leaves) / 1e6),
            format!("{:.0}", PARTICLE * particles / ranks / 1e6),
            format!("{:.0}", grid / 1e6),
            format!("{:.0}", self.per_rank * ranks / 1e6),
            format!("{:.2}", particles * PARTICLE / 1e12),
        ]
    }
}

fn page_text(page: &Path, counts: &[(&str, Count)]) -> Result<String, Failure> {
    let fits = Fits::of(counts);
    plot(page, counts, &fits)?;
    let table = |kinds: &[&str]| {
        let rows = counts.iter().filter(|(kind, _)| kinds.contains(kind)).map(|(_, count)| count.row());
        markdown(&HEADS, &rows.collect::<Vec<_>>())
    };
    let heads = [
        "ranks",
        "particles",
        "leaves per rank",
        "ghost leaves",
        "messages per step, at most",
        "MB sent per step",
        "particles, MB",
        "grid and program, MB",
        "tables of P ranks, MB",
        "checkpoint, TB",
    ];
    let leaves = 1e6 / 512.0 * 2.0;
    let large = [(64.0, 64e6), (1e3, 1e9), (1e4, 1e10)].map(|(ranks, particles)| fits.row(ranks, particles));
    Ok(format!(
        "# Scaling\n\n\
         Written by `studies/scaling/run counts`: counts, not times. Ranks share the cores of one machine, which changes \
         no count. The job is `studies/scaling/block.toml`, a box full of sand with a floor of cells half as wide, one particle \
         per cell. Bytes are those of one exchange of sums; `bytes / surface` divides them by the bytes of the distinct \
         nodes that cross between each pair of ranks. Measured times are in [performance.md](performance.md).\n\n\
         ## One cube on more and more ranks\n\n\
         4096 leaves and a finer floor; the last two rows have eight times as many leaves.\n\n{}\n\
         ## A box that grows with the ranks\n\n\
         Boxes one root octant high.\n\n{}\n\
         ![Bytes per step](scaling/bytes.svg)\n\n\
         ## Fits\n\n\
         The fits use n own leaves per rank and P ranks, and describe the rank with the most. They are fitted to the cube on 8 ranks and more (memory: to all runs); the greatest relative error is in brackets:\n\n\
         - ghost leaves: a layer of {:.1} leaves around a cube of n, (n^(1/3) + {:.1})^3 - n\n\
         - bytes per step: {:.0} n^(2/3) + {:.0} n^(1/3) ({:.0} %)\n\
         - messages per step: 2 for each neighbour, one with sums and one with particles, and one reduction \
         (log2 P messages); at most {:.0} neighbours occur\n\
         - memory: 272 B per particle + {:.0} MB + {:.1} kB per leaf or ghost leaf ({:.0} %); from 16 to 64 ranks with \
         the same leaves {:.0} kB more for each rank of the job, which includes MPI's shared memory on one machine\n\n\
         ## 10,000 ranks and 10^10 particles\n\n\
         From the fits, with 8 particles per cell and every second leaf empty:\n\n{}\n\
         No message and no table grows with the whole tree. Only 8 bytes per rank and table (the markers of the curve) and the memory of MPI itself per partner grow with P. The limits, in the order in which a larger run reaches them:\n\n\
         1. **The surface of small segments.** With a million particles per rank there are {:.1} ghost leaves for each own one, and a \
         rank beside a change of level sends {:.0} MB per step; 100 such ranks on a node send {:.1} GB per step, which takes longer than \
         a tenth of the step on most networks. Fewer ranks with more threads are the remedy: eight times the leaves per rank \
         have {:.1} ghost leaves for each own one, and the node sends {:.1} GB.\n\
         2. **A checkpoint.** All ranks write their parts of one file; at a parallel file system's 100 GB/s the 2.7 TB of \
         10^10 particles take half a minute, and much longer if stripes and collective buffers are left at their defaults.\n\
         3. **Planning a partition.** Each rank gathers five integers from every rank and reduces two per rank: 400 kB and \
         160 kB at P = 10,000, some milliseconds each, at most once in 20 steps. At P = 10^6 this would have to become a tree.\n\
         4. **Waiting.** With one reduction per step the slowest rank sets the pace. An imbalance of a few per cent, or noise of \
         the operating system, costs more than the reduction itself (14 stages at P = 10,000).\n\
         5. **Exact sums for the history.** A row reduces 15 exact accumulators; with `history.every_steps = 1` this is the \
         largest reduction of a step.\n\
         6. **Numbers.** Keys have 64 bits: at most 64 roots along an axis and level 15. Counters of the nodes of one rank have 32 bits: 6.7e7 blocks. Identifiers of particles have 64 bits.\n\n",
        table(&["strong", "fine"]),
        table(&["weak"]),
        fits.thickness,
        2.0 * fits.thickness,
        fits.bytes[0],
        fits.bytes[1],
        100.0 * fits.bytes_off,
        fits.neighbours,
        fits.memory[0] / 1e6,
        fits.memory[1] / 1e3,
        100.0 * fits.memory_off,
        fits.per_rank / 1e3,
        markdown(&heads, &large),
        layer(leaves, fits.thickness) / leaves,
        fits.bytes_at(leaves) / 1e6,
        100.0 * fits.bytes_at(leaves) / 1e9,
        layer(8.0 * leaves, fits.thickness) / (8.0 * leaves),
        100.0 / 8.0 * fits.bytes_at(8.0 * leaves) / 1e9,
    ))
}

fn plot(page: &Path, counts: &[(&str, Count)], fits: &Fits) -> Result<(), Failure> {
    let counts: Vec<&Count> =
        counts.iter().filter(|(kind, count)| *kind != "weak" && count.ranks >= 8.0).map(|(_, c)| c).collect();
    let measured = |value: fn(&Count) -> f64| counts.iter().map(|c| [c.leaves, value(c) / 1e3]).collect();
    let (low, high) = counts.iter().fold((f64::MAX, 0.0_f64), |(l, h), c| (l.min(c.leaves), h.max(c.leaves)));
    let curve = (0..=40).map(|i| {
        let n = low * (high / low).powf(f64::from(i) / 40.0);
        [n, fits.bytes_at(n) / 1e3]
    });
    let chart = Chart {
        title: "Bytes of sums per rank and step, 8 to 64 ranks",
        labels: ["leaves per rank", "kB"],
        logarithmic: [true, true],
        series: vec![
            Series { name: "greatest of a rank".into(), points: measured(|c| c.arena_bytes), marks: true },
            Series { name: "mean".into(), points: measured(|c| c.mean_arena_bytes), marks: true },
            Series { name: "surface (mean)".into(), points: measured(|c| c.mean_surface_bytes), marks: true },
            Series { name: "fit of the greatest".into(), points: curve.collect(), marks: false },
        ],
    };
    let folder = page.with_extension("");
    std::fs::create_dir_all(&folder)
        .and_then(|()| std::fs::write(folder.join("bytes.svg"), chart.svg()))
        .map_err(|error| format!("{}: {error}", folder.display()))
}

/// Surface of partitions of the tree of a column collapse along both curves.
fn curves() -> Result<String, Failure> {
    let path = Path::new("studies/scaling/static_tree.toml");
    let AnyProblem::Three(problem) = job::load(path).map_err(|error| error.to_string())? else {
        return Err(format!("{} is not in space", path.display()));
    };
    let world = World::init().map_err(|error| error.to_string())?;
    let solver = setup::solver(world.comm(), &problem).map_err(|error| error.to_string())?;
    let particles: Vec<usize> = solver.chunks.iter().map(|chunk| chunk.len()).collect();
    let (leaves, brick) = (solver.forest.leaves(), solver.forest.brick());
    let mut rows = Vec::new();
    let mut ratios = Vec::new();
    for ranks in [4, 8, 16, 32, 64] {
        let both =
            [Curve::Morton, Curve::Hilbert].map(|curve| surface(curve, brick, leaves, &particles, ranks));
        let [morton, hilbert] = both;
        ratios.push(hilbert.ghosts as f64 / morton.ghosts as f64);
        rows.push(vec![
            format!("{ranks}"),
            format!("{} / {}", morton.ghosts, hilbert.ghosts),
            format!("{:.0} / {:.0}", morton.faces, hilbert.faces),
            format!("{:.1} / {:.1}", morton.neighbours, hilbert.neighbours),
            format!("{} / {}", morton.most_neighbours, hilbert.most_neighbours),
        ]);
    }
    let heads =
        ["ranks", "filled ghost leaves", "cell faces between ranks", "neighbours, mean", "neighbours, max"];
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    Ok(format!(
        "## Morton or Hilbert\n\n\
         The tree of `{}` at its start ({} leaves), cut along both curves into segments of equal weight with whole families (Morton / Hilbert). Ranks send arenas for filled ghost leaves:\n\n{}\n\
         Along the Hilbert curve there are {:.0} % {} filled ghost leaves on average over these numbers of ranks.\n",
        path.display(),
        leaves.len(),
        markdown(&heads, &rows),
        100.0 * (mean - 1.0).abs(),
        if mean < 1.0 { "fewer" } else { "more" },
    ))
}
