//! Which pages the system gives this process: small ones until a scene turns out to be large.
//!
//! mimalloc asks for pages of 2 MB. The kernel clears such a page when it is first written to, whatever is used of it: a few balls on a
//! plane hold 24 MB so, and 18 in small pages. And a virtual machine may have handed free pages of that size, but not
//! smaller ones, back to its host: to have one again takes milliseconds. Large trees are worth that, as their nodes lie
//! anywhere, and to look up a small page costs as much as a node.

use super::scene::is_over_limit;
use octray::scene::Scene;
pub use system::{keep_small, let_be};

/// Scenes of more shapes are large. (In small pages traces of 66,000 spheres take 0.95 to 0.98 of the time, of 256,000 and 524,000
/// triangles 1.01 to 1.05, but whole processes 0.69 to 1.03, those of two million spheres 0.65. Among 10^6 triangles rays are no
/// slower; among 10^7 camera rays take 1.3.)
const MANY: u64 = 1 << 22;

/// [`let_be`] where `scene`, of so many `shapes`, is large.
pub fn let_be_for(scene: &Scene, shapes: u64) {
    if is_over_limit(scene, shapes, MANY) {
        let_be();
    }
}

#[cfg(target_os = "linux")]
mod system {
    use rustix::thread::{disable_transparent_huge_pages, transparent_huge_pages_are_disabled};
    use std::sync::atomic::{AtomicBool, Ordering};

    /// It is this program that has disabled huge pages, not whoever started it.
    static DISABLED: AtomicBool = AtomicBool::new(false);

    /// From now on pages are small. (Where that cannot be had all is as it was.)
    pub fn keep_small() {
        if transparent_huge_pages_are_disabled() == Ok(false) && disable_transparent_huge_pages(true).is_ok()
        {
            DISABLED.store(true, Ordering::Relaxed);
        }
    }

    /// Pages are again what they were before [`keep_small`]: for what works with much memory, and for what starts other programs,
    /// which inherit it.
    pub fn let_be() {
        if DISABLED.swap(false, Ordering::Relaxed) {
            // (What cannot be had costs time, and nothing else.)
            let _ = disable_transparent_huge_pages(false);
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        /// Whoever has disabled them for this process finds them so afterwards.
        #[test]
        fn huge_pages_are_back_only_where_they_were() {
            let disabled = || transparent_huge_pages_are_disabled();
            let Ok(before) = disabled() else { return };
            for others in [false, true] {
                disable_transparent_huge_pages(others).unwrap();
                keep_small();
                assert_eq!(disabled(), Ok(true));
                let_be();
                assert_eq!(disabled(), Ok(others));
            }
            disable_transparent_huge_pages(before).unwrap();
        }
    }
}

/// Other systems decide by themselves.
#[cfg(not(target_os = "linux"))]
mod system {
    pub fn keep_small() {}
    pub fn let_be() {}
}
