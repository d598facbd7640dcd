//! Objects into the scene: what has no texture has the default one.
//!
//! In come whole objects; out they go into the scene's list, each with a texture, but for what shows the texture of what it cuts.

use super::machine::{Machine, Res};
use super::value::ObjectValue;
use crate::scene::{CsgOp, Object, Shape, Texture};
use rustc_hash::FxHashMap;
use std::sync::Arc;

impl Machine<'_> {
    /// Puts an object and its lights into the scene.
    pub fn place(&mut self, value: ObjectValue) -> Res<()> {
        self.miss(&value.lacks);
        if !value.lights.is_empty() {
            self.scene.lights.extend(value.lights);
        }
        if let Some(mut object) = value.object {
            // Each is an object of its own, even if it is one and the same declared object.
            if object.texture.is_none() || Arc::strong_count(&object) > 1 {
                self.give_default(Arc::make_mut(&mut object), value.facts.cutaway, &mut Given::default());
            }
            if self.finishes_of_interiors {
                self.interior_of_finishes(&mut object)?;
            }
            self.scene.objects.push(object);
        }
        Ok(())
    }

    /// Gives the default texture to what has none, but not to what `cutaway_textures` is to give one. `cutaway` is false if
    /// no part is known to have that.
    fn give_default(&mut self, object: &mut Object, cutaway: bool, given: &mut Given) {
        if object.texture.is_some() {
            return;
        }
        match &mut object.shape {
            Shape::Csg { cutaway_textures: true, .. } => {}
            Shape::Csg { op: CsgOp::Union, children, .. }
                if cutaway && children.iter().any(|child| given.is_cutaway(child)) =>
            {
                for child in children {
                    let before = Arc::as_ptr(child);
                    match given.with_default.get(&before) {
                        Some((_, after)) => *child = after.clone(),
                        None => {
                            let kept = child.clone();
                            self.give_default(Arc::make_mut(child), true, given);
                            given.with_default.insert(before, (kept, child.clone()));
                        }
                    }
                }
            }
            _ => {
                let lacks = self.default_texture.lacks.clone();
                self.miss(&lacks);
                object.texture = Some(self.shared_default());
            }
        }
    }

    fn shared_default(&mut self) -> Arc<Texture> {
        match &self.default_shared {
            Some(texture) => texture.clone(),
            None => {
                let texture = Arc::new(self.default_texture.value.clone());
                self.default_shared = Some(texture.clone());
                texture
            }
        }
    }
}

/// What has been found under way by [`Machine::give_default`], by the address of a shared part.
#[derive(Default)]
struct Given {
    cutaway: FxHashMap<*const Object, bool>,
    /// The part before, which is kept so that its address stays its own, and after.
    with_default: FxHashMap<*const Object, (Arc<Object>, Arc<Object>)>,
}

impl Given {
    /// True if an untextured part of it shows what it cuts.
    fn is_cutaway(&mut self, object: &Arc<Object>) -> bool {
        let Shape::Csg { cutaway_textures, op, children } = &object.shape else { return false };
        let key = Arc::as_ptr(object);
        if let Some(&known) = self.cutaway.get(&key) {
            return known;
        }
        let found =
            *cutaway_textures || (*op == CsgOp::Union && children.iter().any(|child| self.is_cutaway(child)));
        self.cutaway.insert(key, found);
        found
    }
}
