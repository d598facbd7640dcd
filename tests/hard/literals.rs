//! No tolerance without a name: small numbers in the rooms that decide hits stand in constants, with their reason.

use std::fs;
use std::path::Path;

/// `1e-9`, `2.5e-16`, `0.001`: a number with a negative exponent, or a decimal under a hundredth.
fn has_small_literal(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    let exponent = code.match_indices("e-").any(|(at, _)| {
        code[..at].ends_with(|c: char| c.is_ascii_digit())
            && code[at + 2..].starts_with(|c: char| c.is_ascii_digit())
    });
    let decimal = code.match_indices("0.00").any(|(at, _)| {
        !code[..at].ends_with(|c: char| c.is_ascii_digit())
            && code[at + 2..].trim_start_matches('0').starts_with(|c: char| c.is_ascii_digit())
    });
    exponent || decimal
}

#[test]
fn kernels_have_no_naked_tolerances() {
    let mut naked = Vec::new();
    for room in ["src/kernel", "src/csg", "src/bvh", "src/wave"] {
        for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(room)).unwrap() {
            let path = entry.unwrap().path();
            if path.ends_with("tests.rs") {
                continue;
            }
            let Ok(text) = fs::read_to_string(&path) else { continue };
            // Unit tests stand at the end and have tolerances of their own.
            let code = text.split("#[cfg(test)]").next().unwrap_or_default();
            for (number, line) in code.lines().enumerate() {
                if has_small_literal(line) && !line.contains("const ") {
                    naked.push(format!("{}:{}: {}", path.display(), number + 1, line.trim()));
                }
            }
        }
    }
    assert!(naked.is_empty(), "name these and say why:\n{}", naked.join("\n"));
}

#[test]
fn small_literals_are_seen() {
    for (line, seen) in [
        ("let x = 1e-9;", true),
        ("x < 2.5e-16", true),
        ("// 1e-9", false),
        ("a.one-2", false),
        ("1e9", false),
        ("x < 0.001", true),
        ("0.004f32", true),
        ("10.001 + 0.01", false),
        ("0.000", false),
    ] {
        assert_eq!(has_small_literal(line), seen, "{line}");
    }
}
