//! Properties that every model of the list has.
use proptest::prelude::*;

use super::batches::advance::advance;
use super::laws::{Visitor, for_each_law};
use super::*;
use crate::simd::{Lanes, Vector};

fn all(state: &State) -> impl Iterator<Item = [f64; LANES]> {
    let scalars = [state.work, state.wave_speed];
    let lanes = state.elastic.into_iter().chain(state.stress).chain(state.history).chain(scalars);
    lanes.map(Lanes::to_array)
}

/// The update with the processor's widest instructions against the one that this test is compiled for.
struct InstructionsChangeNoBit(State);

impl Visitor for InstructionsChangeNoBit {
    fn visit(&self, example: &str, law: &impl Law) {
        for plane in [false, true] {
            let viscosity = Viscosity { linear: 0.2, quadratic: 2.0 };
            let rate = std::array::from_fn(|lane| 10.0 - 3.0 * lane as f64);
            for shock in [None, Some(Shock { viscosity, rate })] {
                let step = Step { dt: 1e-4, cell: 0.1, size: [0.1; LANES], shock, ..Step::rest(plane) };
                let (mut wide, mut plain) = (self.0, self.0);
                law.update(&mut wide, &step);
                advance(law, &mut plain, &step);
                for (wide, plain) in all(&wide).zip(all(&plain)) {
                    assert_eq!(wide.map(f64::to_bits), plain.map(f64::to_bits), "{example}");
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn bits_do_not_depend_on_instructions(
        normal in prop::array::uniform3(prop::array::uniform8(0.7_f64..1.4)),
        shear in prop::array::uniform3(prop::array::uniform8(-0.2_f64..0.2)),
        history in prop::array::uniform8(0.0_f64..0.1),
    ) {
        let [xy, xz, yz] = shear.map(Lanes::new);
        let [xx, yy, zz] = normal.map(Lanes::new);
        let mut trial = State::new([xx, yy, zz, xy, xz, yz]);
        trial.history = [Lanes::new(history); HISTORIES];
        for_each_law(&InstructionsChangeNoBit(trial));
    }
}

#[test]
fn examples_can_be_read() {
    for text in Parameters::examples() {
        let parameters: Result<Parameters, _> = text.parse();
        assert!(parameters.is_ok(), "{text}: {parameters:?}");
    }
}
