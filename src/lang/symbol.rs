//! Names as small numbers.

use rustc_hash::FxHashMap;
use std::sync::Arc;

/// A user's name, interned; an index into [`Symbols`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol(pub u32);

/// All names met so far in the files of one scene.
#[derive(Debug, Default)]
pub struct Symbols {
    names: Vec<Arc<str>>,
    by_name: FxHashMap<Arc<str>, Symbol>,
}

impl Symbols {
    /// The symbol of `name`; the same for the same text.
    pub fn intern(&mut self, name: &str) -> Symbol {
        if let Some(symbol) = self.by_name.get(name) {
            return *symbol;
        }
        let symbol = Symbol(self.names.len() as u32);
        let shared: Arc<str> = name.into();
        self.names.push(shared.clone());
        self.by_name.insert(shared, symbol);
        symbol
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
