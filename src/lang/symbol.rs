//! Names as small numbers.

use rustc_hash::FxBuildHasher;
use std::hash::BuildHasher;
use std::sync::Arc;

/// A user's name, interned; an index into [`Symbols`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub u32);

/// All names met so far in the files of one scene.
#[derive(Debug, Default)]
pub struct Symbols {
    names: Vec<Arc<str>>,
    /// A symbol's number plus one stands where its name's hash says, or in the next free place behind; 0 is free. At least twice as
    /// many as names, and a power of two. A map would hold the names too, and be six times as large.
    slots: Vec<u32>,
}

/// Places for the names of a small scene with its includes; each time they are too few there are four times as many.
const FIRST_SLOTS: usize = 1 << 10;

impl Symbols {
    /// The symbol of `name`; the same for the same text.
    pub fn intern(&mut self, name: &str) -> Symbol {
        if self.slots.len() <= 2 * self.names.len() {
            self.grow();
        }
        let mut at = self.place_of(name);
        while let number @ 1.. = self.slots[at] {
            if *self.names[number as usize - 1] == *name {
                return Symbol(number - 1);
            }
            at = (at + 1) & (self.slots.len() - 1);
        }
        self.names.push(name.into());
        self.slots[at] = self.names.len() as u32;
        Symbol(self.slots[at] - 1)
    }

    /// Where the search for a name begins.
    #[inline]
    fn place_of(&self, name: &str) -> usize {
        FxBuildHasher.hash_one(name) as usize & (self.slots.len() - 1)
    }

    #[cold]
    fn grow(&mut self) {
        self.slots = vec![0; (4 * self.slots.len()).max(FIRST_SLOTS)];
        for number in 0..self.names.len() {
            let mut at = self.place_of(&self.names[number]);
            while self.slots[at] != 0 {
                at = (at + 1) & (self.slots.len() - 1);
            }
            self.slots[at] = number as u32 + 1;
        }
    }

    /// The text of a symbol.
    pub fn name(&self, symbol: Symbol) -> &Arc<str> {
        &self.names[symbol.0 as usize]
    }

    /// How many there are; symbols are `0..len`.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// True if no name has been met.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}
