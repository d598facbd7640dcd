//! `ior` and `caustics` of a `finish`, where old scenes have them (manual section 3.4.6.3).
//!
//! In come objects on their way into the scene; out they go with interiors that say the same. POV-Ray writes what the finish of
//! an object's uppermost layer says over the interior that the object has or shares with the whole it is a part of, and does
//! so for wholes before their parts and for these in order: what is said last holds (measured).

use super::machine::{Machine, Res};
use crate::scene::{Interior, Object, Shape, Texture};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What finishes say of an interior.
#[derive(Clone, Copy, Default, PartialEq)]
struct Said {
    ior: Option<f64>,
    caustics: Option<f64>,
}

/// What an object has become, if anything, and what is said of the interior that it shares; by its address and what the texture
/// of its whole says. So shared parts are walked once.
type Known = FxHashMap<(*const Object, [Option<u64>; 2]), (Option<Arc<Object>>, Said)>;

impl Machine<'_> {
    /// Writes what the finishes of an object and of its parts say into their interiors.
    pub fn interior_of_finishes(&mut self, object: &mut Arc<Object>) -> Res<()> {
        let (written, said) = self.with_interiors(object, Said::default(), &mut Known::default())?;
        if let Some(written) = written {
            *object = written;
        }
        if said != Said::default() {
            Arc::make_mut(object).interior = Some(said.over(&Interior::default()));
        }
        Ok(())
    }

    fn with_interiors(
        &mut self,
        object: &Arc<Object>,
        outer: Said,
        known: &mut Known,
    ) -> Res<(Option<Arc<Object>>, Said)> {
        let key = (Arc::as_ptr(object), [outer.ior, outer.caustics].map(|value| value.map(f64::to_bits)));
        if let Some(found) = known.get(&key) {
            return Ok(found.clone());
        }
        self.count_steps(1)?;
        let of_texture = object.texture.as_deref().map_or(outer, Said::of);
        let mut said = of_texture;
        let mut written: Option<Object> = None;
        if let Shape::Csg { children, .. } = &object.shape {
            for (k, child) in children.iter().enumerate() {
                let (child, of_child) = self.with_interiors(child, of_texture, known)?;
                said = said.then(of_child);
                if let Some(child) = child
                    && let Shape::Csg { children, .. } =
                        &mut written.get_or_insert_with(|| Object::clone(object)).shape
                {
                    children[k] = child;
                }
            }
        }
        if let Some(interior) = &object.interior
            && said != Said::default()
        {
            written.get_or_insert_with(|| Object::clone(object)).interior = Some(said.over(interior));
            said = Said::default();
        }
        let found = (written.map(Arc::new), said);
        known.insert(key, found.clone());
        Ok(found)
    }
}

impl Said {
    fn of(texture: &Texture) -> Self {
        let finish = texture.layers.last().filter(|_| texture.patterned.is_none()).map(|layer| &layer.finish);
        finish.map_or(Self::default(), |finish| Self { ior: finish.ior, caustics: finish.caustics })
    }

    /// What holds if `next` is said after it.
    fn then(self, next: Self) -> Self {
        Self { ior: next.ior.or(self.ior), caustics: next.caustics.or(self.caustics) }
    }

    fn over(self, interior: &Interior) -> Arc<Interior> {
        let mut interior = interior.clone();
        if let Some(ior) = self.ior {
            interior.ior = if ior == 0.0 { 1.0 } else { ior };
        }
        if let Some(caustics) = self.caustics {
            interior.caustics = caustics / CAUSTICS;
        }
        Arc::new(interior)
    }
}

/// What the `caustics` of an interior count for, in those of a finish.
const CAUSTICS: f64 = 45.0;
