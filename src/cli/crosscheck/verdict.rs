//! What a comparison with POV-Ray's picture comes to.

use super::Row;
use octray::compare::Comparison;
use serde::Serialize;
use std::fmt;

/// Judged by the pixels that differ by more than [`octray::compare::WITHIN`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No pixel differs.
    Agrees,
    /// Only pixels on edges of POV-Ray's picture differ, where a last bit decides what is seen; of random scenes, on edges
    /// of both pictures.
    Silhouettes,
    /// Some other pixels differ, and POV-Ray's own become octray's if the eye is moved by 1e-7: low edges, where a last
    /// bit decides too.
    LastDigits {
        /// How many.
        pixels: usize,
    },
    /// POV-Ray's picture comes from one of its artefacts.
    PovRayWrong {
        /// Which, and how one knows.
        reason: String,
    },
    /// Pixels off edges differ.
    Differs {
        /// How many.
        pixels: usize,
        /// Who sides with whom, where that was looked into.
        note: Option<String>,
    },
}

impl Verdict {
    /// `artefact` is the reason on record for this scene.
    pub fn of(found: &Comparison, artefact: Option<String>) -> Self {
        if found.all.within >= 1.0 {
            Self::Agrees
        } else if found.off_edges.within >= 1.0 {
            Self::Silhouettes
        } else if let Some(reason) = artefact {
            Self::PovRayWrong { reason }
        } else {
            let within = (found.off_edges.within * found.off_edges.pixels as f64).round() as usize;
            Self::Differs { pixels: found.off_edges.pixels - within, note: None }
        }
    }

    /// A word or three for a table.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Silhouettes => "differs at silhouettes only",
            Self::LastDigits { .. } => "hangs on last digits",
            Self::PovRayWrong { .. } => "POV-Ray is wrong here",
            Self::Differs { .. } => "differs",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Agrees | Self::Silhouettes => Ok(()),
            Self::LastDigits { pixels } => write!(f, " in {pixels} pixels"),
            Self::PovRayWrong { reason } => write!(f, ": {reason}"),
            Self::Differs { pixels, note } => {
                write!(f, " in {pixels} pixels")?;
                note.iter().try_for_each(|note| write!(f, "; {note}"))
            }
        }
    }
}

/// One line: how many scenes came to what.
pub fn counts(rows: &[Row]) -> String {
    let of = |name: &str| {
        rows.iter().filter(|row| row.verdict.as_ref().is_some_and(|verdict| verdict.name() == name)).count()
    };
    let names =
        ["agrees", "differs at silhouettes only", "hangs on last digits", "POV-Ray is wrong here", "differs"];
    let mut parts: Vec<String> = names.iter().map(|name| format!("{name}: {}", of(name))).collect();
    if let none @ 1.. = rows.iter().filter(|row| row.verdict.is_none()).count() {
        parts.push(format!("no picture: {none}"));
    }
    format!("{} scenes; {}", rows.len(), parts.join(", "))
}
