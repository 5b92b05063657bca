//! Damage of brittle and ductile materials (`damage_point_given.csv`, `damage_bar_given.csv`).
use std::collections::HashMap;

use agimp::material::driver::control::Prescribed::{Strain, Stress};
use agimp::material::driver::control::{Controlled, Target};

use super::*;

/// A row of a table: names, and numbers by the name of their column.
struct Row {
    path: String,
    law: String,
    numbers: HashMap<String, f64>,
}

impl Row {
    fn at(&self, name: &str) -> f64 {
        self.numbers[name]
    }

    fn three(&self, stem: &str) -> [f64; 3] {
        std::array::from_fn(|k| self.at(&format!("{stem}{}", k + 1)))
    }
}

fn table(name: &str) -> Vec<Row> {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let word = |name: &str| {
            names.iter().position(|n| *n == name).map_or(String::new(), |at| fields[at].to_owned())
        };
        let numbers = names.iter().zip(&fields).filter_map(|(n, f)| Some(((*n).to_owned(), f.parse().ok()?)));
        Row { path: word("path"), law: word("law"), numbers: numbers.collect() }
    };
    lines.map(row).collect()
}

const YOUNG: f64 = 3e10;
const STRENGTH: f64 = 3e6;

fn concrete(law: &str, tension_only: bool) -> Box<dyn Material> {
    let text = format!(
        "model = 'hencky', young = {YOUNG}, poisson = 0.2, damage = {{kind = 'rankine', \
         strength = {STRENGTH}, fracture_energy = 100.0, softening = '{law}', tension_only = {tension_only}}}"
    );
    text.parse::<Parameters>().unwrap_or_else(|error| panic!("{text}: {error}")).build(2400.0)
}

fn damage_of(material: &dyn Material, point: &Point) -> f64 {
    point.history[material.history_names().iter().position(|name| *name == "damage").unwrap()]
}

/// Stress and damage along nine paths with unloading, reversal and more than one axis, for three laws of
/// softening, with damage of all stress and in tension only.
#[test]
fn cracks_open_along_paths() {
    let rows = table("damage_point_given.csv");
    assert_eq!(rows.len(), 159);
    for tension_only in [false, true] {
        let stem = if tension_only { "tension_only_s" } else { "s" };
        for steps in [1, 7] {
            let mut last: Option<(&str, &str)> = None;
            let (mut material, mut strain) = (concrete("linear", tension_only), [0.0; 3]);
            let mut history = material.initial_history();
            let mut elastic = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
            for row in &rows {
                if last != Some((row.path.as_str(), row.law.as_str())) {
                    material = concrete(&row.law, tension_only);
                    (strain, history) = ([0.0; 3], material.initial_history());
                    elastic = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
                    last = Some((row.path.as_str(), row.law.as_str()));
                }
                let mut point = Point::new(material.as_ref());
                (point.history, point.elastic, point.size) = (history, elastic, 0.05);
                let end = row.three("eps");
                stretch_to(&mut point, strain, end, steps);
                (strain, history, elastic) = (end, point.history, point.elastic);
                let place = format!("{} {} {:?}", row.path, row.law, row.at("step"));
                let (found, expected) = (damage_of(material.as_ref(), &point), row.at("damage"));
                assert!((found - expected).abs() <= 1e-10, "{place}: damage {found} for {expected}");
                let scale = row.three("eff").into_iter().fold(STRENGTH, |most, s| most.max(s.abs()));
                for (k, expected) in row.three(stem).into_iter().enumerate() {
                    let found = point.stress[k];
                    assert!((found - expected).abs() <= 1e-10 * scale, "{place}: {found} for {expected}");
                }
            }
        }
    }
}

