//! Logarithmic strains of elastic tensors, and their inverse: code that all models in Hencky strains share.
//!
//! Elastic strains of metals and soils are small, so most tensors are near a multiple of the unit tensor and
//! need no eigenvectors (`near_unit.rs`). The others are decomposed; the choice for a particle follows from
//! its own state.
use super::eigen::{Eigen, Symmetric, decompose};
use super::near_unit::TraceFree;
use crate::material::State;
use crate::material::solid::Hencky;
use crate::simd::math::{exp, ln};
use crate::simd::{Lanes, Mask, Vector, VectorMask, each};

/// The logarithmic strain `½ ln b` of a trial tensor.
pub(crate) struct Strain<V = Lanes> {
    /// Trace.
    pub trace: V,
    /// Deviator.
    pub deviator: Symmetric<V>,
    /// Norm of the deviator.
    pub norm: V,
    /// Lanes that are not near a multiple of the unit tensor, if there are any.
    far: Option<Far>,
}

/// Lanes that were decomposed. They are rare, and handled by a separate function, which has narrower
/// registers than a kernel may have.
struct Far {
    lanes: Mask,
    eigen: Eigen,
    /// Principal strains less their mean.
    deviator: [Lanes; 3],
}

impl<V: Vector> Strain<V> {
    /// Strain of a tensor.
    #[inline(always)]
    pub(crate) fn of(b: &Symmetric<V>, plane: bool) -> Self {
        if V::DERIVES {
            return Self::in_axes(b);
        }
        let (mean, beside) = TraceFree::beside_unit(b);
        let near = beside.is_small() & V::splat(0.0).lt(mean);
        let (trace, deviator) = beside.ln_of_one_plus();
        let mut trace = ln(mean).mul_add(V::splat(1.5), trace * 0.5);
        let mut deviator = each(deviator, |component| component * 0.5);
        let far = (!near.all()).then(|| Far::of(b, !near, plane, &mut trace, &mut deviator));
        let [xx, yy, zz, xy, xz, yz] = deviator;
        let shear = xy.mul_add(xy, xz.mul_add(xz, yz * yz));
        let norm = xx.mul_add(xx, yy.mul_add(yy, zz.mul_add(zz, shear + shear))).sqrt();
        Self { trace, deviator, norm, far }
    }

    /// Strain of a diagonal tensor.
    fn in_axes(b: &Symmetric<V>) -> Self {
        let zero = V::splat(0.0);
        let [x, y, z] = [b[0], b[1], b[2]].map(|stretch| ln(stretch) * 0.5);
        let trace = x + y + z;
        let [x, y, z] = [x, y, z].map(|strain| strain - trace * (1.0 / 3.0));
        let norm = (x * x + y * y + z * z).sqrt();
        Self { trace, deviator: [x, y, z, zero, zero, zero], norm, far: None }
    }

    /// The elastic tensor with another trace of the strain and `kept` times its deviator, from 0 to 1.
    #[inline(always)]
    fn elastic(&self, trace: V, kept: V, plane: bool) -> Symmetric<V> {
        if V::DERIVES {
            return exp_in_axes(trace, &each(self.deviator, |component| component * kept));
        }
        let twice_kept = kept + kept;
        let volumetric = exp(trace * (2.0 / 3.0));
        let deviatoric = TraceFree::new(each(self.deviator, |component| component * twice_kept)).exp();
        let mut elastic = each(deviatoric, |component| component * volumetric);
        if let Some(far) = &self.far {
            far.replace(&mut elastic, trace, twice_kept, plane);
        }
        elastic
    }

    /// Writes the final state, which has another trace of the strain and `kept` times its deviator where
    /// `changed` and the trial one elsewhere: elastic tensor, stress, wave speed. Lanes in `unstrained` get
    /// exactly the unit tensor, and lanes that have not changed keep the bits of the trial tensor.
    #[inline(always)]
    pub(crate) fn finish(
        &self,
        solid: &Hencky,
        state: &mut State<V>,
        end: [V; 2],
        changed: V::Mask,
        unstrained: V::Mask,
        plane: bool,
    ) {
        let (trace, deviator) = self.rewrite(state, end, changed, unstrained, plane);
        solid.load(state, trace, &deviator);
    }

    /// Writes the elastic tensor of the final state as [`Strain::finish`] does; returns trace and deviator of
    /// its strain.
    #[inline(always)]
    pub(crate) fn rewrite(
        &self,
        state: &mut State<V>,
        [trace, kept]: [V; 2],
        changed: V::Mask,
        unstrained: V::Mask,
        plane: bool,
    ) -> (V, Symmetric<V>) {
        if !changed.any() {
            return (self.trace, self.deviator);
        }
        let elastic = self.elastic(trace, kept, plane);
        let kept = changed.select(kept, V::splat(1.0));
        for c in 0..6 {
            let unit = V::splat(if c < 3 { 1.0 } else { 0.0 });
            let returned = unstrained.select(unit, elastic[c]);
            state.elastic[c] = changed.select(returned, state.elastic[c]);
        }
        let deviator = each(self.deviator, |component| component * kept);
        (changed.select(trace, self.trace), deviator)
    }
}

