//! Names and what they stand for: dynamic scopes.
//!
//! Every include and every macro call is a scope. A name means its innermost binding, whoever made it; `#declare`
//! rewrites that binding, `#local` makes one in the scope itself. So each name has a stack of bindings, and
//! looking a name up is one step however deep the calls are.

use super::value::Value;
use crate::lang::Symbol;
use smallvec::SmallVec;
use std::sync::Arc;

/// The bindings of all names.
#[derive(Debug, Default)]
pub(super) struct Scopes {
    /// By symbol, outermost binding first.
    bindings: Vec<SmallVec<[Binding; 1]>>,
    /// The names bound in the open scopes but the outermost, scope by scope.
    locals: Vec<Symbol>,
    /// For each open scope but the outermost, where its names begin in `locals`.
    starts: Vec<usize>,
    /// How many blocks have been left for later: what is bound now is younger than all of them.
    now: u32,
}

#[derive(Debug)]
pub(super) struct Binding {
    scope: u32,
    /// [`Scopes::now`] when its value was set; those that are set anew only because a block was evaluated keep theirs.
    since: u32,
    slot: Slot,
}

/// About as many names as a dozen standard includes have. A table that grows to them by doubling is copied again and again, and
/// each size is memory of its own for the allocator, which the kernel clears two megabytes at a time.
const LIBRARY_NAMES: usize = 1700;

/// Bindings of a name that are out of sight.
pub(super) struct Hidden(Symbol, SmallVec<[Binding; 1]>);

/// What a binding holds.
#[derive(Debug, Clone)]
pub(super) enum Slot {
    Value(Value),
    /// A macro's parameter that stands for a variable of the caller's.
    Reference(Place),
}

/// A variable or an element of one; stays valid while the scope that made it is open.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub symbol: Symbol,
    /// Which of the name's bindings.
    binding: usize,
    /// The flat index in each array on the way down.
    pub path: SmallVec<[usize; 2]>,
}

impl Scopes {
    /// Makes room for the names of a library at once.
    pub fn expect_library(&mut self) {
        self.bindings.reserve(LIBRARY_NAMES.saturating_sub(self.bindings.len()));
    }

    /// How many includes and calls are open.
    pub fn depth(&self) -> usize {
        self.starts.len()
    }

    pub fn push(&mut self) {
        self.starts.push(self.locals.len());
    }

    pub fn pop(&mut self) {
        let depth = self.starts.len() as u32;
        let Some(start) = self.starts.pop() else { return };
        for symbol in self.locals.drain(start..) {
            let stack = &mut self.bindings[symbol.0 as usize];
            if stack.last().is_some_and(|binding| binding.scope == depth) {
                stack.pop();
            }
        }
    }