/// A band of any width takes the energy of fracture: stress, damage, and work less what can be had back.
#[test]
fn a_band_takes_the_energy_of_fracture_whatever_its_width() {
    let rows = table("damage_bar_given.csv");
    assert_eq!(rows.len(), 204);
    let length = 0.2;
    for tension_only in [false, true] {
        let mut last: Option<(&str, f64)> = None;
        let mut material = concrete("linear", tension_only);
        let (mut strain, mut history, mut taken) = (0.0, material.initial_history(), 0.0);
        let mut elastic = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        for row in &rows {
            let width = row.at("h");
            if last != Some((row.law.as_str(), width)) {
                material = concrete(&row.law, tension_only);
                (strain, history, taken) = (0.0, material.initial_history(), 0.0);
                elastic = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
                last = Some((row.law.as_str(), width));
            }
            let mut point = Point::new(material.as_ref());
            (point.history, point.elastic, point.size) = (history, elastic, width);
            let by = row.at("band_strain") - strain;
            point.stretch([by, -0.2 * by, -0.2 * by]);
            (strain, history, elastic) = (row.at("band_strain"), point.history, point.elastic);
            taken += point.work * width;
            let place = format!("{} {width} {strain}", row.law);
            let found = damage_of(material.as_ref(), &point);
            assert!((found - row.at("damage")).abs() <= 1e-10, "{place}: {found}");
            let stress = point.stress[0];
            // The stress of almost broken material is a small part of that of the whole.
            let scale = STRENGTH.max(YOUNG * strain * 1e-2);
            assert!((stress - row.at("stress")).abs() <= 1e-10 * scale, "{place}: {stress}");
            let end = strain * width + (length - width) * stress / YOUNG;
            assert!((end - row.at("u_end")).abs() <= 1e-10 * row.at("u_end").max(1e-5), "{place}: {end}");
            let back = width * point.energy() + (length - width) * stress * stress / (2.0 * YOUNG);
            let expected = row.at("recoverable_energy_per_area");
            assert!((back - expected).abs() <= 1e-10 * 100.0, "{place}: {back} for {expected}");
            let expected = row.at("work_per_area");
            assert!((taken + back - expected).abs() <= 1e-10 * 100.0, "{place}: {taken} {back} {expected}");
        }
    }
}

/// The width of a band is that of the cells at the onset, whatever cells come later.
#[test]
fn the_band_keeps_its_width() {
    let material = concrete("linear", true);
    let stretch = |point: &mut Point, by: f64| point.stretch([by, -0.2 * by, -0.2 * by]);
    let pulled = |sizes: [f64; 2]| {
        let mut point = Point::new(material.as_ref());
        point.size = sizes[0];
        stretch(&mut point, 2e-4);
        point.size = sizes[1];
        stretch(&mut point, 2e-4);
        point.stress
    };
    assert_eq!(pulled([0.05, 0.0125]), pulled([0.05, 0.05]));
    assert_ne!(pulled([0.0125, 0.05]), pulled([0.05, 0.05]));
}

/// Unlike damage does not mix: neither cracks of other widths, nor broken with whole material.
#[test]
fn unlike_damage_does_not_merge() {
    let brittle = concrete("linear", true);
    let alike = |a: [f64; 3], b: [f64; 3]| brittle.alike(&a, &b);
    assert!(alike([0.5, 0.0, 0.1], [0.505, 0.0, 0.1]) && alike([0.0; 3], [0.0; 3]));
    assert!(!alike([0.5, 0.0, 0.1], [0.52, 0.0, 0.1]));
    assert!(!alike([0.001, 0.0, 0.1], [0.0, 0.0, 0.0]) && !alike([0.5, 0.0, 0.1], [0.5, 0.0, 0.05]));
    let metal = steel(", damage = {kind = 'johnson_cook', d1 = 0.5}");
    assert!(metal.alike(&[0.1, 0.0, 0.2], &[0.3, 0.0, 0.205]));
    assert!(!metal.alike(&[0.1, 0.0, 0.2], &[0.1, 0.0, 0.25]));
    assert!(!metal.alike(&[0.5, 0.0, 1.0], &[0.5, 0.0, 1.008]), "strength differs by 8 %");
}

