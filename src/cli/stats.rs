//! What `--stats` writes, and the lanes of it that `octray bench` shows too.

use octray::render::{Occupancy, Precision, RayCounts, RenderOptions, RenderStats};
use serde::Serialize;
use std::collections::BTreeMap;

/// A render's cost, all times in seconds of wall clock.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// Reading and running the scene text.
    pub parse_s: f64,
    /// From scene to columns and trees.
    pub build_s: f64,
    /// Tracing, up to the codes of the pixels.
    pub trace_s: f64,
    /// From start to the written file.
    pub total_s: f64,
    pub width: usize,
    pub height: usize,
    pub threads: usize,
    /// Computed in: finer than what was asked for where that is too coarse for the scene.
    pub precision: Precision,
    pub rays: RayCounts,
    /// Of eight lanes, how many hold a ray or hit when a packet leaves its queue; absent for the reference engine, which has
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub queues: Option<QueueLanes>,
    /// All rays, over `trace_s`.
    pub mrays_per_s: f64,
    /// With `--occupancy`: mean lanes at work, of eight, in tests of boxes and of primitives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occupancy: Option<MeanLanes>,
    /// Shapes by kind.
    pub shapes: BTreeMap<&'static str, u64>,
    /// The most memory the process ever held; null where the system does not tell.
    pub peak_rss_bytes: Option<u64>,
}

/// Mean lanes at work in a test of eight; null where there were none.
#[derive(Debug, Serialize)]
pub struct MeanLanes {
    #[serde(rename = "box")]
    pub boxes: Option<f64>,
    pub leaf: Option<f64>,
}

impl From<Occupancy> for MeanLanes {
    fn from(occupancy: Occupancy) -> Self {
        Self { boxes: occupancy.boxes.mean_lanes(), leaf: occupancy.leaf.mean_lanes() }
    }
}

/// Mean lanes of the packets of each queue; null where there were none.
#[derive(Debug, Serialize)]
pub struct QueueLanes {
    pub camera: Option<f64>,
    pub shadow: Option<f64>,
    pub reflect: Option<f64>,
    pub refract: Option<f64>,
    /// Of hits that are shaded together.
    pub hits: Option<f64>,
    /// Share of the shadow rays that went in no packet, as the light's buffer knew the answer.
    pub shadow_answered: Option<f64>,
}

impl QueueLanes {
    /// `None` of the reference engine, which has no packets.
    pub fn of(rays: &RayCounts) -> Option<Self> {
        let packets = rays.packets;
        let mean = |lanes: u64, packets: u64| (packets > 0).then(|| lanes as f64 / packets as f64);
        (packets.camera > 0).then(|| Self {
            camera: mean(rays.camera, packets.camera),
            shadow: mean(rays.shadow - packets.answered, packets.shadow),
            reflect: mean(rays.reflect, packets.reflect),
            refract: mean(rays.refract, packets.refract),
            hits: mean(packets.hits, packets.shaded),
            shadow_answered: mean(packets.answered, rays.shadow),
        })
    }
}

impl Stats {
    pub fn new(options: &RenderOptions, stats: RenderStats, parse_s: f64, total_s: f64) -> Self {
        Self {
            parse_s,
            build_s: stats.build_s,
            trace_s: stats.trace_s,
            total_s,
            width: options.width,
            height: options.height,
            threads: stats.threads,
            precision: stats.precision,
            rays: stats.rays,
            queues: QueueLanes::of(&stats.rays),
            // Nothing is traced in no time; a clock too coarse to see it must not give an infinity.
            mrays_per_s: stats.rays.total() as f64 / stats.trace_s.max(1e-9) * 1e-6,
            occupancy: stats.occupancy.map(MeanLanes::from),
            shapes: stats.shapes,
            peak_rss_bytes: peak_rss_bytes(),
        }
    }
}

/// `VmHWM` of Linux's process table.
fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kib = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(kib.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
