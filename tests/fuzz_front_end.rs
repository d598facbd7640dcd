//! Any text may be fed to the front end: no panic, no hang, no memory beyond the limits.
//!
//! Inputs are scenes of this repository (and of an installed POV-Ray, in a long run) with pieces cut, doubled, swapped,
//! spliced and overwritten, and plain noise. `OCTRAY_FUZZ_SECONDS` is the budget (default 3), `OCTRAY_FUZZ_SEED` picks
//! the sequence, `OCTRAY_FUZZ_FOLDER` is where each input is written before it is run (default: the folder for temporary
//! files): a stack overflow or an abort leaves its input behind, as `octray-fuzz-<process>.scn`. Every input is evaluated as
//! `octray check` would, its diagnostics are shown in both forms, and its shapes are counted. Then it is included as a library's
//! file, whose blocks wait until they are asked for, and all that it declares is asked for: without errors before, without now, and
//! the same is said and placed.

use octray::eval::{Evaluation, Limits, Options, from_text};
use octray::lang::{Keyword, Severity};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// One input may take this long: the limits below stop a script after well under a second, on a busy machine.
const HANG: Duration = Duration::from_secs(30);

/// Kilobytes the whole process may hold, looked at every [`WATCH`]: six times what the limits below allow one script by the
/// evaluator's own estimate.
const MEMORY_KB: u64 = 3 << 19;

/// How often the watchman looks.
const WATCH: Duration = Duration::from_millis(50);

/// A long run says how far it is this often.
const REPORT: Duration = Duration::from_secs(300);

/// What is put in at random places.
const PIECES: &[&str] = &[
    "{",
    "}",
    "(",
    ")",
    "<",
    ">",
    "[",
    "]",
    ",",
    ";",
    "\"",
    "/*",
    "*/",
    "//",
    "#",
    "#end ",
    "#if(1) ",
    "#else ",
    "#while(1) ",
    "#for(I,1,1e9) ",
    "#macro M(A) ",
    "M(",
    "#declare A = ",
    "#local A = ",
    "#include \"",
    "#break ",
    "#switch(2) ",
    "#case(2) ",
    "#undef A ",
    "#ifdef(A) ",
    "#read(",
    "#write(",
    "#fopen F \"x\" write ",
    "array[",
    "array[1e9]",
    "A[",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "0/0",
    "1/0",
    "4294967296",
    "-1",
    "0",
    "rgb ",
    "x*",
    "sphere{0,1}",
    "union{",
    "object{",
    "texture{",
    "pigment{",
    "finish{",
    "normal{",
    "color_map{",
    "function{",
    "mesh2{",
    "vertex_vectors{",
    "polygon{",
    "prism{",
    "lathe{",
    "blob{",
    "text{",
    "spline{",
    "concat(",
    "str(",
    "vstr(",
    "substr(",
    "chr(",
    "vrotate(",
    "min(",
    "select(",
    "rand(",
    "seed(",
    "dimension_size(",
    "trace(",
    "translate ",
    "rotate ",
    "scale 0 ",
    "matrix<",
    "transform{",
    "#version 3.0;",
    "#default{",
    "#debug ",
    "\u{e9}",
    "\u{0}",
    "\\",
    "\n",
    "sum(i,1,1e9,i)",
    "?",
    ":",
    "|",
    "&",
    "!",
    "=",
];

/// SplitMix64 (Steele, Lea, Flood, Fast splittable pseudorandom number generators).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0..n, or 0 if there is none.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// A range of at most `longest` bytes.
    fn range(&mut self, len: usize, longest: usize) -> std::ops::Range<usize> {
        let start = self.below(len + 1);
        start..(start + self.below(longest)).min(len)
    }
}

/// Scene files below a folder.
fn scenes(folder: &Path, found: &mut Vec<Vec<u8>>) {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            scenes(&path, found);
        } else if path.extension().is_some_and(|e| e == "scn" || e == "pov" || e == "inc") {
            // Long ones take long; what is in them is in shorter ones too.
            found.extend(std::fs::read(&path).ok().filter(|text| text.len() < 30_000));
        }
    }
}

fn mutated(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    if random.below(20) == 0 {
        return (0..random.below(300)).map(|_| random.next() as u8).collect();
    }
    let mut text = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(8) {
        let range = random.range(text.len(), 200);
        match random.below(6) {
            0 => drop(text.splice(range, [])),
            1 => {
                let copy = text[range.clone()].to_vec();
                drop(text.splice(range.end..range.end, copy));
            }
            2 => {
                let copy = text[range].to_vec();
                let at = random.range(text.len(), 40);
                drop(text.splice(at, copy));
            }
            3 => {
                let other = &seeds[random.below(seeds.len())];
                let piece = other[random.range(other.len(), 1000)].to_vec();
                drop(text.splice(range, piece));
            }
            4 => {
                let at = random.below(text.len());
                if let Some(byte) = text.get_mut(at) {
                    *byte = random.next() as u8;
                }
            }
            _ => {
                let piece = PIECES[random.below(PIECES.len())];
                drop(text.splice(range.start..range.start, piece.bytes()));
            }
        }
    }
    text
}

/// A scene that includes a file and asks for the names it may declare.
fn including(path: &Path, text: &str) -> String {
    let name = |declared: &str| {
        let declared = declared.trim_start();
        let end = declared.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(declared.len());
        declared[..end].to_string()
    };
    let macros: Vec<_> = text.split("#macro").skip(1).map(name).collect();
    let mut names: Vec<_> = text.split("#declare").skip(1).map(name).collect();
    names.retain(|name| !name.is_empty() && Keyword::from_text(name).is_none() && !macros.contains(name));
    let mut scene = format!("#include \"{}\"\n", path.file_name().unwrap_or_default().display());
    // The last ones first, so that what they need is asked for by them.
    for name in names.iter().rev().take(50) {
        scene += &format!("#ifdef ({name}) #local Fuzz_Asks = array[1] {{ {name} }} #end\n");
    }
    scene
}

