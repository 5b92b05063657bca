//! Rows of `history.csv`.
use crate::io::history::Column;
use crate::solver::totals::{GridTotals, ParticleTotals};

const fn column(name: &'static str, unit: &'static str) -> Column {
    Column { name, unit }
}

/// Columns after the step.
pub const COLUMNS: [Column; 15] = [
    column("time", "s"),
    column("dt", "s"),
    column("kinetic_energy", "J"),
    column("elastic_energy", "J"),
    column("gravitational_energy", "J"),
    column("plastic_work", "J"),
    column("momentum_x", "kg m/s"),
    column("momentum_y", "kg m/s"),
    column("momentum_z", "kg m/s"),
    column("angular_momentum_x", "kg m^2/s"),
    column("angular_momentum_y", "kg m^2/s"),
    column("angular_momentum_z", "kg m^2/s"),
    column("mass", "kg"),
    column("grid_mass", "kg"),
    column("particles", ""),
];

/// The values of one row.
pub fn row(time: f64, dt: f64, particles: &ParticleTotals, grid: &GridTotals) -> [f64; COLUMNS.len()] {
    let [px, py, pz] = particles.momentum;
    let [lx, ly, lz] = grid.angular_momentum;
    [
        time,
        dt,
        particles.kinetic,
        particles.elastic,
        particles.gravitational,
        particles.plastic_work,
        px,
        py,
        pz,
        lx,
        ly,
        lz,
        particles.mass,
        grid.mass,
        particles.count as f64,
    ]
}
