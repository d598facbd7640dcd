//! Dependencies point one way: holds the table in `ARCHITECTURE.md` against the code.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

type Edges = BTreeMap<String, BTreeSet<String>>;

/// The lines `room -> other, other` of the block after the heading.
fn allowed() -> Edges {
    let page = fs::read_to_string("ARCHITECTURE.md").expect("ARCHITECTURE.md");
    let (_, rest) = page.split_once("## Who may use whom").expect("the heading");
    let block = rest.split("```").nth(1).expect("the block");
    let edge = |line: &str| {
        let (room, others) = line.split_once("->")?;
        let others = others.split(',').map(|o| o.trim().to_owned()).filter(|o| !o.is_empty());
        Some((room.trim().to_owned(), others.collect()))
    };
    block.lines().filter_map(edge).collect()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// What the file's code names after `crate::` (or `octray::`, in the program): comments and unit tests left out,
/// which may look further.
fn rooms_used(file: &Path) -> BTreeSet<String> {
    if file.components().any(|c| c.as_os_str() == "tests" || c.as_os_str() == "tests.rs") {
        return BTreeSet::new();
    }
    let text = fs::read_to_string(file).expect("a readable file");
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code: String =
        code.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n").collect();
    let mut used = BTreeSet::new();
    for prefix in ["crate::", "octray::"] {
        for (at, _) in code.match_indices(prefix) {
            let rest = &code[at + prefix.len()..];
            // `use crate::{a::X, b}` names several; only its outermost names count.
            let names: Vec<&str> = match rest.strip_prefix('{') {
                Some(list) => outermost(list),
                None => vec![rest],
            };
            for name in names {
                let end = name.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(name.len());
                used.insert(name[..end].to_owned());
            }
        }
    }
    used
}

/// The items of a list in braces, up to its end.
fn outermost(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut items) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                items.push(list[start..at].trim());
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                items.push(list[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    items.retain(|item| !item.is_empty());
    items
}

/// The room a file belongs to: the first part of its path under `src`.
fn room(file: &Path) -> String {
    let inside = file.strip_prefix("src").expect("under src");
    let first = inside.components().next().expect("a name").as_os_str().to_string_lossy();
    first.trim_end_matches(".rs").to_owned()
}

#[test]
fn every_room_uses_only_the_rooms_it_may() {
    let allowed = allowed();
    let mut wrong = Vec::new();
    for file in rust_files(Path::new("src")) {
        let room = room(&file);
        if room == "lib" || room == "main" {
            continue;
        }
        let Some(may) = allowed.get(&room) else {
            wrong.push(format!("{}: the room `{room}` is not in the table", file.display()));
            continue;
        };
        for used in rooms_used(&file) {
            if used != room && !may.contains(&used) {
                wrong.push(format!("{}: `{room}` may not use `{used}`", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "against ARCHITECTURE.md:\n{}", wrong.join("\n"));
}

#[test]
fn the_table_has_no_circle() {
    let allowed = allowed();
    let mut done: BTreeSet<&str> = BTreeSet::new();
    // A room is done when all it uses is done; whoever is never done stands in a circle or uses an unknown room.
    while let Some((room, _)) = allowed
        .iter()
        .find(|(room, uses)| !done.contains(room.as_str()) && uses.iter().all(|u| done.contains(u.as_str())))
    {
        done.insert(room);
    }
    let stuck: Vec<_> = allowed.keys().filter(|room| !done.contains(room.as_str())).collect();
    assert!(stuck.is_empty(), "in a circle, or using a room that is not in the table: {stuck:?}");
}

#[test]
fn the_oracle_shares_nothing_but_scene_and_film() {
    let oracle = &allowed()["reference"];
    assert!(oracle.iter().all(|used| used == "scene" || used == "film"), "{oracle:?}");
}

#[test]
fn lists_in_braces_are_read() {
    assert_eq!(outermost("a::{b, c}, d::E,\n f};"), ["a::{b, c}", "d::E", "f"]);
}