/// `exp(2 ε)` of a strain with this trace and this deviator.
#[inline(always)]
pub(crate) fn tensor_of<V: Vector>(trace: V, deviator: &Symmetric<V>, plane: bool) -> Symmetric<V> {
    if V::DERIVES {
        return exp_in_axes(trace, deviator);
    }
    let twice = TraceFree::new(each(*deviator, |component| component + component));
    let near = twice.is_small();
    let volumetric = exp(trace * (2.0 / 3.0));
    let mut tensor = each(twice.exp(), |component| component * volumetric);
    if !near.all() {
        let (mut own, trace) = (cast(&tensor), Lanes::new(trace.to_array()));
        far_tensor_of(&mut own, Mask::from_bits((!near).bits()), trace, &cast(deviator), plane);
        tensor = cast(&own);
    }
    tensor
}

/// `exp(2 ε)` of a diagonal strain.
fn exp_in_axes<V: Vector>(trace: V, deviator: &Symmetric<V>) -> Symmetric<V> {
    let mut tensor = *deviator;
    for normal in &mut tensor[..3] {
        *normal = exp((*normal + trace * (1.0 / 3.0)) * 2.0);
    }
    tensor
}

/// Takes these lanes of [`tensor_of`] from eigenvectors.
#[cold]
#[inline(never)]
fn far_tensor_of(tensor: &mut Symmetric, lanes: Mask, trace: Lanes, deviator: &Symmetric, plane: bool) {
    // Rotations require a positive definite matrix; unlike eigenvalues of b, those of a strain are needed to
    // the same absolute accuracy.
    let squares = each(*deviator, |component| component * component);
    let shear = squares[3] + squares[4] + squares[5];
    let shift = (squares[0] + squares[1] + squares[2] + shear + shear).sqrt() * 2.0 + Lanes::splat(1e-9);
    let mut shifted = *deviator;
    for c in 0..3 {
        shifted[c] += shift;
    }
    let eigen = decompose(&shifted, plane);
    let mean = trace * (1.0 / 3.0);
    let value = each(eigen.value, |value| exp((value - shift + mean) * 2.0));
    let own = eigen.compose(&value, plane);
    for c in 0..6 {
        tensor[c] = lanes.select(own[c], tensor[c]);
    }
}

/// Writes the final state of a return that changes principal strains one by one: this trace and this deviator
/// where `changed`, the trial ones elsewhere. Lanes that have not changed keep the bits of the trial tensor.
#[inline(always)]
pub(crate) fn finish<V: Vector>(
    trial: &Strain<V>,
    solid: &Hencky,
    state: &mut State<V>,
    (trace, deviator): (V, &Symmetric<V>),
    changed: V::Mask,
    plane: bool,
) {
    if !changed.any() {
        return solid.load(state, trial.trace, &trial.deviator);
    }
    let elastic = tensor_of(trace, deviator, plane);
    let mut own = trial.deviator;
    for c in 0..6 {
        state.elastic[c] = changed.select(elastic[c], state.elastic[c]);
        own[c] = changed.select(deviator[c], own[c]);
    }
    solid.load(state, changed.select(trace, trial.trace), &own);
}

impl Far {
    /// Decomposes some lanes, and takes trace and deviator of their strains from that.
    #[inline(always)]
    fn of<V: Vector>(
        b: &Symmetric<V>,
        lanes: V::Mask,
        plane: bool,
        trace: &mut V,
        tensor: &mut Symmetric<V>,
    ) -> Self {
        let (mut own_trace, mut own_tensor) = (Lanes::new(trace.to_array()), cast(tensor));
        let lanes = Mask::from_bits(lanes.bits());
        let far = Self::decompose(&cast(b), lanes, plane, &mut own_trace, &mut own_tensor);
        (*trace, *tensor) = (V::new(own_trace.to_array()), cast(&own_tensor));
        far
    }

    #[cold]
    #[inline(never)]
    fn decompose(b: &Symmetric, lanes: Mask, plane: bool, trace: &mut Lanes, tensor: &mut Symmetric) -> Self {
        let eigen = decompose(b, plane);
        let strain = each(eigen.value, |value| ln(value) * 0.5);
        let sum = strain[0] + strain[1] + strain[2];
        let deviator = each(strain, |e| e - sum * (1.0 / 3.0));
        let composed = eigen.compose(&deviator, plane);
        *trace = lanes.select(sum, *trace);
        for c in 0..6 {
            tensor[c] = lanes.select(composed[c], tensor[c]);
        }
        Self { lanes, eigen, deviator }
    }

