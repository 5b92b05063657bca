//! Meaning of names and signs in expressions. All functions are `libm`'s, so values do not depend on the
//! machine.

use crate::quantity::smooth_step;

/// Variables of an expression, in the order in which values are given.
pub(super) const VARIABLES: [&str; 7] = ["x", "y", "z", "t", "X", "Y", "Z"];

/// Names of functions and constants, for messages.
pub(super) const FUNCTIONS: &str = "sin, cos, tan, asin, acos, atan, atan2(y, x), sinh, cosh, tanh, exp, ln, log10, sqrt, abs, sign, \
     step, ramp, floor, ceil, min(a, b), max(a, b), pi";

/// A function of one value.
pub(super) type Unary = fn(f64) -> f64;

/// A function of two values.
pub(super) type Binary = fn(f64, f64) -> f64;

/// A function with its arguments.
#[derive(Clone, Copy, Debug)]
pub(super) enum Function {
    /// Of one.
    One(Unary),
    /// Of two.
    Two(Binary),
}

impl Function {
    /// How many arguments it takes.
    pub(super) fn arguments(self) -> usize {
        if matches!(self, Self::One(_)) { 1 } else { 2 }
    }
}

/// Meaning of a name.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meaning {
    /// The variable of this number.
    Variable(u8),
    /// A number.
    Constant(f64),
    /// A function.
    Function(Function),
}

/// Meaning of a name, if it is known.
pub(super) fn meaning(name: &str) -> Option<Meaning> {
    if let Some(number) = VARIABLES.iter().position(|variable| *variable == name) {
        return Some(Meaning::Variable(number as u8));
    }
    let one = |function: Unary| Some(Meaning::Function(Function::One(function)));
    let two = |function: Binary| Some(Meaning::Function(Function::Two(function)));
    match name {
        "pi" => Some(Meaning::Constant(std::f64::consts::PI)),
        "sin" => one(libm::sin),
        "cos" => one(libm::cos),
        "tan" => one(libm::tan),
        "asin" => one(libm::asin),
        "acos" => one(libm::acos),
        "atan" => one(libm::atan),
        "sinh" => one(libm::sinh),
        "cosh" => one(libm::cosh),
        "tanh" => one(libm::tanh),
        "exp" => one(libm::exp),
        "ln" => one(libm::log),
        "log10" => one(libm::log10),
        "sqrt" => one(libm::sqrt),
        "abs" => one(f64::abs),
        "sign" => one(sign),
        "step" => one(|a| truth(a >= 0.0)),
        "ramp" => one(smooth_step),
        "floor" => one(libm::floor),
        "ceil" => one(libm::ceil),
        "atan2" => two(libm::atan2),
        "min" => two(f64::min),
        "max" => two(f64::max),
        _ => None,
    }
}

/// An operator between two operands and its rank: the higher binds first, equal ones from left to right.
/// Division binds before multiplication: `a * b / c` is `a * (b / c)`.
pub(super) fn operator(sign: &str) -> Option<(u8, Binary)> {
    Some(match sign {
        "<=" => (0, |a, b| truth(a <= b)),
        ">=" => (0, |a, b| truth(a >= b)),
        "<" => (0, |a, b| truth(a < b)),
        ">" => (0, |a, b| truth(a > b)),
        "+" => (1, |a, b| a + b),
        "-" => (1, |a, b| a - b),
        "*" => (2, |a, b| a * b),
        "/" => (3, |a, b| a / b),
        "^" => (4, libm::pow),
        _ => return None,
    })
}

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

fn sign(a: f64) -> f64 {
    if a > 0.0 {
        1.0
    } else if a < 0.0 {
        -1.0
    } else {
        0.0
    }
}
