//! `spline { ... }` (manual section 3.1.9).

use super::machine::{Machine, Res};
use super::value::Value;
use crate::lang::{Keyword, Mark, Token};
use crate::scene::{Spline, SplineKind};

impl Machine<'_> {
    /// The block behind `spline`.
    pub fn spline(&mut self) -> Res<Spline> {
        self.deeper(|m| {
            let open = m.open("spline")?;
            let named = m.take_named(|value| match value {
                Value::Spline(spline) => Some(Spline::clone(spline)),
                _ => None,
            })?;
            let mut spline = named.unwrap_or_default();
            m.count_steps(spline.len() as u64)?;
            if let Some(kind) = m.spline_kind()? {
                spline.kind = kind;
            }
            while m.peek()? != Token::Mark(Mark::CloseBrace) {
                m.comma()?;
                let place = m.finite()?;
                m.comma()?;
                let value = m.expr()?;
                m.charge(std::mem::size_of::<(f64, [f64; 5])>())?;
                spline.components = spline.components.max(value.n.max(2));
                spline.insert(place, value.promoted(value.n.max(2)));
                m.comma()?;
            }
            m.close("spline", open)?;
            if spline.is_empty() {
                return Err(m.error("a `spline` wants at least one point", m.span(open)));
            }
            spline.settle();
            Ok(spline)
        })
    }

    /// The word that says which kind of spline, if one follows.
    pub fn spline_kind(&mut self) -> Res<Option<SplineKind>> {
        let kind = match self.peek()? {
            Token::Word(Keyword::LinearSpline) => SplineKind::Linear,
            Token::Word(Keyword::QuadraticSpline) => SplineKind::Quadratic,
            Token::Word(Keyword::CubicSpline) => SplineKind::Cubic,
            Token::Word(Keyword::NaturalSpline) => SplineKind::Natural,
            _ => return Ok(None),
        };
        self.next()?;
        self.comma()?;
        Ok(Some(kind))
    }
}