/// A crack that opens between solids that stay takes the energy of fracture with `energy`, and the share of it
/// that follows from Poisson's ratio with the others; under uniaxial stress all take it.
#[test]
fn cracks_between_solids_take_their_energy_of_fracture() {
    for poisson in [0.0, 0.2, 0.4] {
        let share = (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson);
        let kinds = [
            ("kind = 'energy', strength = 3e6", 1.0),
            ("kind = 'rankine', strength = 3e6", share),
            ("kind = 'strain', onset = 1e-4", 1.0 / share),
        ];
        for (kind, share) in kinds {
            for law in ["linear", "exponential_total_strain", "exponential_crack_opening"] {
                for (lateral, expected) in [(0.0, 100.0 * share), (-poisson, 100.0)] {
                    let text = format!(
                        "model = 'hencky', young = {YOUNG}, poisson = {poisson}, damage = {{{kind}, \
                         fracture_energy = 100.0, softening = '{law}'}}"
                    );
                    let material = text.parse::<Parameters>().unwrap().build(2400.0);
                    let mut point = Point::new(material.as_ref());
                    point.size = 0.05;
                    // To 600 times the strain of the onset: next to nothing is left of the exponential laws.
                    for _ in 0..200 {
                        point.stretch([3e-4, lateral * 3e-4, lateral * 3e-4]);
                    }
                    let taken = point.work * point.size;
                    let place = format!("{kind} {law} {poisson} {lateral}");
                    assert!((taken / expected - 1.0).abs() < 1e-6, "{place}: {taken} for {expected}");
                }
            }
        }
    }
}

/// In multiaxial strain with damage of all stress, the work of the stress is what is stored and what is taken.
#[test]
fn work_is_stored_or_taken() {
    let kinds = [
        "kind = 'rankine', strength = 3e6",
        "kind = 'strain', onset = 1e-4",
        "kind = 'energy', strength = 3e6",
    ];
    for kind in kinds {
        for law in ["linear", "exponential_total_strain", "exponential_crack_opening"] {
            let text = format!(
                "model = 'hencky', young = {YOUNG}, poisson = 0.2, damage = {{{kind}, \
                 fracture_energy = 100.0, softening = '{law}', tension_only = false}}"
            );
            let material = text.parse::<Parameters>().unwrap().build(2400.0);
            let mut point = Point::new(material.as_ref());
            point.size = 0.05;
            let mut work = 0.0;
            let steps = 4000;
            let (mut worst, mut greatest) = (0.0_f64, 0.0_f64);
            for step in 0..steps {
                // Forth, back, and forth again along other ratios.
                let turn = f64::from(step) / f64::from(steps);
                let by = 3e-7 * (6.0 * turn).cos();
                let strain = [by, 0.4 * by, -0.3 * by * turn];
                let before = point.stress;
                point.stretch(strain);
                work += (0..3).map(|k| 0.5 * (before[k] + point.stress[k]) * strain[k]).sum::<f64>();
                worst = worst.max((work - point.energy() - point.work).abs());
                greatest = greatest.max(work);
            }
            assert!(damage_of(material.as_ref(), &point) > 0.3);
            assert!(worst < 2e-3 * greatest, "{kind} {law}: {worst} of {greatest}");
        }
    }
}

fn steel(keys: &str) -> Box<dyn Material> {
    let text = format!(
        "model = 'von_mises', young = 211e9, poisson = 0.33, yield_stress = 499e6, \
         hardening = {{kind = 'ludwik', modulus = 382e6, exponent = 0.458}}{keys}"
    );
    text.parse::<Parameters>().unwrap_or_else(|error| panic!("{text}: {error}")).build(7750.0)
}

