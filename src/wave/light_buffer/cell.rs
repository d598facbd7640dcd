//! From what is seen through a cell to what is known of it.

use super::among::{Candidate, is_listed, list, settle};
use super::casters::Caster;
use super::sheet::{Facet, Layer, Window};
use super::{Cell, List, SHEET};
use crate::compile::{Geometry, NO_SURFACE, SurfaceId};
use crate::lane::Scalar;

/// Something that is seen through a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Entry {
    /// Least depth at which it can be met.
    pub near: f32,
    /// Of a triangle, its greatest depth; of others, the depth beyond which it blocks all of the cell by itself.
    pub far: f32,
    /// A caster's number, or [`TRIANGLE`] and a facet's.
    pub what: u32,
    /// See [`Caster::surface`]. (Here, as casters are all over the memory.)
    pub surface: SurfaceId,
}

/// Marks [`Entry::what`] of triangles that are held to be part of sheets.
pub(super) const TRIANGLE: u32 = 1 << 31;

/// From so many entries on they are put in order: else there might be as many looks at them as there are entries.
const SORTED: usize = 256;
/// Behind so many layers with gaps none without is sought.
const LAYERS: usize = 3;

/// What cells are settled from.
pub(super) struct Settle<'a, S: Scalar, B: Scalar> {
    pub scene: &'a Geometry<S, B>,
    /// What entries name.
    pub casters: &'a [Caster],
    pub facets: &'a [Facet],
}

impl<S: Scalar, B: Scalar> Settle<'_, S, B> {
    /// What `entries` tell of the cell in a column and row.
    pub fn cell(
        &self,
        entries: &mut [Entry],
        place: (u32, u32),
        candidates: &mut Vec<Candidate>,
    ) -> (Cell, List) {
        if entries.is_empty() {
            return (Cell::EMPTY, List::NONE);
        }
        let mut cell = Cell::EMPTY;
        let mut triangles = false;
        for entry in &*entries {
            let surface = entry.surface;
            if surface != NO_SURFACE && surface == cell.nearest {
                cell.near = cell.near.min(entry.near);
            } else if entry.near < cell.near {
                cell.near_but_one = cell.near;
                (cell.near, cell.nearest) = (entry.near, surface);
            } else {
                cell.near_but_one = cell.near_but_one.min(entry.near);
            }
            if entry.what & TRIANGLE == 0 {
                cell.blocked = cell.blocked.min(entry.far);
            } else {
                triangles = true;
            }
        }
        if triangles {
            self.cover(&mut cell, entries, place);
        }
        let list = if cell.nearest == SHEET { List::NONE } else { self.list(&cell, entries, candidates) };
        (cell, list)
    }

    /// Looks for triangles that cover the cell together.
    fn cover(&self, cell: &mut Cell, entries: &mut [Entry], place: (u32, u32)) {
        let window = Window::of(place);
        // Those that lie one behind the other without a gap in depth are one layer. Mostly two or three looks at them find
        // it; in order one does.
        if entries.len() > SORTED {
            entries.sort_unstable_by(|a, b| a.near.total_cmp(&b.near).then(a.what.cmp(&b.what)));
        }
        let (mut first, mut rest) = (true, entries);
        for _ in 0..LAYERS {
            let mut far = f32::NEG_INFINITY;
            let least = rest.iter().map(|entry| entry.near).fold(f32::INFINITY, f32::min);
            if rest.is_empty() || least >= cell.blocked {
                return;
            }
            let (mut count, mut limit) = (0, least);
            loop {
                let before = count;
                for k in before..rest.len() {
                    if rest[k].near <= limit {
                        if rest[k].what & TRIANGLE != 0 {
                            far = far.max(rest[k].far);
                            limit = limit.max(far);
                        }
                        rest.swap(count, k);
                        count += 1;
                    }
                }
                if count == before {
                    break;
                }
            }
            let (layer, others) = rest.split_at_mut(count);
            if self.covers(cell, layer, far, &window, first) {
                return;
            }
            (first, rest) = (false, others);
        }
    }

    /// Whether the triangles of a layer leave no gap: then the cell is dark behind it.
    fn covers(&self, cell: &mut Cell, layer: &[Entry], far: f32, window: &Window, first: bool) -> bool {
        let (mut sum, mut alone) = (Layer::default(), true);
        for entry in layer {
            if entry.what & TRIANGLE == 0 {
                alone = false;
                continue;
            }
            if let Some(facet) = self.facets.get((entry.what & !TRIANGLE) as usize) {
                sum.add(facet, window);
            }
        }
        let Some(count) = sum.everywhere().filter(|&count| count > 0) else { return false };
        cell.blocked = cell.blocked.min(far);
        if count == 1 && alone && first {
            cell.nearest = SHEET;
            cell.near_but_one = far;
        }
        true
    }

    /// Lists what may be in the way of points that are not told otherwise, if it is not too much.
    fn list(&self, cell: &Cell, entries: &[Entry], candidates: &mut Vec<Candidate>) -> List {
        let first = candidates.len();
        for entry in entries.iter().filter(|entry| entry.near <= cell.blocked) {
            let (listed, row) = if entry.what & TRIANGLE != 0 {
                let Some(facet) = self.facets.get((entry.what & !TRIANGLE) as usize) else {
                    return List::NONE;
                };
                (true, self.scene.row_of(facet.surface))
            } else {
                let Some(caster) = self.casters.get(entry.what as usize) else { return List::NONE };
                (is_listed(caster), (caster.kind, caster.row))
            };
            if !listed || !list(candidates, first, row, entry.near) {
                candidates.truncate(first);
                return List::NONE;
            }
        }
        settle(&mut candidates[first..]);
        let len = candidates.len() - first;
        match (u32::try_from(first), u32::try_from(len)) {
            (Ok(first), Ok(len)) => List { first, len },
            _ => List::NONE,
        }
    }
}
