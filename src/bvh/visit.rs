//! What a walk asks of whoever sent it.

use super::Run;
use super::eights::Packets;
use super::packet::Packet;
use crate::lane::Scalar;

/// What the walk's owner does in leaves.
pub trait Visit<B: Scalar> {
    /// Rays are done with the first hit, whichever that is: children are taken in their nodes' order instead of from near to far.
    const ANY: bool;
    /// What leaves must know of a ray that walks alone, besides its [`Packet`].
    type Lone;
    /// Tests the primitives of `run` against the packets whose bit is set in `which`, in the lanes that are live, and
    /// shortens their `far` where a nearer hit was found (to a negative number where the ray is done). Returns a bit for
    /// each packet that has changed.
    fn packets(&mut self, run: &Run, which: Packets, packets: &mut [Packet<B>]) -> Packets;
    /// The ray in lane `lane` of packet `packet`, made ready for its leaves: once for all of them.
    fn lone(&self, packet: usize, lane: usize) -> Self::Lone;
    /// Tests the primitives of `run` against one ray, the state of whose packet is given, and which looks up to `far`: the new
    /// `far`.
    fn single(&mut self, run: &Run, ray: &Self::Lone, state: &Packet<B>, far: B) -> B;
    /// True if some kind's rows are worth asking for ahead.
    fn prefetches(&self) -> bool;
    /// Asks the memory for the first rows of `run`, which will soon be tested.
    fn prefetch(&self, run: &Run);
    /// Eight lanes were held against boxes, so many of them with something to hold.
    fn boxes(&mut self, lanes: u32);
    /// False if no ray of the walk cares for runs of this class.
    fn wants(&self, class: u8) -> bool;
}
