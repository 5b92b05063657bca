//! Building the grid plan of one rank: `cargo bench --bench grid_plan`. It is made anew whenever tree or
//! partition change.
use std::cell::OnceCell;

use agimp::grid::GridPlan;
use agimp::grid::plan::ghost_layer::Allowance;
use divan::Bencher;
use partition::comm::World;
use partition::{Brick, Forest};

fn main() {
    divan::main();
}

thread_local! {
    static WORLD: OnceCell<World> = const { OnceCell::new() };
}

/// A column of fine leaves in coarser ones: about 4,000 leaves on three levels.
#[divan::bench(args = [0, 1, 2], sample_count = 5, threads = false)]
fn column_3d(bencher: Bencher, reach: u32) {
    WORLD.with(|cell| {
        let world = cell.get_or_init(|| World::init().expect("MPI starts"));
        let mut forest = Forest::<3>::uniform(world.comm(), Brick { roots: [2, 2, 1] }, 3);
        for level in 3..5 {
            forest.refine_where(world.comm(), |leaf| {
                let middle =
                    |axis: usize| f64::from(leaf.coord[axis] * 2 + 1) / f64::from(2u32 << leaf.level);
                let from_axis = (middle(0) - 1.0).hypot(middle(1) - 1.0);
                leaf.level == level && from_axis < 0.45 && middle(2) < 0.4
            });
        }
        forest.balance(world.comm());
        let allowance = Allowance { reach, graded: true, halo: 0 };
        bencher
            .counter(divan::counter::ItemsCount::new(forest.leaves().len()))
            .bench_local(|| GridPlan::build(world.comm(), &forest, 1.0, allowance));
    });
}