/// What of an evaluation must not depend on when its blocks were read. A script that was stopped says nothing.
fn said(found: &Evaluation) -> String {
    let messages: String = found.messages.iter().map(|message| message.text.as_str()).collect();
    format!("{} objects, {} lights; {messages}", found.scene.objects.len(), found.scene.lights.len())
}

/// Kilobytes that the process holds; 0 where the system does not say.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Since when the input is under way, if one is; and whether all is over.
struct UnderWay {
    since: Option<Instant>,
    done: bool,
}

/// Ends the process if an input takes too long or too much: neither can be stopped from inside.
fn watch(under_way: &Mutex<UnderWay>, input: &Path) {
    loop {
        std::thread::sleep(WATCH);
        let now = under_way.lock().unwrap();
        if now.done {
            return;
        }
        let late = now.since.is_some_and(|since| since.elapsed() > HANG);
        if late || resident_kb() > MEMORY_KB {
            let what = if late { format!("over {HANG:?}") } else { format!("over {MEMORY_KB} kB") };
            eprintln!("an input takes {what}: {}", input.display());
            std::process::exit(101);
        }
    }
}

#[test]
fn no_text_breaks_the_front_end() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let seconds = number("OCTRAY_FUZZ_SECONDS");
    let budget = Duration::from_secs(seconds.unwrap_or(3));
    let mut seeds = Vec::new();
    scenes(Path::new("tests"), &mut seeds);
    if seconds.is_some() {
        scenes(Path::new("/usr/share/doc/povray/examples"), &mut seeds);
        scenes(Path::new("/usr/share/povray-3.7/include"), &mut seeds);
    }
    assert!(seeds.len() > 40, "only {} scenes to begin with", seeds.len());

    let folder = std::env::var_os("OCTRAY_FUZZ_FOLDER").map_or_else(std::env::temp_dir, PathBuf::from);
    let options = Options {
        library_paths: vec![folder.clone(), "/usr/share/povray-3.7/include".into()],
        allow_missing: true,
        limits: Limits { steps: 1_000_000, calls: 500, memory: 256 << 20, errors: 50 },
        ..Options::default()
    };
    let input = folder.join(format!("octray-fuzz-{}.scn", std::process::id()));
    let under_way = Mutex::new(UnderWay { since: None, done: false });
    let mut random = Random(number("OCTRAY_FUZZ_SEED").unwrap_or(1));
    let begin = Instant::now();
    let (mut count, mut bytes, mut reported) = (0u64, 0u64, begin);
    let mut longest = (Duration::ZERO, Vec::new());
    std::thread::scope(|scope| {
        scope.spawn(|| watch(&under_way, &input));
        while begin.elapsed() < budget {
            let text = mutated(&seeds, &mut random);
            std::fs::write(&input, &text).expect("the input is kept before it is run");
            let since = Instant::now();
            under_way.lock().unwrap().since = Some(since);
            let readable = String::from_utf8_lossy(&text);
            let result = std::panic::catch_unwind(|| {
                let found = from_text("fuzz.scn", &readable, &options);
                // Every diagnostic can be shown, whatever it points at.
                for diagnostic in &found.diagnostics {
                    diagnostic.render(&found.sources, false);
                    diagnostic.json(&found.sources);
                }
                octray::render::shape_counts(&found.scene);
                let library = from_text("fuzz.scn", &including(&input, &readable), &options);
                library.diagnostics.iter().for_each(|d| drop(d.render(&library.sources, false)));
                let errors: Vec<_> = library
                    .diagnostics
                    .iter()
                    .filter(|d| d.severity == Severity::Error && !d.message.contains("stopped"))
                    .map(|d| d.short(&library.sources))
                    .collect();
                // An include is a scope of its own, where `#local` sets no element of an outer array.
                let lost = |d: &octray::lang::Diagnostic| d.message.contains("`#local` sets no element");
                let alike = !library.diagnostics.iter().any(lost);
                if alike && !found.has_errors() && std::str::from_utf8(&text).is_ok() {
                    assert!(errors.is_empty(), "as a library: {errors:?}");
                    assert!(library.has_errors() || said(&library) == said(&found), "{}", said(&library));
                }
            });
            under_way.lock().unwrap().since = None;
            count += 1;
            bytes += text.len() as u64;
            if result.is_err() {
                under_way.lock().unwrap().done = true;
                panic!("input {count} ends in a panic: {}", input.display());
            }
            if since.elapsed() > longest.0 {
                longest = (since.elapsed(), text);
            }
            if reported.elapsed() > REPORT {
                reported = Instant::now();
                println!("{count} inputs in {:?}, the longest {:?}", begin.elapsed(), longest.0);
            }
        }
        under_way.lock().unwrap().done = true;
    });
    std::fs::remove_file(&input).expect("it has been written");
    println!(
        "{count} inputs of {bytes} bytes from {} scenes in {:?}; the longest took {:?} for {} bytes",
        seeds.len(),
        begin.elapsed(),
        longest.0,
        longest.1.len()
    );
    if seconds.is_some() {
        std::fs::write(input.with_extension("longest.scn"), &longest.1)
            .expect("the folder can be written to");
    }
    assert!(count > 10, "only {count} inputs in {budget:?}");
}
