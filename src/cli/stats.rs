//! What `--stats` writes.

use octray::render::{Precision, RayCounts, RenderOptions, RenderStats};
use serde::Serialize;
use std::collections::BTreeMap;

/// A render's cost, all times in seconds of wall clock.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// Reading and running the scene text.
    pub parse_s: f64,
    /// From scene to columns and trees.
    pub build_s: f64,
    /// Tracing alone.
    pub trace_s: f64,
    /// From start to the written file.
    pub total_s: f64,
    pub width: usize,
    pub height: usize,
    pub threads: usize,
    pub precision: Precision,
    pub rays: RayCounts,
    /// All rays, over `trace_s`.
    pub mrays_per_s: f64,
    /// Shapes by kind.
    pub shapes: BTreeMap<&'static str, u64>,
    /// The most memory the process ever held; null where the system does not tell.
    pub peak_rss_bytes: Option<u64>,
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
            precision: options.precision,
            rays: stats.rays,
            // Nothing is traced in no time; a clock too coarse to see it must not give an infinity.
            mrays_per_s: stats.rays.total() as f64 / stats.trace_s.max(1e-9) * 1e-6,
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
