//! Problem 3: a column under its own weight, sudden and at rest.
use super::order;
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::{Runs, between};

const HEIGHT: f64 = 50.0;

/// Settings for a number of cells over the height.
fn cells(count: f64) -> Vec<String> {
    let root = 4.0 * HEIGHT / count;
    let high = root * (HEIGHT / root + 1e-9).ceil();
    vec![
        format!("domain.root_edge={root}"),
        format!("domain.size=[{root}, {high}]"),
        format!("bodies[0].shape.max=[{root}, {HEIGHT}]"),
    ]
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 3 Column under its own weight\n\n\
         A column of 50 m (80 kg/m3, E = 1 MPa, nu = 0, g = 10 m/s2) between rollers; *soft* has E = 10 kPa and is compressed to 24 m. *Sudden* ([job](../jobs/verification/column_sudden.toml)): fixed \
         corotated, so that the waves are linear whatever their height, FLIP; exact is d'Alembert's solution, the top moves between 0 and -2 m \
         with the period 1.789 s. *At rest* ([job](../jobs/verification/column_at_rest.toml)): Hencky, kinetic damping; exact for any law is the stress \
         -rho g (H - Y) at what was at the height Y, and e is the mean of its error over rho g H (Charlton, Coombs and Augarde 2017). Exercises stress \
         update, weights under large compression, and equilibrium. It is limited by the free surface, which cuts cells.\n",
    );
    let exact = runs.reference("column_dynamic_fcr.csv", ["t", "u_top"]);
    let mut series = vec![Series {
        name: "exact".into(),
        points: exact.iter().filter(|row| row[0] < 3.6).copied().collect(),
        marks: false,
    }];
    let mut rows = Vec::new();
    for &count in if runs.is_full() { &[16.0, 32.0, 64.0][..] } else { &[16.0, 32.0][..] } {
        let mut settings = cells(count);
        settings.push(format!("tracks[0].point=[{}, {HEIGHT}]", 0.1 * HEIGHT / count));
        let results = runs.run("verification/column_sudden", &format!("column_{count}"), &settings);
        let track = results.history(["time", "centre_top_y"]);
        let start = track[0][1];
        let curve: Vec<[f64; 2]> = track.iter().map(|[t, y]| [*t, y - start]).collect();
        let worst = curve.iter().map(|[t, u]| (u - between(&exact, *t)).abs()).fold(0.0, f64::max) / 2.0;
        page.line(&format!("column.sudden.{count}"), worst);
        rows.push(vec![format!("{count}"), format!("{worst:.2e}")]);
        let step = (curve.len() / 600).max(1);
        series.push(Series {
            name: format!("{count} cells"),
            points: curve.into_iter().step_by(step).collect(),
            marks: false,
        });
    }
    page.table(&["cells", "greatest error of the top over 2 m, two periods"], &rows);
    page.plot(
        "column_sudden",
        &Chart {
            title: "Displacement of the top",
            labels: ["time, s", "m"],
            logarithmic: [false, false],
            series,
        },
    );
    let mut rows = Vec::new();
    for (name, young, file) in [
        ("stiff", 1e6, "column_static_ample_E1MPa_nu0.csv"),
        ("soft", 1e4, "column_static_charlton_E10kPa_nu0.csv"),
    ] {
        let exact = runs.reference(file, ["Y", "y_HEN"]);
        let mut errors = Vec::new();
        for &count in if runs.is_full() { &[16.0, 32.0, 64.0][..] } else { &[16.0, 32.0][..] } {
            let mut settings = cells(count);
            settings.push(format!("materials[0].young={young}"));
            // Slowly, or the column is crushed to nothing on its way.
            settings.push(format!("gravity=[0, \"-10 * min(t / {}, 1)\"]", 4e4 / f64::sqrt(young * 1e2)));
            settings.push("numerics.box_stretch=[0.1, 2]".into());
            let results =
                runs.run("verification/column_at_rest", &format!("column_{name}_{count}"), &settings);
            let last = results.outputs() - 1;
            let [before, after] = [0, last].map(|number| results.particles(number, "position", 2));
            let stress = results.particles(last, "stress", 4);
            let elastic = results.particles(last, "left_cauchy_green", 4);
            let weight = 80.0 * 10.0 * HEIGHT;
            let (mut sum, mut top) = (0.0, 0.0_f64);
            for p in 0..before.len() {
                let b = &elastic[p];
                let ratio = ((b[0] * b[1] - b[3] * b[3]) * b[2]).sqrt();
                let expected = -80.0 * 10.0 * (HEIGHT - before[p][1]);
                sum += (stress[p][1] / ratio - expected).abs();
                top = top.max((after[p][1] - between(&exact, before[p][1])).abs());
            }
            let error = sum / before.len() as f64 / weight;
            errors.push((count, error));
            println!("{name} {count}: {error:.3e} {top:.3e} at {}", results.time(last));
            if name == "soft" {
                page.line(&format!("column.stress.{count}"), error);
            }
            if count == 64.0 {
                page.line(&format!("column.place.{name}"), top / HEIGHT);
            }
            rows.push(vec![
                name.to_owned(),
                format!("{count}"),
                format!("{error:.2e}"),
                format!("{:.2e}", top / HEIGHT),
            ]);
        }
        // Between the finest two of three.
        if let [_, coarse, fine] = errors[..] {
            page.line(&format!("column.order.{name}"), order(coarse, fine));
        }
    }
    page.table(&["column", "cells", "e", "greatest error of a particle's height over H"], &rows);
    let [near, beside] = kink(runs);
    page.text(&format!(
        "With 32 cells, those below half of the height of half the size, the greatest error of the stress within two coarse cells of the jump is {near:.2e} of that at the foot, and its mean within the four beyond on both sides {beside:.2e}.\n"
    ));
    page.line("column.kink", near / beside);
}

/// Greatest error of the stress within two cells of a level jump at half the height, and its mean in the four beyond, over the stress at the foot;
/// stiff column.
fn kink(runs: &Runs) -> [f64; 2] {
    let (middle, cell) = (0.5 * HEIGHT, HEIGHT / 32.0);
    let mut settings = cells(32.0);
    settings.extend(
        ["materials[0].young=1e6", "gravity=[0, \"-10 * min(t / 4, 1)\"]", "numerics.box_stretch=[0.1, 2]"]
            .map(str::to_owned),
    );
    settings.push(format!(
        "tree.regions=[{{ level = 1, shape = {{ kind = \"box\", min = [0, 0], max = [{}, {}] }} }}]",
        4.0 * cell,
        middle - 0.01 * cell
    ));
    let results = runs.run("verification/column_at_rest", "column_kink", &settings);
    let last = results.outputs() - 1;
    // Particles that come into finer cells split, so they carry where they come from.
    let [after, moved] = ["position", "carried"].map(|field| results.particles(last, field, 2));
    let stress = results.particles(last, "stress", 4);
    let elastic = results.particles(last, "left_cauchy_green", 4);
    let (mut worst, mut sum, mut number) = (0.0_f64, 0.0, 0.0);
    for p in 0..after.len() {
        let b = &elastic[p];
        let ratio = ((b[0] * b[1] - b[3] * b[3]) * b[2]).sqrt();
        let height = after[p][1] - moved[p][1];
        let error = (stress[p][1] / ratio + 800.0 * (HEIGHT - height)).abs() / (800.0 * HEIGHT);
        let away = (after[p][1] - middle).abs() / cell;
        if away < 2.0 {
            worst = worst.max(error);
        } else if away < 6.0 {
            sum += error;
            number += 1.0;
        }
    }
    [worst, sum / number]
}
