//! Problem 16: water at rest after violent motion.
use crate::page::Page;
use crate::runs::Runs;

/// Weight of the water per volume, N/m³.
const WEIGHT: f64 = 9810.0;
/// Exponent of Tait's equation.
const GAMMA: f64 = 7.0;

/// Height of the centre of mass of still water that has this depth undeformed (m), by its bulk modulus (Pa): `p = w (H - Y)` at what was at the height Y,
/// `dy/dY = (1 + γ p/K)^(-1/γ)`.
fn still(depth: f64, modulus: f64) -> f64 {
    let count = 10_000;
    let layer = depth / f64::from(count);
    let (mut height, mut moment) = (0.0, 0.0);
    for i in 0..count {
        let pressure = WEIGHT * (depth - (f64::from(i) + 0.5) * layer);
        let thickness = layer * (1.0 + GAMMA * pressure / modulus).powf(-1.0 / GAMMA);
        moment += (height + 0.5 * thickness) * layer;
        height += thickness;
    }
    moment / depth
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 16 Water at rest after violent motion\n\n\
         A column of water, 0.3 m wide and 0.9 m high, collapses in a tank 1 m wide and sloshes; from 2 s on damping stills it, and at 4 s it is at rest: \
         [in 2D](../jobs/verification/water_at_rest.toml), [in 3D](../jobs/verification/water_at_rest_3d.toml) with 0.15 m of 0.25 m of thickness. *Fill* is the height of the centre of \
         mass over that of still water, compressed by its weight. *Energy* is the greatest rise of kinetic, elastic and gravitational energy above its least value so far, over that of the start. \
         Exercises all that keeps a fluid in its volume, splashes, and the free surface. It is limited by the noise of the pressure.\n",
    );
    let finer = [("2", "tree.base_level=2"), ("3", "tree.base_level=3")];
    let in_space = [("0", "tree.base_level=0"), ("1", "tree.base_level=1")];
    let few = if runs.is_full() { 2 } else { 1 };
    let mut rows = Vec::new();
    let mut one = |job: &str, name: &str, settings: &[&str], [floor, modulus]: [f64; 2]| {
        let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        let results = runs.run(&format!("verification/{job}"), &format!("{job}_{name}"), &settings);
        let names = ["centre_water_y", "kinetic_energy", "elastic_energy", "gravitational_energy", "mass"];
        let history = results.history(names);
        // Particles are whole, so the column is a little wider or higher than the job says.
        let [height, .., mass] = *history.last().expect("rows");
        let fill = height / still(mass / 1000.0 / floor, modulus);
        let (mut rise, mut least): (f64, f64) = (0.0, f64::INFINITY);
        let energies: Vec<f64> =
            history.iter().map(|[_, kinetic, elastic, weight, _]| kinetic + elastic + weight).collect();
        for energy in &energies {
            least = least.min(*energy);
            rise = rise.max(energy - least);
        }
        let rise = rise / energies[0];
        page.line(&format!("water.fill.{job}.{name}"), fill);
        page.line(&format!("water.energy.{job}.{name}"), rise);
        rows.push(vec![job.to_owned(), name.to_owned(), format!("{fill:.3}"), format!("{rise:.1e}")]);
    };
    for (name, setting) in &finer[..few] {
        one("water_at_rest", name, &[*setting], [1.0, 1e5]);
    }
    one("water_at_rest", "stiff", &["materials[0].bulk_modulus=1e6"], [1.0, 1e6]);
    one("water_at_rest", "ppc3", &["bodies[0].particles_per_cell=3"], [1.0, 1e5]);
    one("water_at_rest", "flip", &["numerics.transfer=\"flip\""], [1.0, 1e5]);
    for (name, setting) in &in_space[..few] {
        one("water_at_rest_3d", name, &[*setting], [0.25, 1e5]);
    }
    page.table(&["job", "case", "fill", "rise of the energy"], &rows);
}
