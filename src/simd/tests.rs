//! The implementations against each other.
use super::registers::portable;
use super::*;

/// Values with all kinds of signs, sizes and special cases.
fn samples() -> Vec<[f64; 4]> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let unit = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        unit * f64::from_bits((1023 + (state & 63)) << 52) * f64::exp2(-32.0)
    };
    let mut all: Vec<[f64; 4]> = (0..500).map(|_| std::array::from_fn(|_| next())).collect();
    all.push([0.0, -0.0, 1.0, -1.0]);
    all.push([f64::MIN_POSITIVE, f64::MAX, 0.5, -2.5]);
    all.push([1.5, 2.5, 1023.0, -1022.0]);
    all
}

fn same(a: [f64; 4], b: [f64; 4], what: &str) {
    assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "{what}: {a:?} {b:?}");
}

#[test]
fn both_implementations_give_the_same_bits() {
    let all = samples();
    for (i, &x) in all.iter().enumerate() {
        let (y, z) = (all[(i + 7) % all.len()], all[(i + 31) % all.len()]);
        let (a, b, c) = (F64x4::new(x), F64x4::new(y), F64x4::new(z));
        let (p, q, r) = (portable::F64x4::new(x), portable::F64x4::new(y), portable::F64x4::new(z));
        same((a + b).to_array(), (p + q).to_array(), "add");
        same((a - b).to_array(), (p - q).to_array(), "sub");
        same((a * b).to_array(), (p * q).to_array(), "mul");
        same((-a).to_array(), (-p).to_array(), "neg");
        same(a.mul_add(b, c).to_array(), p.mul_add(q, r).to_array(), "mul_add");
        same(a.neg_mul_add(b, c).to_array(), p.neg_mul_add(q, r).to_array(), "neg_mul_add");
        same(a.abs().sqrt().to_array(), p.abs().sqrt().to_array(), "sqrt");
        same(a.floor().to_array(), p.floor().to_array(), "floor");
        same(a.round().to_array(), p.round().to_array(), "round");
        same(a.min(b).to_array(), p.min(q).to_array(), "min");
        same(a.max(b).to_array(), p.max(q).to_array(), "max");
        same(a.copysign(b).to_array(), p.copysign(q).to_array(), "copysign");
        if y.iter().all(|y| *y != 0.0) {
            same((a / b).to_array(), (p / q).to_array(), "div");
        }
        let positive = x.map(|x| x.abs().max(f64::MIN_POSITIVE));
        let ((k, m), (n, o)) = (F64x4::new(positive).split(), portable::F64x4::new(positive).split());
        same(k.to_array(), n.to_array(), "exponent");
        same(m.to_array(), o.to_array(), "significand");
        same(k.power_of_two().to_array(), n.power_of_two().to_array(), "power of two");
        same((m * k.power_of_two()).to_array(), positive, "split and joined");
        let (masks, portables) = ([a.lt(b), a.le(b)], [p.lt(q), p.le(q)]);
        for (mask, other) in masks.into_iter().zip(portables) {
            assert_eq!(mask.bits(), other.bits());
            assert_eq!((!mask).bits(), (!other).bits());
            assert_eq!((mask & a.le(c)).bits(), (other & p.le(r)).bits());
            assert_eq!((mask | a.le(c)).bits(), (other | p.le(r)).bits());
            same(mask.select(a, b).to_array(), other.select(p, q).to_array(), "select");
        }
        let (rows, others) = (F64x4::transpose([a, b, c, a]), portable::F64x4::transpose([p, q, r, p]));
        for i in 0..4 {
            same(rows[i].to_array(), others[i].to_array(), "transpose");
        }
    }
    same(F64x4::splat(0.1).to_array(), portable::F64x4::splat(0.1).to_array(), "splat");
    for bits in 0..16 {
        assert_eq!(Mask4::from_bits(bits).bits(), bits);
        assert_eq!(portable::Mask4::from_bits(bits).bits(), bits);
    }
}

/// Rows from columns, and columns from these.
struct RowsAndBack([[f64; LANES]; 4]);

impl Kernel for RowsAndBack {
    type Output = ([[f64; 4]; LANES], [[f64; LANES]; 4]);

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let mut rows = [F64x4::splat(0.0); LANES];
        V::write_rows(self.0.map(V::new), &mut rows);
        (rows.map(F64x4::to_array), V::columns(&rows).map(V::to_array))
    }
}

#[test]
fn rows_and_columns_are_inverse() {
    let columns = std::array::from_fn(|c| std::array::from_fn(|lane| (10 * c + lane) as f64));
    for (rows, back) in [RowsAndBack(columns).run::<Lanes>(), widest(RowsAndBack(columns))] {
        for (lane, row) in rows.into_iter().enumerate() {
            assert_eq!(row, std::array::from_fn(|c| (10 * c + lane) as f64));
        }
        assert_eq!(back, columns);
    }
    assert_eq!(Mask::from_bits(0b1010_0110).bits(), 0b1010_0110);
}

/// Every operation of vectors on three of them, one of which is positive where an operation requires it.
struct Everything([[f64; LANES]; 3]);

impl Kernel for Everything {
    type Output = (Vec<[u64; LANES]>, Vec<u32>);

    #[inline(always)]
    fn run<V: Vector>(self) -> Self::Output {
        let [a, b, c] = self.0.map(V::new);
        let positive = a.abs().max(V::splat(f64::MIN_POSITIVE));
        let (k, m) = positive.split();
        let mut sum = a;
        sum += b;
        let masks = [a.lt(b), a.le(b), a.lt(b) & a.le(c), a.lt(b) | a.le(c), !a.lt(b)];
        let chosen = V::Mask::from_bits(0b1010_0110);
        let values = [
            [a + b, a - b, a * b, a / b, -a, sum, a * 0.3],
            [a.mul_add(b, c), a.neg_mul_add(b, c), positive.sqrt(), a.abs(), a.floor(), a.round(), a.min(b)],
            [a.max(b), a.copysign(b), k, m, k.power_of_two(), masks[0].select(a, b), chosen.select(a, b)],
        ];
        let masks = masks.iter().chain([&chosen]);
        let bits = |value: V| value.to_array().map(f64::to_bits);
        (values.into_iter().flatten().map(bits).collect(), masks.map(|mask| mask.bits()).collect())
    }
}

/// On processors with AVX-512; elsewhere both are the same.
#[test]
fn the_widest_registers_give_the_same_bits() {
    let mut samples = samples();
    samples.push([f64::INFINITY, f64::NEG_INFINITY, f64::MIN_POSITIVE / 4.0, -0.0]);
    let eight = |i: usize| -> [f64; LANES] {
        std::array::from_fn(|lane| samples[(i + lane / 4 * 13) % samples.len()][lane % 4])
    };
    for i in 0..samples.len() {
        let three = [eight(i), eight(i + 7), eight(i + 31)];
        assert_eq!(Everything(three).run::<Lanes>(), widest(Everything(three)), "{three:?}");
    }
}

#[test]
fn lanes_become_bytes() {
    for bits in 0..1u32 << LANES {
        let bytes = Mask::from_bits(bits).bytes().to_le_bytes();
        assert_eq!(bytes, std::array::from_fn(|lane| (bits >> lane & 1) as u8));
    }
}
