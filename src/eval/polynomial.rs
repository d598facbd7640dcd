//! Surfaces that are given by the coefficients of a polynomial (manual sections 3.4.5.3.3 poly and 3.4.5.3.4 quadric).

use super::machine::{Machine, Res};
use crate::lang::{Mark, Token};
use crate::scene::{Polynomial, Shape};
use std::sync::Arc;

impl Machine<'_> {
    /// `quadric { <xx, yy, zz>, <xy, xz, yz>, <x, y, z>, 1 }`
    pub(super) fn quadric(&mut self) -> Res<Option<Shape>> {
        let squares = self.vector()?;
        self.comma()?;
        let mixed = self.vector()?;
        self.comma()?;
        let linear = self.vector()?;
        self.comma()?;
        let constant = self.finite()?;
        let [xx, yy, zz] = squares.to_array();
        let [xy, xz, yz] = mixed.to_array();
        let [x, y, z] = linear.to_array();
        let coefficients = vec![xx, xy, xz, x, yy, yz, y, zz, z, constant];
        let quadric = Polynomial::new(2, coefficients).map(Polynomial::into_quadric);
        Ok(quadric.map(|quadric| Shape::Polynomial(Arc::new(quadric))))
    }

    /// The coefficients of a `cubic` or `quartic`.
    pub(super) fn surface_of_order(&mut self, order: usize) -> Res<Option<Shape>> {
        let count = Polynomial::terms(order);
        if let Token::Vector(first, found) = self.peek()?
            && usize::from(found) == count
        {
            let program = self.next()?.program as usize;
            let numbers = &self.programs[program].numbers[first as usize..][..count];
            return Ok(surface(order, numbers.to_vec()));
        }
        self.expect(Mark::Less)?;
        let mut coefficients = Vec::with_capacity(count);
        for _ in 0..count {
            coefficients.push(self.finite()?);
            self.comma()?;
        }
        self.expect(Mark::Greater)?;
        Ok(surface(order, coefficients))
    }

    /// `poly { order, <coefficients> }`
    pub(super) fn poly(&mut self) -> Res<Option<Shape>> {
        let order = self.order("poly")?;
        self.surface_of_order(order)
    }

    /// `polynomial { order, xyz(1, 0, 2): value, ... }`
    pub(super) fn polynomial(&mut self) -> Res<Option<Shape>> {
        let order = self.order("polynomial")?;
        let mut coefficients = vec![0.0; Polynomial::terms(order)];
        // The word is no keyword.
        while let Token::Name(_) = self.peek()? {
            self.next()?;
            self.expect(Mark::OpenParen)?;
            let mut powers = [0; 3];
            for power in &mut powers {
                let given = self.finite()?;
                if !(0.0..=order as f64).contains(&given) {
                    let text = format!("a power is a number from 0 to the order {order}, found {given}");
                    return Err(self.error_here(text));
                }
                *power = given as usize;
                self.comma()?;
            }
            self.expect(Mark::CloseParen)?;
            self.expect(Mark::Colon)?;
            let value = self.finite()?;
            self.comma()?;
            let sum: usize = powers.iter().sum();
            if sum > order {
                return Err(self.error_here(format!("the powers add up to {sum}, over the order {order}")));
            }
            coefficients[Polynomial::place(order, powers)] = value;
        }
        Ok(surface(order, coefficients))
    }

    fn order(&mut self, what: &str) -> Res<usize> {
        let order = self.finite()?;
        self.comma()?;
        if !(2.0..=Polynomial::MAX_ORDER as f64).contains(&order) {
            return Err(self.error_here(format!(
                "a {what} has an order of 2 to {}, found {order}",
                Polynomial::MAX_ORDER
            )));
        }
        Ok(order as usize)
    }
}

fn surface(order: usize, coefficients: Vec<f64>) -> Option<Shape> {
    Polynomial::new(order, coefficients).map(|polynomial| Shape::Polynomial(Arc::new(polynomial)))
}