    /// The names that are bound, for suggestions.
    pub fn names(&self) -> impl Iterator<Item = Symbol> + '_ {
        self.bindings.iter().enumerate().filter(|(_, stack)| !stack.is_empty()).map(|(i, _)| Symbol(i as u32))
    }

    /// The innermost value of a name.
    #[inline]
    pub fn get(&self, symbol: Symbol) -> Option<&Value> {
        match &self.bindings.get(symbol.0 as usize)?.last()?.slot {
            Slot::Value(value) => Some(value),
            Slot::Reference(place) => self.at(place),
        }
    }

    /// The innermost value of a name if it is a float.
    #[inline(always)]
    pub fn float(&self, symbol: Symbol) -> Option<f64> {
        let value = match &self.bindings.get(symbol.0 as usize)?.last()?.slot {
            Slot::Value(value) => value,
            Slot::Reference(place) => self.at(place)?,
        };
        match value {
            Value::Number(num) if num.n == 1 => Some(num.v[0]),
            _ => None,
        }
    }

    /// The place that a name stands for; `None` if it stands for nothing.
    pub fn place(&self, symbol: Symbol) -> Option<Place> {
        let stack = self.bindings.get(symbol.0 as usize)?;
        match &stack.last()?.slot {
            Slot::Value(_) => Some(Place { symbol, binding: stack.len() - 1, path: SmallVec::new() }),
            Slot::Reference(place) => Some(place.clone()),
        }
    }

    /// The value at a place.
    pub fn at(&self, place: &Place) -> Option<&Value> {
        let Slot::Value(value) = &self.bindings.get(place.symbol.0 as usize)?.get(place.binding)?.slot else {
            return None;
        };
        let mut value = value;
        for &index in &place.path {
            let Value::Array(array) = value else { return None };
            value = array.items.get(index)?.as_ref()?;
        }
        Some(value)
    }

    /// The value at a place, to be written to.
    pub fn at_mut(&mut self, place: &Place) -> Option<&mut Value> {
        let binding = self.bindings.get_mut(place.symbol.0 as usize)?.get_mut(place.binding)?;
        let Slot::Value(value) = &mut binding.slot else { return None };
        let mut value = value;
        for &index in &place.path {
            let Value::Array(array) = value else { return None };
            value = Arc::make_mut(array).items.get_mut(index)?.as_mut()?;
        }
        Some(value)
    }

    /// Writes to a place; false if it is no longer there.
    pub fn set_at(&mut self, place: &Place, value: Value) -> bool {
        let Some((&last, front)) = place.path.split_last() else {
            return self.at_mut(place).map(|old| *old = value).is_some();
        };
        let array = Place { symbol: place.symbol, binding: place.binding, path: front.into() };
        let Some(Value::Array(array)) = self.at_mut(&array) else { return false };
        let array = Arc::make_mut(array);
        let inner = value.array_depth();
        let deeper = inner + 1 > array.depth;
        let found = array.items.get_mut(last).map(|cell| *cell = Some(value)).is_some();
        if deeper {
            self.deepen(place, inner);
        }
        found
    }

    /// Forgets the array element at a place.
    pub fn clear_at(&mut self, place: &Place) {
        let Some((&last, front)) = place.path.split_last() else { return };
        let array = Place { symbol: place.symbol, binding: place.binding, path: front.into() };
        if let Some(Value::Array(array)) = self.at_mut(&array)
            && let Some(cell) = Arc::make_mut(array).items.get_mut(last)
        {
            *cell = None;
        }
    }

    /// Tells the arrays on the way to `place` that `inner` arrays within each other are there now.
    fn deepen(&mut self, place: &Place, inner: usize) {
        for down in 0..place.path.len() {
            let outer = Place { path: place.path[..down].into(), ..*place };
            if let Some(Value::Array(array)) = self.at_mut(&outer) {
                let array = Arc::make_mut(array);
                array.depth = array.depth.max(place.path.len() - down + inner);
            }
        }
    }

    /// Bytes that a write to `place` copies: arrays are shared until then.
    pub fn copied_by_write(&self, place: &Place) -> usize {
        let bindings = self.bindings.get(place.symbol.0 as usize);
        let binding = bindings.and_then(|bindings| bindings.get(place.binding));
        let mut value = match binding {
            Some(Binding { slot: Slot::Value(value), .. }) => Some(value),
            _ => None,
        };
        let (mut bytes, mut shared) = (0, false);
        for &index in &place.path {
            let Some(Value::Array(array)) = value else { break };
            // What a copy holds is shared with what it is a copy of.
            shared |= Arc::strong_count(array) > 1;
            bytes += if shared { size_of_val(&array.items[..]) } else { 0 };
            value = array.items.get(index).and_then(Option::as_ref);
        }
        bytes
    }

    /// `#declare`: rewrites the innermost binding, or makes one in the outermost scope.
    pub fn declare(&mut self, symbol: Symbol, value: Value) {
        if let Some(Binding { slot: Slot::Value(old), .. }) =
            self.bindings.get_mut(symbol.0 as usize).and_then(|stack| stack.last_mut())
        {
            *old = value;
            return;
        }
        match self.place(symbol) {
            Some(place) => {
                self.set_at(&place, value);
            }
            None => self.bind(symbol, 0, Slot::Value(value)),
        }
    }

    /// `#local`: rewrites the binding of the innermost scope (through it, if it is a parameter by reference), or
    /// makes one there.
    pub fn local(&mut self, symbol: Symbol, value: Value) {
        let depth = self.starts.len() as u32;
        let here =
            self.bindings.get(symbol.0 as usize).and_then(|s| s.last()).is_some_and(|b| b.scope == depth);
        if here {
            self.declare(symbol, value);
        } else {
            self.bind(symbol, depth, Slot::Value(value));
        }
    }

    /// [`Scopes::local`] for the scope that was innermost when `depth` scopes were open: a macro that is still running
    /// may give a local of its caller its value.
    pub fn local_at(&mut self, depth: usize, symbol: Symbol, value: Value) {
        if depth >= self.starts.len() {
            return self.local(symbol, value);
        }
        let index = symbol.0 as usize;
        if self.bindings.len() <= index {
            self.bindings.resize_with(index + 1, SmallVec::new);
        }
        let stack = &mut self.bindings[index];
        let above = stack.iter().rposition(|binding| binding.scope as usize <= depth).map_or(0, |i| i + 1);
        if above > 0 && stack[above - 1].scope as usize == depth {
            let place = match &stack[above - 1].slot {
                Slot::Value(_) => Place { symbol, binding: above - 1, path: SmallVec::new() },
                Slot::Reference(place) => place.clone(),
            };
            self.set_at(&place, value);
            return;
        }
        stack.insert(above, Binding { scope: depth as u32, since: self.now, slot: Slot::Value(value) });
        self.remember(symbol, depth);
    }

    /// Binds a parameter in the innermost scope.
    pub fn bind_local(&mut self, symbol: Symbol, slot: Slot) {
        self.bind(symbol, self.starts.len() as u32, slot);
    }

    /// `#undef`: forgets the innermost binding.
    pub fn undef(&mut self, symbol: Symbol) {
        if let Some(stack) = self.bindings.get_mut(symbol.0 as usize) {
            stack.pop();
        }
    }

    // ----------------------------------------------------------------------------------------------------------
    // Blocks left for later

    /// Counts a block that is left for later; the names that are bound from now on are none of those it means.
    pub fn leave_block(&mut self) -> u32 {
        self.now += 1;
        self.now
    }

    /// The variable that `symbol` stands for and the block count at which its outermost value was set, if blocks have been left
    /// since then. Blocks mean outermost values alone.
    #[inline]
    pub fn older_than_blocks(&self, symbol: Symbol) -> Option<(Symbol, u32)> {
        if self.now == 0 {
            return None;
        }
        let mut symbol = symbol;
        let mut stack = self.bindings.get(symbol.0 as usize)?;
        if let Slot::Reference(place) = &stack.last()?.slot {
            symbol = place.symbol;
            stack = self.bindings.get(symbol.0 as usize)?;
        }
        let outermost = stack.first().filter(|binding| binding.scope == 0)?;
        (outermost.since < self.now).then_some((symbol, outermost.since))
    }

    /// Tells that no block left for later means the variable.
    pub fn make_young(&mut self, variable: Symbol) {
        let now = self.now;
        let stack = self.bindings.get_mut(variable.0 as usize);
        if let Some(binding) = stack.and_then(|stack| stack.first_mut()) {
            binding.since = now;
        }
    }

    /// True if the name has a binding in an inner scope.
    pub fn is_local(&self, symbol: Symbol) -> bool {
        self.bindings
            .get(symbol.0 as usize)
            .and_then(|stack| stack.last())
            .is_some_and(|binding| binding.scope > 0)
    }

    /// True if the innermost binding of the name was made in the scope that is innermost when `depth` are open.
    pub fn is_of(&self, symbol: Symbol, depth: usize) -> bool {
        let stack = self.bindings.get(symbol.0 as usize);
        stack.and_then(|stack| stack.last()).is_some_and(|binding| binding.scope as usize == depth)
    }

    /// The names bound in the open scopes but the outermost.
    pub fn locals(&self) -> &[Symbol] {
        &self.locals
    }

    /// The outermost value of a name.
    pub fn outermost(&self, symbol: Symbol) -> Option<&Value> {
        match self.bindings.get(symbol.0 as usize)?.first()? {
            Binding { scope: 0, slot: Slot::Value(value), .. } => Some(value),
            _ => None,
        }
    }

    /// Rewrites the outermost value of a name, which is as old as it was.
    pub fn put_outermost(&mut self, symbol: Symbol, value: Value) {
        if let Some(Binding { scope: 0, slot: Slot::Value(old), .. }) =
            self.bindings.get_mut(symbol.0 as usize).and_then(|stack| stack.first_mut())
        {
            *old = value;
        }
    }

    /// Takes away what a block that was left as number `block` does not see of a name: locals, and a value that is younger.
    pub fn hide(&mut self, symbol: Symbol, block: u32) -> Hidden {
        let Some(stack) = self.bindings.get_mut(symbol.0 as usize) else {
            return Hidden(symbol, SmallVec::new());
        };
        let seen = stack.first().is_some_and(|binding| binding.scope == 0 && binding.since < block);
        Hidden(symbol, stack.drain(usize::from(seen)..).collect())
    }

    /// Gives back what [`Scopes::hide`] took.
    pub fn show(&mut self, Hidden(symbol, bindings): Hidden) {
        if let Some(stack) = self.bindings.get_mut(symbol.0 as usize) {
            stack.extend(bindings);
        }
    }

    fn bind(&mut self, symbol: Symbol, scope: u32, slot: Slot) {
        let index = symbol.0 as usize;
        if self.bindings.len() <= index {
            self.bindings.resize_with(index + 1, SmallVec::new);
        }
        self.bindings[index].push(Binding { scope, since: self.now, slot });
        self.remember(symbol, scope as usize);
    }

    /// Notes that `symbol` is bound in `scope`.
    fn remember(&mut self, symbol: Symbol, scope: usize) {
        match scope {
            0 => {}
            _ if scope == self.starts.len() => self.locals.push(symbol),
            // A scope that others are open within.
            _ => {
                self.locals.insert(self.starts[scope], symbol);
                self.starts[scope..].iter_mut().for_each(|start| *start += 1);
            }
        }
    }
}