/// A bar in uniaxial tension: σ* = 1/3, so it fails at a plastic strain of `d1 + d2 exp(d3/3)`, up to there as
/// without damage, and has no strength left after a tenth more.
#[test]
fn metal_fails_at_its_failure_strain() {
    let damage = ", damage = {kind = 'johnson_cook', d1 = 0.636, d2 = 1.936, d3 = -2.969}";
    let limit = 0.636 + 1.936 * (-2.969_f64 / 3.0).exp();
    let (failing, whole) = (steel(damage), steel(""));
    let target = |strain: f64| Target {
        shear: 0.0,
        components: [Strain(strain), Stress(0.0), Stress(0.0), Strain(0.0), Strain(0.0), Strain(0.0)],
    };
    let (mut bar, mut reference) = (Controlled::new(failing.as_ref()), Controlled::new(whole.as_ref()));
    let mut failed = None;
    for step in 1..=800 {
        let strain = 0.002 * f64::from(step);
        // Beyond failure no stress is left to prescribe.
        let is_held = bar.go(&target(strain), 1, 0.0).is_ok();
        let plastic = bar.point.history[PLASTIC_STRAIN];
        let index = damage_of(failing.as_ref(), &bar.point);
        if index >= 1.0 || !is_held {
            failed = Some((index, plastic));
            break;
        }
        reference.go(&target(strain), 1, 0.0).unwrap();
        assert!((index - plastic / limit).abs() < 1e-8, "{index} {plastic}");
        assert!((bar.point.stress[0] - reference.point.stress[0]).abs() < 1e-3, "{strain}");
    }
    let (index, plastic) = failed.expect("it fails");
    assert!(index > 0.99 && (plastic / limit - 1.0).abs() < 0.01, "{index} {plastic} {limit}");
}

/// What has failed bears pressure only; the energy that is set free is booked as taken.
#[test]
fn failed_metal_bears_pressure_only() {
    let failing = steel(", damage = {kind = 'johnson_cook', d1 = 0.05}");
    let mut point = Point::new(failing.as_ref());
    let mut work = 0.0;
    let mut go = |point: &mut Point, by: [f64; 3]| {
        let before = point.stress;
        point.stretch(by);
        work += (0..3).map(|k| 0.5 * (before[k] + point.stress[k]) * by[k]).sum::<f64>();
        work
    };
    for _ in 0..4000 {
        go(&mut point, [2e-5, -0.9e-5, -0.9e-5]);
    }
    let work = go(&mut point, [0.0; 3]);
    assert!(damage_of(failing.as_ref(), &point) >= 1.1);
    assert!(point.stress.iter().all(|stress| stress.abs() < 1.0), "{:?}", point.stress);
    let rest = work - point.energy() - point.work;
    assert!(rest.abs() < 2e-3 * work, "{rest} of {work}");
    point.stretch([-0.01; 3]);
    let pressure = point.stress;
    assert!(
        pressure[0] < -1e8 && (pressure[0] - pressure[2]).abs() < 1e-3 * pressure[0].abs(),
        "{pressure:?}"
    );
}

/// The failure strain at other rates and temperatures.
#[test]
fn rate_and_temperature_change_the_failure_strain() {
    let hot = |d: &str, temperature: f64| {
        let text = format!(
            "model = 'von_mises', young = 211e9, poisson = 0.33, yield_stress = 499e6, \
             hardening = {{kind = 'johnson_cook', modulus = 382e6, exponent = 0.458, melting_temperature = 1800.0, \
             reference_temperature = 293.0, temperature = {temperature}, specific_heat = 450.0, heat_fraction = 0.0}}, \
             damage = {{kind = 'johnson_cook', d1 = 0.5, {d}}}"
        );
        text.parse::<Parameters>().unwrap_or_else(|error| panic!("{text}: {error}")).build(7750.0)
    };
    let per_strain = |material: &dyn Material, dt: f64| {
        let mut point = Point::new(material);
        point.dt = dt;
        for _ in 0..20 {
            point.stretch([1e-3, -0.5e-3, -0.5e-3]);
        }
        let before = (point.history[PLASTIC_STRAIN], damage_of(material, &point));
        point.stretch([1e-3, -0.5e-3, -0.5e-3]);
        (point.history[PLASTIC_STRAIN] - before.0) / (damage_of(material, &point) - before.1)
    };
    let (quick, slow) = (hot("d4 = 0.1", 293.0), hot("d4 = 0.1", 293.0));
    let rate = 1e-3 / 1e-6;
    let found = per_strain(quick.as_ref(), 1e-6);
    assert!((found - 0.5 * (1.0 + 0.1 * f64::ln(rate))).abs() < 1e-3, "{found}");
    assert!((per_strain(slow.as_ref(), 1.0) - 0.5).abs() < 1e-9);
    let warm = hot("d5 = 2.0", 793.0);
    let expected = 0.5 * (1.0 + 2.0 * 500.0 / 1507.0);
    let found = per_strain(warm.as_ref(), 1.0);
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}