    /// Takes these lanes of [`Strain::elastic`] from the eigenvectors.
    #[inline(always)]
    fn replace<V: Vector>(&self, elastic: &mut Symmetric<V>, trace: V, twice_kept: V, plane: bool) {
        let mut own = cast(elastic);
        let (trace, twice_kept) = (Lanes::new(trace.to_array()), Lanes::new(twice_kept.to_array()));
        self.compose(&mut own, trace, twice_kept, plane);
        *elastic = cast(&own);
    }

    #[cold]
    #[inline(never)]
    fn compose(&self, elastic: &mut Symmetric, trace: Lanes, twice_kept: Lanes, plane: bool) {
        let twice_mean = trace * (2.0 / 3.0);
        let value = each(self.deviator, |e| exp(e.mul_add(twice_kept, twice_mean)));
        let tensor = self.eigen.compose(&value, plane);
        for c in 0..6 {
            elastic[c] = self.lanes.select(tensor[c], elastic[c]);
        }
    }
}

/// A tensor in other registers.
#[inline(always)]
fn cast<V: Vector, W: Vector>(tensor: &Symmetric<V>) -> Symmetric<W> {
    let mut other = [W::splat(0.0); 6];
    for c in 0..6 {
        other[c] = W::new(tensor[c].to_array());
    }
    other
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::simd::LANES;

    /// Strains of tensors on both sides of the limit of the series, from eigenvalues as well.
    fn agrees_with_eigenvalues(b: &Symmetric, plane: bool, tolerance: f64) -> Result<(), TestCaseError> {
        let strain = Strain::of(b, plane);
        let eigen = decompose(b, plane);
        let principal = each(eigen.value, |value| ln(value) * 0.5);
        let expected = eigen.compose(&principal, plane);
        let back = strain.elastic(strain.trace, Lanes::splat(1.0), plane);
        for lane in 0..LANES {
            let at = |value: Lanes| value.to_array()[lane];
            let mean = at(strain.trace) / 3.0;
            for c in 0..6 {
                let found = at(strain.deviator[c]) + if c < 3 { mean } else { 0.0 };
                let error = (found - at(expected[c])).abs();
                prop_assert!(error <= tolerance, "{c}: {error}");
                let scale = at(b[0]) + at(b[1]) + at(b[2]);
                prop_assert!(
                    (at(back[c]) - at(b[c])).abs() <= 2.0 * tolerance * scale,
                    "{c} on the way back"
                );
            }
            let trace = principal.iter().map(|&e| at(e)).sum::<f64>();
            prop_assert!((at(strain.trace) - trace).abs() <= tolerance);
            prop_assert_eq!(at(strain.trace).to_bits(), at(of_one_lane(b, lane, plane)).to_bits());
        }
        Ok(())
    }

    /// Trace of the strain of one lane alone.
    fn of_one_lane(b: &Symmetric, lane: usize, plane: bool) -> Lanes {
        Strain::of(&each(*b, |component| Lanes::splat(component.to_array()[lane])), plane).trace
    }

    proptest! {
        #[test]
        fn strains_agree_with_eigenvalues(
            normal in prop::array::uniform3(prop::array::uniform8(-1.0_f64..1.0)),
            shear in prop::array::uniform3(prop::array::uniform8(-1.0_f64..1.0)),
            width in prop::sample::select(vec![1e-9, 1e-3, 0.05, 0.1, 0.3]),
            volume in 0.3_f64..3.0,
        ) {
            let normal = normal.map(|x| Lanes::new(x.map(|x| volume * (1.0 + width * x))));
            let [xy, xz, yz] = shear.map(|x| Lanes::new(x.map(|x| volume * width * x)));
            let [xx, yy, zz] = normal;
            agrees_with_eigenvalues(&[xx, yy, zz, xy, xz, yz], false, 4e-15)?;
            let zero = Lanes::splat(0.0);
            agrees_with_eigenvalues(&[xx, yy, zz, xy, zero, zero], true, 4e-15)?;
        }
    }

    #[test]
    fn no_strain_is_exactly_none() {
        let [zero, one] = [0.0, 1.0].map(Lanes::splat);
        let strain = Strain::of(&[one, one, one, zero, zero, zero], false);
        for value in strain.deviator.iter().chain([&strain.trace, &strain.norm]) {
            assert_eq!(value.to_array(), [0.0; LANES]);
        }
    }

    /// A tensor that is no deformation must not pass for one near the unit tensor.
    #[test]
    fn indefinite_tensors_are_decomposed() {
        let zero = Lanes::splat(0.0);
        for diagonal in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let b = [diagonal; 3].map(Lanes::splat);
            let strain = Strain::of(&[b[0], b[1], b[2], zero, zero, zero], false);
            assert!(strain.far.is_some_and(|far| far.lanes.all()), "{diagonal}");
        }
    }
}
