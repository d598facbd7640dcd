//! Where shading puts what it makes: light into sums, rays into queues.

use super::medium::Media;
use super::queue::{Carriers, Feelers, Queue};
use super::sums::Sums;
use crate::film::PacketCounts;
use crate::lane::Lane;

/// Light weaker than this in every channel is not followed (POV-Ray's figure; channels are of order 1).
pub const NO_LIGHT: f64 = 1e-10;

/// Where the shading of a batch puts what it makes.
pub struct Emit<'a, L: Lane> {
    /// Sums of pixels.
    pub sums: &'a mut Sums,
    /// Reflected rays, and those of total internal reflection.
    pub reflected: &'a mut Queue<Carriers<L>>,
    /// Refracted rays, and those that go straight on, by [`Sender`](super::hit_list::Sender).
    pub refracted: &'a mut [Queue<Carriers<L>>; 2],
    /// A queue a light.
    pub shadows: &'a mut [Queue<Feelers<L>>],
    /// The thread's interior lists.
    pub media: &'a mut Media,
    /// Counts packets of hits, hits in them, and shadow rays that lights' buffers have answered.
    pub counts: &'a mut PacketCounts,
}
