//! What is no mistake but seldom meant, told once a scene: what POV-Ray warns of at the end of its parse.

use super::machine::{Lexeme, Machine};
use crate::lang::{Diagnostic, Severity, Span, Token};
use crate::scene::Gamma;

/// Warnings of one kind that are shown; the rest are counted.
pub(super) const SHOWN_OF_A_KIND: usize = 10;

impl Machine<'_> {
    /// Notes that a `#version` that comes first in the scene's text does not come first there.
    pub(super) fn note_late_version(&mut self) {
        let is_scene = self.last.program == 0;
        if is_scene && !self.version_set && self.last.index > 0 {
            self.late_version = Some(self.span(self.last));
        }
    }

    /// Warns of what the whole scene lacks, if the options ask for it and nothing is wrong.
    pub(super) fn advise(&mut self) {
        if !self.options.advise || self.diagnostics.iter().any(|d| d.severity == Severity::Error) {
            return;
        }
        let start = self.span(Lexeme { token: Token::End, program: 0, index: 0 });
        let mut advice = |message: &str, help: &str, span: Span| {
            let diagnostic = Diagnostic::new(Severity::Warning, message, Some(span));
            self.diagnostics.push(if help.is_empty() { diagnostic } else { diagnostic.with_help(help) });
        };
        if !self.version_set {
            let message = "no `#version`: the scene is read by the rules of version 3.6, as POV-Ray does";
            advice(message, "begin the scene with `#version 3.7;`", start);
        } else if let Some(span) = self.late_version {
            let message = "`#version` is not the first statement: what is before it is read by the rules of version 3.6";
            advice(message, "", span);
        }
        if !self.gamma_set {
            let message = match self.scene.globals.assumed_gamma {
                Gamma::Off => "no `assumed_gamma`: colours go to the picture without gamma correction",
                _ => "no `assumed_gamma`: took 1.0",
            };
            advice(message, "write `global_settings { assumed_gamma 1.0 }`", start);
        }
        if !self.camera_set {
            advice("no `camera`: it stands at the origin and looks along z", "", start);
        }
        if self.scene.objects.is_empty() {
            advice("no objects: the picture shows the background alone", "", start);
        } else if self.scene.lights.is_empty() && self.scene.globals.radiosity.is_none() {
            advice("no light source: only ambient and emitted light is seen", "", start);
        }
    }

    /// Tells how many warnings there are beyond those shown.
    pub(super) fn count_warnings(&mut self) {
        let mut more: Vec<_> = self
            .warnings
            .iter()
            .filter(|(_, count)| **count > SHOWN_OF_A_KIND)
            .map(|(k, n)| (*k, *n))
            .collect();
        more.sort_unstable();
        for (kind, count) in more {
            let message = format!("{} more warnings of this kind: {kind}", count - SHOWN_OF_A_KIND);
            self.diagnostics.push(Diagnostic::new(Severity::Warning, message, None));
        }
    }
}
