//! What a walk asks of whoever sent it.

use super::Run;
use super::packet::Packet;
use crate::lane::Scalar;

/// What the walk's owner does in leaves.
pub trait Visit<B: Scalar> {
    /// Tests the primitives of `run` against the packets whose bit is set in `which`, in the lanes that are live, and
    /// shortens their `far` where a nearer hit was found (to a negative number where the ray is done). Returns a bit for
    /// each packet that has changed.
    fn packets(&mut self, run: &Run, which: u8, packets: &mut [Packet<B>]) -> u8;
    /// Tests the primitives of `run` against the ray in lane `.1` of packet `.0`, whose state is given and which looks up
    /// to `far`: the new `far`.
    fn single(&mut self, run: &Run, ray: (usize, usize), state: &Packet<B>, far: B) -> B;
    /// Eight lanes were held against boxes, so many of them with something to hold.
    fn boxes(&mut self, lanes: u32);
    /// False if no ray of the walk cares for runs of this class.
    fn wants(&self, class: u8) -> bool;
}
