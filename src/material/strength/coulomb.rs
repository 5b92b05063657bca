//! Return mapping to the Mohr-Coulomb pyramid in principal stresses, with tension cut-off, exact on faces,
//! edges and apex.
//!
//! With `s₁ ≥ s₂ ≥ s₃`, tension positive: `f = (s₁ - s₃) + (s₁ + s₃) sin φ - 2c cos φ ≤ 0`, flow along the
//! same with ψ in place of φ; cut-off `s₁ ≤ T`, flow along the normal. The implicit step is a complementarity
//! problem over the faces that sorted stresses can reach (the one between 1 and 3 and its two neighbours, and
//! three of the cut-off); its solution is found by going from faces to edges to the apex, as in de Souza
//! Neto, Perić and Owen (2008), section 8.2.
use crate::material::parameters::Lame;
use crate::simd::{Vector, VectorMask};

/// A pyramid, for each particle.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Pyramid<V> {
    /// sin φ.
    pub friction: V,
    /// sin ψ.
    pub dilation: V,
    /// `2c cos φ`, Pa.
    pub strength: V,
    /// Greatest principal stress, Pa; infinite without cut-off.
    pub tension: V,
}

/// Returned principal stresses.
#[derive(Clone, Copy)]
pub(in crate::material) struct Returned<V: Vector> {
    /// Greatest first, Pa.
    pub stress: [V; 3],
    /// Where the trial stress lies outside the pyramid.
    pub flows: V::Mask,
    /// Where the material opens: at the apex or the cut-off.
    pub opens: V::Mask,
}

/// Coefficients of the return map, from a pyramid and the elastic constants. Pyramids that do not change have
/// them computed once.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Slopes<V> {
    /// Stress per flow on the face between 1 and 3, along 1, 2 and 3, Pa.
    stress: [V; 3],
    /// Flow per excess of f on this face, 1/Pa.
    face: V,
    /// The same per sum of the excesses of f on this face and the one between 1 and 2, where they share the
    /// flow.
    low_edge: V,
    /// The same with the face between 2 and 3.
    high_edge: V,
    /// Mean stress of the apex, Pa; infinite without friction.
    pub apex: V,
}

impl<V: Copy> Pyramid<V> {
    /// With other numbers.
    #[inline(always)]
    pub(in crate::material) fn map<W>(&self, change: impl Fn(V) -> W) -> Pyramid<W> {
        Pyramid {
            friction: change(self.friction),
            dilation: change(self.dilation),
            strength: change(self.strength),
            tension: change(self.tension),
        }
    }
}

impl<V: Copy> Slopes<V> {
    /// With other numbers.
    #[inline(always)]
    pub(in crate::material) fn map<W>(&self, change: impl Fn(V) -> W) -> Slopes<W> {
        let [first, second, third] = self.stress;
        Slopes {
            stress: [change(first), change(second), change(third)],
            face: change(self.face),
            low_edge: change(self.low_edge),
            high_edge: change(self.high_edge),
            apex: change(self.apex),
        }
    }
}

impl<V: Vector> Pyramid<V> {
    /// The coefficients of the return map.
    #[inline(always)]
    pub(in crate::material) fn slopes(&self, elastic: &Lame) -> Slopes<V> {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let (friction, dilation) = (self.friction, self.dilation);
        let (twice_mu, lambda) = (2.0 * elastic.mu, elastic.lambda);
        let bulk = dilation * (2.0 * lambda);
        let first = (one + dilation).mul_add(V::splat(twice_mu), bulk);
        let third = (one - dilation).mul_add(V::splat(-twice_mu), bulk);
        // How much a flow lowers f on its own face and on the two faces beside.
        let product = friction * dilation;
        let common = product * (4.0 * lambda);
        let own = (product + one).mul_add(V::splat(2.0 * twice_mu), common);
        let beside_low = ((one + friction) * (one + dilation)).mul_add(V::splat(twice_mu), common);
        let beside_high = ((one - friction) * (one - dilation)).mul_add(V::splat(twice_mu), common);
        let apex = self.strength * 0.5 / friction;
        Slopes {
            stress: [first, bulk, third],
            face: one / own,
            low_edge: one / (own + beside_low),
            high_edge: one / (own + beside_high),
            apex: zero.lt(friction).select(apex, V::splat(f64::INFINITY)),
        }
    }

    /// Whether a stress with this mean and this norm of the deviator lies inside whatever its Lode angle, or
    /// outside whatever its Lode angle. Where it is neither, [`Pyramid::holds`] decides.
    #[inline(always)]
    pub(in crate::material) fn surely(&self, mean: V, norm: V, slopes: &Slopes<V>) -> [V::Mask; 2] {
        // √(3/2) |dev| <= s₁ - s₃ <= √2 |dev|; no principal stress is further from the mean than √(2/3)
        // |dev|, and the sum of the greatest and the least from twice the mean by √(1/6) |dev|.
        let far = norm * (2.0_f64 / 3.0).sqrt();
        let beside = norm * (1.0_f64 / 6.0).sqrt();
        let twice = mean + mean;
        let most = norm.mul_add(V::splat(2.0_f64.sqrt()), (twice + far) * self.friction);
        let least = norm.mul_add(V::splat(1.5_f64.sqrt()), (twice - beside) * self.friction);
        let holds = most.le(self.strength) & (mean + far).le(self.tension.min(slopes.apex));
        [holds, self.strength.lt(least)]
    }

