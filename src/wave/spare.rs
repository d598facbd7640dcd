//! Memory that is used again.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Memory that goes from one user to the next, who finds in it what the last one left: fresh pages cost more than what is written
/// to them.
#[derive(Debug, Default)]
pub struct Spare<T>(Mutex<Vec<T>>);

impl<T: Default> Spare<T> {
    /// Some of it; new if all is in use.
    pub fn take(&self) -> T {
        let spare = self.all().pop();
        spare.unwrap_or_default()
    }

    /// For the next to take.
    pub fn give_back(&self, it: T) {
        self.all().push(it);
    }

    /// What `work` makes with some of it.
    pub fn lend<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        let mut lent = self.take();
        let made = work(&mut lent);
        self.give_back(lent);
        made
    }

    fn all(&self) -> MutexGuard<'_, Vec<T>> {
        let Self(spare) = self;
        spare.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_spare_comes_back() {
        let spare = Spare::<Vec<u8>>::default();
        assert_eq!(spare.lend(|list| list.len()), 0);
        spare.lend(|list| {
            list.push(1);
            // Another at the same time.
            spare.lend(|other| assert!(other.is_empty()));
        });
        assert_eq!(spare.lend(|list| list.len()), 1);
    }
}
