//! Constructive geometry: the children of a composite (manual section 3.4.5.5).

use super::geometry::{EVERYWHERE, keep_extent};
use super::machine::{Lexeme, Machine, Res};
use super::value::{Absent, Facts, Lacks, ObjectValue};
use crate::scene::{CsgOp, Light, Object, Shape};
use std::sync::Arc;

impl Machine<'_> {
    /// The children of a composite.
    pub fn csg(&mut self, op: CsgOp, at: Lexeme) -> Res<ObjectValue> {
        let mut children = Vec::new();
        let mut lights = Vec::new();
        let mut lacks = Lacks::default();
        let mut cutters_missing = false;
        let mut facts = Facts::default();
        let mut stand_ins = Vec::new();
        let mut any_stand_in = false;
        let (mut absent, mut parts) = (None, 0);
        loop {
            let start = self.peek_lexeme()?;
            let Some(child) = self.next_object()? else { break };
            self.charge(size_of::<Light>() * child.lights.len())?;
            if matches!(op, CsgOp::Intersection | CsgOp::Difference) {
                self.warn_of_patch(&child, start, at);
            }
            facts.add(&child.facts);
            facts.textured_part |= child.is_textured();
            self.check_depth(&facts)?;
            // The composite's box asks those of what clips its children, and of what clips that.
            self.count_steps(child.facts.helpers)?;
            cutters_missing |= child.object.is_none() && child.lights.is_empty();
            if child.object.is_none() {
                absent = absent.or(left_by(child.absent, op, parts == 0));
            }
            parts += usize::from(child.object.is_some() || child.absent != Absent::Light);
            any_stand_in |= child.stand_in.is_some();
            stand_ins.extend(child.stand_in.or_else(|| child.object.clone()));
            children.extend(child.object);
            lights.extend(child.lights);
            lacks.add(&child.lacks);
        }
        let span = self.span(at);
        if children.len() == 1 && lights.is_empty() && !cutters_missing {
            self.warn(
                "csg of one",
                format!("a `{}` of one object", self.sources.text(span).to_owned()),
                span,
            );
        }
        if children.is_empty() && lights.is_empty() && !cutters_missing {
            self.warn("empty csg", format!("a `{}` of nothing", self.sources.text(span).to_owned()), span);
        }
        let made_of = |children| {
            let mut object = Object::new(Shape::Csg { op, children, cutaway_textures: false });
            match lights.is_empty() {
                true => keep_extent(&mut object),
                // A light's box has no end (measured).
                false => object.more_mut().extent = Some(EVERYWHERE),
            }
            Arc::new(object)
        };
        let all = match op {
            CsgOp::Union | CsgOp::Merge => Absent::Nothing,
            CsgOp::Intersection | CsgOp::Difference => Absent::Everything,
        };
        let object = (!children.is_empty() && absent.is_none()).then(|| made_of(children));
        let absent = absent.unwrap_or(all);
        let stand_in = any_stand_in.then(|| made_of(stand_ins));
        // What a composite of composites shows of what it cuts is settled where it is cut.
        facts.cutaway &= op == CsgOp::Union;
        facts.shapes = facts.shapes.saturating_add(1);
        Ok(ObjectValue { object, stand_in, lights, lacks, facts, absent })
    }

    /// Warns of a part of an intersection or difference (at `csg`) that has no inside.
    fn warn_of_patch(&mut self, part: &ObjectValue, start: Lexeme, csg: Lexeme) {
        if part.facts.patch || (part.object.is_none() && !part.lights.is_empty()) {
            let (word, csg) = (self.text_of(start), self.text_of(csg));
            let message =
                format!("this `{word}` has no inside, or a part of it has none: no use in a `{csg}`");
            self.warn("patch in csg", message, self.span(start));
        }
    }
}

/// What a composite is whatever else it has, for one part without surfaces; `None` if the part makes no difference.
fn left_by(part: Absent, op: CsgOp, is_first: bool) -> Option<Absent> {
    let part = if op == CsgOp::Difference && !is_first { part.inverted() } else { part };
    match (op, part) {
        (CsgOp::Intersection | CsgOp::Difference, Absent::Nothing | Absent::Flat) => Some(Absent::Nothing),
        (CsgOp::Merge, Absent::Everything) => Some(Absent::Everything),
        _ => None,
    }
}