    /// Whether a stress, greatest first, lies inside although each value may be wrong by `slack`.
    #[inline(always)]
    pub(in crate::material) fn holds(&self, stress: &[V; 3], slack: V) -> V::Mask {
        let [high, _, low] = *stress;
        let (high, low) = (high + slack, low - slack);
        let face = (high - low) + (high + low + slack + slack).mul_add(self.friction, -self.strength);
        face.le(V::splat(0.0)) & high.le(self.tension)
    }

    /// Value of f, Pa, where the pyramid is that between two stresses.
    #[inline(always)]
    fn face(&self, high: V, low: V) -> V {
        (high - low) + (high + low).mul_add(self.friction, -self.strength)
    }

    /// The returned stress of a trial stress, greatest first.
    #[inline(always)]
    pub(in crate::material) fn returned(
        &self,
        trial: &[V; 3],
        slopes: &Slopes<V>,
        elastic: &Lame,
    ) -> Returned<V> {
        let [s1, s2, s3] = *trial;
        let [d1, bulk, d3] = slopes.stress;
        let excess = self.face(s1, s3);
        let flow = excess * slopes.face;
        let face = [flow.neg_mul_add(d1, s1), flow.neg_mul_add(bulk, s2), flow.neg_mul_add(d3, s3)];
        // Two equal stresses after the return share the flow of their faces.
        let low = (excess + self.face(s1, s2)) * slopes.low_edge;
        let pair = low.neg_mul_add(bulk + d3, s2 + s3) * 0.5;
        let low_edge = [low.neg_mul_add(d1, s1), pair, pair];
        let high = (excess + self.face(s2, s3)) * slopes.high_edge;
        let pair = high.neg_mul_add(bulk + d1, s1 + s2) * 0.5;
        let high_edge = [pair, pair, high.neg_mul_add(d3, s3)];

        let (is_low, is_high) = (face[1].lt(face[2]), face[0].lt(face[1]));
        let at_apex = (is_low & low_edge[0].lt(low_edge[1])) | (is_high & high_edge[1].lt(high_edge[2]));
        let mut flows = V::splat(0.0).lt(excess);
        let mut opens = flows & at_apex;
        let mut stress = *trial;
        for k in 0..3 {
            let edge = is_high.select(high_edge[k], is_low.select(low_edge[k], face[k]));
            stress[k] = flows.select(at_apex.select(slopes.apex, edge), trial[k]);
        }
        let torn = self.tension.lt(stress[0]);
        if torn.any() {
            let cut = self.cut_off(trial, slopes.stress, elastic);
            for k in 0..3 {
                stress[k] = torn.select(cut[k], stress[k]);
            }
            flows = flows | torn;
            opens = opens | torn;
        }
        Returned { stress, flows, opens }
    }

