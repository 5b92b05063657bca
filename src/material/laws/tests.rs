//! Claims about all laws of the list.
use super::*;

/// A strength factor divides c and tan φ; the model stays valid, and 1 changes nothing.
#[test]
fn weakened_models_are_valid_and_have_less_strength() {
    let mut weakened = 0;
    for text in Parameters::examples() {
        let model: Parameters = text.parse().expect("an example");
        let Some(weaker) = model.weakened(1.5) else { continue };
        assert!(weaker.check().is_ok(), "{text}");
        assert_eq!(model.weakened(1.0), Some(model.clone()), "{text}");
        if let (Parameters::MohrCoulomb(before), Parameters::MohrCoulomb(after)) = (&model, &weaker) {
            let [before_tan, after_tan] = [before, after].map(|p| p.friction_angle.to_radians().tan());
            assert!((1.5 * after_tan / before_tan - 1.0).abs() < 1e-14, "{text}");
            assert_eq!(after.cohesion, before.cohesion / 1.5);
        }
        let associated = weaker.associated();
        assert!(associated.check().is_ok(), "{text}");
        if let Parameters::MohrCoulomb(p) = &associated {
            assert!(p.dilation_angle == p.friction_angle || p.residual_friction_angle.is_some(), "{text}");
        }
        weakened += 1;
    }
    assert!(weakened >= 15, "{weakened} models with strength");
}
