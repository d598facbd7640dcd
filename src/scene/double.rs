//! One f64 as a [`Number`].

use super::noise::sums_at;
use super::number::Number;

impl Number for f64 {
    fn lit(value: f64) -> Self {
        value
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn abs(self) -> Self {
        f64::abs(self)
    }
    fn if_less(self, other: Self, yes: Self, no: Self) -> Self {
        if self < other { yes } else { no }
    }
    fn whole(self) -> Self {
        self.trunc()
    }
    fn sine(self) -> Self {
        self.sin()
    }
    fn raised(self, exponent: f64) -> Self {
        self.powf(exponent)
    }
    fn lattice<const N: usize>(p: [Self; 3]) -> [Self; N] {
        sums_at(p)
    }
    fn everywhere(self) -> Option<f64> {
        Some(self)
    }
    fn each<const N: usize>(arguments: [Self; N], f: impl Fn([f64; N]) -> f64) -> Self {
        f(arguments)
    }
}
