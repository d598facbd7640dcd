//! Polynomials in x, y and z, whose zeros are surfaces (manual sections 3.4.5.3.3 poly and 3.4.5.3.4 quadric).

/// `sum of c x^i y^j z^k` over all `i + j + k <= order`. The surface is where it is 0; inside it is negative.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    order: usize,
    coefficients: Vec<f64>,
    quadric: bool,
}

impl Polynomial {
    /// Highest order that scenes may ask for.
    pub const MAX_ORDER: usize = 35;

    /// Number of terms of a polynomial of `order`.
    pub const fn terms(order: usize) -> usize {
        (order + 1) * (order + 2) * (order + 3) / 6
    }

    /// `coefficients` in POV-Ray's order: falling powers of x, among these of y, among these of z (for order 2: xx, xy,
    /// xz, x, yy, yz, y, zz, z, 1). `None` unless they are as many as [`Polynomial::terms`], finite, and of an order
    /// from 1 to [`Polynomial::MAX_ORDER`].
    pub fn new(order: usize, coefficients: Vec<f64>) -> Option<Self> {
        let sound = (1..=Self::MAX_ORDER).contains(&order)
            && coefficients.len() == Self::terms(order)
            && coefficients.iter().all(|c| c.is_finite());
        sound.then_some(Self { order, coefficients, quadric: false })
    }

    /// The same, written as a `quadric`.
    pub fn into_quadric(self) -> Self {
        Self { quadric: true, ..self }
    }

    /// POV-Ray turns a `quadric` inside out by its coefficients and then takes it for inside out once more, so that its two
    /// textures change places, unlike those of any other shape (measured in POV-Ray 3.7).
    pub fn exchanges_textures(&self) -> bool {
        self.quadric
    }

    /// The highest `i + j + k`.
    pub fn order(&self) -> usize {
        self.order
    }

    /// As given to [`Polynomial::new`].
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Place of the term `x^i y^j z^k` among the coefficients; `i + j + k` must be at most the order.
    pub fn place(order: usize, [i, j, k]: [usize; 3]) -> usize {
        // Before it: all terms of a higher power of x, which leave less than `order - i` for the other two; then those of a
        // higher power of y; then those of a higher power of z.
        let triangle = |n: usize| n * (n + 1) / 2;
        let pyramid = |n: usize| n * (n + 1) * (n + 2) / 6;
        let rest = order - i;
        pyramid(rest) + triangle(rest - j) + (rest - j - k)
    }

    /// Exponents of x, y and z of each term, in the order of the coefficients.
    pub fn exponents(order: usize) -> impl Iterator<Item = [usize; 3]> {
        (0..=order).rev().flat_map(move |i| {
            (0..=order - i).rev().flat_map(move |j| (0..=order - i - j).rev().map(move |k| [i, j, k]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_stand_where_their_exponents_say() {
        for order in 1..=6 {
            let exponents: Vec<_> = Polynomial::exponents(order).collect();
            assert_eq!(exponents.len(), Polynomial::terms(order));
            for (place, powers) in exponents.into_iter().enumerate() {
                assert_eq!(Polynomial::place(order, powers), place, "{powers:?} of order {order}");
            }
        }
    }

    #[test]
    fn unsound_coefficients_are_no_polynomial() {
        assert!(Polynomial::new(2, vec![1.0; 9]).is_none());
        assert!(Polynomial::new(1, vec![1.0, f64::NAN, 0.0, 0.0]).is_none());
        assert!(Polynomial::new(36, vec![0.0; Polynomial::terms(36)]).is_none());
    }
}