    /// Return where the cut-off is active; `flow` is the stress per flow on the face between 1 and 3.
    #[inline(always)]
    fn cut_off(&self, trial: &[V; 3], flow: [V; 3], elastic: &Lame) -> [V; 3] {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let [s1, s2, s3] = *trial;
        let tension = self.tension;
        let (lambda, wave) = (elastic.lambda, elastic.pressure_wave());
        // The cut-off alone, for one, two or three stresses.
        let share = (s1 - tension) * (lambda / wave);
        let single = [tension, s2 - share, s3 - share];
        let share = (s1 + s2 - tension - tension) * (lambda / (wave + lambda));
        let double = [tension, tension, s3 - share];
        let triple = [tension; 3];
        let (is_double, is_triple) = (tension.lt(single[1]), tension.lt(double[2]));
        let mut stress = single;
        for k in 0..3 {
            stress[k] = is_double.select(is_triple.select(triple[k], double[k]), single[k]);
        }
        // The pyramid with it: the least stress follows from the greatest.
        let both = zero.lt(self.face(stress[0], stress[2]));
        if both.any() {
            let least = ((one + self.friction) * tension - self.strength) / (one - self.friction);
            // Two equations for the flow on the face and that on the cut-off.
            let [d1, d2, d3] = flow;
            let (first, third) = (s1 - tension, s3 - least);
            let determinant = d1 * lambda - d3 * wave;
            let shear = (first * lambda - third * wave) / determinant;
            let open = (d1 * third - d3 * first) / determinant;
            let middle = s2 - shear * d2 - open * lambda;
            let corner = [tension, middle.min(tension).max(least), least];
            for k in 0..3 {
                stress[k] = both.select(corner[k], stress[k]);
            }
        }
        stress
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::simd::{LANES, Lanes};

    /// Solves the complementarity problem over the nine faces by trying all sets of up to three of them.
    fn by_all_sets(trial: [f64; 3], p: [f64; 4], elastic: &Lame) -> Option<[f64; 3]> {
        let [friction, dilation, strength, tension] = p;
        let mut faces: Vec<([f64; 3], [f64; 3], f64)> = Vec::new();
        for (i, j) in [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)] {
            let direction = |sine: f64| {
                std::array::from_fn(|k| {
                    if k == i {
                        1.0 + sine
                    } else if k == j {
                        sine - 1.0
                    } else {
                        0.0
                    }
                })
            };
            faces.push((direction(friction), direction(dilation), strength));
        }
        if tension.is_finite() {
            for i in 0..3 {
                let unit = std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 });
                faces.push((unit, unit, tension));
            }
        }
        let stress_of = |m: &[f64; 3]| -> [f64; 3] {
            std::array::from_fn(|k| 2.0 * elastic.mu * m[k] + elastic.lambda * (m[0] + m[1] + m[2]))
        };
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let n = faces.len();
        let size = trial.iter().fold(1.0_f64, |size, s| size.max(s.abs()));
        let mut best: Option<(f64, [f64; 3])> = None;
        for set in 0..1_u32 << n {
            if set.count_ones() > 3 {
                continue;
            }
            let active: Vec<usize> = (0..n).filter(|i| set >> i & 1 == 1).collect();
            let m = active.len();
            let right = DVector::from_fn(m, |r, _| dot(&faces[active[r]].0, &trial) - faces[active[r]].2);
            let a = DMatrix::from_fn(m, m, |r, c| dot(&faces[active[r]].0, &stress_of(&faces[active[c]].1)));
            let largest = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let factors = a.full_piv_lu();
            if factors.u().diagonal().iter().any(|pivot| pivot.abs() <= 1e-6 * largest) {
                continue;
            }
            let flow = match m {
                0 => right,
                _ => match factors.solve(&right) {
                    Some(flow) => flow,
                    None => continue,
                },
            };
            let mut stress = trial;
            for (&i, flow) in active.iter().zip(flow.iter()) {
                let d = stress_of(&faces[i].1);
                (0..3).for_each(|k| stress[k] -= flow * d[k]);
            }
            let worst = faces.iter().map(|face| (dot(&face.0, &stress) - face.2) / size);
            let worst = worst.chain(flow.iter().map(|flow| -flow * elastic.mu / size));
            let worst = worst.fold(0.0, f64::max);
            if best.is_none_or(|(least, _)| worst < least) {
                best = Some((worst, stress));
            }
        }
        best.filter(|(worst, _)| *worst < 1e-12).map(|(_, stress)| stress)
    }

    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    #[test]
    fn agrees_with_the_solution_over_all_sets_of_faces() {
        let mut seed = 5;
        let mut regions = [0; 3];
        for round in 0..1500 {
            let elastic = Lame::new(1.0, 0.45 * random(&mut seed).abs());
            let friction = (0.1 + 0.7 * random(&mut seed).abs()).sin();
            // Without dilation a stress beyond the apex returns in the limit only.
            let dilation = friction * (0.05 + 0.95 * random(&mut seed).abs());
            let strength = if round % 4 == 0 { 0.0 } else { random(&mut seed).abs() };
            let apex = 0.5 * strength / friction;
            let tension = if round % 2 == 0 { f64::INFINITY } else { apex * random(&mut seed).abs() };
            let scale = 1.0 + strength;
            let mut trials = [[0.0; 3]; LANES];
            for trial in &mut trials {
                *trial = [0; 3].map(|_| 2.0 * scale * random(&mut seed) - 0.5 * scale);
                if round % 3 == 0 {
                    trial[1] = trial[round / 3 % 2 * 2];
                }
                trial.sort_by(|a, b| b.total_cmp(a));
            }
            let pyramid = Pyramid {
                friction: Lanes::splat(friction),
                dilation: Lanes::splat(dilation),
                strength: Lanes::splat(strength),
                tension: Lanes::splat(tension),
            };
            let lanes = [0, 1, 2].map(|k| Lanes::new(trials.map(|trial| trial[k])));
            let returned = pyramid.returned(&lanes, &pyramid.slopes(&elastic), &elastic);
            let stress = returned.stress.map(Lanes::to_array);
            for (lane, trial) in trials.into_iter().enumerate() {
                let expected = by_all_sets(trial, [friction, dilation, strength, tension], &elastic);
                let expected = expected.unwrap_or_else(|| panic!("no solution for {trial:?}"));
                for k in 0..3 {
                    let error = (stress[k][lane] - expected[k]).abs();
                    assert!(error <= 1e-12 * scale, "{trial:?}: {} {expected:?}", stress[k][lane]);
                }
                let opens = returned.opens.bits() >> lane & 1 == 1;
                regions[usize::from(expected != trial) + usize::from(opens)] += 1;
            }
        }
        assert!(regions.iter().all(|&count| count > 300), "{regions:?}");
    }
}
