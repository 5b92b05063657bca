//! Newton's method with tangents on a point under prescribed stresses.
use super::Prescribed::{Strain, Stress};
use super::*;
use crate::material::Parameters;

/// Change of the Cauchy stress, Pa, per change of each component of E.
fn slopes(at: &Controlled) -> [[f64; 6]; 6] {
    let strain = full(&at.strain).symmetric_eigen();
    let axes = strain.eigenvectors;
    let shear = |gamma: f64| Matrix3::new(1.0, gamma, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let (tangent, volume) = (at.point.tangent(), determinant(&at.gradient()));
    let tau = full(&at.point.stress);
    std::array::from_fn(|c| {
        let unit: [f64; 6] = std::array::from_fn(|k| if k == c { 1.0 } else { 0.0 });
        // The derivative of exp(E), times exp(-E), in principal axes (Daleckii and Krein 1965).
        let mut change = axes.transpose() * full(&unit) * axes;
        for i in 0..3 {
            for j in 0..3 {
                let difference = strain.eigenvalues[i] - strain.eigenvalues[j];
                change[(i, j)] *= if difference == 0.0 { 1.0 } else { libm::expm1(difference) / difference };
            }
        }
        let gradient = shear(at.shear) * axes * change * axes.transpose() * shear(-at.shear);
        let d = (gradient + gradient.transpose()) * 0.5;
        let w = (gradient - gradient.transpose()) * 0.5;
        let d = [d.m11, d.m22, d.m33, 2.0 * d.m12, 2.0 * d.m13, 2.0 * d.m23];
        let turned = w * tau - tau * w - tau * gradient.trace();
        let turned = [turned.m11, turned.m22, turned.m33, turned.m12, turned.m13, turned.m23];
        std::array::from_fn(|k| ((0..6).map(|m| tangent[k][m] * d[m]).sum::<f64>() + turned[k]) / volume)
    })
}

/// From one state of a compressed material to another far away, with shear and a prescribed stress across.
/// Near the end the errors of the stress, as a share of Young's modulus, square until rounding ends them.
#[test]
fn newton_with_tangents_converges_quadratically() {
    for model in [
        "model = 'neo_hookean', young = 1e6, poisson = 0.3",
        "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 2e3, \
         hardening = {kind = 'voce', saturation = 5e3, rate = 10.0, modulus = 1e4}",
        "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30, cohesion = 1e3, \
         dilation_angle = 10",
        "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 30, cohesion = 1e3, \
         dilation_angle = 10",
    ] {
        let material = model.parse::<Parameters>().unwrap().build(1000.0);
        let mut start = Controlled::new(material.as_ref());
        let target = |shear: f64, along: f64| {
            let none = Stress(0.0);
            let components = [Stress(-1e4), Stress(-1.2e4), Strain(along), none, none, none];
            Target { shear, components }
        };
        start.go(&target(0.0, -0.03), 30, 0.0).unwrap();
        let end = target(0.01, -0.05);
        let free = [0, 1, 3, 4, 5].into_iter().zip([-1e4, -1.2e4, 0.0, 0.0, 0.0]).collect();
        let search = Search { start: &start, target: &end, dt: 0.0, free };
        let mut strain = start.strain;
        strain[2] = -0.05;
        let mut now = search.moved(strain).unwrap();
        let mut all = Vec::new();
        loop {
            let errors = search.residual(&now);
            all.push(greatest(&errors) / 1e6);
            let slopes = slopes(&now);
            let column = |&(k, _): &(usize, f64)| search.free.iter().map(|&(c, _)| slopes[k][c]).collect();
            let columns: Vec<Vec<f64>> = search.free.iter().map(column).collect();
            let change = solution(&columns, &errors);
            match change.and_then(|change| search.descend(&strain, &errors, change)) {
                Some(next) => (strain, now) = next,
                None => break,
            }
        }
        assert!(all.len() <= 15 && *all.last().unwrap() < 1e-14, "{all:?} {model}");
        let near: Vec<_> = all.windows(2).filter(|pair| pair[0] < 1e-5 && pair[0] > 1e-14).collect();
        assert!(!near.is_empty(), "{all:?} {model}");
        for pair in near {
            // The curvature of the stress over the modulus is about one over the strain at yield.
            assert!(pair[1] < 1e3 * pair[0] * pair[0] + 1e-14, "{all:?} {model}");
        }
    }
}
