//! A progress bar on a terminal; nothing anywhere else.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use octray::render::Progress;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Drawn while it lives, gone when dropped.
pub struct Bar {
    bar: ProgressBar,
    rays: Arc<AtomicU64>,
}

impl Bar {
    /// A bar on the standard error stream if that is a terminal; hidden if `quiet`.
    pub fn new(pixels: usize, quiet: bool) -> Self {
        let rays = Arc::new(AtomicU64::new(0));
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(pixels as u64), target);
        let counted = Arc::clone(&rays);
        let mrays = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            let seconds = state.elapsed().as_secs_f64().max(1e-3);
            // The bar is only there to be looked at; a failure to format it is no reason to stop.
            let _ = write!(out, "{:.2} Mrays/s", counted.load(Relaxed) as f64 / seconds * 1e-6);
        };
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {mrays}  {eta} left")
            .expect("the template is a constant");
        bar.set_style(style.with_key("mrays", mrays));
        Self { bar, rays }
    }

    /// To be called from any thread, in any order.
    pub fn update(&self, progress: Progress) {
        self.rays.fetch_max(progress.rays, Relaxed);
        if progress.pixels > self.bar.position() {
            self.bar.set_position(progress.pixels);
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
