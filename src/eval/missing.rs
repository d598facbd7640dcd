//! What a scene asks for and octray does not model: noted down where it is met, told once at the end.

use super::machine::{Lexeme, Machine};
use super::value::Lacks;
use crate::lang::{Diagnostic, Severity, Span};
use rustc_hash::FxHashMap;

/// A feature that is read but not modelled.
#[derive(Debug, Clone, PartialEq)]
pub struct Missing {
    /// In the language's words.
    pub feature: String,
    /// How much it matters.
    pub effect: Effect,
    /// In how many places of the text.
    pub places: usize,
    /// The first one.
    pub first: Span,
}

/// How much it matters that a feature is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// The picture would be wrong: it is not rendered unless the user allows it.
    Refused,
    /// A hint that changes no picture of ours, or hardly.
    Ignored,
}

/// What has been met so far.
#[derive(Debug, Default)]
pub(super) struct MissingList {
    /// Everything met: feature, place, and whether something placed in the scene has it.
    met: Vec<(String, Span, bool)>,
    index: FxHashMap<(String, Span), u32>,
    /// What the scene has; merged by feature.
    told: Vec<Missing>,
    by_feature: FxHashMap<String, usize>,
    ignored_at: rustc_hash::FxHashSet<(Span, &'static str)>,
}

impl MissingList {
    fn tell(&mut self, feature: &str, effect: Effect, span: Span) {
        match self.by_feature.get(feature) {
            Some(&at) => self.told[at].places += 1,
            None => {
                self.by_feature.insert(feature.to_string(), self.told.len());
                self.told.push(Missing { feature: feature.into(), effect, places: 1, first: span });
            }
        }
    }
}

impl Machine<'_> {
    /// Notes down that `feature` was met at `at`. It is told only if what holds it is used.
    pub fn lack(&mut self, feature: impl Into<String>, at: Lexeme) -> Lacks {
        let (feature, span) = (feature.into(), self.span(at));
        let list = &mut self.missing;
        let next = list.met.len() as u32;
        let index = *list.index.entry((feature.clone(), span)).or_insert(next);
        if index == next {
            list.met.push((feature, span, false));
        }
        Lacks { met: smallvec::smallvec![index], depth: 0 }
    }

    /// Takes a feature out of `lacks`: it has turned out not to be needed.
    pub fn forget(&self, lacks: &mut Lacks, feature: &str) {
        lacks.met.retain(|index| self.missing.met[*index as usize].0 != feature);
    }

    /// The scene has everything in `lacks`.
    pub fn miss(&mut self, lacks: &Lacks) {
        for &index in &lacks.met {
            let (feature, span, told) = &mut self.missing.met[index as usize];
            if !std::mem::replace(told, true) {
                let (feature, span) = (feature.clone(), *span);
                self.missing.tell(&feature, Effect::Refused, span);
            }
        }
    }

    /// A hint at `at` is left aside.
    pub fn ignore(&mut self, feature: &'static str, at: Lexeme) {
        let span = self.span(at);
        if self.missing.ignored_at.insert((span, feature)) {
            self.missing.tell(feature, Effect::Ignored, span);
        }
    }

    /// Ends the list: what is refused comes first. Unless the user wants no more than the list, every entry becomes a
    /// diagnostic.
    pub fn finish_missing(&mut self) -> Vec<Missing> {
        let mut list = std::mem::take(&mut self.missing.told);
        list.sort_by_key(|missing| missing.effect);
        if self.options.list_missing {
            return list;
        }
        for missing in &list {
            let (severity, said) = match (missing.effect, self.options.allow_missing) {
                (Effect::Refused, false) => (Severity::Error, "not modelled yet"),
                (Effect::Refused, true) => (Severity::Warning, "not modelled yet, left out"),
                (Effect::Ignored, _) => (Severity::Note, "ignored"),
            };
            let more = match missing.places {
                1 => String::new(),
                places => format!(" ({places} places, the first here)"),
            };
            let message = format!("{said}: `{}`{more}", missing.feature);
            self.diagnostics.push(Diagnostic::new(severity, message, Some(missing.first)));
        }
        list
    }
}
