//! POV-Ray's own example scenes: every one that POV-Ray renders must evaluate.
//!
//! Where the packages `povray-examples` and `povray-includes` are not installed there is nothing to count, and the test says so.

use octray::eval::{Effect, Options, load};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "/usr/share/doc/povray/examples";
const INCLUDES: &str = "/usr/share/povray-3.7/include";

/// What POV-Ray cannot read either: it includes a file whose name is still to be filled in.
const NO_SCENES: [&str; 1] = ["portfolio/__empty.pov"];

fn scenes_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            scenes_below(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "pov") {
            found.push(path);
        }
    }
}

#[test]
fn every_example_scene_of_pov_ray_evaluates() {
    if !Path::new(EXAMPLES).is_dir() || !Path::new(INCLUDES).is_dir() {
        eprintln!("skipped: {EXAMPLES} or {INCLUDES} is not there");
        return;
    }
    let mut paths = Vec::new();
    scenes_below(Path::new(EXAMPLES), &mut paths);
    paths.sort();
    let options = Options { list_missing: true, library_paths: vec![INCLUDES.into()], ..Options::default() };
    let evaluate = |path: &PathBuf| {
        let done = load(path, &options);
        let error = done.has_errors().then(|| {
            let errors = done.diagnostics.iter().filter(|d| d.severity == octray::lang::Severity::Error);
            errors.map(|d| d.short(&done.sources)).next().unwrap_or_default()
        });
        let refused = done.missing.iter().filter(|missing| missing.effect == Effect::Refused);
        (
            path.strip_prefix(EXAMPLES).unwrap().to_path_buf(),
            error,
            refused.map(|m| m.feature.clone()).collect(),
        )
    };
    let done: Vec<(PathBuf, Option<String>, Vec<String>)> = paths.par_iter().map(evaluate).collect();

    let mut refusals: BTreeMap<&str, usize> = BTreeMap::new();
    for feature in done.iter().flat_map(|(_, _, refused)| refused) {
        *refusals.entry(feature).or_default() += 1;
    }
    let mut refusals: Vec<_> = refusals.into_iter().collect();
    refusals.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let rendered = done.iter().filter(|(_, error, refused)| error.is_none() && refused.is_empty()).count();
    let good = done.iter().filter(|(_, error, _)| error.is_none()).count();
    println!("{good} of {} scenes evaluate, {rendered} of them without anything refused", done.len());
    for (feature, count) in refusals {
        println!("{count:4} {feature}");
    }

    let expected = |path: &Path| NO_SCENES.iter().any(|name| path == Path::new(name));
    let wrong: Vec<_> = done.iter().filter(|(path, error, _)| error.is_some() != expected(path)).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
